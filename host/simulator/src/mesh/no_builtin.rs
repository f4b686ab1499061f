//! Stands in for the built-in objects if the feature `objects` is off: there are none.

use crate::error::{Error, Result};
use crate::mesh::Object;

/// No names.
pub(super) fn names() -> [&'static str; 0] {
    []
}

/// Not this object.
pub(super) fn one(name: &str) -> Result<Object> {
    Err(absent(name))
}

/// Any number: there are no shapes.
pub(super) const BACKGROUND_SHAPES: usize = 200;

/// No shapes.
pub(super) fn background(_: usize, _: u64) -> Result<Object> {
    Err(absent(super::BACKGROUND))
}

fn absent(name: &str) -> Error {
    Error::setting("source", name, "a file or a directory: the built-in objects need the feature `objects`")
}
