//! A probe of three switches that recognizes, at the end of a link: the whole program of a board but the board.

use super::session::{PROGRAM, Station};
use super::storage::{NoStorage, Storage};
use crate::Model;
use crate::effector::{Effector, EffectorSettings, Fault, Scale, Sensed, State, drain};
use core::fmt;
use palpate_shared::link::{Decision, Device, DeviceEnd, Event, Refusal, TouchMessage, VerdictMessage};
use palpate_shared::{ContactTime, Pose, Touch};

/// Interface of a board to a [`ProbeStation`].
pub trait Board {
    /// Failure of the link; [`core::convert::Infallible`] for a UART.
    type Error;

    /// Messages of the switches: [`Watcher::sense`](crate::effector::Watcher::sense), with the pins' interrupt held
    /// off.
    fn sense(&mut self) -> Sensed;

    /// Takes bytes that have come from the host, without waiting for any; how many. Bytes that a UART reports as garbled are
    /// best left out: the host sends again what was in them.
    ///
    /// # Errors
    /// The link failed.
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error>;

    /// Sends a frame to the host.
    ///
    /// # Errors
    /// The link failed.
    fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error>;

    /// The pose that the robot's controller last announced, and how many microseconds ago. Asked for once per touch, in the
    /// step that sees it begin: when an approach is over, the next one may have been announced.
    fn pose(&mut self) -> Option<(Pose, u32)> {
        None
    }

    /// True while the robot's controller says that no approach is under way, or a button is pressed that ends one: asked for in
    /// each step, so a change has to wake the main loop. An approach that ends without a contact is a touch with none, which
    /// no switch can report. Without such a signal those approaches are not told.
    fn is_over(&mut self) -> bool {
        false
    }
}

/// The signal that no approach is under way.
#[derive(Clone, Copy, Debug)]
enum Signal {
    /// Not there, for longer than a button bounces.
    Gone,
    /// There.
    There,
    /// Not there any more, since this time.
    Going(u32),
}

/// True if the approach that is under way has had a contact.
#[derive(Clone, Copy, Debug)]
struct Course {
    signal: Signal,
    /// True if it had, or may have had: at power-up nobody knows, nor after a fault.
    has_contact: bool,
    /// True if the touch in progress is that of the approach before.
    is_late: bool,
}

impl Course {
    /// At power-up.
    const UNKNOWN: Self = Self { signal: Signal::Gone, has_contact: true, is_late: false };

    /// Takes in the signal; true if an approach is over that had no contact. A signal that comes back within `pause`
    /// microseconds bounces. Some instructions.
    fn ends_without(&mut self, is_over: bool, effector: &Effector, pause: u32) -> bool {
        let Some(now) = effector.now() else { return false };
        let (signal, ends) = match (is_over, self.signal) {
            (true, Signal::Gone) => (Signal::There, true),
            (true, Signal::Going(since)) => (Signal::There, now.wrapping_sub(since) >= pause),
            (true, Signal::There) => (Signal::There, false),
            (false, Signal::There) => (Signal::Going(now), false),
            (false, Signal::Going(since)) if now.wrapping_sub(since) < pause => (Signal::Going(since), false),
            (false, _) => (Signal::Gone, false),
        };
        self.signal = signal;
        if !ends {
            return false;
        }
        self.is_late = effector.state() == State::Touching;
        // With a finger that is closed, or after a dropped touch, there may have been one.
        !core::mem::replace(&mut self.has_contact, false) && effector.state() == State::Waiting
    }

    /// A touch is over.
    fn touched(&mut self) {
        self.has_contact |= !core::mem::take(&mut self.is_late);
    }

    /// A finger is faulty, and a touch may have been dropped.
    fn is_lost(&mut self) {
        (self.has_contact, self.is_late) = (true, false);
    }
}

/// Settings of a [`ProbeStation`].
#[derive(Clone, Copy, Debug)]
pub struct ProbeSettings {
    /// Waiting times of the effector; the timeout is the model's, see [`EffectorSettings::for_model`].
    pub effector: EffectorSettings,
    /// From the probe that is there to the one that the model was trained for.
    pub scale: Scale,
    /// A pose that was announced longer before the first contact, in microseconds, does not count; nor does one announced
    /// more than [`EffectorSettings::release`] after it, which is that of the next approach.
    pub pose_lasts: u32,
    /// True if verdicts carry the numbers needed to compare them with another recognizer's: 12 bytes, and a posterior.
    pub detail: bool,
    /// Another number after each start, counted or random: see [`DeviceEnd::new`].
    pub boot: u32,
    /// Name and version of the program on the link.
    pub program: &'static str,
}

impl Default for ProbeSettings {
    /// The model's own probe; poses last two seconds.
    fn default() -> Self {
        let effector = EffectorSettings::default();
        Self { effector, scale: Scale::IDENTITY, pose_lasts: 2_000_000, detail: true, boot: 0, program: PROGRAM }
    }
}

/// Event of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Happened {
    /// Bytes came from the host and were dealt with.
    Heard,
    /// The probe touched, or ended an approach without a contact.
    Touched {
        /// The touch, as the model takes it; with a pose if one was announced. Without a contact where an approach ended
        /// so ([`Board::is_over`]).
        touch: Touch,
        /// Microseconds from the announcement of the pose to the first contact, or to the end of an approach without one.
        pose_age: Option<u32>,
        /// The verdict so far, or the reason why the touch was not counted. A decision ends an object: the next touch
        /// begins another.
        outcome: Result<VerdictMessage, Refusal>,
    },
    /// A finger is faulty.
    Faulty(Fault),
}

impl Happened {
    /// The object that was recognized in this step.
    pub const fn recognized(&self) -> Option<u8> {
        match self {
            Self::Touched { outcome: Ok(VerdictMessage { decision: Decision::Recognized(object), .. }), .. } => {
                Some(*object)
            }
            _ => None,
        }
    }
}

/// A link that failed in a step, and what happened in the step all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkFailed<E> {
    /// The event that [`ProbeStation::step`] would have returned.
    pub happened: Option<Happened>,
    /// The link's error; the first of several.
    pub error: E,
}

impl<E: fmt::Display> fmt::Display for LinkFailed<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for LinkFailed<E> {}

/// The longest that a chip sleeps, in microseconds: a second.
pub const LONGEST_WAIT: u32 = 1_000_000;

/// A board whose link may fail: the first error is kept, and once sending has failed nothing more is sent. What cannot be
/// received says nothing of what can be sent.
struct Line<'b, B: Board> {
    board: &'b mut B,
    failed: Option<B::Error>,
    sends: bool,
}

impl<B: Board> Line<'_, B> {
    fn send(&mut self, frame: &[u8]) {
        if self.sends
            && let Err(error) = self.board.send(frame)
        {
            self.sends = false;
            self.failed.get_or_insert(error);
        }
    }

    /// Bytes from the host, as many as there are.
    fn receive<'r>(&mut self, buffer: &'r mut [u8]) -> &'r [u8] {
        let received = self.board.receive(buffer);
        let count = received.unwrap_or_else(|error| {
            self.failed.get_or_insert(error);
            0
        });
        buffer.get(..count).unwrap_or_default()
    }
}

/// Effector, recognizer, link and storage: call [`ProbeStation::step`] until nothing has happened, then sleep until an
/// interrupt or for [`ProbeStation::wait`].
///
/// Touches of its own fingers and touches from the host go into the same evidence.
///
/// RAM: effector, link, recognition and the storage's. Stack: a few buffers for frames more than
/// [`Recognizer::push`](crate::Recognizer::push). The README of the firmware states the size of both.
#[derive(Debug)]
pub struct ProbeStation<'m, const N: usize, S = NoStorage> {
    effector: Effector,
    station: Station<'m, N, S>,
    end: DeviceEnd,
    settings: ProbeSettings,
    /// The checksum of the model that the effector is set for.
    model: u32,
    /// The announcement before the touch in progress, and the time between the two; known once a step has seen it
    /// begin.
    announced: Option<Option<(Pose, u32)>>,
    course: Course,
    started: bool,
}

impl<'m, const N: usize, S: Storage> ProbeStation<'m, N, S> {
    /// A station that begins with the model that was loaded last into `storage`; `built_in` is a model in flash, in use until
    /// another is loaded.
    pub fn open(built_in: &'m [u8], storage: S, settings: ProbeSettings) -> Self {
        let mut station = Station::open(built_in, storage);
        station.set_program(settings.program);
        let end = DeviceEnd::new(settings.boot);
        let effector = Effector::new(settings.effector);
        let mut probe = Self {
            effector,
            station,
            end,
            settings,
            model: 0,
            announced: None,
            course: Course::UNKNOWN,
            started: false,
        };
        probe.follow_model();
        probe
    }

    /// The model in use; `None` if there is none that this program can read.
    pub fn model(&self) -> Option<Model<'_>> {
        self.station.model()
    }

    /// State of the probe within a touch.
    pub const fn state(&self) -> State {
        self.effector.state()
    }

    /// Microseconds from `now`, the time that [`Sensed::Nothing`] said last, for which there is nothing to do without an
    /// interrupt: at most [`LONGEST_WAIT`], so that any timer can be set to it and none overflows.
    pub fn wait(&self, now: u32) -> u32 {
        [self.effector.due(now), self.end.wait(now)].into_iter().flatten().fold(LONGEST_WAIT, u32::min)
    }

    /// Does what there is to do, `None` if that is nothing: takes bytes from the host, then looks at the switches, so that
    /// neither waits for the other. Of two things that happened it returns the touch or fault.
    ///
    /// # Errors
    /// The link's, with what happened all the same. Call it again. What could not be sent is sent again: an answer when the host asks
    /// again, a touch until the host has heard it.
    pub fn step<B: Board>(&mut self, board: &mut B) -> Result<Option<Happened>, LinkFailed<B::Error>> {
        let mut line = Line { board, failed: None, sends: true };
        if !core::mem::replace(&mut self.started, true) {
            self.end.start(|frame| line.send(frame));
        }
        let mut buffer = [0; 32];
        let bytes = line.receive(&mut buffer);
        if !bytes.is_empty() {
            self.end.receive(bytes, &mut self.station, |frame| line.send(frame));
            self.follow_model();
        }
        let heard = (!bytes.is_empty()).then_some(Happened::Heard);
        let sensed = drain(&mut self.effector, || line.board.sense());
        if let Some(now) = self.effector.now() {
            self.end.tick(now, |frame| line.send(frame));
        }
        let happened = match sensed {
            Ok(Some(touch)) => {
                self.course.touched();
                Some(self.touched(&touch, &mut line))
            }
            Ok(None) => {
                let (is_over, pause) = (line.board.is_over(), self.settings.effector.release);
                match self.course.ends_without(is_over, &self.effector, pause) {
                    true => Some(self.missed(&mut line)),
                    false => heard,
                }
            }
            Err(fault) => {
                self.course.is_lost();
                self.end.tell(fault.into(), |frame| line.send(frame));
                Some(Happened::Faulty(fault))
            }
        };
        if self.effector.state() != State::Touching {
            self.announced = None;
        } else if self.announced.is_none() {
            self.announced = Some(self.ask_pose(line.board));
        }
        match line.failed {
            None => Ok(happened),
            Some(error) => Err(LinkFailed { happened, error }),
        }
    }

    fn touched<B: Board>(&mut self, touch: &Touch, line: &mut Line<'_, B>) -> Happened {
        let touch = self.settings.scale.apply(touch);
        // Where the whole touch has passed since the last step, nobody has seen it begin.
        let announced = self.announced.take().unwrap_or_else(|| self.ask_pose(line.board));
        self.tell(touch, announced, line)
    }

    /// An approach without a contact. Its pose may be older than that of a touch, by the time in which the probe passes an
    /// object.
    fn missed<B: Board>(&mut self, line: &mut Line<'_, B>) -> Happened {
        let lasts = self.settings.pose_lasts.saturating_add(self.settings.effector.timeout);
        let announced = line.board.pose().filter(|(_, age)| *age <= lasts);
        self.tell(Touch::new([ContactTime::MISSING; 3]), announced, line)
    }

    /// Takes a touch into account and tells the host.
    fn tell<B: Board>(&mut self, touch: Touch, announced: Option<(Pose, u32)>, line: &mut Line<'_, B>) -> Happened {
        let touch = announced.map_or(touch, |(pose, _)| touch.with_pose(pose));
        let pose_age = announced.map(|(_, age)| age);
        // Touches from the host may have decided: one that counts begins another object.
        if self.station.has_decided() && self.station.model().is_some_and(|model| model.accepts(&touch).is_ok()) {
            let _ = self.station.reset();
        }
        let outcome = self.station.push(&touch, self.settings.detail);
        if outcome.is_ok_and(|verdict| verdict.decision != Decision::Undecided) {
            let _ = self.station.reset();
        }
        let event = match outcome {
            Ok(verdict) => Event::Touch { touch: TouchMessage::from(&touch), pose_age, verdict },
            Err(refusal) => Event::Refused { touch: TouchMessage::from(&touch), refusal },
        };
        self.end.tell(event, |frame| line.send(frame));
        Happened::Touched { touch, pose_age, outcome }
    }

    /// The pose of the touch in progress, or else of the last one, and how long before the first contact it was announced.
    fn ask_pose<B: Board>(&self, board: &mut B) -> Option<(Pose, u32)> {
        let (pose, age) = board.pose()?;
        let since_contact = self.effector.since_contact();
        let before = age.saturating_sub(since_contact);
        let after = since_contact.saturating_sub(age);
        (before <= self.settings.pose_lasts && after <= self.settings.effector.release).then_some((pose, before))
    }

    /// Sets the effector for the model, if that is another one than before.
    fn follow_model(&mut self) {
        let Some(model) = self.station.model() else { return };
        if model.checksum() != self.model {
            self.model = model.checksum();
            self.effector.set(self.settings.effector.for_model(&model, &self.settings.scale));
        }
    }
}
