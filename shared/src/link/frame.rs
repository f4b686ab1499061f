//! Messages in frames: postcard, CRC-32, COBS.

use super::message::Message;
use crate::checksum::checksum;
use cobs::{DecodeResult, DecoderState};

/// The version of frames and messages. A frame of another version is not read.
pub const VERSION: u8 = 4;

/// Version and session.
const HEADER: usize = 5;
/// CRC-32.
const TRAILER: usize = 4;
/// The longest message: a chunk, or an answer, and what stands around it.
const MESSAGE_MAX: usize = super::CHUNK + 32;
const DECODED_MAX: usize = HEADER + MESSAGE_MAX + TRAILER;

/// The longest frame on the line: COBS adds a byte at the front, and there is a 0x00 at each end.
pub const FRAME_MAX: usize = DECODED_MAX + 3;

/// A message and the session it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame<'a> {
    /// The host's session; in an event the current one, 0 before one is open.
    pub session: u32,
    /// The message.
    pub message: Message<'a>,
}

/// Reason why the bytes between two 0x00 are no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FrameError {
    /// Not COBS, too short, or the checksum is wrong: bytes were lost or changed on the way.
    Garbled,
    /// More than [`FRAME_MAX`] bytes without a 0x00.
    TooLong,
    /// The frame is whole, but of another version of this format.
    Version(u8),
    /// The frame is whole, but its message is not of this version.
    Message,
}

/// Writes a frame into `out` and returns its bytes: 0x00, the frame, 0x00. The leading 0x00 ends whatever the line held
/// before.
///
/// Cost: some instructions for each byte, most of them for COBS. Returns nothing if the message is longer than any that [`Request`](super::Request)
/// and its like allow: a chunk of more than [`CHUNK`](super::CHUNK) bytes.
pub fn encode<'o>(frame: &Frame<'_>, out: &'o mut [u8; FRAME_MAX]) -> &'o [u8] {
    let mut plain = [0; DECODED_MAX];
    let Some(length) = fill(frame, &mut plain) else { return &[] };
    let Some((leading, body)) = out.split_first_mut() else { return &[] };
    *leading = 0;
    let encoded = cobs::try_encode(plain.get(..length).unwrap_or_default(), body).unwrap_or(0);
    let Some(end) = body.get_mut(encoded) else { return &[] };
    *end = 0;
    out.get(..encoded + 2).unwrap_or_default()
}

/// Header, message and checksum; the length of all.
fn fill(frame: &Frame<'_>, plain: &mut [u8; DECODED_MAX]) -> Option<usize> {
    let (header, rest) = plain.split_first_chunk_mut::<HEADER>()?;
    let [a, b, c, d] = frame.session.to_le_bytes();
    *header = [VERSION, a, b, c, d];
    let room = rest.get_mut(..MESSAGE_MAX)?;
    let length = HEADER + postcard::to_slice(&frame.message, room).ok()?.len();
    let (covered, rest) = plain.split_at_mut_checked(length)?;
    *rest.first_chunk_mut::<TRAILER>()? = checksum(covered).to_le_bytes();
    Some(length + TRAILER)
}

/// Takes bytes one at a time and says when they make a frame.
///
/// RAM: room for the longest frame, and a few numbers.
#[derive(Debug)]
pub struct Decoder {
    cobs: DecoderState,
    plain: [u8; DECODED_MAX],
    length: usize,
    /// A whole frame was handed out, and its bytes may be overwritten.
    done: bool,
    too_long: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder at the beginning of a frame.
    pub const fn new() -> Self {
        Self { cobs: DecoderState::Idle, plain: [0; DECODED_MAX], length: 0, done: false, too_long: false }
    }

    /// Takes a byte. Returns a frame when the byte ends one, an error when it ends something else.
    ///
    /// Cost: a few instructions, and at the end of a frame some for each of its bytes. Cannot panic.
    pub fn feed(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        if self.done {
            (self.done, self.length) = (false, 0);
        }
        match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(byte)) => {
                match self.plain.get_mut(self.length) {
                    Some(slot) => (*slot, self.length) = (byte, self.length + 1),
                    None => self.too_long = true,
                }
                return None;
            }
            Ok(DecodeResult::DataComplete) => {}
            Err(_) => {
                self.done = true;
                let too_long = core::mem::take(&mut self.too_long);
                return Some(Err(if too_long { FrameError::TooLong } else { FrameError::Garbled }));
            }
        }
        self.done = true;
        if core::mem::take(&mut self.too_long) {
            return Some(Err(FrameError::TooLong));
        }
        Some(parse(self.plain.get(..self.length).unwrap_or_default()))
    }
}

fn parse(plain: &[u8]) -> Result<Frame<'_>, FrameError> {
    let (covered, stated) = plain.split_last_chunk::<TRAILER>().ok_or(FrameError::Garbled)?;
    let (&[version, a, b, c, d], message) = covered.split_first_chunk::<HEADER>().ok_or(FrameError::Garbled)?;
    if checksum(covered) != u32::from_le_bytes(*stated) {
        return Err(FrameError::Garbled);
    }
    if version != VERSION {
        return Err(FrameError::Version(version));
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(Frame { session: u32::from_le_bytes([a, b, c, d]), message }),
        _ => Err(FrameError::Message),
    }
}
