//! Rows of features, for models that other libraries trained: CSV files, sequences, and the chip's form of a row.

mod columns;
mod generate;
mod label;
mod notes;
pub mod scales;
mod sequences;
mod table;

pub(crate) use columns::some;
pub use columns::{BY_POSITION, Features, Matched, check_columns, columns_of};
pub use generate::generate;
pub(crate) use label::{class, not_a_class};
pub use notes::{notes, warnings};
pub use sequences::{RowOf, RowSequence, SequenceColumns, Sequences, SequencesBuilder};

use crate::error::{Error, Place, Result, problem};
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Key, f32_key};
use std::fmt::Display;
use std::path::Path;
use table::{Table, no_rows};

/// Rows of features, NaN where one is missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Features of a row.
    pub features: usize,
    /// Row after row, as the file has them: models compare them as f32, or as whole numbers of units.
    pub values: Vec<f64>,
    /// The label of each row, if a column of them was asked for.
    pub labels: Vec<String>,
    /// True if columns were taken by their position: see [`BY_POSITION`].
    pub by_position: bool,
}

/// Rule that turns a value into the number that a model compares: see `FORMAT.md`.
#[derive(Clone, Debug, PartialEq)]
pub enum Encoder {
    /// The key of an f32 value.
    Real,
    /// The value times the feature's scale, rounded to the nearest whole number.
    Scaled(Vec<f32>),
}

impl Rows {
    /// Reads a CSV file: a header, then one row per line; a cell that is empty or NaN is missing.
    ///
    /// Columns are matched as [`Features::among`] does it. The column `label` is no feature.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io); with the line, a file that is not such a table or has no rows, columns that
    /// cannot be matched, a cell that is not a number, an empty line.
    pub fn read(path: &Path, features: impl Into<Features>, label: Option<&str>) -> Result<Self> {
        let features = features.into();
        let table = Table::read(path)?;
        let label = label.map(|name| table.column(name)).transpose()?;
        let header: Vec<&str> = table.header.iter().map(String::as_str).collect();
        let matched = features.among(&header, label.as_slice()).map_err(|error| table.in_header(error))?;
        let (mut values, mut labels) = (Vec::new(), Vec::new());
        for record in table.records() {
            let (line, record) = record?;
            for &column in &matched.columns {
                let text = record.get(column).unwrap_or_default();
                let value = number(text).ok_or_else(|| {
                    not_a_number(header.get(column).copied().unwrap_or_default(), text).at(Place::line(path, line))
                })?;
                values.push(value);
            }
            labels.extend(label.map(|column| record.get(column).unwrap_or_default().to_owned()));
        }
        if values.is_empty() {
            return Err(no_rows().at(Place::file(path)));
        }
        Ok(Self { features: features.count(), values, labels, by_position: matched.by_position })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.values.len() / self.features.max(1)
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The rows, in order.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.features.max(1))
    }
}

/// Reads a CSV file of margins: no header, one row per line, as many numbers in each.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io); with the line, another number of cells, and a cell that is not a number.
pub fn read_margins(path: &Path) -> Result<Vec<Vec<f64>>> {
    let finite = |text: &str| text.parse::<f64>().ok().filter(|margin| margin.is_finite());
    let table = Table::without_header(path, "read the margins")?;
    let row = |record: Result<(u64, csv::StringRecord)>| {
        let (line, record) = record?;
        let number = |(column, text): (usize, &str)| {
            finite(text).ok_or_else(|| not_a_number(column + 1, text).at(Place::line(path, line)))
        };
        record.iter().enumerate().map(number).collect()
    };
    table.records().map(row).collect()
}

/// Reads a CSV file of a library's predictions: no header, one row per line, a class or a value in each, or one for each target.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io); with the line, another number of cells.
pub fn read_values(path: &Path) -> Result<Vec<Vec<String>>> {
    let table = Table::without_header(path, "read the values")?;
    table.records().map(|record| Ok(record?.1.iter().map(String::from).collect())).collect()
}

/// A cell that is not a number, in a column by name or number.
fn not_a_number(column: impl Display, text: &str) -> Error {
    problem!("{text:?} in the column {column} is not a number")
        .fix("Give a number, or leave the cell empty where the value is missing.")
}

/// A cell's number; NaN if it is empty.
fn number(text: &str) -> Option<f64> {
    if text.is_empty() || matches!(text, "NA" | "N/A" | "null" | "None") {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

impl Encoder {
    /// Encoder of a model. One that computes its features compares whole numbers as they are.
    pub fn of(model: &Model<'_>) -> Self {
        if model.key() == Key::Real {
            return Self::Real;
        }
        let stated = model.features().map(|feature| feature.scale);
        Self::Scaled(stated.chain(std::iter::repeat(1.0)).take(model.feature_count()).collect())
    }

    /// Encoder of the features that someone measures: all but the model's [position](Model::position).
    pub fn measured(model: &Model<'_>) -> Self {
        let mut own = Self::of(model);
        if let (Self::Scaled(scales), Some(position)) = (&mut own, model.position()) {
            scales.remove(position.feature.into());
        }
        own
    }

    /// Encoder of one of the features.
    pub fn only(&self, feature: usize) -> Self {
        match self {
            Self::Real => Self::Real,
            Self::Scaled(scales) => Self::Scaled(scales.get(feature).copied().into_iter().collect()),
        }
    }

    /// The value that a number of a feature stands for; NaN if it stands for none.
    pub fn value(&self, feature: usize, number: i32) -> f64 {
        match self {
            Self::Real => {
                let magnitude = f64::from(f32::from_bits(number.unsigned_abs()));
                if number < 0 { -magnitude } else { magnitude }
            }
            Self::Scaled(_) if number == MISSING_FEATURE => f64::NAN,
            Self::Scaled(scales) => f64::from(number) / f64::from(scales.get(feature).copied().unwrap_or(1.0)),
        }
    }

    /// Encodes a row into the numbers that the model compares.
    pub fn row<V: Copy + Into<f64>>(&self, row: &[V]) -> Vec<i32> {
        match self {
            Self::Real => row.iter().map(|&value| f32_key(value.into() as f32)).collect(),
            Self::Scaled(scales) => row.iter().zip(scales).map(|(&value, &scale)| whole(value, scale)).collect(),
        }
    }
}

/// The numbers from one to another that stand for a missing value.
pub(crate) fn missing_text(ends: Option<[f64; 2]>) -> String {
    match ends {
        None => "NaN alone".into(),
        Some([low, high]) if low == high => format!("NaN and {low}"),
        Some([low, high]) => format!("NaN and {low} to {high}"),
    }
}

/// A value as a whole number of its feature's units: the nearest, halves away from zero; values beyond ±(2³¹ − 1) become
/// that, and NaN a missing value.
pub fn whole(value: impl Into<f64>, scale: f32) -> i32 {
    let value: f64 = value.into();
    if value.is_nan() {
        return MISSING_FEATURE;
    }
    // `as` saturates; −2³¹ is a missing value.
    ((value * f64::from(scale)).round() as i32).max(-i32::MAX)
}

/// The names of a model's features: those that it states, or f0, f1 and so on.
pub fn feature_names(model: &Model<'_>) -> Vec<String> {
    let stated: Vec<String> = model.features().map(|feature| feature.name.to_owned()).collect();
    if stated.len() == model.feature_count() {
        return stated;
    }
    (0..model.feature_count()).map(crate::ensemble::Inputs::default_name).collect()
}
