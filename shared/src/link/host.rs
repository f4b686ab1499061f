//! The host's end of the link.

use super::frame::{Decoder, FRAME_MAX, Frame, encode};
use super::message::{Answer, Event, Message, Request};
use core::fmt;

/// Waiting times of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostSettings {
    /// Microseconds after which an unanswered request is sent again; doubles with each attempt, up to 16 times.
    pub retry: u64,
    /// Attempts after which the chip counts as silent.
    pub attempts: u32,
}

impl Default for HostSettings {
    /// 100 ms: longer than the longest request and its answer take at 115,200 baud. 20 attempts: half a minute.
    fn default() -> Self {
        Self { retry: 100_000, attempts: 20 }
    }
}

/// Counts kept by the host's end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostStatistics {
    /// Requests sent for the first time.
    pub sent: u64,
    /// Requests sent again.
    pub resent: u64,
    /// Whole frames received.
    pub received: u64,
    /// Frames that were garbled or too long, or no message of this version.
    pub garbled: u64,
    /// Answers and events that had been received before, or belong to another session.
    pub repeated: u64,
    /// The chip's own events that were lost.
    pub missed_events: u64,
}

/// Something for the program that uses the link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incoming<'a> {
    /// The session is open: requests may be sent.
    Opened,
    /// The answer to the request under way.
    Answer(Answer<'a>),
    /// Something happened on the chip that was no request; in order, once for each.
    Event {
        /// The event.
        event: Event,
        /// Number of events before it that the chip gave up because nobody heard them.
        missed: u32,
    },
    /// The chip told something in another session: it may have been reset. The answer to any request shows whether it was.
    Stranger,
}

/// Reason why the session cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinkError {
    /// The chip does not answer any more. The request under way may have been executed or not.
    Silent,
    /// The chip has forgotten the session and everything it was told in it: it was reset, or another host speaks to it.
    Forgotten,
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Silent => "the chip does not answer: it may have executed the last command or not",
            Self::Forgotten => "the chip was reset and kept nothing of what it was told",
        })
    }
}

impl core::error::Error for LinkError {}

/// Step from the number of a session to the next one; odd, so that none returns soon.
const SESSION_STEP: u32 = 0x9e37_79b9;

/// Starts of chips whose events a host remembers to have heard.
const BOOTS: usize = 16;

/// The request under way.
#[derive(Clone, Copy, Debug)]
struct Sent {
    bytes: [u8; FRAME_MAX],
    length: usize,
    at: u64,
    attempts: u32,
}

impl Sent {
    fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

/// The host's end: bytes from the line in, bytes for the line out. `now` is in microseconds on any clock that does not go
/// back.
///
/// RAM: two of the longest frames.
#[derive(Debug)]
pub struct HostEnd {
    settings: HostSettings,
    decoder: Decoder,
    session: u32,
    is_open: bool,
    /// Number of the last request.
    number: u32,
    sent: Option<Sent>,
    /// The chip's boot number and the number of the event that is to come next, and those of its starts before, or of other chips:
    /// that of the session first.
    heard: [Option<(u32, u32)>; BOOTS],
    /// True once the chip has said that it does not know the session.
    is_forgotten: bool,
    statistics: HostStatistics,
}

impl HostEnd {
    /// An end that is not connected.
    pub const fn new(settings: HostSettings) -> Self {
        Self {
            settings,
            decoder: Decoder::new(),
            session: 0,
            is_open: false,
            number: 0,
            sent: None,
            heard: [None; BOOTS],
            is_forgotten: false,
            statistics: HostStatistics { sent: 0, resent: 0, received: 0, garbled: 0, repeated: 0, missed_events: 0 },
        }
    }

    /// The counts so far.
    pub const fn statistics(&self) -> HostStatistics {
        self.statistics
    }

    /// Starts opening a session; [`Incoming::Opened`] says when it is. A request under way is dropped. Events are counted on from the
    /// session before: those that the chip still keeps come, and those that it gave up are missed.
    ///
    /// `session` is where the numbers of sessions begin: a random one, another each time, so that no two hosts take the same. 0 counts
    /// as 1. Each time that the chip is asked, another number follows.
    pub fn connect(&mut self, session: u32, now: u64, send: impl FnMut(&[u8])) {
        // 0 is the session of a chip that knows of none.
        (self.session, self.is_open, self.is_forgotten) = (session.max(1), false, false);
        self.put(Request::Hello { previous: 0, boot: 0 }, now, send);
    }

    /// Connects again after a session has ended, like [`connect`](Self::connect), with the number that follows. A number that the chip may know already would
    /// not do: it takes the hello for a request of that session, and does not answer it, or refuses it.
    pub fn reconnect(&mut self, now: u64, send: impl FnMut(&[u8])) {
        self.connect(self.session.wrapping_add(SESSION_STEP), now, send);
    }

    /// True if the session is open, and no request is under way.
    pub const fn is_idle(&self) -> bool {
        self.is_open && self.sent.is_none()
    }

    /// Sends a request and says whether it did: only one can be under way, in an open session.
    pub fn request(&mut self, request: Request<'_>, now: u64, send: impl FnMut(&[u8])) -> bool {
        let is_idle = self.is_idle();
        if is_idle {
            self.put(request, now, send);
        }
        is_idle
    }

    fn put(&mut self, request: Request<'_>, now: u64, mut send: impl FnMut(&[u8])) {
        self.number = self.number.wrapping_add(1);
        let message = Message::Request { number: self.number, request };
        let mut bytes = [0; FRAME_MAX];
        let length = encode(&Frame { session: self.session, message }, &mut bytes).len();
        self.statistics.sent += 1;
        let sent = Sent { bytes, length, at: now, attempts: 1 };
        send(sent.bytes());
        self.sent = Some(sent);
    }

    /// Takes bytes from the line, in any portions, and hands what they bring to `incoming`. Cannot panic, whatever the
    /// bytes.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        now: u64,
        mut send: impl FnMut(&[u8]),
        mut incoming: impl FnMut(Incoming<'_>),
    ) {
        // The decoder hands out what lies in it, so it is moved out while that is borrowed.
        let mut decoder = core::mem::take(&mut self.decoder);
        for &byte in bytes {
            match decoder.feed(byte) {
                None => {}
                Some(Err(_)) => self.statistics.garbled += 1,
                Some(Ok(frame)) => {
                    self.statistics.received += 1;
                    self.take(frame, now, &mut send, &mut incoming);
                }
            }
        }
        self.decoder = decoder;
    }

    fn take(
        &mut self,
        Frame { session, message }: Frame<'_>,
        now: u64,
        send: &mut impl FnMut(&[u8]),
        incoming: &mut impl FnMut(Incoming<'_>),
    ) {
        match message {
            Message::Answer { number, answer }
                if session == self.session && number == self.number && self.sent.is_some() =>
            {
                self.sent = None;
                match answer {
                    Answer::Session { session, boot, event } if !self.is_open && session == self.session => {
                        self.is_open = true;
                        self.remember(boot, event);
                        incoming(Incoming::Opened);
                    }
                    Answer::Session { session: previous, boot, .. } if !self.is_open => {
                        // Another chip that was asked before may have opened this one.
                        self.session = self.session.wrapping_add(SESSION_STEP).max(1);
                        self.put(Request::Hello { previous, boot }, now, send);
                    }
                    Answer::Forgotten => (self.is_open, self.is_forgotten) = (false, true),
                    answer => incoming(Incoming::Answer(answer)),
                }
            }
            Message::Event { number, event } if self.is_open && session == self.session => {
                let heard = Message::Heard { number };
                send(encode(&Frame { session, message: heard }, &mut [0; FRAME_MAX]));
                let [Some((_, next)), ..] = &mut self.heard else { return };
                let missed = number.wrapping_sub(*next);
                if missed >> 31 == 1 {
                    self.statistics.repeated += 1;
                    return;
                }
                *next = number.wrapping_add(1);
                self.statistics.missed_events += u64::from(missed);
                incoming(Incoming::Event { event, missed });
            }
            Message::Event { .. } if self.is_open => incoming(Incoming::Stranger),
            _ => self.statistics.repeated += 1,
        }
    }

    /// Puts a start of a chip first, whose next event has this number.
    fn remember(&mut self, boot: u32, event: u32) {
        let known = self.heard.iter().position(|heard| heard.is_some_and(|(known, _)| known == boot));
        // What the first one told before it was listened to is nobody's; those after it are counted from 0.
        let next = if self.heard.iter().all(Option::is_none) { event } else { 0 };
        let last = self.heard.get_mut(..=known.unwrap_or(BOOTS - 1)).unwrap_or_default();
        last.rotate_right(1);
        if let (None, [first, ..]) = (known, last) {
            *first = Some((boot, next));
        }
    }

    /// Sends the request under way again if it has been without an answer for too long. Call it often.
    ///
    /// # Errors
    /// [`LinkError`] when the session cannot go on: [`HostEnd::reconnect`] begins another.
    pub fn tick(&mut self, now: u64, mut send: impl FnMut(&[u8])) -> Result<(), LinkError> {
        if self.is_forgotten {
            return Err(LinkError::Forgotten);
        }
        let Self { settings, sent: Some(sent), statistics, .. } = self else { return Ok(()) };
        let doublings = sent.attempts.saturating_sub(1).min(4);
        if now.saturating_sub(sent.at) < settings.retry << doublings {
            return Ok(());
        }
        if sent.attempts >= settings.attempts {
            return Err(LinkError::Silent);
        }
        (sent.at, sent.attempts) = (now, sent.attempts.saturating_add(1));
        statistics.resent += 1;
        send(sent.bytes());
        Ok(())
    }
}
