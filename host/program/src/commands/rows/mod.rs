//! `palpate rows`: models over rows of features, of other libraries.

mod calibrate;
mod evaluate;
mod recognize;

pub(super) use recognize::reset;

use super::remark;
use palpate::Result;
use palpate::compile;
use palpate::rows::{BY_POSITION, Features, Rows, SequenceColumns, Sequences};
use palpate_onboard::Model;
use std::path::Path;

group! {
    /// Set thresholds that keep an error rate on sequences of rows
    Calibrate => calibrate,
    /// Measure how often a model is right on rows, or on sequences of rows
    Evaluate => evaluate,
    /// Give the class or the value of rows
    Recognize => recognize,
}

/// Reads rows of these features; says on stderr if columns are taken by their position.
pub(super) fn read_rows(path: &Path, features: impl Into<Features>, label: Option<&str>) -> Result<Rows> {
    let rows = Rows::read(path, features, label)?;
    say_by_position(path, rows.by_position);
    Ok(rows)
}

/// Says on stderr that columns of a file were taken by their position, if they were.
fn say_by_position(path: &Path, by_position: bool) {
    if by_position {
        remark(&format!("palpate: note: {}: {BY_POSITION}", path.display()));
    }
}

/// Reads sequences for a model; says on stderr if columns are taken by their position.
fn read_sequences(path: &Path, model: &Model<'_>, columns: &SequenceColumns<'_>) -> Result<Sequences> {
    let mut known = compile::names(model);
    known.truncate(model.known_count());
    sequences_of(path, model, columns, &known)
}

/// Reads sequences of these classes.
fn sequences_of(
    path: &Path,
    model: &Model<'_>,
    columns: &SequenceColumns<'_>,
    classes: &[String],
) -> Result<Sequences> {
    let sequences = Sequences::read(path, Features::measured(model), columns, classes)?;
    say_by_position(path, sequences.by_position);
    Ok(sequences)
}
