//! Following a chip over the link: the questions to ask, and the answers and events.

use palpate_shared::Touch;
use palpate_shared::link::{
    Answer, Command, Decision, Decoder, Event, FrameError, HostEnd, HostSettings, Incoming, LinkError, ModelInfo,
    Outcome, Query, Refusal, TouchMessage, VerdictMessage,
};
use serde::Serialize;

/// Microseconds after which a chip whose program does not know the question for its name is asked no longer.
const PROGRAM_WAIT: u64 = 5_000_000;

/// From the number of a session that ended to the next; odd, so that none comes again soon.
const SESSION_STEP: u32 = 0x9e37_79b9;

/// Contact times in microseconds; none for a finger that missed.
type Times = [Option<u32>; 3];

/// Something new.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "is", rename_all = "kebab-case")]
pub(crate) enum Happening {
    /// The chip answers.
    Connected,
    /// The chip has not answered for half a minute. It is asked again.
    Silent,
    /// A whole frame of another version of the link came.
    Version { theirs: u8, ours: u8 },
    /// Name and version of the chip's program; empty if it does not say.
    Program { name: String },
    /// The chip's model.
    Model { checksum: u32, length: u32, objects: Vec<String> },
    /// The chip has none.
    NoModel { why: String },
    /// The posterior of each object.
    Posteriors { of: Vec<f64> },
    /// The chip's fingers touched. `earlier`: in a start of the chip before the current one.
    Touch { times: Times, verdict: &'static str, object: u8, touches: u32, earlier: bool },
    /// The chip's fingers touched, and that was not counted.
    Refused { times: Times, why: String, earlier: bool },
    /// A finger is faulty: 0, 1 or 2; none if it is not the fault of one finger.
    Fault { finger: Option<u8>, what: String },
    /// The chip was started.
    Started,
    /// The chip has forgotten its touches, as it was told.
    Reset,
    /// Number of the chip's reports that were lost on the way.
    Missed { count: u32 },
}

/// Knowledge about a chip, asked for one question after the other.
#[derive(Debug, Default)]
struct Known {
    /// None while it is not known; none inside if the chip has none.
    model: Option<Option<ModelInfo>>,
    names: Vec<String>,
    posteriors: Vec<f64>,
    /// True once the posteriors are those after the last touch.
    is_current: bool,
    has_program: bool,
}

impl Known {
    fn next(&self) -> Option<Query> {
        let object = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
        match self.model {
            None => Some(Query::Model),
            Some(Some(info)) if self.names.len() < info.objects() => {
                Some(Query::Name { object: object(self.names.len()) })
            }
            Some(Some(_)) if !self.is_current => Some(Query::Posteriors { first: object(self.posteriors.len()) }),
            _ => (!self.has_program).then_some(Query::Program),
        }
    }

    fn touched(&mut self) {
        self.posteriors.clear();
        self.is_current = false;
    }

    /// Takes the answer to a question.
    fn take(&mut self, query: Query, answer: Answer<'_>, happened: &mut Vec<Happening>) {
        match (query, answer) {
            (Query::Model, Answer::Model(info)) => self.model = Some(Some(info)),
            (Query::Model, answer) => {
                self.model = Some(None);
                let why = match answer {
                    Answer::Refused(refusal) => refusal.to_string(),
                    _ => "the chip does not say which model it has".into(),
                };
                happened.push(Happening::NoModel { why });
            }
            (Query::Name { object }, answer) => {
                self.names.push(match answer {
                    Answer::Name(name) => name.into(),
                    _ => format!("object {object}"),
                });
                if let Some(Some(info)) = self.model
                    && self.names.len() == info.objects()
                {
                    let ModelInfo { checksum, length, .. } = info;
                    happened.push(Happening::Model { checksum, length, objects: self.names.clone() });
                }
            }
            (Query::Posteriors { first }, Answer::Posteriors(bytes)) => {
                // Parts that do not follow one another belong to different touches: ask again from the first.
                if usize::from(first) != self.posteriors.len() {
                    return;
                }
                let probability = |q56: &[u8; 8]| u64::from_le_bytes(*q56) as f64 / 2.0_f64.powi(56);
                self.posteriors.extend(bytes.as_chunks().0.iter().map(probability));
                self.is_current = bytes.is_empty() || self.posteriors.len() >= self.names.len();
                if self.is_current {
                    happened.push(Happening::Posteriors { of: self.posteriors.clone() });
                }
            }
            (Query::Posteriors { .. }, _) => self.is_current = true,
            (Query::Program, answer) => {
                self.has_program = true;
                if let Answer::Program(name) = answer {
                    happened.push(Happening::Program { name: name.into() });
                }
            }
            _ => {}
        }
    }
}

/// A chip that is followed.
#[derive(Debug)]
pub(crate) struct Watch {
    end: HostEnd,
    /// Reads the same bytes: the end counts frames of another version and does not say which.
    versions: Decoder,
    session: u32,
    /// The chip's boot number, if it is known.
    boot: Option<u32>,
    known: Known,
    /// The question that is open, and since when.
    asked: Option<(Query, u64)>,
    happened: Vec<Happening>,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            end: HostEnd::new(HostSettings::default()),
            versions: Decoder::new(),
            session: 0,
            boot: None,
            known: Known::default(),
            asked: None,
            happened: Vec::new(),
        }
    }
}

impl Watch {
    /// Happenings since it was last asked.
    pub(crate) fn take(&mut self) -> Vec<Happening> {
        core::mem::take(&mut self.happened)
    }

    pub(crate) fn garbled(&self) -> u64 {
        self.end.statistics().garbled
    }

    pub(crate) fn connect(&mut self, session: u32, now: u64, line: &mut Vec<u8>) {
        (self.session, self.asked, self.known) = (session, None, Known::default());
        self.end.connect(session, now, |bytes| line.extend(bytes));
    }

    pub(crate) fn receive(&mut self, bytes: &[u8], now: u64, line: &mut Vec<u8>) {
        for byte in bytes {
            if let Some(Err(FrameError::Version(theirs))) = self.versions.feed(*byte) {
                self.happened.push(Happening::Version { theirs, ours: palpate_shared::link::VERSION });
            }
            // One at a time: what an answer says decides on the next question.
            let mut opened = false;
            let Self { end, boot, known, asked, happened, .. } = self;
            end.receive(
                &[*byte],
                now,
                |bytes| line.extend(bytes),
                |incoming| match incoming {
                    Incoming::Opened => opened = true,
                    Incoming::Answer(answer) => {
                        if let Some((query, _)) = asked.take() {
                            known.take(query, answer, happened);
                        }
                    }
                    Incoming::Event { event, missed, boot: of } => {
                        if missed > 0 {
                            happened.push(Happening::Missed { count: missed });
                        }
                        if event == Event::Started {
                            // Perhaps with another program or model.
                            (*boot, *known) = (Some(of), Known::default());
                        }
                        let is_earlier = boot.is_some_and(|boot| boot != of);
                        if matches!(event, Event::Touch { .. } | Event::Refused { .. }) && !is_earlier {
                            known.touched();
                        }
                        happened.push(told(&event, is_earlier));
                    }
                    Incoming::Outcome { outcome: Outcome::Refused(refusal), .. } => {
                        happened.push(Happening::Fault { finger: None, what: refusal.to_string() });
                    }
                    Incoming::Outcome { .. } => {
                        known.touched();
                        happened.push(Happening::Reset);
                    }
                },
            );
            if opened {
                (self.boot, self.asked, self.known) = (Some(self.end.boot()), None, Known::default());
                self.happened.push(Happening::Connected);
            }
            self.ask(now, line);
        }
    }

    fn ask(&mut self, now: u64, line: &mut Vec<u8>) {
        if self.asked.is_none()
            && let Some(query) = self.known.next()
            && self.end.ask(query, now, |bytes| line.extend(bytes))
        {
            self.asked = Some((query, now));
        }
    }

    pub(crate) fn tick(&mut self, now: u64, line: &mut Vec<u8>) {
        if let Some((Query::Program, since)) = self.asked
            && now.saturating_sub(since) > PROGRAM_WAIT
        {
            self.end.withdraw();
            (self.asked, self.known.has_program) = (None, true);
        }
        if let Err(error) = self.end.tick(now, |bytes| line.extend(bytes)) {
            if matches!(error, LinkError::Silent { .. }) {
                self.happened.push(Happening::Silent);
            }
            self.connect(self.session.wrapping_add(SESSION_STEP), now, line);
        }
        self.ask(now, line);
    }

    pub(crate) fn reset(&mut self, now: u64, line: &mut Vec<u8>) {
        // A window that is full already holds resets.
        self.end.submit(Command::Reset, now, |bytes| line.extend(bytes));
    }
}

fn times(touch: &TouchMessage) -> Times {
    Touch::from(touch).times().map(|time| time.micros())
}

fn told(event: &Event, earlier: bool) -> Happening {
    match event {
        Event::Touch { touch, verdict: VerdictMessage { decision, best, touches, .. }, .. } => {
            let (verdict, object) = match *decision {
                Decision::Recognized(object) => ("recognized", object),
                Decision::Unknown => ("unknown", *best),
                Decision::GaveUp => ("gave up", *best),
                _ => ("undecided", *best),
            };
            Happening::Touch { times: times(touch), verdict, object, touches: *touches, earlier }
        }
        Event::Refused { touch, refusal } => {
            let times = times(touch);
            let why = match refusal {
                Refusal::Pattern if times == [None; 3] => {
                    "no finger touched, and the model was not trained on such approaches".into()
                }
                refusal => refusal.to_string(),
            };
            Happening::Refused { times, why, earlier }
        }
        Event::Fault { kind, finger } => {
            Happening::Fault { finger: (*finger < 3).then_some(*finger), what: kind.to_string() }
        }
        Event::Started => Happening::Started,
        _ => Happening::Fault { finger: None, what: "the chip reports something that this page does not know".into() },
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
