//! A probe of three switches that recognizes, at the end of a link: the whole program of a board but the board.

use super::session::{PROGRAM, RecordsTooShort, Station};
use super::storage::{NoStorage, Storage};
use crate::Model;
use crate::effector::{Effector, Fault, Scale, Sensed, Settings, State, drain};
use palpate_shared::link::{Decision, Device, DeviceEnd, Event, Refusal, TouchMessage, VerdictMessage};
use palpate_shared::{Pose, Touch};

/// What a board has to offer a [`ProbeStation`].
pub trait Board {
    /// Why the link failed; [`core::convert::Infallible`] for a UART.
    type Error;

    /// What the switches have to say: [`Watcher::sense`](crate::effector::Watcher::sense), with the pins' interrupt held
    /// off.
    fn sense(&mut self) -> Sensed;

    /// Takes bytes that have come from the host, without waiting for any; how many.
    ///
    /// # Errors
    /// The link failed.
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error>;

    /// Sends a frame to the host.
    ///
    /// # Errors
    /// The link failed.
    fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error>;

    /// The pose that the robot's controller last announced, and how many microseconds ago. Asked for when an approach is
    /// over, once per touch.
    fn pose(&mut self) -> Option<(Pose, u32)> {
        None
    }
}

/// How a [`ProbeStation`] works.
#[derive(Clone, Copy, Debug)]
pub struct ProbeSettings {
    /// How long the effector waits for what; the timeout is the model's, see [`Settings::for_model`].
    pub effector: Settings,
    /// From the probe that is there to the one that the model was trained for.
    pub scale: Scale,
    /// A pose that was announced longer ago, in microseconds, is none.
    pub pose_lasts: u32,
    /// Whether verdicts carry what is needed to compare them with another recognizer's: 12 bytes, and a posterior.
    pub detail: bool,
    /// Another number after each start, counted or random: see [`DeviceEnd::new`]. A station that keeps records counts by
    /// itself and may be given 0.
    pub boot: u32,
    /// What the program is called on the link: name and version.
    pub program: &'static str,
}

impl Default for ProbeSettings {
    /// The model's own probe; poses last two seconds.
    fn default() -> Self {
        let effector = Settings::default();
        Self { effector, scale: Scale::IDENTITY, pose_lasts: 2_000_000, detail: true, boot: 0, program: PROGRAM }
    }
}

/// What happened in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Happened {
    /// Bytes came from the host and were dealt with.
    Heard,
    /// The probe touched.
    Touched {
        /// The touch, as the model takes it; with a pose if one was announced.
        touch: Touch,
        /// Microseconds since the pose was announced.
        pose_age: Option<u32>,
        /// What is known now, or why the touch was not counted. A decision ends an object: the next touch begins another.
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

/// Effector, recognizer, link and storage: call [`ProbeStation::step`] until nothing has happened, then sleep until an
/// interrupt or until [`ProbeStation::due`].
///
/// Touches of its own fingers and touches from the host go into the same evidence. After each, what is known is stored, then
/// told: a verdict that the host has heard survives a power cut.
///
/// RAM: 180 bytes of effector, 800 of link, 250 and 8 per object of recognition, and the storage's. Stack: about 3 KB more
/// than [`Recognizer::push`](crate::Recognizer::push).
#[derive(Debug)]
pub struct ProbeStation<'m, const N: usize, S = NoStorage> {
    effector: Effector,
    station: Station<'m, N, S>,
    end: DeviceEnd,
    settings: ProbeSettings,
    /// The checksum of the model that the effector is set for.
    model: u32,
    started: bool,
}

impl<'m, const N: usize, S: Storage> ProbeStation<'m, N, S> {
    /// A station that continues from what `storage` holds; `built_in` is a model in flash, in use until another is loaded.
    ///
    /// # Errors
    /// [`RecordsTooShort`].
    pub fn open(built_in: &'m [u8], storage: S, settings: ProbeSettings) -> Result<Self, RecordsTooShort> {
        let (mut station, progress, starts) = Station::open(built_in, storage)?;
        station.set_program(settings.program);
        let end = DeviceEnd::new(progress, settings.boot.wrapping_add(starts));
        let effector = Effector::new(settings.effector);
        let mut probe = Self { effector, station, end, settings, model: 0, started: false };
        probe.follow_model();
        Ok(probe)
    }

    /// The model in use; `None` if there is none that this program can read.
    pub fn model(&self) -> Option<Model<'_>> {
        self.station.model()
    }

    /// Where the probe is in a touch.
    pub const fn state(&self) -> State {
        self.effector.state()
    }

    /// Microseconds from `now`, the time that [`Sensed::Nothing`] said last, until there is something to do without an
    /// interrupt; `None`: nothing before the next edge or byte.
    pub fn due(&self, now: u32) -> Option<u32> {
        self.effector.due(now)
    }

    /// Does what there is to do; `None` if that is nothing.
    ///
    /// # Errors
    /// The link's. What was to be sent is lost; the host notices, and asks again for what it waits for.
    pub fn step<B: Board>(&mut self, board: &mut B) -> Result<Option<Happened>, B::Error> {
        if !core::mem::replace(&mut self.started, true) {
            let mut result = Ok(());
            let mut send = |frame: &[u8]| {
                if result.is_ok() {
                    result = board.send(frame);
                }
            };
            // Boot numbers count records, so without one a start before the first touch would have that of the next start.
            self.end.store(&mut self.station, &mut send);
            self.end.tell(Event::Started, &mut send);
            result?;
        }
        let mut buffer = [0; 32];
        let count = board.receive(&mut buffer)?;
        if let Some(bytes) = buffer.get(..count).filter(|bytes| !bytes.is_empty()) {
            let mut result = Ok(());
            self.end.receive(bytes, &mut self.station, |frame| {
                if result.is_ok() {
                    result = board.send(frame);
                }
            });
            self.follow_model();
            return result.map(|()| Some(Happened::Heard));
        }
        match drain(&mut self.effector, || board.sense()) {
            Ok(None) => Ok(None),
            Ok(Some(touch)) => self.touched(&touch, board).map(Some),
            Err(fault) => tell(&mut self.end, fault.into(), board).map(|()| Some(Happened::Faulty(fault))),
        }
    }

    fn touched<B: Board>(&mut self, touch: &Touch, board: &mut B) -> Result<Happened, B::Error> {
        let mut touch = self.settings.scale.apply(touch);
        let announced = board.pose().filter(|(_, age)| *age <= self.settings.pose_lasts);
        if let Some((pose, _)) = announced {
            touch = touch.with_pose(pose);
        }
        let pose_age = announced.map(|(_, age)| age);
        let outcome = self.station.push(&touch, self.settings.detail);
        if outcome.is_ok_and(|verdict| verdict.decision != Decision::Undecided) {
            self.station.reset();
        }
        let event = match outcome {
            Ok(verdict) => Event::Touch { touch: TouchMessage::from(&touch), pose_age, verdict },
            Err(refusal) => Event::Refused { touch: TouchMessage::from(&touch), refusal },
        };
        let mut result = Ok(());
        let mut send = |frame: &[u8]| {
            if result.is_ok() {
                result = board.send(frame);
            }
        };
        self.end.store(&mut self.station, &mut send);
        self.end.tell(event, &mut send);
        result.map(|()| Happened::Touched { touch, pose_age, outcome })
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

fn tell<B: Board>(end: &mut DeviceEnd, event: Event, board: &mut B) -> Result<(), B::Error> {
    let mut result = Ok(());
    end.tell(event, |frame| result = board.send(frame));
    result
}
