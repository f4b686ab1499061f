//! Touches to the chip, verdicts from it, and the host's own recognizer beside it.

use super::connection::places;
use super::{ChipModel, Connection, Step, Steps};
use crate::error::Result;
use crate::locate::{Approach, CELLS, Pose, TOUCHES};
use palpate_onboard::station::{NoStorage, Station, Table};
use palpate_shared::link::{
    ApproachMessage, Decision, Device, Event, LinkError, POSE_BYTES, PlaceMessage, Refusal, VerdictMessage,
};
use palpate_shared::{Position, Touch};
use serde::Serialize;
use std::fmt::Debug;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Question to the chip after each touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asks {
    /// None.
    Nothing,
    /// The next approach of the model's plan, unless the touch decided.
    Approach,
    /// With a model of maps: the object's place, and the next approach within this many micrometers unless the touch decided.
    Place {
        /// None: twice the maps' range.
        within: Option<u32>,
    },
}

/// The place of an object on the chip's table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Located {
    /// True if no finger met more than the table so far.
    pub table_alone: bool,
    /// True if the chip's search was not finished.
    pub exhausted: bool,
    /// The most likely poses of the most likely object, best first.
    pub poses: Vec<Pose>,
    /// Next approach; none after a verdict.
    pub next: Option<Approach>,
}

/// Something new from the chip.
#[derive(Clone, Debug, PartialEq)]
pub enum Update {
    /// Another object begins, with its name, if known.
    Object(Option<String>),
    /// A touch, and the state after it.
    Touch {
        /// The touch.
        touch: Touch,
        /// The chip's verdict after it.
        verdict: VerdictMessage,
        /// True if this touch decided.
        decided: bool,
        /// The posterior of each object, where the host recognizes too.
        posteriors: Option<Vec<f64>>,
    },
    /// A touch that the chip did not count, because its model was not trained for it.
    Refused {
        /// The touch.
        touch: Touch,
        /// The reason.
        refusal: Refusal,
    },
    /// The approach that the chip proposes next, after a touch that decided nothing.
    Next(ApproachMessage),
    /// The object's place, after a touch.
    Located(Located),
    /// Something that happened on the chip by itself, and how many events before it were lost.
    Event(Event, u32),
}

/// Results of a stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Touches that the chip counted.
    pub touches: u64,
    /// Touches that the chip did not count, because its model was not trained for them.
    pub refused: u64,
    /// Touches, counted or not, that were compared with the host's recognizer.
    pub compared: u64,
    /// Proposed approaches, with places, that were compared with the host's recognizer.
    pub approaches: u64,
    /// Compared touches with another verdict, posterior, evidence, place or approach.
    pub differences: u64,
    /// The first of them.
    pub first_difference: Option<String>,
    /// Objects whose names were known and that were recognized correctly.
    pub right: u64,
    /// Objects whose names were known and that were mistaken for others.
    pub wrong: u64,
    /// Objects whose names were known and that were not recognized.
    pub undecided: u64,
    /// Seconds in which the chip had something to answer. Waiting for touches to be typed is not included.
    pub seconds: f64,
    /// Requests that this end sent.
    pub sent: u64,
    /// Requests that this end sent again.
    pub resent: u64,
    /// Garbled frames that this end received.
    pub garbled: u64,
    /// Garbled frames that the chip received.
    pub chip_garbled: u64,
    /// Requests that reached the chip more than once, and were executed once.
    pub chip_repeated: u64,
    /// Requests that reached the chip after a later one, and were not executed.
    pub chip_late: u64,
    /// The chip's own events that were lost.
    pub missed_events: u64,
}

impl Summary {
    /// Touches per second.
    pub fn rate(&self) -> f64 {
        self.touches as f64 / self.seconds.max(1e-9)
    }
}

/// Streams `steps` to the chip until they end or `each` breaks, and passes every update to `each`, in order. With a
/// `mirror`, the host recognizes the same touches with this model's bytes and compares every verdict, posterior and evidence; with
/// maps it has room for as many cells as a chip. Answers to `asks` are compared too.
///
/// # Errors
/// When a step cannot be read, the chip refuses a touch, the line breaks, the mirror's model is not the chip's, or it is
/// asked for what its model does not have; before a touch with a position is sent to a chip without maps, which may not know it.
pub fn stream(
    connection: &mut Connection,
    mut steps: Steps,
    chip: &ChipModel,
    mirror: Option<&[u8]>,
    asks: Asks,
    mut each: impl FnMut(&mut Connection, Update) -> Result<ControlFlow<()>>,
) -> Result<Summary> {
    if let Some(model) = mirror
        && let expected = model.last_chunk().map_or(0, |stated| u32::from_le_bytes(*stated))
        && expected != chip.info.checksum
    {
        let chip = chip.info.checksum;
        let what =
            format!("the chip's model is not the one to compare with: checksum {chip:08x} instead of {expected:08x}");
        return Err(connection.wrong(what, "Load the model into the chip first."));
    }
    let mut table = Box::new(Table::new());
    let mirror = mirror.map(|model| Mirror::open_with(model, NoStorage, &mut *table));
    let mut run = Run { summary: Summary::default(), busy: Duration::ZERO, mirror, chip, truth: None, decided: false };
    // An object whose place is asked for ends with its verdict, where lines do not say which touches are of it.
    let mut has_ended = false;
    'steps: while let Some(step) = steps.next_step()? {
        if std::mem::take(&mut has_ended) && matches!(step, Step::Touch(_)) {
            let update = run.reset(connection, None)?;
            if each(connection, update)?.is_break() {
                break;
            }
        }
        let update = match step {
            Step::Object(name) => run.reset(connection, name)?,
            Step::Touch(touch) => run.touch(connection, touch)?,
        };
        // A verdict ends the object: the next touch is of another one.
        let (is_touch, is_open) = match &update {
            Update::Touch { verdict, .. } => (true, verdict.decision == Decision::Undecided),
            Update::Refused { .. } => (true, !run.decided),
            _ => (false, false),
        };
        if each(connection, update)?.is_break() {
            break;
        }
        let answer = match asks {
            Asks::Approach if is_open => Some(run.next_approach(connection)?),
            Asks::Place { within } if is_touch => {
                has_ended = !is_open && matches!(steps, Steps::Lines { .. });
                Some(run.locate(connection, within, is_open)?)
            }
            _ => None,
        };
        let mut updates = Vec::from_iter(answer);
        while let Some((event, missed)) = connection.hear(Duration::ZERO)? {
            if event == Event::Started {
                return Err(connection.ended(LinkError::Forgotten));
            }
            updates.push(Update::Event(event, missed));
        }
        for update in updates {
            if each(connection, update)?.is_break() {
                break 'steps;
            }
        }
    }
    run.end_object();
    let (host, counts) = (connection.statistics(), connection.chip_statistics()?);
    Ok(Summary {
        seconds: run.busy.as_secs_f64(),
        sent: host.sent,
        resent: host.resent,
        garbled: host.garbled,
        missed_events: host.missed_events,
        chip_garbled: counts.garbled.into(),
        chip_repeated: counts.repeated.into(),
        chip_late: counts.late.into(),
        ..run.summary
    })
}

/// The host's own recognizer, with a chip's room for maps.
type Mirror<'m> = Station<'m, 256, NoStorage, &'m mut Table<CELLS, TOUCHES, 16>>;

/// A probability from Q56, as chips send posteriors.
pub fn probability(q56: u64) -> f64 {
    q56 as f64 / (1_u64 << 56) as f64
}

/// A running stream.
struct Run<'m> {
    summary: Summary,
    /// Time in which the chip had something to answer.
    busy: Duration,
    mirror: Option<Mirror<'m>>,
    chip: &'m ChipModel,
    truth: Option<String>,
    decided: bool,
}

impl Run<'_> {
    /// Asks the chip, and adds up how long the answer takes.
    fn timed<T>(&mut self, ask: impl FnOnce() -> Result<T>) -> Result<T> {
        let began = Instant::now();
        let answered = ask();
        self.busy += began.elapsed();
        answered
    }

    fn reset(&mut self, connection: &mut Connection, name: Option<String>) -> Result<Update> {
        self.timed(|| connection.reset())?;
        if let Some(mirror) = &mut self.mirror {
            // Without a model it has nothing to forget.
            let _ = mirror.reset();
        }
        self.end_object();
        self.truth.clone_from(&name);
        Ok(Update::Object(name))
    }

    fn touch(&mut self, connection: &mut Connection, touch: Touch) -> Result<Update> {
        if touch.position().is_some() && !self.chip.info.has_maps() {
            return Err(connection.refused(Refusal::Position));
        }
        let answered = self.timed(|| connection.touch(&touch))?;
        let mut posteriors = None;
        if let Some(mirror) = &mut self.mirror {
            let expected = match touch.position() {
                Some(Position { micrometers }) => mirror.press(&touch, micrometers, true),
                None => mirror.push(&touch, true),
            };
            let objects = 0..=self.chip.info.last_object;
            posteriors = Some(objects.map(|object| mirror.posterior(object).map_or(0.0, probability)).collect());
            self.summary.compared += 1;
            self.compare(&touch, &expected, &answered);
        }
        Ok(match answered {
            Err(refusal) => {
                self.summary.refused += 1;
                Update::Refused { touch, refusal }
            }
            Ok(verdict) => {
                self.summary.touches += 1;
                let decided = verdict.decision != Decision::Undecided && !self.decided;
                if decided {
                    self.decided = true;
                    self.count(verdict.decision);
                }
                Update::Touch { touch, verdict, decided, posteriors }
            }
        })
    }

    fn next_approach(&mut self, connection: &mut Connection) -> Result<Update> {
        let answered = self.timed(|| connection.next_approach())?;
        if let Some(mirror) = &self.mirror {
            let expected = mirror.next_approach(&[0; POSE_BYTES]);
            self.summary.approaches += 1;
            self.compare(&"the approach", &expected, &answered);
        }
        answered.map(Update::Next).map_err(|refusal| connection.refused(refusal))
    }

    fn locate(&mut self, connection: &mut Connection, within: Option<u32>, is_open: bool) -> Result<Update> {
        let located = |(place, poses): (PlaceMessage, Vec<Pose>), next| {
            let PlaceMessage { table_alone, exhausted, .. } = place;
            Located { table_alone, exhausted, poses, next }
        };
        let answered = self.timed(|| {
            let found = connection.places()?;
            Ok(located(found, if is_open { Some(connection.next_press(within)?) } else { None }))
        })?;
        if let Some(mirror) = &mut self.mirror {
            let found = places(|rank| mirror.place(rank));
            let next = is_open.then(|| mirror.next_press(within)).transpose();
            let expected = found.and_then(|found| Ok(located(found, next?)));
            self.summary.approaches += 1;
            self.compare(&"the place", &expected, &Ok(answered.clone()));
        }
        Ok(Update::Located(answered))
    }

    /// Counts a difference between what the host expects and what the chip answers.
    fn compare<T: PartialEq + Debug>(&mut self, what: &dyn Debug, expected: &T, answered: &T) {
        if expected != answered {
            self.summary.differences += 1;
            let number = self.summary.touches + self.summary.refused;
            let difference =
                || format!("after touch {number}, {what:?}: the host says {expected:?}, the chip {answered:?}");
            self.summary.first_difference.get_or_insert_with(difference);
        }
    }

    fn count(&mut self, decision: Decision) {
        let Some(truth) = &self.truth else { return };
        let said = match decision {
            Decision::Recognized(object) => self.chip.names.get(usize::from(object)),
            _ => None,
        };
        match said {
            Some(said) if said == truth => self.summary.right += 1,
            Some(_) => self.summary.wrong += 1,
            None => self.summary.undecided += 1,
        }
    }

    fn end_object(&mut self) {
        if !std::mem::take(&mut self.decided) && self.truth.is_some() {
            self.count(Decision::GaveUp);
        }
    }
}
