//! Sequences of rows as Parquet: a column for each feature, and those of label, sequence and group.

use crate::error::{Error, Place, Result, RowsProblem};
use crate::touches::parquet_table;
use palpate_trees::rows::{Features, SequenceColumns, Sequences};
use std::path::Path;

/// Reads the file.
pub(super) fn read(
    path: &Path,
    features: impl Into<Features>,
    columns: &SequenceColumns<'_>,
    classes: &[String],
) -> Result<Sequences> {
    let not_rows = |detail: String| Error::at(Place::file(path), RowsProblem::NotTable { detail });
    let (header, records) = parquet_table(path, not_rows)?;
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let records = (2_u64..).zip(records).map(Ok);
    Sequences::from_table(&header, records, features, columns, classes, |line| Place::line(path, line))
}
