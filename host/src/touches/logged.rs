//! Contents of a robot's log.

use crate::error::{Error, problem};
use palpate_shared::Touch;

/// The channels of a log: topics, with the names of their schemas.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Channels {
    /// Topics with touches.
    pub touches: Vec<String>,
    /// Skipped topics.
    pub others: Vec<String>,
}

/// A touch as a message of a log holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Time of logging, in nanoseconds on the log's clock.
    pub time: u64,
    /// The byte at which the message, or the chunk with it, begins.
    pub offset: u64,
    /// The touch.
    pub touch: Touch,
    /// Its object, if that is known.
    pub object: Option<String>,
}

/// The problem with something in a log that exceeds a limit.
pub(super) fn too_large(what: &str, bytes: u64, most: u64) -> Error {
    problem!("{what} of {bytes} bytes, where at most {most} are read")
        .fix("If it is meant, keep the touches alone: mcap filter LOG -o TOUCHES.mcap -y TOPIC.")
}
