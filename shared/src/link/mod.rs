//! The link between a host and a chip that recognizes.
//!
//! # Frames
//!
//! ```text
//! COBS( version u8 │ session u32 LE │ message, postcard │ CRC-32 LE of all before ) 0x00
//! ```
//!
//! At most [`FRAME_MAX`] bytes on the line. A frame that does not decode, is too long or fails its checksum is counted
//! and dropped; the next 0x00 starts a new frame. [`Decoder`] takes bytes in any portions.
//!
//! # Messages
//!
//! | from | message | delivery |
//! |---|---|---|
//! | host | [`Request`]: hello, model, load, touch, press, reset, next approach, names, program, counts, posteriors, places | numbered; repeated until answered |
//! | chip | [`Answer`] | with the request's number |
//! | chip | [`Event`]: its own touches, faults, power-up | numbered from its start; repeated until heard |
//! | host | heard | with the event's number |
//!
//! Each side has one frame under way, and waits for what it is answered. The chip executes a request if its number is one more than that of
//! the last one. If it is the same, the host has not heard the answer: the chip sends the same bytes again and does nothing else. Any
//! other number is a late copy, which says nothing new. So a touch is counted once, even if the line loses, doubles, garbles or delays
//! frames. The host takes an event once by its number in the same way.
//!
//! The chip keeps [`EVENTS`] events that no host has heard. If there are more, it gives up the oldest; the next event's number tells the
//! host how many it missed.
//!
//! A host opens a session, whose number is in each of its frames and in the answers to them. It is a random number of the host's, so that two
//! hosts never believe that the same session is theirs; several may listen to one chip. Hello names the session that the host believes to
//! be current and the chip's boot number, and opens a session only where both are right; so a late copy of a hello cannot open one
//! again. After a reset the chip knows of no session: it executes none of its requests, and says that it is forgotten.
//!
//! Touches with a position ([`Request::Press`]) and requests about the place of an object are only for a chip that
//! [has maps](ModelInfo::has_maps); others may be built without them, and do not answer.
//!
//! [`DeviceEnd`] and [`HostEnd`] do this without a transport: bytes go in, bytes come out, and whoever calls them says what time it is.
//!
//! # Costs
//!
//! [`CHUNK`] bytes of a model are in one request. At 115,200 baud a model of 27,251 bytes takes 3.3 s where each answer comes
//! after 5 ms. The longest frame takes [`FRAME_MAX`] bytes of RAM: twice in a [`DeviceEnd`], twice on the stack while it answers.

mod device;
mod frame;
mod host;
mod message;

pub use crate::checksum::checksum;
pub use device::{Device, DeviceEnd};
pub use frame::{Decoder, FRAME_MAX, Frame, FrameError, VERSION, encode};
pub use host::{HostEnd, HostSettings, HostStatistics, Incoming, LinkError};
#[cfg(any(test, feature = "position"))]
pub use message::PlaceMessage;
pub use message::{
    Answer, ApproachMessage, Decision, Detail, Event, FaultKind, Message, ModelInfo, Refusal, Request, Statistics,
    TouchMessage, VerdictMessage,
};

/// The most bytes of a model in one request.
pub const CHUNK: usize = 256;

/// The most bytes of a name or of a program's name and version.
pub(crate) const TEXT: usize = 128;

/// Events that the chip keeps until the host has heard them.
pub const EVENTS: u32 = 4;

/// Bytes with a bit for each pose.
pub const POSE_BYTES: usize = crate::MOST_POSES.div_ceil(8);

/// Posteriors in one answer.
pub(crate) const POSTERIORS: usize = 16;

/// Microseconds after which the chip repeats an event that is not heard; it doubles twice.
pub(crate) const REPEAT: u32 = 250_000;

#[cfg(test)]
mod tests;
