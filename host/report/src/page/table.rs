//! Tables: shown in the page with columns that sort, and written as CSV.

use super::axis::number;
use crate::bug;
use palpate::error::Result;

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number and how many decimals are shown; CSV has all of them.
    Number(f64, usize),
    /// A number, its uncertainty, and how many decimals are shown; two columns in CSV.
    Spread(f64, f64, usize),
    /// A share of one, shown as a percentage with this many decimals; CSV has the share.
    Percent(f64, usize),
    /// A share of one and its uncertainty, shown as percentages; two columns in CSV.
    PercentSpread(f64, f64, usize),
    /// Not measured.
    Missing,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_string())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl Cell {
    /// A whole number.
    pub fn count(value: impl TryInto<u64>) -> Self {
        value.try_into().map_or(Self::Missing, |value| Self::Number(value as f64, 0))
    }

    /// Text on the page.
    pub fn shown(&self) -> String {
        match *self {
            Self::Text(ref text) => text.clone(),
            Self::Number(value, decimals) => number(value, decimals),
            // One measurement has no spread.
            Self::Spread(value, 0.0, decimals) => number(value, decimals),
            Self::PercentSpread(value, 0.0, decimals) => Self::Percent(value, decimals).shown(),
            Self::Spread(value, spread, decimals) => {
                format!("{} ± {}", number(value, decimals), number(spread, decimals))
            }
            Self::Percent(value, decimals) => format!("{}\u{a0}%", number(value * 100.0, decimals)),
            Self::PercentSpread(value, spread, decimals) => {
                format!("{} ± {}\u{a0}%", number(value * 100.0, decimals), number(spread * 100.0, decimals))
            }
            Self::Missing => "–".to_string(),
        }
    }

    /// Number that the column is sorted by, if this is one.
    pub(crate) fn value(&self) -> Option<f64> {
        match *self {
            Self::Number(value, _)
            | Self::Spread(value, _, _)
            | Self::Percent(value, _)
            | Self::PercentSpread(value, _, _) => Some(value).filter(|value| value.is_finite()),
            Self::Text(_) | Self::Missing => None,
        }
    }

    /// Its CSV fields: one, or value and spread.
    fn fields(&self) -> Vec<String> {
        let plain = |value: f64| if value.is_finite() { format!("{value}") } else { String::new() };
        match *self {
            Self::Text(ref text) => vec![text.clone()],
            Self::Number(value, _) | Self::Percent(value, _) => vec![plain(value)],
            Self::Spread(value, spread, _) | Self::PercentSpread(value, spread, _) => vec![plain(value), plain(spread)],
            Self::Missing => vec![String::new()],
        }
    }
}

/// Rows under named columns: the numbers behind a figure, or a table's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    /// The columns' names, units in parentheses.
    pub columns: Vec<String>,
    /// The rows, each as long as `columns`.
    pub rows: Vec<Vec<Cell>>,
}

impl Records {
    /// No rows yet.
    pub fn new<S: Into<String>>(columns: impl IntoIterator<Item = S>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row; one that is too short is filled with [`Cell::Missing`].
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let mut row: Vec<Cell> = row.into_iter().collect();
        row.resize(self.columns.len(), Cell::Missing);
        self.rows.push(row);
    }

    /// The rows as CSV, a header line first. A column with an uncertainty becomes two.
    ///
    /// # Errors
    /// If the CSV library refuses, which it has no reason to.
    pub(crate) fn csv(&self) -> Result<Vec<u8>> {
        let spread: Vec<bool> = (0..self.columns.len())
            .map(|c| self.rows.iter().any(|row| matches!(row[c], Cell::Spread(..) | Cell::PercentSpread(..))))
            .collect();
        let refused = |error: &dyn std::error::Error| bug(format!("cannot write CSV: {error}"));
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header = self
            .columns
            .iter()
            .zip(&spread)
            .flat_map(|(name, &spread)| std::iter::once(name.clone()).chain(spread.then(|| format!("{name} ±"))));
        writer.write_record(header).map_err(|error| refused(&error))?;
        for row in &self.rows {
            let fields = row.iter().zip(&spread).flat_map(|(cell, &spread)| {
                let mut fields = cell.fields();
                fields.resize(1 + usize::from(spread), String::new());
                fields
            });
            writer.write_record(fields).map_err(|error| refused(&error))?;
        }
        writer.into_inner().map_err(|error| refused(&error))
    }
}

/// A table in the page.
#[derive(Clone, Debug)]
pub struct Table {
    /// Its anchor, and its file's stem.
    pub id: String,
    /// Title of the table.
    pub title: String,
    /// Caption: how to read it, and how it was made.
    pub caption: String,
    /// The command that remakes it.
    pub command: String,
    /// Its contents.
    pub data: Records,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_quotes_and_gives_uncertainties_their_own_column() {
        let mut data = Records::new(["object", "accuracy"]);
        data.push(["a, b".into(), Cell::PercentSpread(0.75, 0.01, 1)]);
        data.push(["c".into()]);
        assert_eq!(
            String::from_utf8(data.csv().unwrap()).unwrap(),
            "object,accuracy,accuracy ±\n\"a, b\",0.75,0.01\nc,,\n"
        );
    }

    #[test]
    fn numbers_are_shown_for_people() {
        assert_eq!(Cell::Number(1234567.0, 0).shown(), "1,234,567");
        assert_eq!(Cell::Number(-1234.5, 1).shown(), "\u{2212}1,234.5");
        assert_eq!(Cell::PercentSpread(0.907, 0.025, 1).shown(), "90.7 ± 2.5\u{a0}%");
        assert_eq!(Cell::Number(f64::NAN, 1).shown(), "–");
    }
}
