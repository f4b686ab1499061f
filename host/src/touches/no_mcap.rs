//! In place of what reads logs where the feature `mcap` is off: an error that says so.

use super::logged::{Channels, Message};
use crate::error::{Place, Result, problem};
use std::io::Read;
use std::path::Path;

/// No log.
pub(super) fn read(_: impl Read, path: &Path, _: impl FnMut(Message) -> Result<()>) -> Result<Channels> {
    Err(problem!("this program was built without MCAP")
        .fix("Build it with the feature mcap, which is on by default.")
        .at(Place::file(path)))
}
