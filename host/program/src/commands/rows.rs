//! Rows of features, as the commands that take them read them.

use super::remark;
use palpate::Result;
use palpate::rows::{BY_POSITION, Features, Rows};
use std::path::Path;

/// Reads rows of these features; says on stderr if columns are taken by their position.
pub(super) fn read_rows(path: &Path, features: impl Into<Features>, label: Option<&str>) -> Result<Rows> {
    let rows = Rows::read(path, features, label)?;
    say_by_position(path, rows.by_position);
    Ok(rows)
}

/// Says on stderr that columns of a file were taken by their position, if they were.
pub(super) fn say_by_position(path: &Path, by_position: bool) {
    if by_position {
        remark(&format!("palpate: note: {}: {BY_POSITION}", path.display()));
    }
}
