//! A host with a script, as the transport of a chip's program: one thread, no time.

use embedded_io::{ErrorKind, ErrorType, Read, Write};
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::link::{
    Answer, CHUNK, Decision, Detail, HostEnd, HostSettings, Incoming, LinkError, Refusal, Request, VerdictMessage,
    checksum,
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
    /// Asks or tells something.
    Ask(Request<'static>),
    /// Loads these bytes, announced under this checksum.
    Load(&'static [u8], u32),
}

/// A load under way.
#[derive(Clone, Copy)]
struct Loading {
    bytes: &'static [u8],
    /// Offset of the next chunk; none before the chip has said which is the first.
    next: Option<usize>,
}

/// The host with its script, as the chip's transport: what the chip reads is what the host has to say. One thread.
pub struct Desk {
    /// The host's end of the link.
    pub host: HostEnd,
    /// Steps that it has still to take.
    pub script: VecDeque<Step>,
    /// Bytes on the line.
    pub to_chip: VecDeque<u8>,
    /// Answers to touches, in order.
    pub verdicts: Vec<Result<VerdictMessage, Refusal>>,
    /// The result of each load.
    pub loads: Vec<Result<(), Refusal>>,
    /// Answers to all else, in order.
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
    loading: Option<Loading>,
    /// The request under way is a touch.
    is_touch: bool,
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
            verdicts: Vec::new(),
            loads: Vec::new(),
            answers: Vec::new(),
            open: false,
            now: 0,
            rng: ChaCha8Rng::seed_from_u64(1),
            cut_every,
            may_fail: false,
            failed: None,
            loading: None,
            is_touch: false,
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

    /// Says the next thing, once the one before is answered.
    fn talk(&mut self) {
        let Self { host, script, to_chip, now, loading, is_touch, .. } = self;
        if !host.is_idle() {
            return;
        }
        let request = match *loading {
            Some(Loading { bytes, next }) => {
                let next = next.expect("the chip says where a load begins");
                let bytes = &bytes[next..];
                Request::Chunk { offset: next as u32, bytes: &bytes[..bytes.len().min(CHUNK)] }
            }
            None => match script.pop_front() {
                None => return,
                Some(Step::Ask(request)) => request,
                Some(Step::Load(bytes, checksum)) => {
                    *loading = Some(Loading { bytes, next: None });
                    Request::Begin { length: bytes.len() as u32, checksum }
                }
            },
        };
        *is_touch = matches!(request, Request::Touch { .. } | Request::Press { .. });
        host.request(request, *now, |bytes| to_chip.extend(bytes));
    }

    fn hear(&mut self, answer: Answer<'_>) {
        match (self.loading, answer) {
            (Some(_), Answer::Refused(refusal)) => {
                self.loading = None;
                self.loads.push(Err(refusal));
            }
            (Some(Loading { bytes, next }), Answer::Wanted { offset }) => {
                let expected = next.map_or(0, |next| bytes.len().min(next + CHUNK));
                if offset as usize != expected {
                    self.continued.push(offset);
                    assert!(self.continued.len() < 1_000, "the load goes on for ever");
                }
                self.loading = Some(Loading { bytes, next: Some(offset as usize) });
                if offset as usize == bytes.len() {
                    self.loading = None;
                    self.loads.push(Ok(()));
                }
            }
            (None, Answer::Verdict(verdict)) => self.verdicts.push(Ok(verdict)),
            (None, Answer::Refused(refusal)) if self.is_touch => self.verdicts.push(Err(refusal)),
            (None, answer) => self.answers.push(format!("{answer:?}")),
            (Some(_), answer) => panic!("{answer:?} to a part of a model"),
        }
    }

    /// True once everything was sent and answered.
    pub fn is_done(&self) -> bool {
        self.open && self.script.is_empty() && self.loading.is_none() && self.host.is_idle()
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
        // What an answer says is taken once the host is no longer borrowed.
        let mut host = std::mem::replace(&mut self.host, HostEnd::new(HostSettings::default()));
        let (now, mut sent) = (self.now, Vec::new());
        host.receive(
            buffer,
            now,
            |bytes| sent.extend_from_slice(bytes),
            |incoming| match incoming {
                Incoming::Opened => self.open = true,
                Incoming::Answer(answer) => self.hear(answer),
                Incoming::Event { .. } | Incoming::Stranger => {}
            },
        );
        self.host = host;
        self.to_chip.extend(sent);
        Ok(buffer.len())
    }

    fn flush(&mut self) -> Result<(), PowerCut> {
        Ok(())
    }
}

/// Sends a touch.
pub fn push(touch: &Touch) -> Step {
    Step::Ask(Request::Touch { touch: touch.into(), detail: true })
}

/// Sends a model.
pub fn load(bytes: &'static [u8]) -> Step {
    Step::Load(bytes, checksum(bytes))
}

/// Answers of a recognizer to these touches.
pub fn expected(bytes: &[u8], touches: &[Touch]) -> Vec<Result<VerdictMessage, Refusal>> {
    let model = Model::new(bytes).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap();
    let verdict = |touch| {
        let decision = match recognizer.push(touch) {
            Ok(Verdict::Undecided) => Decision::Undecided,
            Ok(Verdict::Recognized { object, .. }) => Decision::Recognized(object),
            Ok(Verdict::Unknown) => Decision::Unknown,
            Ok(Verdict::GaveUp) => Decision::GaveUp,
            Err(Refused::Pattern(_)) => return Err(Refusal::Pattern),
            Err(Refused::Spread) => return Err(Refusal::Spread),
            Err(refused) => panic!("{refused}"),
        };
        let best = recognizer.best();
        let detail = Some(Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
        let touches = recognizer.touches();
        Ok(VerdictMessage { decision, best: best as u8, touches, detail })
    };
    touches.iter().map(verdict).collect()
}
