//! Numbers in READMEs, held against measurements.
//!
//! `PALPATE_RESTATE=1` replaces stated figures by measured ones, so that a README follows the code.

use crate::ROOT;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A README whose numbers are measured.
pub struct Readme {
    path: PathBuf,
    text: String,
    wrong: Vec<String>,
}

impl Readme {
    /// Reads one, by its path in the repository.
    ///
    /// # Panics
    /// If it cannot be read.
    pub fn open(path: &str) -> Self {
        let path = Path::new(ROOT).join(path);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Self { path, text, wrong: Vec::new() }
    }

    /// Compares the first number in a cell of a table with a measurement, which may differ by this many percent. `row` is the first
    /// cell, as it stands there; `column` is counted from 0, that cell.
    ///
    /// # Panics
    /// If there is not one such cell with a number.
    pub fn cell(&mut self, row: &str, column: usize, measured: u64, percent: u64) {
        let start = format!("| {row} |");
        let lines: Vec<usize> = self.text.match_indices(&start).map(|(at, _)| at).collect();
        let [line] = lines[..] else { panic!("{}: {} rows {start}", self.path.display(), lines.len()) };
        let mut at = line;
        for _ in 0..=column {
            at += self.text[at..].find('|').expect("a cell") + 1;
        }
        let end = at + self.text[at..].find('|').expect("the end of a cell");
        self.hold(&format!("{row}, column {column}"), at..end, measured, percent);
    }

    /// Holds the first number after a text, which stands there once, in the same way.
    ///
    /// # Panics
    /// If the text does not stand there once, with a number in its paragraph after it.
    pub fn after(&mut self, before: &str, measured: u64, percent: u64) {
        let places: Vec<usize> = self.text.match_indices(before).map(|(at, _)| at + before.len()).collect();
        let [at] = places[..] else { panic!("{}: {} times {before:?}", self.path.display(), places.len()) };
        let end = self.text[at..].find("\n\n").map_or(self.text.len(), |length| at + length);
        self.hold(before, at..end, measured, percent);
    }

    fn hold(&mut self, what: &str, within: Range<usize>, measured: u64, percent: u64) {
        let is_digit = |byte: u8| byte.is_ascii_digit() || byte == b',';
        let bytes = &self.text.as_bytes()[within.clone()];
        let first = bytes.iter().position(u8::is_ascii_digit);
        let start = within.start + first.unwrap_or_else(|| panic!("{}: no number: {what}", self.path.display()));
        let mut end =
            start + self.text.as_bytes()[start..within.end].iter().take_while(|byte| is_digit(**byte)).count();
        // A comma at the end belongs to the sentence.
        end -= usize::from(self.text.as_bytes()[end - 1] == b',');
        let stated: u64 = self.text[start..end].replace(',', "").parse().expect("digits");
        if std::env::var_os("PALPATE_RESTATE").is_some() {
            self.text.replace_range(start..end, &with_commas(measured));
        } else if stated.abs_diff(measured) * 100 > percent * measured {
            self.wrong.push(format!("{what}: states {stated}, measured {measured}"));
        }
    }

    /// Fails unless all numbers held, as stated or after the change.
    ///
    /// # Panics
    /// If one did not, or the file cannot be written.
    pub fn finish(self) {
        let path = self.path.display();
        assert!(
            self.wrong.is_empty(),
            "{path}:\n{}\nwith PALPATE_RESTATE=1 this test writes what it measures",
            self.wrong.join("\n")
        );
        if std::env::var_os("PALPATE_RESTATE").is_some() {
            std::fs::write(&self.path, &self.text).unwrap_or_else(|error| panic!("{path}: {error}"));
        }
    }
}

/// Thousands set apart.
fn with_commas(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
