//! The host's end of the link.

use super::WINDOW;
use super::frame::{Decoder, FRAME_MAX, Frame, encode};
use super::message::{Answer, Command, Event, Message, Outcome, Query};
use core::fmt;
use embedded_io::{Read, ReadReady, Write};

/// Waiting times of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostSettings {
    /// Microseconds after which an unanswered frame is sent again; doubles with each attempt, up to 16 times.
    pub retry: u64,
    /// Attempts after which the chip counts as silent.
    pub attempts: u32,
}

impl Default for HostSettings {
    /// 300 ms: longer than a full window takes at 115,200 baud. 12 attempts: half a minute.
    fn default() -> Self {
        Self { retry: 300_000, attempts: 12 }
    }
}

/// Counts kept by the host's end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostStatistics {
    /// Frames sent for the first time.
    pub sent: u64,
    /// Frames sent again.
    pub resent: u64,
    /// Whole frames received.
    pub received: u64,
    /// Frames that were garbled or too long, or no message of this version.
    pub garbled: u64,
    /// Outcomes and answers that had been received before, or belong to another session.
    pub repeated: u64,
    /// Times that the chip said that it had missed a command.
    pub early: u64,
    /// The chip's own events that were lost on the way.
    pub missed_events: u64,
}

/// Something for the program that uses the link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incoming<'a> {
    /// The session is open: commands may be given.
    Opened,
    /// The result of a command; in the order of the commands, once for each.
    Outcome {
        /// The command's number.
        sequence: u32,
        /// The result.
        outcome: Outcome,
    },
    /// The answer to the question.
    Answer(Answer<'a>),
    /// Something happened on the chip that was not a command.
    Event {
        /// The event.
        event: Event,
        /// Number of events before it that were lost on the way.
        missed: u32,
        /// The boot number of the start in which it happened.
        boot: u32,
    },
}

/// Reason why the session cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinkError {
    /// The chip does not answer any more.
    Silent {
        /// Commands whose outcome is known.
        answered: u32,
        /// Commands that may have been executed or not.
        uncertain: u32,
    },
    /// The chip has forgotten the session, and everything it was told in it: it was reset.
    Forgotten {
        /// Commands whose outcome is known, and whose effect is lost.
        answered: u32,
        /// Commands that may have been executed or not; if so, their effect is lost.
        uncertain: u32,
    },
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent { answered, uncertain } => write!(
                f,
                "the chip does not answer: {answered} commands were executed, {uncertain} may have been. Check port, \
                 speed and cable, and that the chip's program speaks link version {}",
                super::VERSION
            ),
            Self::Forgotten { answered, uncertain } => write!(
                f,
                "the chip was reset and kept nothing: {answered} commands are lost, and up to {uncertain} more. Start \
                 again, or use a program that stores its progress"
            ),
        }
    }
}

impl core::error::Error for LinkError {}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Not connected.
    Closed,
    /// Asking for the current session.
    Asking,
    /// Opening our own.
    Opening,
    Open,
    /// Asking whether the chip has forgotten our session.
    Doubting,
}

/// Starts of chips that a host remembers: an event may be late by half as many.
const BOOTS: usize = 16;

/// Step from the number of a session that could not be opened to the next one; odd, so that none returns soon.
const SESSION_STEP: u32 = 0x9e37_79b9;

/// A frame in flight.
#[derive(Clone, Copy, Debug)]
struct Sent {
    bytes: [u8; FRAME_MAX],
    length: usize,
    at: u64,
    attempts: u32,
    outcome: Option<Outcome>,
}

impl Sent {
    fn new(frame: &Frame<'_>, now: u64) -> Self {
        let mut bytes = [0; FRAME_MAX];
        let length = encode(frame, &mut bytes).len();
        Self { bytes, length, at: now, attempts: 1, outcome: None }
    }

    fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    fn is_due(&self, now: u64, settings: &HostSettings) -> bool {
        let doublings = self.attempts.saturating_sub(1).min(4);
        now.saturating_sub(self.at) >= settings.retry << doublings
    }

    fn again(&mut self, now: u64, statistics: &mut HostStatistics, send: &mut impl FnMut(&[u8])) {
        self.at = now;
        statistics.resent += 1;
        send(self.bytes());
    }
}

/// The host's end: bytes from the line in, bytes for the line out. `now` is in microseconds on any clock that does not go
/// back.
///
/// RAM: a window of frames.
#[derive(Debug)]
pub struct HostEnd {
    settings: HostSettings,
    decoder: Decoder,
    phase: Phase,
    session: u32,
    next: u32,
    oldest: u32,
    window: [Option<Sent>; WINDOW],
    question: Option<(u8, Sent)>,
    tag: u8,
    /// The chip's boot number when the session was opened.
    boot: u32,
    /// The chip's boot number and the number of its next event, and those of its starts before, or of other chips: the
    /// newest first.
    boots: [Option<(u32, u32)>; BOOTS],
    last_rush: Option<(u32, u64)>,
    /// True once the chip has said that it is in another session.
    forgotten: bool,
    statistics: HostStatistics,
}

impl HostEnd {
    /// An end that is not connected.
    pub const fn new(settings: HostSettings) -> Self {
        Self {
            settings,
            decoder: Decoder::new(),
            phase: Phase::Closed,
            session: 0,
            next: 0,
            oldest: 0,
            window: [None; WINDOW],
            question: None,
            tag: 0,
            boot: 0,
            boots: [None; BOOTS],
            last_rush: None,
            forgotten: false,
            statistics: HostStatistics {
                sent: 0,
                resent: 0,
                received: 0,
                garbled: 0,
                repeated: 0,
                early: 0,
                missed_events: 0,
            },
        }
    }

    /// The counts so far.
    pub const fn statistics(&self) -> HostStatistics {
        self.statistics
    }

    /// The chip's boot number when the session was opened; 0 before the first.
    pub const fn boot(&self) -> u32 {
        self.boot
    }

    /// Starts opening a session; [`Incoming::Opened`] says when it is. Everything in flight is dropped.
    ///
    /// `session` is the session's number: a random one, another each time, so that no two hosts take the same. 0 counts
    /// as 1. Where the chip has another session by the time that it is asked to open this one, other numbers follow.
    pub fn connect(&mut self, session: u32, now: u64, mut send: impl FnMut(&[u8])) {
        self.phase = Phase::Asking;
        // 0 is the session of a chip that knows of none.
        (self.session, self.next, self.oldest) = (session.max(1), 0, 0);
        self.window = [None; WINDOW];
        self.forgotten = false;
        self.put_question(Query::Hello, now, &mut send);
    }

    /// True if the session is open, and no command or question is in flight.
    pub fn is_idle(&self) -> bool {
        self.phase == Phase::Open && self.question.is_none() && self.oldest == self.next
    }

    /// True if [`HostEnd::submit`] would take a command.
    pub fn has_room(&self) -> bool {
        let open = matches!(self.phase, Phase::Open | Phase::Doubting);
        open && usize::try_from(self.next.wrapping_sub(self.oldest)).is_ok_and(|under_way| under_way < WINDOW)
    }

    /// True if [`HostEnd::ask`] would take a question.
    pub(crate) const fn can_ask(&self) -> bool {
        matches!(self.phase, Phase::Open) && self.question.is_none()
    }

    /// Commands whose outcome has been handed out.
    pub const fn answered(&self) -> u32 {
        self.oldest
    }

    /// Sends a command and returns its number; `None` while the window is full or the session is not open.
    pub fn submit(&mut self, command: Command<'_>, now: u64, mut send: impl FnMut(&[u8])) -> Option<u32> {
        if !self.has_room() {
            return None;
        }
        let sequence = self.next;
        let message = Message::Command { sequence, command };
        let sent = Sent::new(&Frame { session: self.session, message }, now);
        send(sent.bytes());
        self.statistics.sent += 1;
        *slot(&mut self.window, sequence)? = Some(sent);
        self.next = self.next.wrapping_add(1);
        Some(sequence)
    }

    /// Asks a question and says whether it did: only one can be open.
    pub fn ask(&mut self, query: Query, now: u64, mut send: impl FnMut(&[u8])) -> bool {
        let can = self.can_ask();
        if can {
            self.put_question(query, now, &mut send);
        }
        can
    }

    /// Gives up the question that was asked last, if it has no answer yet: another can be asked. For questions that chips
    /// with older programs do not answer.
    pub fn withdraw(&mut self) {
        if self.phase == Phase::Open {
            self.question = None;
        }
    }

    fn put_question(&mut self, query: Query, now: u64, send: &mut impl FnMut(&[u8])) {
        self.tag = self.tag.wrapping_add(1);
        let session = self.session;
        let sent = Sent::new(&Frame { session, message: Message::Query { tag: self.tag, query } }, now);
        send(sent.bytes());
        self.statistics.sent += 1;
        self.question = Some((self.tag, sent));
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
        frame: Frame<'_>,
        now: u64,
        send: &mut impl FnMut(&[u8]),
        incoming: &mut impl FnMut(Incoming<'_>),
    ) {
        self.is_alive(&frame.message);
        match frame.message {
            Message::Answer { asker, tag, answer }
                if asker == self.session && self.question.as_ref().is_some_and(|(t, _)| *t == tag) =>
            {
                self.question = None;
                self.take_answer(frame.session, answer, now, send, incoming);
            }
            Message::Outcome { sequence, outcome } if frame.session == self.session && self.is_under_way(sequence) => {
                self.take_outcome(sequence, outcome, now, send, incoming);
            }
            Message::Expected { sequence } if frame.session == self.session => {
                self.statistics.early += 1;
                if self.is_under_way(sequence) {
                    self.rush(sequence, now, send);
                } else if sequence.wrapping_sub(self.oldest) >> 31 == 1 && self.can_ask() {
                    // Late, or the chip has forgotten what it answered: ask.
                    self.doubt(now, send);
                }
            }
            // Either late, or the chip has forgotten our session: ask.
            Message::Expected { .. } if self.can_ask() => {
                self.doubt(now, send);
            }
            Message::Event { boot, sequence, event } => {
                let known = self.boots.iter().position(|known| known.is_some_and(|(known, _)| known == boot));
                let is_first = self.boots.iter().all(Option::is_none);
                let expected = match known.and_then(|place| self.boots.get(place).copied().flatten()) {
                    Some((_, next)) => next,
                    // What a chip said before we listened is not missed; one that has started counts from 0.
                    None if is_first => sequence,
                    None => 0,
                };
                let missed = sequence.wrapping_sub(expected);
                if missed >> 31 == 1 {
                    self.statistics.repeated += 1;
                    return;
                }
                // A late event of a start before does not make that the newest.
                let place = known.unwrap_or_else(|| {
                    self.boots.rotate_right(1);
                    0
                });
                if let Some(slot) = self.boots.get_mut(place) {
                    *slot = Some((boot, sequence.wrapping_add(1)));
                }
                if event == Event::Started || known.is_none() && !is_first {
                    // What was on its way to the chip when it was reset is gone.
                    self.send_again(self.oldest, now, send);
                    if let Some((_, question)) = &mut self.question {
                        question.again(now, &mut self.statistics, send);
                    }
                }
                self.statistics.missed_events += u64::from(missed);
                incoming(Incoming::Event { event, missed, boot });
            }
            _ => self.statistics.repeated += 1,
        }
    }

    /// Asks whether the chip still knows of our session.
    fn doubt(&mut self, now: u64, send: &mut impl FnMut(&[u8])) {
        self.phase = Phase::Doubting;
        self.put_question(Query::Hello, now, send);
    }

    /// A chip that answers is not silent, even if answers were lost: attempts are counted again from here.
    fn is_alive(&mut self, message: &Message<'_>) {
        if !matches!(message, Message::Answer { .. } | Message::Outcome { .. } | Message::Expected { .. }) {
            return;
        }
        if let Some((_, question)) = &mut self.question {
            question.attempts = 1;
        }
        if let Some(Some(sent)) = slot(&mut self.window, self.oldest) {
            sent.attempts = 1;
        }
    }

    fn take_answer(
        &mut self,
        session: u32,
        answer: Answer<'_>,
        now: u64,
        send: &mut impl FnMut(&[u8]),
        incoming: &mut impl FnMut(Incoming<'_>),
    ) {
        match (self.phase, answer) {
            (Phase::Opening, Answer::Session { boot, .. }) if session == self.session => {
                (self.phase, self.boot) = (Phase::Open, boot);
                incoming(Incoming::Opened);
            }
            // In the second case another host opened one in the meantime, or the chip was reset.
            (phase @ (Phase::Asking | Phase::Opening), Answer::Session { boot, .. }) => {
                if phase == Phase::Opening {
                    // The chip that was asked before may be another one and have opened it, or may still do so: what is
                    // repeated there must not be a command that it expects.
                    self.session = self.session.wrapping_add(SESSION_STEP).max(1);
                }
                self.phase = Phase::Opening;
                self.put_question(Query::Open { previous: session, boot }, now, send);
            }
            (Phase::Doubting, Answer::Session { .. }) => {
                self.forgotten = session != self.session;
                self.phase = Phase::Open;
            }
            (Phase::Open, answer) => incoming(Incoming::Answer(answer)),
            // No answer: begin again.
            (Phase::Asking | Phase::Opening, _) => {
                self.phase = Phase::Asking;
                self.put_question(Query::Hello, now, send);
            }
            (Phase::Closed | Phase::Doubting, _) => self.put_question(Query::Hello, now, send),
        }
    }

    fn take_outcome(
        &mut self,
        sequence: u32,
        outcome: Outcome,
        now: u64,
        send: &mut impl FnMut(&[u8]),
        incoming: &mut impl FnMut(Incoming<'_>),
    ) {
        match slot(&mut self.window, sequence) {
            Some(Some(sent)) if sent.outcome.is_none() => sent.outcome = Some(outcome),
            _ => self.statistics.repeated += 1,
        }
        while self.oldest != self.next
            && let Some(place) = slot(&mut self.window, self.oldest)
            && let Some(outcome) = place.as_ref().and_then(|sent| sent.outcome)
        {
            *place = None;
            let sequence = self.oldest;
            self.oldest = self.oldest.wrapping_add(1);
            incoming(Incoming::Outcome { sequence, outcome });
        }
        // The chip executes in order, so an outcome that is older than this one was lost.
        if self.is_under_way(self.oldest) && self.oldest != sequence && sequence.wrapping_sub(self.oldest) >> 31 == 0 {
            self.rush(self.oldest, now, send);
        }
    }

    /// Sends everything from `sequence` on again that has no outcome, unless that was done just now.
    fn rush(&mut self, sequence: u32, now: u64, send: &mut impl FnMut(&[u8])) {
        let just_now = |(last, at): (u32, u64)| last == sequence && now.saturating_sub(at) < self.settings.retry;
        if self.last_rush.is_some_and(just_now) {
            return;
        }
        self.last_rush = Some((sequence, now));
        self.send_again(sequence, now, send);
    }

    fn send_again(&mut self, from: u32, now: u64, send: &mut impl FnMut(&[u8])) {
        let mut sequence = from;
        while sequence != self.next {
            if let Some(Some(sent)) = slot(&mut self.window, sequence)
                && sent.outcome.is_none()
            {
                sent.again(now, &mut self.statistics, send);
            }
            sequence = sequence.wrapping_add(1);
        }
    }

    fn is_under_way(&self, sequence: u32) -> bool {
        sequence.wrapping_sub(self.oldest) < self.next.wrapping_sub(self.oldest)
    }

    /// Sends again everything that has been without an answer for too long. Call it often.
    ///
    /// # Errors
    /// [`LinkError`] when the session cannot go on: [`HostEnd::connect`] begins another.
    pub fn tick(&mut self, now: u64, mut send: impl FnMut(&[u8])) -> Result<(), LinkError> {
        let (answered, uncertain) = (self.oldest, self.next.wrapping_sub(self.oldest));
        if self.forgotten {
            return Err(LinkError::Forgotten { answered, uncertain });
        }
        if let Some((_, question)) = &mut self.question
            && question.is_due(now, &self.settings)
        {
            if question.attempts >= self.settings.attempts {
                return Err(LinkError::Silent { answered, uncertain });
            }
            question.attempts = question.attempts.saturating_add(1);
            question.again(now, &mut self.statistics, &mut send);
        }
        let oldest = self.oldest;
        if let Some(Some(sent)) = slot(&mut self.window, oldest)
            && sent.is_due(now, &self.settings)
        {
            if sent.attempts >= self.settings.attempts {
                return Err(LinkError::Silent { answered, uncertain });
            }
            // Those behind it are sent again with it, but have not failed: the chip takes them in order.
            sent.attempts = sent.attempts.saturating_add(1);
            self.send_again(oldest, now, &mut send);
        }
        Ok(())
    }

    /// Reads what is there on `transport`, answers it, and sends again what is due. Does not wait. Call it again after an
    /// error: a UART reports each garbled byte as one.
    ///
    /// # Errors
    /// The transport's own, or [`LinkError`].
    pub fn exchange<T: Read + Write + ReadReady>(
        &mut self,
        transport: &mut T,
        now: u64,
        incoming: impl FnMut(Incoming<'_>),
    ) -> Result<Result<(), LinkError>, T::Error> {
        let mut buffer = [0; 64];
        let count = if transport.read_ready()? { transport.read(&mut buffer)? } else { 0 };
        let mut written = Ok(());
        let mut send = |frame: &[u8]| {
            if written.is_ok() {
                written = transport.write_all(frame);
            }
        };
        self.receive(buffer.get(..count).unwrap_or_default(), now, &mut send, incoming);
        let ticked = self.tick(now, &mut send);
        written?;
        transport.flush()?;
        Ok(ticked)
    }
}

fn slot(window: &mut [Option<Sent>; WINDOW], sequence: u32) -> Option<&mut Option<Sent>> {
    let places = u32::try_from(WINDOW).unwrap_or(1);
    window.get_mut(usize::try_from(sequence % places).unwrap_or(0))
}
