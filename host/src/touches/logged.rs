//! Contents of the messages of a robot's log.

use palpate_shared::Touch;

/// The channels of a log: topics, with the names of their schemas.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Channels {
    /// Topics with touches.
    pub touches: Vec<String>,
    /// Topics with verdicts.
    pub verdicts: Vec<String>,
    /// Skipped topics.
    pub others: Vec<String>,
}

/// A message of a log that was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Time of logging, in nanoseconds on the log's clock.
    pub time: u64,
    /// The byte at which the message, or the chunk with it, begins.
    pub offset: u64,
    /// Its contents.
    pub content: Content,
}

/// Contents of a message of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// A touch, and its object if that is known.
    Touch(Touch, Option<String>),
    /// A verdict.
    Verdict(LoggedVerdict),
}

/// A verdict as logs hold it: the fields of `palpate recognize --json`, and the posterior of every object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoggedVerdict {
    /// Number of touches that it rests on.
    pub touch: u32,
    /// One of [`VERDICTS`](Self::VERDICTS).
    pub verdict: String,
    /// The likeliest object; empty before the first touch.
    pub object: String,
    /// Its posterior, from 0 to 1.
    pub posterior: f64,
    /// Reason why the touch was not counted.
    pub refused: Option<String>,
    /// The posterior of every object.
    pub posteriors: Vec<(String, f64)>,
}

impl LoggedVerdict {
    /// Possible values of a verdict.
    pub const VERDICTS: [&'static str; 4] = ["undecided", "recognized", "unknown", "gave-up"];
}
