//! Following a chip over the link: the questions to ask, and the answers and events.

use palpate_shared::Touch;
use palpate_shared::link::{
    Answer, Decision, Decoder, Event, FrameError, HostEnd, HostSettings, Incoming, LinkError, ModelInfo, Refusal,
    Request, TouchMessage, VERSION, VerdictMessage,
};
use serde::Serialize;

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
    /// The chip's fingers touched.
    Touch { times: Times, verdict: &'static str, object: u8, touches: u32 },
    /// The chip's fingers touched, and that was not counted.
    Refused { times: Times, why: String },
    /// A finger is faulty: 0, 1 or 2; none if it is not the fault of one finger.
    Fault { finger: Option<u8>, what: String },
    /// The chip was started.
    Started,
    /// The chip has forgotten its touches, as it was told.
    Reset,
    /// Number of the chip's reports that were lost on the way.
    Missed { count: u32 },
}

/// Knowledge about a chip, asked for one request after the other.
#[derive(Debug, Default)]
struct Known {
    /// None while it is not known; none inside if the chip has none.
    model: Option<Option<ModelInfo>>,
    names: Vec<String>,
    has_program: bool,
    posteriors: Vec<f64>,
    /// True once the posteriors are those after the last touch.
    is_current: bool,
}

impl Known {
    fn next(&self) -> Option<Request<'static>> {
        let object = |count: usize| u8::try_from(count).unwrap_or(u8::MAX);
        match self.model {
            None => Some(Request::Model),
            Some(Some(info)) if self.names.len() < info.objects() => {
                Some(Request::Name { object: object(self.names.len()) })
            }
            _ if !self.has_program => Some(Request::Program),
            Some(Some(_)) if !self.is_current => Some(Request::Posteriors { first: object(self.posteriors.len()) }),
            _ => None,
        }
    }

    fn touched(&mut self) {
        self.posteriors.clear();
        self.is_current = false;
    }

    /// Takes the answer to a request.
    fn take(&mut self, request: &Request<'_>, answer: Answer<'_>, happened: &mut Vec<Happening>) {
        match (request, answer) {
            (Request::Model, Answer::Model(info)) => self.model = Some(Some(info)),
            (Request::Model, answer) => {
                self.model = Some(None);
                let why = match answer {
                    Answer::Refused(refusal) => refusal.to_string(),
                    _ => "the chip does not say which model it has".into(),
                };
                happened.push(Happening::NoModel { why });
            }
            (Request::Name { object }, answer) => {
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
            (Request::Posteriors { first }, Answer::Posteriors(bytes)) => {
                // Parts that do not follow one another belong to different touches: ask again from the first.
                if usize::from(*first) != self.posteriors.len() {
                    return;
                }
                let probability = |q56: &[u8; 8]| u64::from_le_bytes(*q56) as f64 / 2.0_f64.powi(56);
                self.posteriors.extend(bytes.as_chunks().0.iter().map(probability));
                self.is_current = bytes.is_empty() || self.posteriors.len() >= self.names.len();
                if self.is_current {
                    happened.push(Happening::Posteriors { of: self.posteriors.clone() });
                }
            }
            (Request::Posteriors { .. }, _) => self.is_current = true,
            (Request::Program, answer) => {
                self.has_program = true;
                if let Answer::Name(name) = answer {
                    happened.push(Happening::Program { name: name.into() });
                }
            }
            (Request::Reset, Answer::Refused(refusal)) => {
                happened.push(Happening::Fault { finger: None, what: refusal.to_string() });
            }
            (Request::Reset, _) => {
                self.touched();
                happened.push(Happening::Reset);
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
    known: Known,
    /// The request under way.
    asked: Option<Request<'static>>,
    /// True if the chip is to forget its touches.
    resets: bool,
    /// True if the chip may have been reset: an answer to anything shows whether it was.
    is_doubtful: bool,
    happened: Vec<Happening>,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            end: HostEnd::new(HostSettings::default()),
            versions: Decoder::new(),
            known: Known::default(),
            asked: None,
            resets: false,
            is_doubtful: false,
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
        self.forget();
        self.end.connect(session, now, |bytes| line.extend(bytes));
    }

    /// Forgets what was known and wanted in a session that has ended.
    fn forget(&mut self) {
        (self.asked, self.known) = (None, Known::default());
        (self.resets, self.is_doubtful) = (false, false);
    }

    pub(crate) fn receive(&mut self, bytes: &[u8], now: u64, line: &mut Vec<u8>) {
        for byte in bytes {
            if let Some(Err(FrameError::Version(theirs))) = self.versions.feed(*byte) {
                self.happened.push(Happening::Version { theirs, ours: VERSION });
            }
            // One at a time: what an answer says decides on the next request.
            let Self { end, known, asked, is_doubtful, happened, .. } = self;
            end.receive(
                &[*byte],
                now,
                |bytes| line.extend(bytes),
                |incoming| match incoming {
                    Incoming::Opened => happened.push(Happening::Connected),
                    Incoming::Answer(answer) => {
                        if let Some(request) = asked.take() {
                            known.take(&request, answer, happened);
                        }
                    }
                    Incoming::Event { event, missed } => {
                        if missed > 0 {
                            happened.push(Happening::Missed { count: missed });
                        }
                        match event {
                            // Perhaps with another program or model.
                            Event::Started => *known = Known::default(),
                            Event::Touch { .. } | Event::Refused { .. } => known.touched(),
                            _ => {}
                        }
                        happened.push(told(&event));
                    }
                    Incoming::Stranger => *is_doubtful = true,
                },
            );
            self.proceed(now, line);
        }
    }

    /// Begins another session where the one before has ended, and asks what there is to ask.
    fn proceed(&mut self, now: u64, line: &mut Vec<u8>) {
        if let Err(error) = self.end.tick(now, |bytes| line.extend(bytes)) {
            if error == LinkError::Silent {
                self.happened.push(Happening::Silent);
            }
            self.forget();
            self.end.reconnect(now, |bytes| line.extend(bytes));
        }
        if !self.end.is_idle() {
            return;
        }
        let request = match self.resets {
            true => Some(Request::Reset),
            false => self.known.next().or_else(|| self.is_doubtful.then_some(Request::Counts)),
        };
        if let Some(request) = request {
            (self.resets, self.is_doubtful) = (false, false);
            self.end.request(request.clone(), now, |bytes| line.extend(bytes));
            self.asked = Some(request);
        }
    }

    pub(crate) fn tick(&mut self, now: u64, line: &mut Vec<u8>) {
        self.proceed(now, line);
    }

    pub(crate) fn reset(&mut self, now: u64, line: &mut Vec<u8>) {
        self.resets = true;
        self.proceed(now, line);
    }
}

fn times(touch: &TouchMessage) -> Times {
    Touch::from(touch).times().map(|time| time.micros())
}

fn told(event: &Event) -> Happening {
    match event {
        Event::Touch { touch, verdict: VerdictMessage { decision, best, touches, .. }, .. } => {
            let object = if let Decision::Recognized(object) = decision { object } else { best };
            Happening::Touch { times: times(touch), verdict: decision.name(), object: *object, touches: *touches }
        }
        Event::Refused { touch, refusal } => {
            let times = times(touch);
            let why = match refusal {
                Refusal::Pattern if times == [None; 3] => {
                    "no finger touched, and the model was not trained on such approaches".into()
                }
                refusal => refusal.to_string(),
            };
            Happening::Refused { times, why }
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
