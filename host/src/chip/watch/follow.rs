//! A journal that may still be growing.

use crate::chip::Entry;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Reads a journal's entries as they come.
#[derive(Debug)]
pub struct Follow {
    path: PathBuf,
    reader: BufReader<File>,
    /// A line that is not complete yet.
    partial: String,
    line: u64,
}

impl Follow {
    /// Begins at the journal's first line.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|source| Error::io(path, "read the journal", source))?;
        Ok(Self { path: path.into(), reader: BufReader::new(file), partial: String::new(), line: 0 })
    }

    /// The next entry; `None` while there is no further line.
    ///
    /// # Errors
    /// When a line is not an entry.
    pub fn next_entry(&mut self) -> Result<Option<Entry>> {
        let read = self.reader.read_line(&mut self.partial);
        read.map_err(|source| Error::io(&self.path, "read the journal", source))?;
        if !self.partial.ends_with('\n') {
            return Ok(None);
        }
        self.line += 1;
        let entry = serde_json::from_str(&self.partial).map_err(|error| {
            let fix = "Write one with: palpate link PORT --journal FILE.";
            Error::line(&self.path, self.line, format!("not a journal's entry: {error}"), fix)
        })?;
        self.partial.clear();
        Ok(Some(entry))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn lines_are_read_once_they_are_complete_and_wrong_ones_are_named() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut follow = Follow::open(file.path()).unwrap();
        assert_eq!(follow.next_entry().unwrap(), None);
        write!(file, r#"{{"is":"object","na"#).unwrap();
        assert_eq!(follow.next_entry().unwrap(), None);
        writeln!(file, r#"me":"spoon"}}"#).unwrap();
        assert_eq!(follow.next_entry().unwrap(), Some(Entry::Object { name: Some("spoon".into()) }));
        assert_eq!(follow.next_entry().unwrap(), None);
        writeln!(file, "nonsense").unwrap();
        assert!(follow.next_entry().unwrap_err().to_string().contains(":2: not a journal's entry"));
    }
}
