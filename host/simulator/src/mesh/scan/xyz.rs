//! XYZ files: a point on each line, as three numbers, with others that a header names or that show what they are.

use super::{Point, Points};
use crate::error::{Error, MeshProblem, Place, Result};
use crate::mesh::words::{coordinate, number, shown};
use std::io::BufRead;
use std::path::Path;

/// Most columns that are read.
const MOST: usize = 16;

/// Reads the points of an XYZ text; errors name `path`. Numbers may be separated by blanks, commas or semicolons; what
/// follows `#` or `//` on a line is skipped. Before the points there may be a line with the names of the columns, which may
/// be a comment, and a line with the number of points.
pub(in crate::mesh) fn parse(mut reader: impl BufRead, path: &Path) -> Result<Points> {
    let mut table = Table::default();
    let (mut line, mut raw) = (0, Vec::new());
    loop {
        raw.clear();
        if reader.read_until(b'\n', &mut raw).map_err(|source| Error::io(path, "read the points", source))? == 0 {
            break;
        }
        line += 1;
        let text = raw.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&raw);
        let comment = [text.iter().position(|&byte| byte == b'#'), text.windows(2).position(|pair| pair == b"//")];
        let end = comment.into_iter().flatten().min().unwrap_or(text.len());
        let (text, comment) = (text[..end].trim_ascii(), &text[end..]);
        let at = |problem| Error::at(Place::line(path, line), problem);
        if text.is_empty() {
            table.names = table.names.or_else(|| names(comment));
            continue;
        }
        table.add(text).map_err(at)?;
    }
    let rows = table.rows();
    if let Some(stated) = table.stated.filter(|&stated| stated != rows) {
        return Err(Error::at(Place::line(path, line), damaged(format!("it states {stated} points and has {rows}"))));
    }
    table.points().map_err(|problem| Error::at(Place::file(path), problem))
}

fn damaged(what: String) -> MeshProblem {
    MeshProblem::Damaged { format: "XYZ", what }
}

/// The words of a line.
fn words(text: &[u8]) -> Vec<&[u8]> {
    let is_gap = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
    text.split(is_gap).filter(|word| !word.is_empty()).collect()
}

/// The names of columns, if a line has those of coordinates.
fn names(line: &[u8]) -> Option<Vec<String>> {
    let is_mark = |byte: &u8| b"#/\"'".contains(byte);
    let name = |word: &[u8]| -> String {
        word.iter().filter(|byte| !is_mark(byte)).map(|byte| char::from(byte.to_ascii_lowercase())).collect()
    };
    let names: Vec<String> = words(line).into_iter().map(name).filter(|name| !name.is_empty()).collect();
    ["x", "y", "z"].iter().all(|axis| names.iter().any(|name| name == axis)).then_some(names)
}

/// Numbers in rows and columns.
#[derive(Default)]
struct Table {
    names: Option<Vec<String>>,
    /// Number of rows that the file states.
    stated: Option<usize>,
    columns: usize,
    values: Vec<f64>,
}

impl Table {
    fn add(&mut self, text: &[u8]) -> Result<(), MeshProblem> {
        let words = words(text);
        let is_first = self.columns == 0;
        if is_first && let ([only], None) = (&words[..], self.stated) {
            self.stated = number(only);
            if self.stated.is_some() {
                return Ok(());
            }
        }
        if is_first && words.iter().all(|word| number::<f64>(word).is_none()) && names(text).is_some() {
            self.names = names(text);
            return Ok(());
        }
        let is_digit = |at: Option<usize>| at.and_then(|at| text.get(at)).is_some_and(u8::is_ascii_digit);
        let is_decimal = |at: usize| text[at] == b',' && is_digit(at.checked_sub(1)) && is_digit(Some(at + 1));
        if text.iter().any(|byte| byte.is_ascii_whitespace() || *byte == b';') && (0..text.len()).any(is_decimal) {
            return Err(damaged(format!("commas stand in its numbers, where points should: {:?}", shown(text))));
        }
        if is_first {
            self.columns = words.len();
        }
        if words.len() != self.columns || !(3..=MOST).contains(&words.len()) {
            let wanted = match (3..=MOST).contains(&self.columns) {
                true => format!("{}, as on the first line", self.columns),
                false => format!("3 to {MOST}"),
            };
            return Err(damaged(format!("{} numbers where there should be {wanted}: {:?}", words.len(), shown(text))));
        }
        for (word, axis) in words.iter().zip("xyz".chars().chain(std::iter::repeat('-'))) {
            let value: f64 = number(word).ok_or_else(|| MeshProblem::NotANumber { text: shown(word) })?;
            // What is not a number was not measured.
            self.values.push(if value.is_nan() || axis == '-' { value } else { coordinate(word, axis)? });
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// The points, with normals and places of sensors where the columns are these.
    fn points(self) -> Result<Points, MeshProblem> {
        let mut points = Points::default();
        if self.columns == 0 {
            return Ok(points);
        }
        let [place, normal, viewpoint] = match &self.names {
            Some(names) if names.len() == self.columns => self.named(names, &mut points.notes),
            _ => self.guessed(&mut points.notes)?,
        };
        for row in self.values.chunks_exact(self.columns) {
            let three = |columns: Option<[usize; 3]>| columns.map(|columns| columns.map(|column| row[column]));
            let whole = |columns| three(columns).filter(|values| values.iter().all(|value| value.is_finite()));
            let place = three(place).unwrap_or([f64::NAN; 3]);
            points.add(Point { place, normal: whole(normal), viewpoint: whole(viewpoint) });
        }
        Ok(points)
    }

    /// The columns of places, normals and sensors by their names.
    fn named(&self, names: &[String], notes: &mut Vec<String>) -> [Option<[usize; 3]>; 3] {
        let column = |wanted: &str| names.iter().position(|name| name == wanted);
        let three = |wanted: [&str; 3]| match wanted.map(column) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let normal = three(["nx", "ny", "nz"])
            .or_else(|| three(["normal_x", "normal_y", "normal_z"]))
            .or_else(|| three(["normalx", "normaly", "normalz"]));
        let found = [three(["x", "y", "z"]), normal, three(["vp_x", "vp_y", "vp_z"])];
        let used: Vec<usize> = found.iter().flatten().flatten().copied().collect();
        let others = (0..self.columns).filter(|column| !used.contains(column));
        note_unused(others.map(|column| names[column].clone()).collect(), notes);
        found
    }

    /// The columns of places and normals by their values.
    fn guessed(&self, notes: &mut Vec<String>) -> Result<[Option<[usize; 3]>; 3], MeshProblem> {
        let count = self.columns;
        let unclear = |what: &str| {
            Err(damaged(format!(
                "{what}. A first line with the names of its columns says what they are, such as x y z nx ny nz or x y z r g b"
            )))
        };
        let mut firsts = self.values.chunks_exact(count).map(|row| row[0]).enumerate();
        if count > 3 && self.rows() > 2 && firsts.all(|(index, first)| first == self.values[0] + index as f64) {
            return unclear("its first column counts the points, and coordinates should stand there");
        }
        let fits = |first: usize, is_right: &dyn Fn(&[f64]) -> bool| {
            let right = self.values.chunks_exact(count).filter(|row| is_right(&row[first..first + 3])).count();
            100 * right >= 99 * self.rows()
        };
        let is_missing = |values: &[f64]| values.iter().all(|value| *value == 0.0 || value.is_nan());
        let is_unit = |values: &[f64]| {
            let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
            is_missing(values) || (length - 1.0).abs() < 0.02
        };
        let threes = || 3..count.saturating_sub(2);
        let units: Vec<usize> = threes().filter(|&first| fits(first, &is_unit) && !fits(first, &is_missing)).collect();
        let is_color = |first: usize| {
            fits(first, &|values| values.iter().all(|value| (0.0..=1.0).contains(value)))
                || fits(first, &|values| {
                    values.iter().all(|value| (0.0..=65_535.0).contains(value) && value.fract() == 0.0)
                })
        };
        let is_signed = |first: usize| !fits(first, &|values| values.iter().all(|value| *value >= 0.0));
        let normal = match units.as_slice() {
            [only] => Some(*only),
            // Normals may have any length.
            [] if count == 6 && is_signed(3) => Some(3),
            [] if count < 6 || threes().any(is_color) => None,
            [] if count == 6 => return unclear("its columns 4 to 6 are neither normals nor colors"),
            [] => return unclear(&format!("which of its {count} columns are normals is unclear")),
            _ => return unclear(&format!("several of its {count} columns may be normals")),
        };
        let used = |column: usize| column < 3 || normal.is_some_and(|first| (first..first + 3).contains(&column));
        note_unused((0..count).filter(|&column| !used(column)).map(|column| (column + 1).to_string()).collect(), notes);
        Ok([Some([0, 1, 2]), normal.map(|first| [first, first + 1, first + 2]), None])
    }
}

/// Says which columns are not used.
fn note_unused(names: Vec<String>, notes: &mut Vec<String>) {
    match names.as_slice() {
        [] => {}
        [only] => notes.push(format!("column {only} is neither coordinates nor normals, and is not used")),
        _ => notes.push(format!("columns {} are neither coordinates nor normals, and are not used", names.join(", "))),
    }
}
