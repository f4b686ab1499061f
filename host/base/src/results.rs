//! Results: rows of values under named columns, which become aligned text, JSON, or a page's table.

use crate::wording::{decimal, percent, percent_within};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// One value of a result.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Words.
    Text(String),
    /// A number and how many decimals are shown.
    Number(f64, usize),
    /// A number, how many decimals are shown, and its unit.
    Measure(f64, usize, &'static str),
    /// A number, its uncertainty, and how many decimals are shown.
    Spread(f64, f64, usize),
    /// A share of one, shown as a percentage with this many decimals.
    Percent(f64, usize),
    /// A share of one and its uncertainty, shown as percentages.
    PercentSpread(f64, f64, usize),
    /// Not measured.
    Missing,
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<&String> for Value {
    fn from(text: &String) -> Self {
        Self::Text(text.clone())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Value {
    fn from(count: usize) -> Self {
        Self::Number(count as f64, 0)
    }
}

impl From<u64> for Value {
    fn from(count: u64) -> Self {
        Self::Number(count as f64, 0)
    }
}

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

impl Value {
    /// The value as people read it.
    pub fn shown(&self) -> String {
        match *self {
            Self::Text(ref text) => text.clone(),
            Self::Number(value, decimals) => decimal(value, decimals),
            Self::Measure(value, decimals, unit) => format!("{}\u{a0}{unit}", decimal(value, decimals)),
            // One measurement has no spread.
            Self::Spread(value, 0.0, decimals) => decimal(value, decimals),
            Self::PercentSpread(value, 0.0, decimals) => Self::Percent(value, decimals).shown(),
            Self::Spread(value, spread, decimals) => {
                format!("{} ± {}", decimal(value, decimals), decimal(spread, decimals))
            }
            Self::Percent(value, decimals) => percent(value, decimals).replace(" %", "\u{a0}%"),
            Self::PercentSpread(value, spread, decimals) => {
                percent_within(value, spread, decimals).replace(" %", "\u{a0}%")
            }
            Self::Missing => "–".to_owned(),
        }
    }

    /// The number and its uncertainty, if there are any.
    pub fn numbers(&self) -> (Option<f64>, Option<f64>) {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        match *self {
            Self::Number(value, _) | Self::Measure(value, ..) | Self::Percent(value, _) => (finite(value), None),
            Self::Spread(value, spread, _) | Self::PercentSpread(value, spread, _) => (finite(value), finite(spread)),
            Self::Text(_) | Self::Missing => (None, None),
        }
    }
}

/// A number (a whole one of a count), a number with its uncertainty in a list, a string, or null.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (self, self.numbers()) {
            (Self::Text(text), _) => text.serialize(serializer),
            (Self::Spread(..) | Self::PercentSpread(..), numbers) => numbers.serialize(serializer),
            (Self::Number(_, 0), (Some(count), _)) if count.fract() == 0.0 => (count as i64).serialize(serializer),
            (_, (number, _)) => number.serialize(serializer),
        }
    }
}

/// A row of [`Results`] from values of several types: `row!["fork", 3_usize, Value::Percent(0.5, 1)]`.
#[macro_export]
macro_rules! row {
    ($($value:expr),* $(,)?) => { [$($crate::results::Value::from($value)),*] };
}

/// Rows of values under named columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    /// The columns' names, units in parentheses.
    pub columns: Vec<String>,
    /// The rows, each as long as `columns`.
    pub rows: Vec<Vec<Value>>,
}

impl Results {
    /// No rows yet.
    pub fn new<S: Into<String>>(columns: impl IntoIterator<Item = S>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// No rows yet of single results: what each is, its value, and a note.
    pub fn list() -> Self {
        Self::new(["", "", ""])
    }

    /// Adds a row; one that is too short ends with empty text.
    pub fn push(&mut self, row: impl IntoIterator<Item = impl Into<Value>>) {
        let mut row: Vec<Value> = row.into_iter().map(Into::into).collect();
        row.resize(self.columns.len(), Value::Text(String::new()));
        self.rows.push(row);
    }

    /// True if a column reads as numbers: unless most of its values are words, such as "over 200".
    pub fn is_numeric(&self, column: usize) -> bool {
        let words = self.rows.iter().filter(|row| matches!(row[column], Value::Text(_))).count();
        2 * words <= self.rows.len()
    }

    /// The rows as lines of text, with their columns below each other; above them the columns' names, if they have any.
    ///
    /// ```
    /// use palpate_base::results::{Results, Value};
    /// use palpate_base::row;
    ///
    /// let mut results = Results::new(["object", "right"]);
    /// results.push(row!["fork", Value::Percent(0.5, 1)]);
    /// assert_eq!(results.text(), "object   right\nfork    50.0 %\n");
    /// ```
    pub fn text(&self) -> String {
        let is_named = self.columns.iter().any(|name| !name.is_empty());
        let values = self.rows.iter().map(|row| row.iter().map(Value::shown).collect());
        let lines: Vec<Vec<String>> = is_named.then(|| self.columns.clone()).into_iter().chain(values).collect();
        let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
        let columns: Vec<(usize, bool)> =
            (0..self.columns.len()).map(|own| (width(own), self.is_numeric(own))).collect();
        let padded = |(cell, &(width, is_numeric)): (&String, &(usize, bool))| match is_numeric {
            true => format!("{cell:>width$}"),
            false => format!("{cell:width$}"),
        };
        let text = |line: &Vec<String>| line.iter().zip(&columns).map(padded).collect::<Vec<_>>().join("  ");
        lines.iter().map(|line| format!("{}\n", text(line).trim_end().replace('\u{a0}', " "))).collect()
    }
}

/// A list of the rows, each with its values by the columns' names.
impl Serialize for Results {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let named =
            |row: &Vec<Value>| self.columns.iter().cloned().zip(row.iter().cloned()).collect::<BTreeMap<_, _>>();
        serializer.collect_seq(self.rows.iter().map(named))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_shown_for_people() {
        for (value, shown) in [
            (Value::Number(1_234_567.0, 0), "1,234,567"),
            (Value::Number(-1_234.5, 1), "\u{2212}1,234.5"),
            (Value::Measure(1.25, 2, "ms"), "1.25\u{a0}ms"),
            (Value::Spread(4.5, 0.0, 1), "4.5"),
            (Value::PercentSpread(0.907, 0.025, 1), "90.7 ± 2.5\u{a0}%"),
            (Value::Percent(f64::NAN, 1), "–"),
            (Value::from(None::<usize>), "–"),
        ] {
            assert_eq!(value.shown(), shown);
        }
    }

    #[test]
    fn rows_become_aligned_text_and_objects_of_json() {
        let mut results = Results::new(["object", "touches", "right"]);
        results.push(row!["ladle", 1_234_usize, Value::PercentSpread(0.5, 0.25, 0)]);
        results.push(row!["fork", None::<usize>, Value::Percent(1.0, 0)]);
        assert_eq!(
            results.text(),
            "object  touches      right\nladle     1,234  50 ± 25 %\nfork          –      100 %\n"
        );
        assert_eq!(
            serde_json::to_value(&results).unwrap(),
            serde_json::json!([
                {"object": "ladle", "touches": 1_234, "right": [0.5, 0.25]},
                {"object": "fork", "touches": null, "right": 1.0},
            ])
        );
        let mut list = Results::list();
        list.push(row!["noise", Value::Measure(1.0, 1, "ms"), "of each finger"]);
        list.push(row!["timer", "none found"]);
        assert_eq!(list.text(), "noise      1.0 ms  of each finger\ntimer  none found\n");
    }
}
