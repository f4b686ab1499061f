//! State that a chip keeps through a power cut, and how a record is recognized among other bytes.

use super::storage::Place;
use palpate_shared::link::{Payload, Progress, checksum};
use serde::{Deserialize, Serialize};

/// Model in use; bytes of it where it was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Source {
    BuiltIn,
    First(u32),
    Second(u32),
}

impl Source {
    /// A loaded model.
    pub(super) const fn loaded(place: Place, length: u32) -> Self {
        match place {
            Place::First => Self::First(length),
            Place::Second => Self::Second(length),
        }
    }

    /// True if the model is in this place.
    pub(super) const fn is_in(self, place: Place) -> bool {
        matches!((self, place), (Self::First(_), Place::First) | (Self::Second(_), Place::Second))
    }
}

/// Data that arrives in chunks, and the length that has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Staged {
    pub(super) payload: Payload,
    pub(super) length: u32,
    pub(super) checksum: u32,
    pub(super) received: u32,
}

/// Version of the meaning of a record's bytes; part of its checksum, so that records of other versions count as
/// damaged.
const VERSION: u32 = 3;

/// The value of erased bytes of most flash. Records in memory of other kinds say this too.
pub(super) const ERASED: u8 = 0xff;

/// Addend of a record's checksum, by the value of erased bytes where the record is: it is how a start knows that value.
fn version(erased: u8) -> u32 {
    VERSION ^ u32::from(!erased) << 8
}

/// A record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Record<'a> {
    /// The checksum of the model that it is of; 0 for none.
    pub(super) model: u32,
    pub(super) source: Source,
    pub(super) staged: Option<Staged>,
    pub(super) progress: Progress,
    /// The recognizer's snapshot.
    pub(super) evidence: &'a [u8],
}

/// Length and checksum stand before the counter and the record; the length is of both.
const HEADER: usize = 6;
const COUNTER: usize = 4;

/// The most bytes that a record takes for models of up to `objects` objects.
pub const fn record_length(objects: usize) -> usize {
    // Model, source, staging and the snapshot's length; session; an outcome takes up to 26 bytes; the event; the snapshot.
    let session = 18 + 26 * palpate_shared::link::WINDOW + 67;
    HEADER + COUNTER + 31 + session + crate::SNAPSHOT_LENGTH + 10 * objects
}

/// A record among other bytes.
pub(super) struct Found<'p> {
    pub(super) counter: u32,
    pub(super) record: &'p [u8],
    /// Bytes in all.
    pub(super) length: usize,
}

impl Found<'_> {
    /// True if this record was written after `other`.
    pub(super) const fn is_newer_than(&self, other: u32) -> bool {
        let ahead = self.counter.wrapping_sub(other);
        ahead != 0 && ahead >> 31 == 0
    }
}

/// The record at the start of `bytes`, whose erased value is `erased`, if there is a whole one.
pub(super) fn read(bytes: &[u8], erased: u8) -> Option<Found<'_>> {
    let (&[l0, l1, c0, c1, c2, c3], body) = bytes.split_first_chunk::<HEADER>()?;
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    let written = body.get(..length)?;
    if checksum(written) ^ version(erased) != u32::from_le_bytes([c0, c1, c2, c3]) {
        return None;
    }
    let (counter, record) = written.split_first_chunk::<COUNTER>()?;
    Some(Found { counter: u32::from_le_bytes(*counter), record, length: HEADER + length })
}

/// Writes the record that `fill` gives to the start of `bytes`, without its number; its length in all, or `None` if there is
/// no room.
pub(super) fn write(bytes: &mut [u8], fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Option<usize> {
    let (header, body) = bytes.split_first_chunk_mut::<HEADER>()?;
    let length = COUNTER + fill(body.get_mut(COUNTER..)?)?;
    let [l0, l1] = u16::try_from(length).ok()?.to_le_bytes();
    *header = [l0, l1, 0, 0, 0, 0];
    Some(HEADER + length)
}

/// Numbers the record that was written into `bytes`, for memory whose erased value is `erased`. It is whole then, and may be
/// numbered again.
pub(super) fn number(bytes: &mut [u8], counter: u32, erased: u8) -> Option<()> {
    let (header, body) = bytes.split_first_chunk_mut::<HEADER>()?;
    let [l0, l1, ..] = *header;
    *body.first_chunk_mut::<COUNTER>()? = counter.to_le_bytes();
    let written = body.get(..usize::from(u16::from_le_bytes([l0, l1])))?;
    let [c0, c1, c2, c3] = (checksum(written) ^ version(erased)).to_le_bytes();
    *header = [l0, l1, c0, c1, c2, c3];
    Some(())
}
