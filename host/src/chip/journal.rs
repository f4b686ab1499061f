//! What happened on a link, as lines of JSON: for programs, and for `palpate watch` to look at later or meanwhile.

use super::{ChipModel, Update};
use crate::error::{Error, Result};
use palpate_shared::link::{Decision, Event};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "is", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Entry {
    /// The chip's model.
    Model {
        /// The objects' names.
        objects: Vec<String>,
        /// Bytes.
        length: u32,
        /// CRC-32.
        checksum: u32,
    },
    /// The touches of another object begin.
    Object {
        /// Its name, where it is known.
        name: Option<String>,
    },
    /// A touch, and what is known after it.
    Touch {
        /// Microseconds after the first contact, null where it is missing.
        times: [Option<u32>; 3],
        /// `undecided`, `unknown`, or an object's name.
        verdict: String,
        /// The object with the most evidence.
        best: String,
        /// Touches of this object so far.
        touches: u32,
        /// The posterior of each object, where it is known.
        posteriors: Option<Vec<f64>>,
        /// Seconds since the beginning.
        at: f64,
    },
    /// A fault of the chip's own fingers.
    Fault {
        /// What is wrong.
        what: String,
    },
    /// What both ends of the link have seen so far.
    Link {
        /// Frames that one end sent again.
        resent: u64,
        /// Garbled frames that either end received.
        garbled: u64,
        /// The chip's own events that were lost.
        missed: u64,
    },
}

/// A journal being written: each line is there for readers as soon as it is complete.
pub struct Journal {
    path: PathBuf,
    file: std::fs::File,
}

impl Journal {
    /// Begins a journal. A file that is there already is emptied: a journal is followed while it is written, so it cannot
    /// appear whole at its end.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        let file = std::fs::File::create(path).map_err(|source| Error::io(path, "write the journal", source))?;
        Ok(Self { path: path.into(), file })
    }

    /// Appends an entry.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, entry: &Entry) -> Result<()> {
        let io = |source| Error::io(&self.path, "write the journal", source);
        let mut line = serde_json::to_vec(entry).map_err(|e| io(e.into()))?;
        line.push(b'\n');
        self.file.write_all(&line).map_err(io)
    }
}

impl Entry {
    /// The entry for an update; `None` where nothing happened.
    pub fn of(update: &Update, chip: &ChipModel, at: Duration) -> Option<Self> {
        let name = |object: u8| chip.names.get(usize::from(object)).cloned().unwrap_or_default();
        match update {
            Update::Object(name) => Some(Self::Object { name: name.clone() }),
            Update::Touch { touch, verdict, posteriors, .. } => Some(Self::Touch {
                times: touch.times().map(|time| time.micros()),
                verdict: match verdict.decision {
                    Decision::Recognized(object) => name(object),
                    Decision::Unknown => "unknown".into(),
                    _ => "undecided".into(),
                },
                best: name(verdict.best),
                touches: verdict.touches,
                posteriors: posteriors.clone(),
                at: at.as_secs_f64(),
            }),
            Update::Event(Event::Touch { touch, verdict }, _) => {
                let touch = Update::Touch { touch: touch.into(), verdict: *verdict, decided: false, posteriors: None };
                Self::of(&touch, chip, at)
            }
            Update::Event(Event::Fault { kind, finger }, _) => {
                let what = if *finger < 3 { format!("finger {}: {kind}", finger + 1) } else { kind.to_string() };
                Some(Self::Fault { what })
            }
            Update::Event(..) | Update::Idle => None,
        }
    }
}
