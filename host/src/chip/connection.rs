//! A session with a chip.

use super::Transport;
use crate::error::{Error, Kind, Place, Result, problem};
use crate::locate::{Approach, Pose};
use crate::progress::{self, Progress};
use palpate_shared::Touch;
use palpate_shared::link::{
    Answer, ApproachMessage, CHUNK, Event, HostEnd, HostSettings, HostStatistics, Incoming, LinkError, ModelInfo,
    POSE_BYTES, PlaceMessage, Refusal, Request, Statistics, VERSION, VerdictMessage, checksum,
};
use std::collections::VecDeque;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::{Duration, Instant};

/// Times that a chip may have a load go on from an earlier byte: memory that is worn out would have it go on forever.
const CONTINUED: u32 = 20;

/// Time after which it is looked whether a request has to be sent again.
const TICK: Duration = Duration::from_millis(20);

/// A model as the chip describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChipModel {
    /// Checksum, bytes, descriptor.
    pub info: ModelInfo,
    /// The objects' names.
    pub names: Vec<String>,
    /// The placements' names, of a model of maps.
    pub placements: Vec<String>,
}

/// A session with a chip. What it is asked or told, it answers before the call returns; a [`Refusal`] is an answer too.
pub struct Connection {
    end: HostEnd,
    transport: Transport,
    started: Instant,
    /// Events that are not handed out yet, and how many were lost before each.
    heard: VecDeque<(Event, u32)>,
    is_open: bool,
    /// True if the chip may have been reset.
    is_doubtful: bool,
}

impl Connection {
    /// Opens a session.
    ///
    /// # Errors
    /// When the chip does not answer.
    pub fn open(transport: Transport, settings: HostSettings) -> Result<Self> {
        let mut connection = Self {
            end: HostEnd::new(settings),
            transport,
            started: Instant::now(),
            heard: VecDeque::new(),
            is_open: false,
            is_doubtful: false,
        };
        connection.connect()?;
        Ok(connection)
    }

    /// Goes on over another transport, after the line broke: a new session with the same chip, or another. What the chip
    /// reports by itself is counted on from before, so that no event is taken twice and those in between are missed ones.
    ///
    /// # Errors
    /// When the chip does not answer.
    pub fn reopen(&mut self, transport: Transport) -> Result<()> {
        self.transport = transport;
        self.connect()
    }

    fn connect(&mut self) -> Result<()> {
        (self.is_open, self.is_doubtful) = (false, false);
        let now = self.now();
        let mut sent = Ok(());
        self.end.connect(session(), now, |bytes| sent = self.transport.send(bytes));
        sent?;
        while !self.is_open {
            self.exchange(TICK, |_| ())?.map_err(|error| self.ended(error))?;
        }
        Ok(())
    }

    fn now(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// The transport, for its name and for resetting an emulated chip.
    pub fn transport(&mut self) -> &mut Transport {
        &mut self.transport
    }

    /// Counts kept by this end.
    pub(crate) fn statistics(&self) -> HostStatistics {
        self.end.statistics()
    }

    /// Takes what comes within `wait`, answers it, and sends again what is due.
    fn exchange(&mut self, wait: Duration, mut answer: impl FnMut(Answer<'_>)) -> Result<Result<(), LinkError>> {
        let bytes = self.transport.receive(wait)?;
        let now = self.now();
        let Self { end, transport, heard, is_open, is_doubtful, .. } = self;
        let mut sent = Ok(());
        let mut send = |bytes: &[u8]| {
            if sent.is_ok() {
                sent = transport.send(bytes);
            }
        };
        end.receive(&bytes, now, &mut send, |incoming| match incoming {
            Incoming::Opened => *is_open = true,
            Incoming::Answer(given) => answer(given),
            // Told in `hear`, whether or not the chip's own announcement arrives.
            Incoming::Event { event: Event::Started, .. } => {}
            Incoming::Event { event, missed } => heard.push_back((event, missed)),
            Incoming::Stranger => *is_doubtful = true,
        });
        let ticked = end.tick(now, &mut send);
        sent.map(|()| ticked)
    }

    /// The chip's next message about something that it was not asked for, and how many before it were lost, waiting no longer than
    /// `wait` for it. A chip that was reset is in a new session then, and [`Event::Started`] tells it: it may have another model.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn hear(&mut self, wait: Duration) -> Result<Option<(Event, u32)>> {
        if self.heard.is_empty() {
            // Without a request under way, nothing ends the session.
            let _ = self.exchange(wait, |_| ())?;
        }
        if std::mem::take(&mut self.is_doubtful)
            && let Err(error) = self.try_ask(Request::Counts, |_| Some(()))?
        {
            if error != LinkError::Forgotten {
                return Err(self.ended(error));
            }
            self.connect()?;
            self.heard.push_front((Event::Started, 0));
        }
        Ok(self.heard.pop_front())
    }

    /// The answer to a request, or why the session has ended; `read` takes what it expects of an answer.
    fn try_ask<T>(
        &mut self,
        request: Request<'_>,
        read: impl Fn(Answer<'_>) -> Option<T>,
    ) -> Result<Result<Result<T, Refusal>, LinkError>> {
        let now = self.now();
        let mut sent = Ok(());
        let is_sent = self.end.request(request, now, |bytes| sent = self.transport.send(bytes));
        sent?;
        if !is_sent {
            // One that was never answered is still under way.
            return Ok(Err(LinkError::Silent));
        }
        let mut answered = None;
        loop {
            let ticked = self.exchange(TICK, |answer| {
                answered = Some(match answer {
                    Answer::Refused(refusal) => Some(Err(refusal)),
                    answer => read(answer).map(Ok),
                });
            })?;
            match (answered.take(), ticked) {
                (Some(Some(answer)), _) => return Ok(Ok(answer)),
                (Some(None), _) => {
                    return Err(self.wrong("the chip's answer does not match the question", OTHER_VERSION));
                }
                (None, Err(error)) => return Ok(Err(error)),
                (None, Ok(())) => {}
            }
        }
    }

    /// The answer to a request, or the refusal.
    fn ask<T>(&mut self, request: Request<'_>, read: impl Fn(Answer<'_>) -> Option<T>) -> Result<Result<T, Refusal>> {
        self.try_ask(request, read)?.map_err(|error| self.ended(error))
    }

    /// The answer to a request that must not be refused.
    fn must<T>(&mut self, request: Request<'_>, read: impl Fn(Answer<'_>) -> Option<T>) -> Result<T> {
        self.ask(request, read)?.map_err(|refusal| self.refused(refusal))
    }

    /// A problem with this chip.
    pub(super) fn wrong(&self, what: impl Into<String>, fix: &str) -> Error {
        Error::new(what).fix(fix).at(Place::file(self.transport.name()))
    }

    /// The error for a session that has ended.
    pub(super) fn ended(&self, error: LinkError) -> Error {
        let fix = match error {
            LinkError::Forgotten => "Start again.".into(),
            _ => format!(
                "Check the port, its speed and the cable, and that the chip's program speaks link version {VERSION}."
            ),
        };
        self.wrong(error.to_string(), &fix).as_kind(Kind::Lost)
    }

    /// The error for a refusal that leaves nothing to go on with.
    pub fn refused(&self, refusal: Refusal) -> Error {
        let fix = match refusal {
            Refusal::NoModel => NO_MODEL,
            Refusal::NoObject => "Load the model again.",
            Refusal::Position => "Load maps, which `palpate maps train` makes, or leave positions out.",
            _ => OTHER_VERSION,
        };
        self.wrong(format!("the chip refuses: {refusal}"), fix)
    }

    /// The model in use on the chip, if there is one.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn model(&mut self) -> Result<Option<ChipModel>> {
        let info = match self.ask(Request::Model, |answer| match answer {
            Answer::Model(info) => Some(info),
            _ => None,
        })? {
            Ok(info) => info,
            Err(Refusal::NoModel) => return Ok(None),
            Err(refusal) => return Err(self.refused(refusal)),
        };
        let objects = (0..=info.last_object).map(|object| self.must(Request::Name { object }, name));
        let names = objects.collect::<Result<_>>()?;
        let mut placements = Vec::new();
        for placement in if info.has_maps() { 0..u8::MAX } else { 0..0 } {
            match self.ask(Request::Placement { placement }, name)? {
                Ok(name) => placements.push(name),
                Err(Refusal::NoObject) => break,
                Err(refusal) => return Err(self.refused(refusal)),
            }
        }
        Ok(Some(ChipModel { info, names, placements }))
    }

    /// The model in use on the chip.
    ///
    /// # Errors
    /// When it has none, the line broke or the chip is silent.
    pub fn must_have_model(&mut self) -> Result<ChipModel> {
        self.model()?.ok_or_else(|| self.wrong("the chip has no model", NO_MODEL))
    }

    /// Name and version of the chip's program; none if it does not say.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub(crate) fn program(&mut self) -> Result<Option<String>> {
        Ok(Some(self.must(Request::Program, name)?).filter(|program| !program.is_empty()))
    }

    /// Counts kept by the chip's end.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub(crate) fn chip_statistics(&mut self) -> Result<Statistics> {
        self.must(Request::Counts, |answer| match answer {
            Answer::Counts(statistics) => Some(statistics),
            _ => None,
        })
    }

    /// The posteriors of all objects in Q56.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn posteriors(&mut self, objects: usize) -> Result<Vec<u64>> {
        let mut posteriors = Vec::new();
        while posteriors.len() < objects {
            let first = u8::try_from(posteriors.len()).unwrap_or(u8::MAX);
            posteriors.extend(self.must(Request::Posteriors { first }, |answer| match answer {
                Answer::Posteriors(bytes) if !bytes.is_empty() => {
                    Some(bytes.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect::<Vec<_>>())
                }
                _ => None,
            })?);
        }
        Ok(posteriors)
    }

    /// Has the chip take a touch into account: its verdict, or why it does not count the touch.
    ///
    /// # Errors
    /// When the chip refuses it for another reason, the line broke, or the chip is silent or has forgotten the session.
    pub fn touch(&mut self, touch: &Touch) -> Result<Result<VerdictMessage, Refusal>> {
        let answered = self.ask(Request::of_touch(touch, true), |answer| match answer {
            Answer::Verdict(verdict) => Some(verdict),
            _ => None,
        })?;
        match answered {
            Err(refusal) if !refusal.is_of_a_touch() => Err(self.refused(refusal)),
            answered => Ok(answered),
        }
    }

    /// Has the chip forget all touches: another object comes.
    ///
    /// # Errors
    /// When the chip refuses, the line broke, or the chip is silent or has forgotten the session.
    pub fn reset(&mut self) -> Result<()> {
        self.must(Request::Reset, |answer| (answer == Answer::Done).then_some(()))
    }

    /// The approach that the chip proposes, of those in any pose; refused if its model has no plan.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn next_approach(&mut self) -> Result<Result<ApproachMessage, Refusal>> {
        self.ask(Request::NextApproach { without: [0; POSE_BYTES] }, |answer| match answer {
            Answer::NextApproach(approach) => Some(approach),
            _ => None,
        })
    }

    /// The most likely places of the most likely object, of a model of maps; the first answer says what is true of all.
    ///
    /// # Errors
    /// When the chip has none, the line broke or the chip is silent.
    pub(crate) fn places(&mut self) -> Result<(PlaceMessage, Vec<Pose>)> {
        places(|rank| {
            self.must(Request::Place { rank }, |answer| match answer {
                Answer::Place(place) => Some(place),
                _ => None,
            })
        })
    }

    /// The approach straight down that the chip proposes, of a model of maps; `within` as in [`Request::NextPress`].
    ///
    /// # Errors
    /// Errors of [`places`](Self::places).
    pub(crate) fn next_press(&mut self, within: Option<u32>) -> Result<Approach> {
        self.must(Request::NextPress { within }, |answer| match answer {
            Answer::NextPress(approach) => Some(approach),
            _ => None,
        })
    }

    /// Loads a model into the chip, which checks it before it uses it. `progress` counts bytes.
    ///
    /// # Errors
    /// When the chip refuses it: it then goes on with the one it had, as it does when this is
    /// [cancelled](crate::error::Kind::Cancelled); loaded again, a model goes on where it was. When the line broke or the chip is
    /// silent.
    pub fn load(&mut self, bytes: &[u8], progress: &dyn Progress) -> Result<()> {
        progress.begin("loading", Some(bytes.len() as u64));
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        let mut request = Request::Begin { length, checksum: checksum(bytes) };
        let (mut at, mut told, mut continued) = (0, 0, 0);
        loop {
            let wanted = self.ask(request, |answer| match answer {
                Answer::Wanted { offset } => Some(offset),
                _ => None,
            })?;
            let offset = match wanted {
                Ok(offset) if offset >= at || continued < CONTINUED => offset,
                wanted => {
                    let refusal = wanted.err().unwrap_or(Refusal::Unwritable);
                    let fix = "Load another model; the chip still uses the one it had.";
                    return Err(self.wrong(format!("the chip refuses the model: {refusal}"), fix));
                }
            };
            continued += u32::from(offset < at);
            at = offset;
            let arrived = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
            progress::advance(progress, arrived.saturating_sub(told) as u64)?;
            told = told.max(arrived);
            let rest = bytes.get(arrived..).unwrap_or_default();
            if rest.is_empty() {
                return Ok(());
            }
            request = Request::Chunk { offset, bytes: rest.get(..CHUNK).unwrap_or(rest) };
        }
    }
}

const NO_MODEL: &str = "Load a model into it.";
const OTHER_VERSION: &str = "Flash the chip again: its program speaks another version of the link.";

/// The error for a line that carries touches, and a model over rows.
pub fn no_rows() -> Error {
    problem!("the model is over rows of features, and the line to a chip carries touches").fix(
        "Recognize rows here with `palpate rows recognize MODEL ROWS.csv`; on the chip the program itself \
         passes them to push_features, and its verdicts are the same.",
    )
}

/// The places that are answered, from the most likely on, and the first answer.
pub(super) fn places<E>(mut ask: impl FnMut(u8) -> Result<PlaceMessage, E>) -> Result<(PlaceMessage, Vec<Pose>), E> {
    let first = ask(0)?;
    let (mut poses, mut next) = (Vec::new(), first.place);
    while let Some(pose) = next {
        poses.push(pose);
        next = if poses.len() < 255 { ask(u8::try_from(poses.len()).unwrap_or(u8::MAX))?.place } else { None };
    }
    Ok((first, poses))
}

fn name(answer: Answer<'_>) -> Option<String> {
    match answer {
        Answer::Name(name) => Some(name.into()),
        _ => None,
    }
}

/// A number for a session that no other host takes: from the keys that the system gives to hash maps.
fn session() -> u32 {
    let [a, b, c, d, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
