//! The chip's end of the link.

use super::frame::{Decoder, FRAME_MAX, Frame, encode};
use super::message::{
    Answer, ApproachMessage, Command, Event, Message, ModelInfo, Outcome, Query, Refusal, Statistics, micrometers,
};
use super::{CHUNK, POSE_BYTES, POSTERIORS, WINDOW};
use crate::Touch;
#[cfg(any(test, feature = "position"))]
use crate::{Approach, TablePose};
use embedded_io::{Read, Write};

/// Target of the link: a recognizer, and a place for models.
pub trait Device {
    /// Takes a touch into account; [`Outcome::Verdict`], with a detail if asked for.
    fn touch(&mut self, touch: &Touch, detail: bool) -> Outcome;

    /// Forgets all touches.
    fn reset(&mut self) -> Outcome;

    /// A model of `length` bytes is about to come.
    fn begin(&mut self, length: u32, checksum: u32) -> Outcome;

    /// A part of it.
    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Outcome;

    /// It is complete: check it and use it, or refuse it and keep what was there before.
    fn commit(&mut self) -> Outcome;

    /// The model in use.
    fn model(&self) -> Option<ModelInfo>;

    /// An object's name.
    fn name(&self, object: u8) -> Option<&str>;

    /// An object's posterior in Q56.
    fn posterior(&self, object: u8) -> Option<u64>;

    /// The approach that helps most among those whose poses are not in `without`: see [`Query::NextApproach`].
    ///
    /// # Errors
    /// A [`Refusal`] to send instead.
    fn next_approach(&self, without: &[u8; POSE_BYTES]) -> Result<ApproachMessage, Refusal> {
        let _ = without;
        Err(Refusal::Unsupported)
    }

    /// Takes a touch with a position into account, in micrometers; [`Outcome::Verdict`], with a detail if asked for.
    fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Outcome {
        let _ = (touch, position, detail);
        Outcome::Refused(Refusal::Position)
    }

    #[cfg(any(test, feature = "position"))]
    /// True if no finger met more than the table, and the place of this rank where the most likely object lies.
    ///
    /// # Errors
    /// A [`Refusal`] to send instead.
    fn place(&mut self, rank: u8) -> Result<(bool, Option<TablePose>), Refusal> {
        let _ = rank;
        Err(Refusal::Unsupported)
    }

    #[cfg(any(test, feature = "position"))]
    /// A placement's name.
    fn placement(&self, placement: u8) -> Option<&str> {
        let _ = placement;
        None
    }

    #[cfg(any(test, feature = "position"))]
    /// The approach straight down that tells most: see [`Query::NextPress`]. Asked again before another touch, it is the same.
    ///
    /// # Errors
    /// A [`Refusal`] to send instead.
    fn next_press(&mut self, within: Option<u32>) -> Result<Approach, Refusal> {
        let _ = within;
        Err(Refusal::Unsupported)
    }

    /// Name and version of the chip's program, for [`Query::Program`]: at most [`CHUNK`] bytes of it are sent.
    fn program(&self) -> &str {
        ""
    }

    /// Number of touches, since power-up, that were not counted because the model was not trained for them.
    fn refused(&self) -> u32 {
        0
    }
}

/// The state of a session.
#[derive(Clone, Debug)]
struct Progress {
    /// 0 before the first.
    session: u32,
    /// Number of the next command.
    next: u32,
    outcomes: [Option<Outcome>; WINDOW],
}

impl Progress {
    /// Nothing of this session executed.
    const fn of(session: u32) -> Self {
        Self { session, next: 0, outcomes: [None; WINDOW] }
    }

    /// Slot of a command's outcome.
    fn slot(&mut self, sequence: u32) -> Option<&mut Option<Outcome>> {
        // WINDOW fits any integer, and divides 2³², so that slots stay in order when the sequence wraps.
        let window = u32::try_from(WINDOW).unwrap_or(1);
        self.outcomes.get_mut(usize::try_from(sequence % window).unwrap_or(0))
    }
}

/// The chip's end: bytes from the line in, bytes for the line out.
///
/// RAM: the last outcomes, and room for the longest frame; on the stack for another one while a frame is answered.
#[derive(Debug)]
pub struct DeviceEnd {
    decoder: Decoder,
    progress: Progress,
    statistics: Statistics,
    boot: u32,
    events: u32,
}

impl DeviceEnd {
    /// An end without a session. `boot` has to be another number after each start, counted or random: it says to a host that
    /// evidence and session are gone.
    pub const fn new(boot: u32) -> Self {
        Self {
            decoder: Decoder::new(),
            progress: Progress::of(0),
            statistics: Statistics { frames: 0, garbled: 0, repeated: 0, early: 0, foreign: 0, refused: 0 },
            boot,
            events: 0,
        }
    }

    /// The counts so far.
    pub const fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Number of commands of the current session that have been executed.
    pub const fn executed(&self) -> u32 {
        self.progress.next
    }

    /// Takes bytes from the line, in any portions, does what they say, and hands every frame to be sent to `send`.
    ///
    /// Cannot fail or panic with any bytes.
    pub fn receive(&mut self, bytes: &[u8], device: &mut impl Device, mut send: impl FnMut(&[u8])) {
        let Self { decoder, progress, statistics, boot, .. } = self;
        for &byte in bytes {
            match decoder.feed(byte) {
                None => {}
                Some(Err(_)) => statistics.garbled = statistics.garbled.saturating_add(1),
                Some(Ok(frame)) => {
                    statistics.frames = statistics.frames.saturating_add(1);
                    respond(frame, progress, statistics, *boot, device, &mut send);
                }
            }
        }
    }

    /// Tells the host that the chip has started.
    pub fn start(&mut self, send: impl FnMut(&[u8])) {
        self.tell(Event::Started, send);
    }

    /// Sends an event to the host.
    pub fn tell(&mut self, event: Event, mut send: impl FnMut(&[u8])) {
        let message = Message::Event { boot: self.boot, sequence: self.events, event };
        self.events = self.events.wrapping_add(1);
        send(encode(&Frame { session: self.progress.session, message }, &mut [0; FRAME_MAX]));
    }

    /// Waits for bytes on `transport`, and answers them there. Call it in a loop, also after an error: a UART reports each
    /// garbled byte as one, and the host asks again for what it does not get.
    ///
    /// # Errors
    /// The transport's own.
    pub fn serve<T: Read + Write>(&mut self, transport: &mut T, device: &mut impl Device) -> Result<(), T::Error> {
        let mut buffer = [0; 32];
        let count = transport.read(&mut buffer)?;
        let mut result = Ok(());
        self.receive(buffer.get(..count).unwrap_or_default(), device, |frame| {
            if result.is_ok() {
                result = transport.write_all(frame);
            }
        });
        result?;
        transport.flush()
    }
}

fn respond(
    frame: Frame<'_>,
    progress: &mut Progress,
    statistics: &mut Statistics,
    boot: u32,
    device: &mut impl Device,
    send: &mut impl FnMut(&[u8]),
) {
    match frame.message {
        Message::Query { tag, query } => {
            if let Query::Open { previous, boot: known } = query
                && previous == progress.session
                && known == boot
                && frame.session != progress.session
            {
                *progress = Progress::of(frame.session);
            }
            let mut buffer = [0; CHUNK];
            let answer = answer(query, progress, statistics, boot, device, &mut buffer);
            let message = Message::Answer { asker: frame.session, tag, answer };
            send(encode(&Frame { session: progress.session, message }, &mut [0; FRAME_MAX]));
        }
        Message::Command { sequence, command } => {
            let message = execute(frame.session, sequence, &command, progress, statistics, device);
            send(encode(&Frame { session: progress.session, message }, &mut [0; FRAME_MAX]));
        }
        // Chips do not talk to each other: an echo.
        Message::Answer { .. } | Message::Outcome { .. } | Message::Expected { .. } | Message::Event { .. } => {
            statistics.foreign = statistics.foreign.saturating_add(1);
        }
    }
}

/// Executes the command if it is the next one; the message to send in any case.
fn execute<'a>(
    session: u32,
    sequence: u32,
    command: &Command<'_>,
    progress: &mut Progress,
    statistics: &mut Statistics,
    device: &mut impl Device,
) -> Message<'a> {
    let expected = Message::Expected { sequence: progress.next };
    if session != progress.session {
        statistics.foreign = statistics.foreign.saturating_add(1);
        return expected;
    }
    let behind = progress.next.wrapping_sub(sequence);
    if behind != 0 {
        let known = usize::try_from(behind).is_ok_and(|behind| behind <= WINDOW);
        let counter = if known { &mut statistics.repeated } else { &mut statistics.early };
        *counter = counter.saturating_add(1);
        let outcome = progress.slot(sequence).and_then(|slot| slot.filter(|_| known));
        return outcome.map_or(expected, |outcome| Message::Outcome { sequence, outcome });
    }
    let outcome = match *command {
        Command::Touch { touch, detail } => device.touch(&Touch::from(&touch), detail),
        Command::Reset => device.reset(),
        Command::Begin { length, checksum } => device.begin(length, checksum),
        Command::Chunk { offset, bytes } => device.chunk(offset, bytes),
        Command::Commit => device.commit(),
        Command::Press { touch, position, detail } => device.press(&Touch::from(&touch), micrometers(position), detail),
    };
    if let Some(slot) = progress.slot(sequence) {
        *slot = Some(outcome);
    }
    progress.next = sequence.wrapping_add(1);
    Message::Outcome { sequence, outcome }
}

fn answer<'b>(
    query: Query,
    progress: &Progress,
    statistics: &Statistics,
    boot: u32,
    device: &'b mut impl Device,
    buffer: &'b mut [u8; CHUNK],
) -> Answer<'b> {
    match query {
        Query::Hello | Query::Open { .. } => Answer::Session { next: progress.next, boot },
        Query::Model => device.model().map_or(Answer::Refused(Refusal::NoModel), Answer::Model),
        Query::Name { object } => named(device.name(object)),
        #[cfg(any(test, feature = "position"))]
        Query::Placement { placement } => named(device.placement(placement)),
        Query::Program => Answer::Program(short(device.program())),
        Query::Statistics => Answer::Statistics(Statistics { refused: device.refused(), ..*statistics }),
        Query::Posteriors { first } => {
            let objects = (first..=u8::MAX).take(POSTERIORS);
            let posteriors = objects.map_while(|object| device.posterior(object));
            let mut count = 0;
            for (slot, posterior) in buffer.as_chunks_mut::<8>().0.iter_mut().zip(posteriors) {
                *slot = posterior.to_le_bytes();
                count += slot.len();
            }
            Answer::Posteriors(buffer.get(..count).unwrap_or_default())
        }
        Query::NextApproach { without } => match device.next_approach(&without) {
            Ok(approach) => Answer::NextApproach(approach),
            Err(refusal) => Answer::Refused(refusal),
        },
        #[cfg(any(test, feature = "position"))]
        Query::Place { rank } => match device.place(rank) {
            Ok((table_alone, place)) => Answer::Place { table_alone, place },
            Err(refusal) => Answer::Refused(refusal),
        },
        #[cfg(any(test, feature = "position"))]
        Query::NextPress { within } => match device.next_press(within) {
            Ok(press) => Answer::NextPress(press),
            Err(refusal) => Answer::Refused(refusal),
        },
    }
}

fn named(name: Option<&str>) -> Answer<'_> {
    name.map_or(Answer::Refused(Refusal::NoObject), |name| Answer::Name(short(name)))
}

/// The beginning of a text: as much of it as fits into a frame.
fn short(text: &str) -> &str {
    text.get(..text.floor_char_boundary(CHUNK)).unwrap_or_default()
}
