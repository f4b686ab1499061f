//! In place of what reads logs where the feature `mcap` is off: an error that says so.

use super::logged::{Channels, Message};
use crate::error::{Error, Place, Result, TouchesProblem};
use std::io::Read;
use std::path::Path;

/// No log.
pub(super) fn read(_: impl Read, path: &Path, _: impl FnMut(Message) -> Result<()>) -> Result<Channels> {
    Err(Error::variant_at(Place::file(path), TouchesProblem::NoMcap))
}
