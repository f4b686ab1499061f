//! Rows of features, as the commands that take them read them.

use super::remark;
use palpate::Result;
use palpate::rows::Rows;
use std::path::Path;

/// Reads rows for features with these names; says on stderr if columns are taken by their position.
pub(super) fn read_rows(path: &Path, features: &[&str], label: Option<&str>) -> Result<Rows> {
    let rows = Rows::read(path, features, label)?;
    if rows.by_position {
        remark(&format!(
            "palpate: note: {}: columns are taken by their position, since the header does not name all features",
            path.display()
        ));
    }
    Ok(rows)
}
