//! In place of the built-in objects where the feature `objects` is off: there are none.

use crate::error::{Error, Result};
use crate::mesh::Object;

/// No names.
pub(super) fn names() -> [&'static str; 0] {
    []
}

/// No objects.
pub(super) fn all() -> Vec<Object> {
    Vec::new()
}

/// Not this object either.
pub(super) fn one(name: &str) -> Result<Object> {
    Err(Error::data(
        format!("there is no built-in object {name} without the feature `objects`"),
        "Give a file, or build with the feature `objects`.",
    ))
}
