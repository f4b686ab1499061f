//! Touches that all have a position, or all have none.

use crate::error::{Error, Result, problem};
use palpate_shared::Touch;

/// Touches that all have a position, or all have none.
#[derive(Default)]
pub(super) struct Alike {
    /// True if those so far have one.
    has_position: Option<bool>,
}

impl Alike {
    /// Refuses a touch that is not like those before.
    pub(super) fn admit(&mut self, touch: &Touch) -> Result<()> {
        let has_position = touch.position().is_some();
        match *self.has_position.get_or_insert(has_position) == has_position {
            true => Ok(()),
            false => Err(other_position(has_position, "the touches before it")),
        }
    }
}

/// The problem of a touch that has a position, where the `others` have none, or the other way round.
pub(super) fn other_position(has_position: bool, others: &str) -> Error {
    let (own, have) = if has_position { ("a", "have none") } else { ("no", "have one") };
    problem!("{own} position, where {others} {have}").fix("Give every touch of the data set a position, or none.")
}
