//! Events of a link, as lines of JSON for programs and lines of text for people.

use super::{ChipModel, Update};
use crate::wording::percent;
use palpate_shared::Pose;
use palpate_shared::link::{ApproachMessage, Decision, Event};
use serde::Serialize;
use std::fmt;
use std::time::Duration;

/// Something that happened. Its `Display` is the same for people.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// Another object begins.
    Object {
        /// Its name, if known.
        name: Option<String>,
    },
    /// A touch, and the state after it.
    Touch {
        /// Microseconds after the first contact, null where it is missing.
        times: [Option<u32>; 3],
        /// `undecided`, `unknown`, or an object's name.
        verdict: String,
        /// The object with the most evidence.
        best: String,
        /// Touches of this object so far.
        touches: u32,
        /// The posterior of each object, if known.
        posteriors: Option<Vec<f64>>,
        /// Seconds since the beginning.
        at: f64,
    },
    /// The approach that the chip proposes next.
    Next {
        /// The number of its pose.
        pose: u16,
        /// Unit vector of the motion.
        direction: [f64; 3],
        /// Unit vector along the row of fingers.
        alignment: [f64; 3],
        /// Degree to which it distinguishes the likeliest object from the others, from 0 (not at all) to 1.
        score: f64,
    },
    /// A fault of the chip's own fingers.
    Fault {
        /// Description of the fault.
        what: String,
    },
}

impl Entry {
    /// The entry for a chip's model.
    pub fn model(chip: &ChipModel) -> Self {
        Self::Model { objects: chip.names.clone(), length: chip.info.length, checksum: chip.info.checksum }
    }

    /// The entry for a proposed approach.
    pub fn next(approach: &ApproachMessage) -> Self {
        // Q15, to four digits.
        let unit = |q15: f64| (q15 / 32_767.0 * 1e4).round() / 1e4;
        let Pose { direction, alignment } = approach.middle();
        let [direction, alignment] = [direction, alignment].map(|vector| vector.map(|q15| unit(q15.into())));
        Self::Next { pose: approach.pose, direction, alignment, score: unit(approach.score.into()) }
    }

    /// The entry for an update; `None` where nothing happened.
    pub fn of(update: &Update, chip: &ChipModel, at: Duration) -> Option<Self> {
        let name = |object: u8| chip.names.get(usize::from(object)).cloned().unwrap_or_default();
        match update {
            Update::Object(name) => Some(Self::Object { name: name.clone() }),
            Update::Touch { touch, verdict, posteriors, .. } => Some(Self::Touch {
                times: touch.times().map(|time| time.micros()),
                verdict: match verdict.decision {
                    Decision::Recognized(object) => name(object),
                    decision => decision.name().into(),
                },
                best: name(verdict.best),
                touches: verdict.touches,
                posteriors: posteriors.clone(),
                at: at.as_secs_f64(),
            }),
            Update::Event(Event::Touch { touch, verdict, .. }, _) => {
                let touch = Update::Touch { touch: touch.into(), verdict: *verdict, decided: false, posteriors: None };
                Self::of(&touch, chip, at)
            }
            Update::Event(Event::Fault { kind, finger }, _) => {
                let what = if *finger < 3 { format!("finger {}: {kind}", finger + 1) } else { kind.to_string() };
                Some(Self::Fault { what })
            }
            Update::Refused { refusal, .. } | Update::Event(Event::Refused { refusal, .. }, _) => {
                Some(Self::Fault { what: format!("a touch was not counted: {refusal}") })
            }
            Update::Next(approach) => Some(Self::next(approach)),
            Update::Located(_) | Update::Event(..) => None,
        }
    }
}

/// One line for people, without an end of line.
impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model { objects, length, checksum } => {
                write!(f, "model of {length} bytes, checksum {checksum:08x}: {}", objects.join(", "))
            }
            Self::Object { name: Some(name) } => write!(f, "another object: {name}"),
            Self::Object { name: None } => f.write_str("another object"),
            Self::Touch { times, verdict, best, touches, posteriors, .. } => {
                write!(f, "{touches:5}")?;
                for time in times {
                    match time {
                        Some(micros) => write!(f, " {:9.3}", f64::from(*micros) / 1e3)?,
                        None => write!(f, " {:>9}", "-")?,
                    }
                }
                f.write_str(" ms  ")?;
                if verdict != "undecided" {
                    return f.write_str(verdict);
                }
                write!(f, "perhaps {best}")?;
                match posteriors.as_ref().and_then(|p| p.iter().copied().reduce(f64::max)) {
                    Some(posterior) => write!(f, " {}", percent(posterior, 1)),
                    None => Ok(()),
                }
            }
            Self::Next { pose, direction: [x, y, z], alignment: [u, v, w], score } => write!(
                f,
                "next: pose {pose}, along {x:.2} {y:.2} {z:.2}, row {u:.2} {v:.2} {w:.2}, separation {score:.3}"
            ),
            Self::Fault { what } => write!(f, "fault: {what}"),
        }
    }
}
