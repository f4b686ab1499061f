//! A host with a script, as the transport of a chip's program: one thread, no time.

use embedded_io::{ErrorKind, ErrorType, Read, Write};
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::link::{
    CHUNK, Command, Decision, Detail, HostEnd, HostSettings, Incoming, LinkError, Outcome, Query, Refusal,
    VerdictMessage, checksum,
};
use rand::rngs::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use std::cell::Cell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Room for objects of the chips that are tested.
pub const OBJECTS: usize = 16;

/// The power went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerCut;

impl core::fmt::Display for PowerCut {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("power cut")
    }
}

impl core::error::Error for PowerCut {}

impl embedded_io::Error for PowerCut {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// Something for the host to say.
#[derive(Clone, Debug)]
pub enum Step {
    /// Give a command.
    Do(Command<'static>),
    /// Ask a question.
    Ask(Query),
}

/// The host with its script, as the chip's transport: what the chip reads is what the host has to say. One thread.
pub struct Desk {
    /// The host's end of the link.
    pub host: HostEnd,
    /// Steps that it has still to send.
    pub script: VecDeque<Step>,
    /// Bytes on the line.
    pub to_chip: VecDeque<u8>,
    /// Outcomes of all commands, in order.
    pub outcomes: Vec<Outcome>,
    /// To all questions, in order.
    pub answers: Vec<String>,
    /// The session is open.
    pub open: bool,
    /// Microseconds.
    pub now: u64,
    /// Splits sent bytes, and cuts the power.
    pub rng: ChaCha8Rng,
    /// Writes per power cut, on average; 0 for no cuts.
    pub cut_every: u32,
    /// The session may end.
    pub may_fail: bool,
    /// Error that ended the session.
    pub failed: Option<LinkError>,
    /// Commands without an outcome so far.
    given: VecDeque<Command<'static>>,
    /// Chunks since the last beginning.
    chunks: Vec<Command<'static>>,
    /// Outcomes to come that do not count: the load goes on from an earlier chunk.
    passed_over: usize,
    /// Offsets from which the chip had loads go on.
    pub continued: Vec<u32>,
    /// Off once the power is gone: nothing is read or written then.
    pub power: Rc<Cell<bool>>,
}

impl Desk {
    /// A new host with something to say; the power goes in one of `cut_every` writes, 0 for none.
    pub fn new(script: impl IntoIterator<Item = Step>, cut_every: u32) -> Self {
        let mut desk = Self {
            host: HostEnd::new(HostSettings { retry: 1_000, attempts: 1_000 }),
            script: script.into_iter().collect(),
            to_chip: VecDeque::new(),
            outcomes: Vec::new(),
            answers: Vec::new(),
            open: false,
            now: 0,
            rng: ChaCha8Rng::seed_from_u64(1),
            cut_every,
            may_fail: false,
            failed: None,
            given: VecDeque::new(),
            chunks: Vec::new(),
            passed_over: 0,
            continued: Vec::new(),
            power: Rc::new(Cell::new(true)),
        };
        // Another host each time.
        static SESSIONS: AtomicU32 = AtomicU32::new(1);
        let session = SESSIONS.fetch_add(1, Ordering::Relaxed);
        let Self { host, to_chip, .. } = &mut desk;
        host.connect(session, 0, |bytes| to_chip.extend(bytes));
        desk
    }

    fn talk(&mut self) {
        let Self { host, script, to_chip, now, given, chunks, .. } = self;
        while let Some(step) = script.front() {
            let said = match step {
                Step::Do(_) if matches!(given.back(), Some(Command::Begin { .. } | Command::Commit)) => false,
                Step::Do(command) => host.submit(command.clone(), *now, |bytes| to_chip.extend(bytes)).is_some(),
                Step::Ask(query) => host.is_idle() && host.ask(*query, *now, |bytes| to_chip.extend(bytes)),
            };
            if !said {
                break;
            }
            let Some(Step::Do(command)) = script.pop_front() else { continue };
            match command {
                Command::Begin { .. } => chunks.clear(),
                Command::Chunk { .. } => chunks.push(command.clone()),
                _ => {}
            }
            given.push_back(command);
        }
    }

    /// Takes an outcome, unless it is of a chunk that comes again.
    fn hear(&mut self, outcome: Outcome) {
        self.given.pop_front();
        if self.passed_over > 0 {
            self.passed_over -= 1;
        } else if let Outcome::Continue { offset: from } = outcome {
            self.continued.push(from);
            let is_again = |command: &Command<'_>| matches!(command, Command::Chunk { offset, .. } if *offset >= from);
            while matches!(self.script.front(), Some(Step::Do(Command::Chunk { offset, .. })) if *offset < from) {
                self.script.pop_front();
            }
            let again = self.chunks.extract_if(.., |command| is_again(command));
            let commit = self.given.iter().filter(|command| **command == Command::Commit).cloned();
            let again: Vec<_> = again.chain(commit).map(Step::Do).collect();
            again.into_iter().rev().for_each(|step| self.script.push_front(step));
            self.passed_over = self.given.len();
        } else {
            self.outcomes.push(outcome);
        }
    }

    /// True once everything was sent and answered.
    pub fn is_done(&self) -> bool {
        self.open && self.script.is_empty() && self.host.is_idle()
    }
}

impl Desk {
    /// Returns an error once the power is cut: bytes on the line are lost, those in the host are not.
    fn alive(&mut self) -> Result<(), PowerCut> {
        if self.power.get() {
            return Ok(());
        }
        self.to_chip.clear();
        Err(PowerCut)
    }
}

impl ErrorType for Desk {
    type Error = PowerCut;
}

impl Read for Desk {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, PowerCut> {
        self.alive()?;
        for _ in 0..100_000 {
            self.talk();
            if self.is_done() {
                return Ok(0);
            }
            if !self.to_chip.is_empty() {
                let count = buffer.len().min(self.to_chip.len()).min(1 + self.rng.next_u32() as usize % 40);
                buffer[..count].iter_mut().for_each(|byte| *byte = self.to_chip.pop_front().unwrap());
                return Ok(count);
            }
            self.now += 100;
            let Self { host, to_chip, now, .. } = self;
            if let Err(error) = host.tick(*now, |bytes| to_chip.extend(bytes)) {
                assert!(self.may_fail, "{error}");
                self.failed = Some(error);
                return Ok(0);
            }
        }
        panic!("the script does not end: {:?}", self.host.statistics());
    }
}

impl Write for Desk {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, PowerCut> {
        self.alive()?;
        if self.cut_every > 0 && self.rng.random_ratio(1, self.cut_every) {
            self.power.set(false);
            return self.alive().map(|()| 0);
        }
        let Self { host, to_chip, answers, open, now, .. } = self;
        let mut outcomes = Vec::new();
        host.receive(
            buffer,
            *now,
            |bytes| to_chip.extend(bytes),
            |incoming| match incoming {
                Incoming::Opened => *open = true,
                Incoming::Outcome { outcome, .. } => outcomes.push(outcome),
                Incoming::Answer(answer) => answers.push(format!("{answer:?}")),
                Incoming::Event { .. } => {}
            },
        );
        outcomes.into_iter().for_each(|outcome| self.hear(outcome));
        Ok(buffer.len())
    }

    fn flush(&mut self) -> Result<(), PowerCut> {
        Ok(())
    }
}

/// Sends a touch.
pub fn push(touch: &Touch) -> Step {
    Step::Do(Command::Touch { touch: touch.into(), detail: true })
}

/// Sends a model.
pub fn load(bytes: &'static [u8]) -> Vec<Step> {
    let begin = Command::Begin { length: bytes.len() as u32, checksum: checksum(bytes) };
    let mut steps = vec![Step::Do(begin)];
    for (i, bytes) in bytes.chunks(CHUNK).enumerate() {
        steps.push(Step::Do(Command::Chunk { offset: (i * CHUNK) as u32, bytes }));
    }
    steps.push(Step::Do(Command::Commit));
    steps
}

/// Outcomes of a recognizer for these touches.
pub fn expected(bytes: &[u8], touches: &[Touch]) -> Vec<Outcome> {
    let model = Model::new(bytes).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap();
    let verdict = |touch| {
        let decision = match recognizer.push(touch) {
            Ok(Verdict::Undecided) => Decision::Undecided,
            Ok(Verdict::Recognized { object, .. }) => Decision::Recognized(object),
            Ok(Verdict::Unknown) => Decision::Unknown,
            Ok(Verdict::GaveUp) => Decision::GaveUp,
            Err(Refused::Pattern(_)) => return Outcome::Refused(Refusal::Pattern),
            Err(Refused::Spread) => return Outcome::Refused(Refusal::Spread),
            Err(refused) => panic!("{refused}"),
        };
        let best = recognizer.best();
        let detail = Some(Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
        let touches = recognizer.touches();
        Outcome::Verdict(VerdictMessage { decision, best: best as u8, touches, detail })
    };
    touches.iter().map(verdict).collect()
}

/// Outcomes of touches, counted or not.
pub fn answers_to_touches(desk: &Desk) -> Vec<Outcome> {
    let is_answer = |outcome: &&Outcome| match outcome {
        Outcome::Verdict(_) => true,
        Outcome::Refused(refusal) => refusal.is_of_a_touch(),
        _ => false,
    };
    desk.outcomes.iter().filter(is_answer).copied().collect()
}
