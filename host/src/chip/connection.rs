//! A session with a chip.

use super::Transport;
use crate::error::{Error, Result};
use palpate_shared::link::{
    Answer, CHUNK, Command, Event, HostEnd, HostSettings, HostStatistics, Incoming, ModelInfo, Outcome, Payload, Query,
    Refusal, Statistics, checksum,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What a chip says, kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Owned {
    /// What came of a command, in the commands' order.
    Outcome(Outcome),
    /// Something happened on the chip by itself; so many events before it were lost.
    Event(Event, u32),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Reply {
    Model(ModelInfo),
    Name(String),
    Statistics(Statistics),
    Posteriors(Vec<u64>),
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
}

/// A session with a chip.
pub struct Connection {
    end: HostEnd,
    transport: Transport,
    started: Instant,
    heard: VecDeque<Owned>,
    reply: Option<Reply>,
    open: bool,
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
        };
        let now = connection.now();
        let mut sent = Ok(());
        connection.end.connect(now, |bytes| sent = connection.transport.send(bytes));
        sent?;
        while !connection.open {
            connection.exchange(Duration::from_millis(20))?;
        }
        Ok(connection)
    }

    fn now(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// The transport, to be reset or named.
    pub fn transport(&mut self) -> &mut Transport {
        &mut self.transport
    }

    /// What this end has seen.
    pub fn statistics(&self) -> HostStatistics {
        self.end.statistics()
    }

    /// Whether no command is without an outcome.
    pub fn is_idle(&self) -> bool {
        self.end.is_idle()
    }

    /// Whether [`Connection::submit`] would take a command at once.
    pub fn has_room(&self) -> bool {
        self.end.has_room()
    }

    /// Sends a command if there is room for it, and says whether it did.
    ///
    /// # Errors
    /// When the chip is gone.
    pub fn submit(&mut self, command: Command<'_>) -> Result<bool> {
        let now = self.now();
        let mut sent = Ok(());
        let number = self.end.submit(command, now, |bytes| sent = self.transport.send(bytes));
        sent.map(|()| number.is_some())
    }

    /// What the chip has said; waits for something, at most for `wait`.
    ///
    /// # Errors
    /// When the chip is gone, silent, or has forgotten the session: the error says how many touches that concerns.
    pub fn hear(&mut self, wait: Duration) -> Result<Option<Owned>> {
        if self.heard.is_empty() {
            self.exchange(wait)?;
        }
        Ok(self.heard.pop_front())
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
            Incoming::Outcome { outcome, .. } => heard.push_back(Owned::Outcome(outcome)),
            Incoming::Event { event, missed } => heard.push_back(Owned::Event(event, missed)),
            Incoming::Answer(answer) => *reply = Some(keep(answer)),
        });
        let ticked = end.tick(now, &mut send);
        sent?;
        ticked.map_err(|error| {
            let text = error.to_string();
            let (what, fix) = text.split_once(". ").unwrap_or((&text, "Check the cable"));
            Error::file(self.transport.name(), what, format!("{fix}."))
        })
    }

    fn ask(&mut self, query: Query) -> Result<Reply> {
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
                return Ok(reply);
            }
            self.exchange(Duration::from_millis(20))?;
        }
    }

    fn unexpected<T>(&self, reply: &Reply) -> Result<T> {
        let what = match reply {
            Reply::Refused(refusal) => format!("the chip refuses: {refusal}"),
            _ => "the chip answers something else than it was asked".into(),
        };
        Err(Error::file(self.transport.name(), what, "See palpate help link."))
    }

    /// The model in use on the chip; `None` if it has none.
    ///
    /// # Errors
    /// When the chip is gone.
    pub fn model(&mut self) -> Result<Option<ChipModel>> {
        let info = match self.ask(Query::Model)? {
            Reply::Model(info) => info,
            Reply::Refused(Refusal::NoModel) => return Ok(None),
            reply => return self.unexpected(&reply),
        };
        let mut names = Vec::new();
        for object in 0..=info.last_object {
            match self.ask(Query::Name { object })? {
                Reply::Name(name) => names.push(name),
                reply => return self.unexpected(&reply),
            }
        }
        Ok(Some(ChipModel { info, names }))
    }

    /// What the chip's end has seen.
    ///
    /// # Errors
    /// When the chip is gone.
    pub fn chip_statistics(&mut self) -> Result<Statistics> {
        match self.ask(Query::Statistics)? {
            Reply::Statistics(statistics) => Ok(statistics),
            reply => self.unexpected(&reply),
        }
    }

    /// The posteriors of all objects in Q56.
    ///
    /// # Errors
    /// When the chip is gone.
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

    /// Loads a model into the chip, which checks it before it uses it; `progress` is told of the bytes that are there.
    ///
    /// # Errors
    /// When the chip refuses it (it then goes on with the one it had), or is gone.
    pub fn load(&mut self, bytes: &[u8], mut progress: impl FnMut(usize)) -> Result<()> {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        let begin = Command::Begin { payload: Payload::Model, length, checksum: checksum(bytes) };
        let chunks = bytes.chunks(CHUNK).enumerate().map(|(index, bytes)| {
            let offset = u32::try_from(index * CHUNK).unwrap_or(u32::MAX);
            Command::Chunk { offset, bytes }
        });
        let mut commands = std::iter::once(begin).chain(chunks).chain([Command::Commit]);
        let total = bytes.len().div_ceil(CHUNK) + 2;
        let mut done = 0_usize;
        while done < total {
            while self.has_room()
                && let Some(command) = commands.next()
            {
                self.submit(command)?;
            }
            match self.hear(Duration::from_millis(20))? {
                Some(Owned::Outcome(Outcome::Refused(refusal))) => {
                    let what = format!("the chip refuses the model: {refusal}");
                    return Err(Error::file(self.transport.name(), what, "The model it had is still in use."));
                }
                Some(Owned::Outcome(_)) => {
                    progress(bytes.len().min(done * CHUNK));
                    done += 1;
                }
                Some(Owned::Event(..)) | None => {}
            }
        }
        Ok(())
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
        Answer::Refused(refusal) => Reply::Refused(refusal),
        _ => Reply::Other,
    }
}
