//! The chip's end of the link.

#[cfg(any(test, feature = "position"))]
use super::message::PlaceMessage;
use super::message::{
    Answer, ApproachMessage, Event, Message, ModelInfo, Refusal, Request, Statistics, VerdictMessage, micrometers,
};
use super::{Decoder, EVENTS, FRAME_MAX, Frame, POSE_BYTES, POSTERIORS, REPEAT, TEXT, encode};
#[cfg(any(test, feature = "position"))]
use crate::Approach;
use crate::Touch;

/// Target of the link: a recognizer, and a place for models. What a chip does not do is refused.
///
/// Every error is a [`Refusal`] to send instead.
pub trait Device {
    /// Takes a touch into account; with a detail if asked for.
    ///
    /// # Errors
    /// A [`Refusal`]; the touch is then not counted.
    fn touch(&mut self, touch: &Touch, detail: bool) -> Result<VerdictMessage, Refusal>;

    /// Takes a touch with a position into account, in micrometers; with a detail if asked for.
    ///
    /// # Errors
    /// A [`Refusal`]; the touch is then not counted.
    fn press(&mut self, _touch: &Touch, _position: [i32; 3], _detail: bool) -> Result<VerdictMessage, Refusal> {
        Err(Refusal::Position)
    }

    /// Forgets all touches.
    ///
    /// # Errors
    /// [`Refusal::NoModel`].
    fn reset(&mut self) -> Result<(), Refusal>;

    /// A model of `length` bytes is about to come: the offset to begin with, as [`Answer::Wanted`] has it.
    ///
    /// # Errors
    /// A [`Refusal`].
    fn begin(&mut self, _length: u32, _checksum: u32) -> Result<u32, Refusal> {
        Err(Refusal::Unsupported)
    }

    /// A part of it: the offset of the next. With the last part the model is checked, and used or refused.
    ///
    /// # Errors
    /// A [`Refusal`]; the model of before is then still in use.
    fn chunk(&mut self, _offset: u32, _bytes: &[u8]) -> Result<u32, Refusal> {
        Err(Refusal::Unsupported)
    }

    /// The model in use.
    fn model(&self) -> Option<ModelInfo> {
        None
    }

    /// An object's name.
    fn name(&self, _object: u8) -> Option<&str> {
        None
    }

    /// An object's posterior in Q56.
    fn posterior(&self, _object: u8) -> Option<u64> {
        None
    }

    /// The approach that helps most among those whose poses are not in `without`: see [`Request::NextApproach`].
    ///
    /// # Errors
    /// A [`Refusal`].
    fn next_approach(&self, _without: &[u8; POSE_BYTES]) -> Result<ApproachMessage, Refusal> {
        Err(Refusal::Unsupported)
    }

    /// The place of this rank where the most likely object lies.
    ///
    /// # Errors
    /// A [`Refusal`].
    #[cfg(any(test, feature = "position"))]
    fn place(&mut self, _rank: u8) -> Result<PlaceMessage, Refusal> {
        Err(Refusal::Unsupported)
    }

    /// A placement's name.
    #[cfg(any(test, feature = "position"))]
    fn placement(&self, _placement: u8) -> Option<&str> {
        None
    }

    /// The approach straight down that tells most: see [`Request::NextPress`]. Until the next touch it is the same.
    ///
    /// # Errors
    /// A [`Refusal`].
    #[cfg(any(test, feature = "position"))]
    fn next_press(&mut self, _within: Option<u32>) -> Result<Approach, Refusal> {
        Err(Refusal::Unsupported)
    }

    /// Name and version of the chip's program: at most 128 bytes of it are sent.
    fn program(&self) -> &str {
        ""
    }

    /// Number of touches, since power-up, that were not counted because the model was not trained for them.
    fn refused(&self) -> u32 {
        0
    }
}

/// The last request of the session: its number, and the frame that answers it.
#[derive(Debug)]
struct Last {
    number: u32,
    bytes: [u8; FRAME_MAX],
    length: usize,
}

impl Last {
    fn keep(&mut self, session: u32, number: u32, answer: Answer<'_>) {
        self.number = number;
        self.length = encode(&Frame { session, message: Message::Answer { number, answer } }, &mut self.bytes).len();
    }

    fn frame(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

/// The chip's own events that its host has not heard yet.
#[derive(Debug)]
struct Events {
    kept: [Option<Event>; EVENTS as usize],
    /// Number of the oldest one that is kept, and of the next one to come.
    oldest: u32,
    next: u32,
    /// Time of the last attempt, once the clock is known, and the number of attempts.
    tried: Option<u32>,
    attempts: u32,
}

impl Events {
    /// Place of the event of this number. EVENTS divides 2³², so places stay in order when numbers wrap.
    fn slot(&mut self, number: u32) -> Option<&mut Option<Event>> {
        self.kept.get_mut(usize::try_from(number % EVENTS).unwrap_or(0))
    }

    /// Keeps an event; the oldest one gives way where there are too many.
    fn push(&mut self, event: Event) {
        if let Some(slot) = self.slot(self.next) {
            *slot = Some(event);
        }
        self.next = self.next.wrapping_add(1);
        if self.next.wrapping_sub(self.oldest) > EVENTS {
            self.drop_oldest();
        }
    }

    const fn drop_oldest(&mut self) {
        (self.oldest, self.tried, self.attempts) = (self.oldest.wrapping_add(1), None, 0);
    }

    /// The event of this number as a message, if it is kept.
    fn message(&mut self, number: u32) -> Option<Message<'static>> {
        let event = (number != self.next).then(|| self.slot(number).copied()).flatten().flatten()?;
        Some(Message::Event { number, event })
    }

    /// Microseconds from an attempt to the next one.
    const fn patience(&self) -> u32 {
        let doublings = if self.attempts < 2 { self.attempts } else { 2 };
        REPEAT << doublings
    }
}

/// The chip's end: bytes from the line in, bytes for the line out.
///
/// RAM: room for two of the longest frames, one that arrives and the last answer, and for the events that the host has not heard; on
/// the stack for two more while one is answered.
#[derive(Debug)]
pub struct DeviceEnd {
    decoder: Decoder,
    /// 0 before the first.
    session: u32,
    last: Last,
    events: Events,
    statistics: Statistics,
    boot: u32,
}

impl DeviceEnd {
    /// An end without a session. `boot` has to be another number after each start, counted or random: it says to a host that
    /// evidence and session are gone.
    pub const fn new(boot: u32) -> Self {
        Self {
            decoder: Decoder::new(),
            session: 0,
            last: Last { number: 0, bytes: [0; FRAME_MAX], length: 0 },
            events: Events { kept: [None; EVENTS as usize], oldest: 0, next: 0, tried: None, attempts: 0 },
            statistics: Statistics { frames: 0, garbled: 0, repeated: 0, late: 0, refused: 0 },
            boot,
        }
    }

    /// The counts so far.
    pub const fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Takes bytes from the line, in any portions, does what they say, and hands every frame to be sent to `send`.
    ///
    /// Cannot fail or panic with any bytes.
    pub fn receive(&mut self, bytes: &[u8], device: &mut impl Device, mut send: impl FnMut(&[u8])) {
        // The decoder hands out what lies in it, so the rest is borrowed apart from it.
        let Self { decoder, session, last, events, statistics, boot } = self;
        for &byte in bytes {
            let Some(decoded) = decoder.feed(byte) else { continue };
            let counter = if decoded.is_ok() { &mut statistics.frames } else { &mut statistics.garbled };
            *counter = counter.saturating_add(1);
            let Ok(Frame { session: asker, message }) = decoded else { continue };
            let is_own = asker == *session;
            match message {
                Message::Request { number, .. } if is_own && number == last.number => {
                    statistics.repeated = statistics.repeated.saturating_add(1);
                    send(last.frame());
                }
                Message::Request { number, request } if is_own && number == last.number.wrapping_add(1) => {
                    let mut posteriors = [0; 8 * POSTERIORS];
                    last.keep(asker, number, execute(&request, statistics, device, &mut posteriors));
                    send(last.frame());
                }
                Message::Request { number, request: Request::Hello { previous, boot: known } } if !is_own => {
                    let is_opened = (previous, known) == (*session, *boot);
                    if is_opened {
                        *session = asker;
                    }
                    let answer = Answer::Session { session: *session, boot: *boot, event: events.next };
                    if is_opened {
                        last.keep(asker, number, answer);
                        send(last.frame());
                        send_event(*session, events.message(events.oldest), &mut send);
                    } else {
                        transmit(asker, Message::Answer { number, answer }, &mut send);
                    }
                }
                Message::Request { number, .. } => {
                    statistics.late = statistics.late.saturating_add(1);
                    if !is_own {
                        transmit(asker, Message::Answer { number, answer: Answer::Forgotten }, &mut send);
                    }
                }
                Message::Heard { number } if is_own && number == events.oldest && number != events.next => {
                    events.drop_oldest();
                    send_event(*session, events.message(events.oldest), &mut send);
                }
                // Heard twice; or an echo, as chips do not talk to each other.
                _ => {}
            }
        }
    }

    /// Tells the host that the chip has started.
    pub fn start(&mut self, send: impl FnMut(&[u8])) {
        self.tell(Event::Started, send);
    }

    /// Keeps an event for the host, and sends the oldest that it has not heard; this one, if no host has ever spoken. Where the host has
    /// not heard [`EVENTS`] of them, the oldest is given up; the numbers tell it.
    pub fn tell(&mut self, event: Event, mut send: impl FnMut(&[u8])) {
        let number = self.events.next;
        self.events.push(event);
        let number = if self.session == 0 { number } else { self.events.oldest };
        send_event(self.session, self.events.message(number), &mut send);
    }

    /// Sends an event again that the host has not heard for long enough. `now` is in microseconds, and may wrap. A chip with events of its
    /// own calls it whenever it is awake.
    pub fn tick(&mut self, now: u32, mut send: impl FnMut(&[u8])) {
        match self.wait(now) {
            Some(0) => {
                self.events.attempts = self.events.attempts.saturating_add(1);
                self.events.tried = Some(now);
                send_event(self.session, self.events.message(self.events.oldest), &mut send);
            }
            Some(_) if self.events.tried.is_none() => self.events.tried = Some(now),
            _ => {}
        }
    }

    /// Microseconds until [`tick`](Self::tick) has something to do; none if there is nothing, or no host has ever spoken.
    pub fn wait(&self, now: u32) -> Option<u32> {
        let Events { oldest, next, tried, .. } = self.events;
        let since = tried.map_or(0, |tried| now.wrapping_sub(tried));
        (self.session != 0 && oldest != next).then(|| self.events.patience().saturating_sub(since))
    }
}

fn send_event(session: u32, message: Option<Message<'_>>, send: &mut impl FnMut(&[u8])) {
    if let Some(message) = message {
        transmit(session, message, send);
    }
}

/// Sends a message that is not kept as a frame.
// Its room on the stack is taken only while it runs, and once.
#[inline(never)]
fn transmit(session: u32, message: Message<'_>, send: &mut impl FnMut(&[u8])) {
    send(encode(&Frame { session, message }, &mut [0; FRAME_MAX]));
}

/// Does what a request says.
fn execute<'d>(
    request: &Request<'_>,
    statistics: &Statistics,
    device: &'d mut impl Device,
    posteriors: &'d mut [u8; 8 * POSTERIORS],
) -> Answer<'d> {
    let wanted = |offset| Answer::Wanted { offset };
    let answered = match *request {
        // The session is open already.
        Request::Hello { .. } => Err(Refusal::OutOfOrder),
        Request::Model => device.model().map(Answer::Model).ok_or(Refusal::NoModel),
        Request::Begin { length, checksum } => device.begin(length, checksum).map(wanted),
        Request::Chunk { offset, bytes } => device.chunk(offset, bytes).map(wanted),
        Request::Touch { touch, detail } => device.touch(&Touch::from(&touch), detail).map(Answer::Verdict),
        Request::Press { touch, position, detail } => {
            device.press(&Touch::from(&touch), micrometers(position), detail).map(Answer::Verdict)
        }
        Request::Reset => device.reset().map(|()| Answer::Done),
        Request::Name { object } => named(device.name(object)),
        Request::Program => Ok(Answer::Name(short(device.program()))),
        Request::Counts => Ok(Answer::Counts(Statistics { refused: device.refused(), ..*statistics })),
        Request::Posteriors { first } => {
            let known = (first..=u8::MAX).map_while(|object| device.posterior(object));
            let mut count = 0;
            for (slot, posterior) in posteriors.as_chunks_mut::<8>().0.iter_mut().zip(known) {
                *slot = posterior.to_le_bytes();
                count += slot.len();
            }
            Ok(Answer::Posteriors(posteriors.get(..count).unwrap_or_default()))
        }
        Request::NextApproach { without } => device.next_approach(&without).map(Answer::NextApproach),
        #[cfg(any(test, feature = "position"))]
        Request::Place { rank } => device.place(rank).map(Answer::Place),
        #[cfg(any(test, feature = "position"))]
        Request::Placement { placement } => named(device.placement(placement)),
        #[cfg(any(test, feature = "position"))]
        Request::NextPress { within } => device.next_press(within).map(Answer::NextPress),
    };
    answered.unwrap_or_else(Answer::Refused)
}

fn named(name: Option<&str>) -> Result<Answer<'_>, Refusal> {
    name.map(|name| Answer::Name(short(name))).ok_or(Refusal::NoObject)
}

/// The beginning of a text: as much of it as fits into an answer.
fn short(text: &str) -> &str {
    text.get(..text.floor_char_boundary(TEXT)).unwrap_or_default()
}
