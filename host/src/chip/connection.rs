//! A session with a chip.

use super::Transport;
use crate::error::{ChipProblem, Error, Place, Result};
use crate::progress::{self, Progress};
use palpate_onboard::locate::{Approach, Pose};
use palpate_shared::link::{
    Answer, ApproachMessage, CHUNK, Command, Event, HostEnd, HostSettings, HostStatistics, Incoming, ModelInfo,
    Outcome, POSE_BYTES, Query, Refusal, Statistics, checksum,
};
use std::collections::VecDeque;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::{Duration, Instant};

/// Times that a chip may have a load go on from an earlier byte: memory that is worn out would have it go on forever.
const CONTINUED: u32 = 20;

/// Message of a chip, by itself or about a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received {
    /// The outcome of a command, in the commands' order.
    Outcome(Outcome),
    /// Something that happened on the chip by itself, and how many events before it were lost.
    Event(Event, u32),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Reply {
    Model(ModelInfo),
    Name(String),
    Statistics(Statistics),
    Posteriors(Vec<u64>),
    NextApproach(ApproachMessage),
    Place(bool, Option<Pose>),
    NextPress(Approach),
    Program(String),
    Refused(Refusal),
    Other,
}

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

/// A session with a chip.
pub struct Connection {
    end: HostEnd,
    transport: Transport,
    started: Instant,
    /// Items heard and not handed out yet; of events also the boot number of the start that they are of.
    heard: VecDeque<(Received, u32)>,
    reply: Option<Reply>,
    open: bool,
    /// Checksum of the model that [`Connection::model`] described, and the boot number of the chip at that time.
    model: Option<(u32, u32)>,
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
            reply: None,
            open: false,
            model: None,
        };
        connection.connect()?;
        let boot = connection.end.boot();
        // What the line still held of an earlier start is nobody's.
        connection.heard.retain(|(received, of)| !matches!(received, Received::Event(..)) || *of == boot);
        Ok(connection)
    }

    /// Goes on over another transport, after the line broke: a new session with the same chip, or another. What the chip
    /// reports by itself is counted on from before, so that no event is taken twice and those in between are missed ones.
    ///
    /// # Errors
    /// When the chip does not answer.
    pub fn reopen(&mut self, transport: Transport) -> Result<()> {
        (self.transport, self.reply, self.open) = (transport, None, false);
        self.connect()
    }

    fn connect(&mut self) -> Result<()> {
        let now = self.now();
        let mut sent = Ok(());
        self.end.connect(session(), now, |bytes| sent = self.transport.send(bytes));
        sent?;
        while !self.open {
            self.exchange(Duration::from_millis(20))?;
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
    pub fn statistics(&self) -> HostStatistics {
        self.end.statistics()
    }

    /// True if every command has its outcome.
    pub fn is_idle(&self) -> bool {
        self.end.is_idle()
    }

    /// True if [`Connection::submit`] would take a command at once.
    pub fn has_room(&self) -> bool {
        self.end.has_room()
    }

    /// Sends a command if there is room for it, and says whether it did.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn submit(&mut self, command: Command<'_>) -> Result<bool> {
        let now = self.now();
        let mut sent = Ok(());
        let number = self.end.submit(command, now, |bytes| sent = self.transport.send(bytes));
        sent.map(|()| number.is_some())
    }

    /// Returns the chip's next message, waiting no longer than `wait` for it.
    ///
    /// # Errors
    /// When the line broke, or the chip is silent or has forgotten the session: the error says how many commands are
    /// concerned. [`ChipProblem::Replaced`] where it was reset and has another model than [`Connection::model`] described;
    /// that has to be asked again then.
    pub fn hear(&mut self, wait: Duration) -> Result<Option<Received>> {
        if self.heard.is_empty() {
            self.exchange(wait)?;
        }
        let Some((received, boot)) = self.heard.pop_front() else { return Ok(None) };
        if matches!(received, Received::Event(..))
            && let Err(error) = self.check_model(boot)
        {
            // It is of the model that the chip has now.
            self.heard.push_front((received, boot));
            return Err(error);
        }
        Ok(Some(received))
    }

    /// Checks the model of a chip that has restarted since its model was read: a loaded model that cannot be read any more
    /// is replaced by the program's own.
    fn check_model(&mut self, boot: u32) -> Result<()> {
        let Some((known, of)) = self.model else { return Ok(()) };
        if of == boot {
            return Ok(());
        }
        match self.ask(Query::Model)? {
            Reply::Model(info) if info.checksum == known => {
                self.model = Some((known, boot));
                Ok(())
            }
            Reply::Model(_) | Reply::Refused(Refusal::NoModel) => {
                self.model = None;
                Err(self.wrong(ChipProblem::Replaced))
            }
            reply => self.unexpected(&reply),
        }
    }

    fn exchange(&mut self, wait: Duration) -> Result<()> {
        let bytes = self.transport.receive(wait)?;
        let now = self.now();
        let Self { end, transport, heard, reply, open, .. } = self;
        let mut sent = Ok(());
        let mut send = |bytes: &[u8]| {
            if sent.is_ok() {
                sent = transport.send(bytes);
            }
        };
        end.receive(&bytes, now, &mut send, |incoming| match incoming {
            Incoming::Opened => *open = true,
            Incoming::Outcome { outcome, .. } => heard.push_back((Received::Outcome(outcome), 0)),
            Incoming::Event { event, missed, boot } => heard.push_back((Received::Event(event, missed), boot)),
            Incoming::Answer(answer) => *reply = Some(keep(answer)),
        });
        let ticked = end.tick(now, &mut send);
        sent?;
        ticked.map_err(|error| self.wrong(ChipProblem::from(error)))
    }

    fn ask(&mut self, query: Query) -> Result<Reply> {
        match self.ask_until(query, None)? {
            Some(reply) => Ok(reply),
            None => Err(self.wrong(ChipProblem::UnexpectedAnswer)),
        }
    }

    /// The answer; none if it has not come by `until`.
    fn ask_until(&mut self, query: Query, until: Option<Instant>) -> Result<Option<Reply>> {
        let mut asked = false;
        self.reply = None;
        loop {
            if !asked {
                let now = self.now();
                let mut sent = Ok(());
                asked = self.end.ask(query, now, |bytes| sent = self.transport.send(bytes));
                sent?;
            }
            if let Some(reply) = self.reply.take() {
                return Ok(Some(reply));
            }
            if until.is_some_and(|until| Instant::now() > until) {
                self.end.withdraw();
                return Ok(None);
            }
            self.exchange(Duration::from_millis(20))?;
        }
    }

    fn unexpected<T>(&self, reply: &Reply) -> Result<T> {
        Err(self.wrong(match *reply {
            Reply::Refused(refusal) => ChipProblem::Refused(refusal),
            _ => ChipProblem::UnexpectedAnswer,
        }))
    }

    /// The error for a problem with this chip.
    pub(super) fn wrong(&self, problem: ChipProblem) -> Error {
        Error::variant_at(Place::file(self.transport.name()), problem)
    }

    /// The model in use on the chip.
    ///
    /// # Errors
    /// [`ChipProblem::NoModel`] if it has none. When the line broke or the chip is silent.
    pub fn model(&mut self) -> Result<ChipModel> {
        let info = match self.ask(Query::Model)? {
            Reply::Model(info) => info,
            Reply::Refused(Refusal::NoModel) => return Err(self.wrong(ChipProblem::NoModel)),
            reply => return self.unexpected(&reply),
        };
        let mut names = Vec::new();
        for object in 0..=info.last_object {
            match self.ask(Query::Name { object })? {
                Reply::Name(name) => names.push(name),
                reply => return self.unexpected(&reply),
            }
        }
        let mut placements = Vec::new();
        while info.has_maps() && placements.len() < 255 {
            let placement = u8::try_from(placements.len()).unwrap_or(u8::MAX);
            match self.ask(Query::Placement { placement })? {
                Reply::Name(name) => placements.push(name),
                Reply::Refused(Refusal::NoObject) => break,
                reply => return self.unexpected(&reply),
            }
        }
        self.model = Some((info.checksum, self.end.boot()));
        Ok(ChipModel { info, names, placements })
    }

    /// Name and version of the chip's program; none if it does not say. A chip that does not know the question takes ten
    /// seconds.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn program(&mut self) -> Result<Option<String>> {
        let until = Instant::now() + Duration::from_secs(10);
        match self.ask_until(Query::Program, Some(until))? {
            Some(Reply::Program(program)) => Ok(Some(program).filter(|program| !program.is_empty())),
            Some(reply) => self.unexpected(&reply),
            None => Ok(None),
        }
    }

    /// Counts kept by the chip's end.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn chip_statistics(&mut self) -> Result<Statistics> {
        match self.ask(Query::Statistics)? {
            Reply::Statistics(statistics) => Ok(statistics),
            reply => self.unexpected(&reply),
        }
    }

    /// The posteriors of all objects in Q56.
    ///
    /// # Errors
    /// When the line broke or the chip is silent.
    pub fn posteriors(&mut self, objects: usize) -> Result<Vec<u64>> {
        let mut posteriors = Vec::new();
        while posteriors.len() < objects {
            let first = u8::try_from(posteriors.len()).unwrap_or(u8::MAX);
            match self.ask(Query::Posteriors { first })? {
                Reply::Posteriors(page) if !page.is_empty() => posteriors.extend(page),
                reply => return self.unexpected(&reply),
            }
        }
        Ok(posteriors)
    }

    /// The approach that the chip proposes, of those in any pose. A chip that does not know the question does not
    /// answer.
    ///
    /// # Errors
    /// [`ChipProblem::Refused`] if its model has no plan. When the line broke or the chip is silent.
    pub fn next_approach(&mut self) -> Result<ApproachMessage> {
        match self.ask(Query::NextApproach { without: [0; POSE_BYTES] })? {
            Reply::NextApproach(approach) => Ok(approach),
            reply => self.unexpected(&reply),
        }
    }

    /// True if no finger met more than the table, and the most likely places of the most likely object, of a model of maps.
    ///
    /// # Errors
    /// [`ChipProblem::Refused`] if it has none. When the line broke or the chip is silent.
    pub fn places(&mut self) -> Result<(bool, Vec<Pose>)> {
        places(|rank| match self.ask(Query::Place { rank })? {
            Reply::Place(table_alone, place) => Ok((table_alone, place)),
            reply => self.unexpected(&reply),
        })
    }

    /// The approach straight down that the chip proposes, of a model of maps; `within` as in [`Query::NextPress`].
    ///
    /// # Errors
    /// Errors of [`places`](Self::places).
    pub fn next_press(&mut self, within: Option<u32>) -> Result<Approach> {
        match self.ask(Query::NextPress { within })? {
            Reply::NextPress(approach) => Ok(approach),
            reply => self.unexpected(&reply),
        }
    }

    /// Loads a model into the chip, which checks it before it uses it. `progress` counts bytes.
    ///
    /// # Errors
    /// [`ChipProblem::ModelRefused`] when the chip refuses it: it then goes on with the one it had, as it does when this
    /// is [cancelled](crate::error::Kind::Cancelled); loaded again, a model goes on where it was. When the line broke or the chip is silent.
    pub fn load(&mut self, bytes: &[u8], progress: &dyn Progress) -> Result<()> {
        progress.begin("loading", Some(bytes.len() as u64));
        self.model = None;
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        let begin = Command::Begin { length, checksum: checksum(bytes) };
        let command = |at: usize| match bytes.get(at..).unwrap_or_default() {
            [] => (Command::Commit, usize::MAX),
            rest => {
                let (offset, bytes) = (u32::try_from(at).unwrap_or(u32::MAX), rest.get(..CHUNK).unwrap_or(rest));
                (Command::Chunk { offset, bytes }, at + bytes.len())
            }
        };
        self.submit(begin)?;
        // Ends of the commands under way, and how many of them the chip refuses because it goes on from an earlier byte.
        let (mut under_way, mut passed_over) = (VecDeque::from([0]), 0_usize);
        let (mut next, mut told, mut continued) = (0, 0, 0);
        loop {
            // The outcome of the beginning says which chunk is the first.
            while passed_over == 0 && next != usize::MAX && under_way.front() != Some(&0) && self.has_room() {
                let (command, end) = command(next);
                self.submit(command)?;
                next = end;
                under_way.push_back(end);
            }
            let Some(&end) = under_way.front() else { return Ok(()) };
            let Some(Received::Outcome(outcome)) = self.hear(Duration::from_millis(20))? else {
                progress::check(progress)?;
                continue;
            };
            under_way.pop_front();
            let arrived = match outcome {
                _ if passed_over > 0 => {
                    passed_over -= 1;
                    continue;
                }
                Outcome::Continue { offset } if continued < CONTINUED => {
                    next = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
                    (passed_over, continued) = (under_way.len(), continued + 1);
                    next
                }
                Outcome::Continue { .. } => return Err(self.wrong(ChipProblem::ModelRefused(Refusal::Unwritable))),
                Outcome::Refused(refusal) => return Err(self.wrong(ChipProblem::ModelRefused(refusal))),
                _ => end.min(bytes.len()),
            };
            progress::advance(progress, arrived.saturating_sub(told) as u64)?;
            told = told.max(arrived);
        }
    }
}

/// The places that are answered, from the most likely on, and whether no finger met more than the table.
pub(super) fn places<E>(mut ask: impl FnMut(u8) -> Result<(bool, Option<Pose>), E>) -> Result<(bool, Vec<Pose>), E> {
    let mut poses = Vec::new();
    loop {
        let (table_alone, place) = ask(u8::try_from(poses.len()).unwrap_or(u8::MAX))?;
        let Some(place) = place.filter(|_| poses.len() < 255) else { return Ok((table_alone, poses)) };
        poses.push(place);
    }
}

fn keep(answer: Answer<'_>) -> Reply {
    match answer {
        Answer::Model(info) => Reply::Model(info),
        Answer::Name(name) => Reply::Name(name.into()),
        Answer::Statistics(statistics) => Reply::Statistics(statistics),
        Answer::Posteriors(bytes) => {
            Reply::Posteriors(bytes.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect())
        }
        Answer::NextApproach(approach) => Reply::NextApproach(approach),
        Answer::Place { table_alone, place } => Reply::Place(table_alone, place),
        Answer::NextPress(press) => Reply::NextPress(press),
        Answer::Program(program) => Reply::Program(program.into()),
        Answer::Refused(refusal) => Reply::Refused(refusal),
        _ => Reply::Other,
    }
}

/// A number for a session that no other host takes: from the keys that the system gives to hash maps.
fn session() -> u32 {
    let [a, b, c, d, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
