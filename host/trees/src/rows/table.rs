//! CSV files, record by record, each with its line; no line is left out.

use crate::error::{Error, Place, Result, problem};
use std::path::{Path, PathBuf};

/// A CSV file in memory.
pub(super) struct Table {
    path: PathBuf,
    bytes: Vec<u8>,
    /// The cells of the first line; empty for a file without a header.
    pub(super) header: Vec<String>,
    has_header: bool,
}

impl Table {
    /// Reads a file; its first line is a header.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io), and if it is not text.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let mut table = Self::without_header(path, "read the rows")?;
        table.has_header = true;
        let header = table.reader().headers().map_err(|error| table.wrong(&error))?.clone();
        table.header = header.iter().map(String::from).collect();
        Ok(table)
    }

    /// Reads a file whose first line is a record like the others.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io), where `action` failed.
    pub(super) fn without_header(path: &Path, action: &'static str) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, action, source))?;
        Ok(Self { path: path.into(), bytes, header: Vec::new(), has_header: false })
    }

    fn reader(&self) -> csv::Reader<&[u8]> {
        let mut builder = csv::ReaderBuilder::new();
        builder.trim(csv::Trim::All).has_headers(self.has_header).from_reader(self.bytes.as_slice())
    }

    /// The problem in the header, or another one that explains it: an empty file, or cells that something else than commas
    /// separates.
    pub(super) fn in_header(&self, error: Error) -> Error {
        if self.header.iter().all(String::is_empty) {
            return no_rows().at(Place::file(&self.path));
        }
        let separator = match self.header.as_slice() {
            [only] => [';', '\t'].into_iter().find(|separator| only.contains(*separator)),
            _ => None,
        };
        let explained = separator.map(|separator| {
            problem!("its cells are separated by {:?}", separator.to_string())
                .fix("Separate cells by commas, and write decimals with a point.")
        });
        explained.unwrap_or(error).at(Place::line(&self.path, 1))
    }

    /// The position of a column.
    ///
    /// # Errors
    /// If there is no such column.
    pub(super) fn column(&self, name: &str) -> Result<usize> {
        let found = self.header.iter().position(|column| column == name);
        found.ok_or_else(|| self.in_header(no_column(name)))
    }

    /// The records below the header, each with its line.
    ///
    /// # Errors
    /// For one with another number of cells, or no text, and for an empty line above another one: it may be a row with a
    /// missing value.
    pub(super) fn records(&self) -> impl Iterator<Item = Result<(u64, csv::StringRecord)>> {
        let mut lines = Lines { bytes: &self.bytes, at: 0, line: 1 };
        let mut reader = self.reader();
        // Where records begin is known after the header.
        let mut result = if self.has_header { reader.headers().map(|_| ()) } else { Ok(()) };
        let mut from = if self.has_header { reader.position().byte() } else { 0 };
        std::iter::from_fn(move || {
            if let Err(error) = std::mem::replace(&mut result, Ok(())) {
                return Some(Err(self.wrong(&error)));
            }
            let mut record = csv::StringRecord::new();
            match reader.read_record(&mut record) {
                Ok(false) => None,
                Err(error) => Some(Err(self.wrong(&error))),
                Ok(true) => {
                    let start = usize::try_from(from).unwrap_or(usize::MAX);
                    from = reader.position().byte();
                    Some(match lines.first(start) {
                        Ok(line) => Ok((line, record)),
                        Err(line) => Err(problem!("the line is empty")
                            .fix("Remove it; or write \"\" for a missing value of the only column.")
                            .at(Place::line(&self.path, line))),
                    })
                }
            }
        })
    }

    /// A problem of the CSV reader.
    fn wrong(&self, error: &csv::Error) -> Error {
        let not_rows = |detail: &str| {
            problem!("not rows of features as CSV: {detail}")
                .fix("Give a header line with the features' names, then one row per line.")
        };
        let problem = match error.kind() {
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                let cells = if *len == 1 { "cell" } else { "cells" };
                problem!("it has {len} {cells}, where the header has {expected_len}").fix(
                    "Give each row as many cells as there are names, with nothing between commas where a value is missing.",
                )
            }
            csv::ErrorKind::Utf8 { .. } if self.bytes.starts_with(b"PAR1") => {
                let instead = palpate_base::gone::instead(".parquet").unwrap_or_default();
                not_rows("it is a Parquet file").fix(format!("Instead, {instead}."))
            }
            csv::ErrorKind::Utf8 { .. } => not_rows("it is not UTF-8"),
            _ => not_rows(&error.to_string()),
        };
        let place = match error.position() {
            // From where the record before ended, which may be within the end of its line.
            Some(position) => {
                let start = usize::try_from(position.byte()).unwrap_or(usize::MAX);
                let mut lines = Lines { bytes: &self.bytes, at: 0, line: 1 };
                Place::line(&self.path, lines.first(start).unwrap_or_else(|line| line))
            }
            None => Place::file(&self.path),
        };
        problem.at(place)
    }
}

/// A table without rows.
pub(super) fn no_rows() -> Error {
    problem!("it has no rows").fix("Give at least one row below the header.")
}

/// A column that was asked for and is not there.
pub(super) fn no_column(name: &str) -> Error {
    problem!("it has no column {name:?}").fix("Name one of the columns in the header.")
}

/// Lines of a text, counted once.
struct Lines<'b> {
    bytes: &'b [u8],
    /// Bytes that were counted.
    at: usize,
    /// The line that begins there, or goes on.
    line: u64,
}

impl Lines<'_> {
    /// The line of the record that begins after `start`, where the one before ended; an error with the line if it is an empty
    /// one.
    fn first(&mut self, start: usize) -> Result<u64, u64> {
        // The second half of a line's end.
        let half = matches!(self.bytes.get(start.saturating_sub(1)..=start), Some(b"\r\n"));
        let start = start + usize::from(half && start > 0);
        let passed = self.bytes.get(self.at..start.max(self.at)).unwrap_or_default();
        self.line += passed.iter().filter(|&&byte| byte == b'\n').count() as u64;
        self.at = start.max(self.at);
        match self.bytes.get(start..) {
            Some([b'\n', ..] | [b'\r', b'\n', ..]) => Err(self.line),
            _ => Ok(self.line),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The line and the cells of each record, or the complaint without its path.
    fn read(text: &str) -> Vec<Result<(u64, String), String>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let table = Table::read(file.path()).unwrap();
        let path = file.path().display().to_string();
        let of = |record: Result<(u64, csv::StringRecord)>| match record {
            Ok((line, record)) => Ok((line, record.iter().collect::<Vec<_>>().join("|"))),
            Err(error) => Err(error.to_string().trim_start_matches(&path).to_owned()),
        };
        table.records().map(of).collect()
    }

    #[test]
    fn records_have_their_lines_whatever_ends_one() {
        for end in ["\n", "\r\n"] {
            let text = ["a,b", "1,2", "\"x\ny\",4", "5,6", ""].join(end);
            let found = read(&text);
            let lines: Vec<u64> = found.iter().map(|found| found.as_ref().unwrap().0).collect();
            assert_eq!(lines, [2, 3, 5], "{end:?}");
            let ragged = read(&["a,b", "1,2", "3", "4,5"].join(end));
            let complaint = ragged[1].as_ref().unwrap_err();
            assert!(complaint.starts_with(":3: it has 1 cell, where the header has 2"), "{complaint}");
        }
    }

    #[test]
    fn an_empty_line_within_a_file_is_an_error_with_its_number_and_one_at_the_end_is_none() {
        for end in ["\n", "\r\n"] {
            let found = read(&["x", "1", "", "-1", ""].join(end));
            assert_eq!(found[0], Ok((2, "1".into())));
            let complaint = found[1].as_ref().unwrap_err();
            assert!(complaint.starts_with(":3: the line is empty"), "{complaint}");
            assert_eq!(read(&["x", "1", "\"\"", "-1", "", "", ""].join(end)).len(), 3);
            assert_eq!(read(&["x", "", "1"].join(end))[0].as_ref().unwrap_err()[..3], *":2:");
        }
    }
}
