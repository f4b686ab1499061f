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
//! | host | [`Command`]: touch, press, reset, load | numbered, executed exactly once and in order |
//! | chip | [`Outcome`]: verdict, done, refused | repeated on demand for the last [`WINDOW`] commands |
//! | host | [`Query`]: model, names, posteriors, places, statistics, next approach, program | changes nothing, repeated until answered |
//! | chip | [`Answer`] | |
//! | chip | [`Event`]: its own touches, faults, power-up | numbered, so that the host knows how many it missed |
//!
//! A host opens a session, whose number is in every frame. Within it, commands are numbered from 0. The chip executes only
//! the command that it expects next. An earlier one is a repetition, and its outcome is sent again; a later one shows that
//! something was lost, and the chip says which one it expects. The host keeps up to [`WINDOW`] commands under way and
//! repeats those that stay without an outcome. So a command is executed once, even if the line loses, duplicates, garbles
//! or delays frames. After a reset the chip knows of no session: it executes none of its commands, and the host, which asks, hears
//! that the session and all evidence are gone.
//!
//! A session's number is a random number of the host's, so that two hosts never believe that the same session is theirs.
//! Opening names the session that the host believes to be current and the chip's boot number, so that a late copy of an
//! opening cannot open again. A boot number also comes with every event: events are counted from the chip's start, and
//! the host notices a start even if the event that announces it was lost.
//!
//! Touches with a position ([`Command::Press`]), and the questions about the place of an object, came to this version later. A
//! chip whose program is older does not read them, and refuses to load maps. So a host looks first whether the chip
//! [has maps](ModelInfo::has_maps); an older host takes those for a model of rows, and sends it nothing.
//!
//! An answer names the session of the host that asked, so that several hosts may listen to one chip.
//!
//! [`DeviceEnd`] and [`HostEnd`] do this without a transport or a clock: bytes go in, bytes come out. Over an
//! [`embedded_io`] transport: [`DeviceEnd::serve`] and [`HostEnd::exchange`].

mod device;
mod frame;
mod host;
mod message;

pub use crate::checksum::checksum;
pub use device::{Device, DeviceEnd};
pub use frame::{Decoder, FRAME_MAX, Frame, FrameError, VERSION, encode};
pub use host::{HostEnd, HostSettings, HostStatistics, Incoming, LinkError};
pub use message::{
    Answer, ApproachMessage, Command, Decision, Detail, Event, FaultKind, Message, ModelInfo, Outcome, Query, Refusal,
    Statistics, TouchMessage, VerdictMessage,
};

/// Commands that may be under way at a time, and outcomes that the chip keeps.
pub const WINDOW: usize = 8;

/// The most bytes of a model in one message.
pub const CHUNK: usize = 128;

/// Bytes with a bit for each pose.
pub const POSE_BYTES: usize = crate::MOST_POSES.div_ceil(8);

/// Posteriors in one answer.
pub(crate) const POSTERIORS: usize = CHUNK / 8;

#[cfg(test)]
mod tests;
