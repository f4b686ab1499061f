//! Touches to the chip, verdicts from it, and the host's own recognizer beside it.

use super::connection::places;
use super::{ChipModel, Connection, Received, Step, Steps};
use crate::error::{ChipProblem, Result};
use crate::locate::{Approach, CELLS, Pose, TOUCHES};
use palpate_onboard::station::{NoStorage, Station, Table};
use palpate_shared::link::{
    ApproachMessage, Command, Decision, Device, Event, Outcome, POSE_BYTES, Refusal, VerdictMessage,
};
use palpate_shared::{Position, Touch};
use serde::Serialize;
use std::collections::VecDeque;
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
    /// Nothing has happened for a while.
    Idle,
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
    /// Frames that this end sent.
    pub sent: u64,
    /// Frames that this end sent again.
    pub resent: u64,
    /// Garbled frames that this end received.
    pub garbled: u64,
    /// Garbled frames that the chip received.
    pub chip_garbled: u64,
    /// Commands that reached the chip more than once, and were counted once.
    pub chip_repeated: u64,
    /// Commands that reached the chip after one that was lost.
    pub chip_early: u64,
    /// The chip's own events that were lost.
    pub missed_events: u64,
}

impl Summary {
    /// Touches per second.
    pub fn rate(&self) -> f64 {
        self.touches as f64 / self.seconds.max(1e-9)
    }
}

/// Adds up the time in which something was under way.
#[derive(Default)]
struct Busy {
    since: Option<Instant>,
    total: Duration,
}

impl Busy {
    /// Something is under way or not, from now on.
    fn set(&mut self, busy: bool, now: Instant) {
        match (self.since, busy) {
            (None, true) => self.since = Some(now),
            (Some(since), false) => {
                self.total += now.duration_since(since);
                self.since = None;
            }
            _ => {}
        }
    }
}

/// Messages that were sent and have no outcome yet.
enum Sent {
    Object(Option<String>),
    Touch { touch: Touch, expected: Option<Result<VerdictMessage, Refusal>>, posteriors: Option<Vec<f64>> },
}

/// Streams `steps` to the chip until they end or `each` breaks, and passes every update to `each`, in order. With a
/// `mirror`, the host recognizes the same touches with this model's bytes and compares every verdict, posterior and evidence; with
/// maps it has room for [`CELLS`] cells. Answers to `asks` are compared too: one touch at a time is then under way.
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
        return Err(connection.wrong(ChipProblem::OtherModel { chip: chip.info.checksum, expected }));
    }
    let mut table = Box::new(Table::new());
    let mut mirror = mirror.map(|model| Mirror::open_with(model, NoStorage, &mut *table));
    // A person who types lines wants each verdict before typing the next line.
    let one_by_one = asks != Asks::Nothing || matches!(steps, Steps::Lines { .. });
    let mut run = Run { summary: Summary::default(), under_way: VecDeque::new(), truth: None, decided: false };
    // An object whose place is asked for ends with its verdict, where lines do not say which touches are of it.
    let (mut pending, mut has_ended) = (None, false);
    let mut more = true;
    let mut busy = Busy::default();
    while more || pending.is_some() || !run.under_way.is_empty() {
        while connection.has_room() && (pending.is_some() || more) && (!one_by_one || run.under_way.is_empty()) {
            let mut step = match pending.take() {
                Some(step) => Some(step),
                None => steps.next_step()?,
            };
            if std::mem::take(&mut has_ended) && matches!(step, Some(Step::Touch(_))) {
                pending = step.replace(Step::Object(None));
            }
            let Some(step) = step else {
                more = false;
                break;
            };
            if let Step::Touch(touch) = &step
                && touch.position().is_some()
                && !chip.info.has_maps()
            {
                return Err(connection.wrong(ChipProblem::Refused(Refusal::Position)));
            }
            if !connection.submit(command(&step))? {
                pending = Some(step);
                break;
            }
            busy.set(true, Instant::now());
            run.under_way.push_back(sent(step, mirror.as_mut(), chip));
        }
        let update = match connection.hear(Duration::from_millis(50))? {
            None => Update::Idle,
            Some(Received::Event(event, missed)) => Update::Event(event, missed),
            Some(Received::Outcome(outcome)) => run.take(outcome, chip).map_err(|problem| connection.wrong(problem))?,
        };
        busy.set(!run.under_way.is_empty(), Instant::now());
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
            Asks::Approach if is_open => {
                let approach = connection.next_approach()?;
                let expected = mirror.as_ref().map(|mirror| mirror.next_approach(&[0; POSE_BYTES]));
                run.compare_answers(expected, &Ok(approach));
                Update::Next(approach)
            }
            Asks::Place { within } if is_touch => {
                let (table_alone, poses) = connection.places()?;
                let next = if is_open { Some(connection.next_press(within)?) } else { None };
                let located = Located { table_alone, poses, next };
                run.compare_answers(
                    mirror.as_mut().map(|mirror| expected(mirror, within, is_open)),
                    &Ok(located.clone()),
                );
                has_ended = !is_open && matches!(steps, Steps::Lines { .. });
                Update::Located(located)
            }
            _ => continue,
        };
        if each(connection, answer)?.is_break() {
            break;
        }
    }
    busy.set(false, Instant::now());
    run.summary.seconds = busy.total.as_secs_f64();
    run.end_object(chip);
    let (host, chip) = (connection.statistics(), connection.chip_statistics()?);
    let summary = run.summary;
    Ok(Summary {
        sent: host.sent,
        resent: host.resent,
        garbled: host.garbled,
        missed_events: host.missed_events,
        chip_garbled: chip.garbled.into(),
        chip_repeated: chip.repeated.into(),
        chip_early: chip.early.into(),
        ..summary
    })
}

/// The host's own recognizer, with a chip's room for maps.
type Mirror<'m> = Station<'m, 256, NoStorage, &'m mut Table<CELLS, TOUCHES, 16>>;

/// The place that the host's own recognizer says.
fn expected(mirror: &mut Mirror<'_>, within: Option<u32>, is_open: bool) -> Result<Located, Refusal> {
    let (table_alone, poses) = places(|rank| mirror.place(rank))?;
    let next = if is_open { Some(mirror.next_press(within)?) } else { None };
    Ok(Located { table_alone, poses, next })
}

fn command(step: &Step) -> Command<'static> {
    match step {
        Step::Object(_) => Command::Reset,
        Step::Touch(touch) => Command::of_touch(touch, true),
    }
}

fn sent(step: Step, mirror: Option<&mut Mirror<'_>>, chip: &ChipModel) -> Sent {
    match step {
        Step::Object(name) => {
            if let Some(mirror) = mirror {
                mirror.reset();
            }
            Sent::Object(name)
        }
        Step::Touch(touch) => {
            let Some(mirror) = mirror else { return Sent::Touch { touch, expected: None, posteriors: None } };
            let expected = Some(match touch.position() {
                Some(Position { micrometers }) => mirror.press(&touch, micrometers, true),
                None => mirror.push(&touch, true),
            });
            let objects = 0..=chip.info.last_object;
            let posteriors = objects.map(|object| mirror.posterior(object).map_or(0.0, probability)).collect();
            Sent::Touch { touch, expected, posteriors: Some(posteriors) }
        }
    }
}

/// A probability from Q56, as chips send posteriors.
pub fn probability(q56: u64) -> f64 {
    q56 as f64 / (1_u64 << 56) as f64
}

/// State of a running stream.
struct Run {
    summary: Summary,
    under_way: VecDeque<Sent>,
    truth: Option<String>,
    decided: bool,
}

impl Run {
    fn take(&mut self, outcome: Outcome, chip: &ChipModel) -> Result<Update, ChipProblem> {
        match (self.under_way.pop_front(), outcome) {
            (Some(Sent::Touch { touch, expected, .. }), Outcome::Refused(refusal)) if refusal.is_of_a_touch() => {
                self.summary.refused += 1;
                self.compare(&touch, expected, Err(refusal));
                Ok(Update::Refused { touch, refusal })
            }
            (_, Outcome::Refused(refusal)) => Err(ChipProblem::Refused(refusal)),
            (Some(Sent::Object(name)), Outcome::Done) => {
                self.end_object(chip);
                self.truth.clone_from(&name);
                Ok(Update::Object(name))
            }
            (Some(Sent::Touch { touch, expected, posteriors }), Outcome::Verdict(verdict)) => {
                self.summary.touches += 1;
                self.compare(&touch, expected, Ok(verdict));
                let decided = verdict.decision != Decision::Undecided && !self.decided;
                if decided {
                    self.decided = true;
                    self.count(verdict.decision, chip);
                }
                Ok(Update::Touch { touch, verdict, decided, posteriors })
            }
            _ => Err(ChipProblem::UnexpectedAnswer),
        }
    }

    fn compare(
        &mut self,
        touch: &Touch,
        expected: Option<Result<VerdictMessage, Refusal>>,
        verdict: Result<VerdictMessage, Refusal>,
    ) {
        let Some(expected) = expected else { return };
        self.summary.compared += 1;
        if expected != verdict {
            self.summary.differences += 1;
            let number = self.summary.touches + self.summary.refused;
            let difference = || format!("touch {number}, {touch:?}: the host says {expected:?}, the chip {verdict:?}");
            self.summary.first_difference.get_or_insert_with(difference);
        }
    }

    fn compare_answers<T: PartialEq + Debug>(&mut self, expected: Option<T>, answer: &T) {
        let Some(expected) = expected else { return };
        self.summary.approaches += 1;
        if expected != *answer {
            self.summary.differences += 1;
            let number = self.summary.touches + self.summary.refused;
            let difference = || format!("after touch {number} the host says {expected:?}, the chip {answer:?}");
            self.summary.first_difference.get_or_insert_with(difference);
        }
    }

    fn count(&mut self, decision: Decision, chip: &ChipModel) {
        let Some(truth) = &self.truth else { return };
        let said = match decision {
            Decision::Recognized(object) => chip.names.get(usize::from(object)),
            _ => None,
        };
        match said {
            Some(said) if said == truth => self.summary.right += 1,
            Some(_) => self.summary.wrong += 1,
            None => self.summary.undecided += 1,
        }
    }

    fn end_object(&mut self, chip: &ChipModel) {
        if !std::mem::take(&mut self.decided) && self.truth.is_some() {
            self.count(Decision::GaveUp, chip);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_for_the_next_touch_does_not_count_as_time_of_the_chip() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut busy = Busy::default();
        for (is_busy, seconds) in
            [(false, 5), (true, 10), (true, 11), (false, 12), (false, 100), (true, 200), (false, 203)]
        {
            busy.set(is_busy, at(seconds));
        }
        assert_eq!(busy.total, Duration::from_secs(2 + 3));
    }
}
