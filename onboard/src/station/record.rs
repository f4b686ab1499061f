//! What a chip remembers through a power cut.

use core::sync::atomic::{Ordering, compiler_fence};
use palpate_shared::link::{NotStored, Payload, Progress, checksum};
use serde::{Deserialize, Serialize};

/// Which model is in use; bytes of it where it was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Source {
    BuiltIn,
    First(u32),
    Second(u32),
}

impl Source {
    pub(super) const fn with_length(self, length: u32) -> Self {
        match self {
            Self::BuiltIn => Self::BuiltIn,
            Self::First(_) => Self::First(length),
            Self::Second(_) => Self::Second(length),
        }
    }
}

/// What is arriving in chunks, and how much of it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Staged {
    pub(super) payload: Payload,
    pub(super) length: u32,
    pub(super) checksum: u32,
    pub(super) received: u32,
}

/// What the bytes of a record mean; goes into its checksum, so that records of other versions count as damaged.
const VERSION: u32 = 2;

/// A record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Record<'a> {
    pub(super) counter: u32,
    /// The checksum of the model that it is of; 0 for none.
    pub(super) model: u32,
    pub(super) source: Source,
    pub(super) staged: Option<Staged>,
    pub(super) progress: Progress,
    /// The recognizer's snapshot.
    pub(super) evidence: &'a [u8],
}

/// Length and checksum stand before the record.
const HEADER: usize = 6;

/// Two places for records, written in turns.
#[derive(Debug)]
pub(super) struct Records<'a> {
    places: [&'a mut [u8]; 2],
    /// Counter of the newest record.
    counter: u32,
}

impl<'a> Records<'a> {
    pub(super) fn new(places: [&'a mut [u8]; 2]) -> Self {
        let counter = newest(&places).map_or(0, |record| record.counter);
        Self { places, counter }
    }

    /// The newest whole record.
    pub(super) fn newest(&self) -> Option<Record<'_>> {
        newest(&self.places)
    }

    /// Whether there are no places: the chip does without records.
    pub(super) fn is_empty(&self) -> bool {
        self.places.iter().all(|place| place.is_empty())
    }

    /// Writes a record over the older one; its counter is put in. On an error the newest one stays.
    pub(super) fn write(&mut self, record: Record<'_>) -> Result<(), NotStored> {
        let counter = self.counter.wrapping_add(1);
        let [even, odd] = &mut self.places;
        let place = if counter.is_multiple_of(2) { even } else { odd };
        let (header, body) = place.split_first_chunk_mut::<HEADER>().ok_or(NotStored)?;
        let record = Record { counter, ..record };
        let written = postcard::to_slice(&record, body).map_err(|_| NotStored)?;
        let length = u16::try_from(written.len()).map_err(|_| NotStored)?;
        let [c0, c1, c2, c3] = (checksum(written) ^ VERSION).to_le_bytes();
        let [l0, l1] = length.to_le_bytes();
        *header = [l0, l1, c0, c1, c2, c3];
        self.counter = counter;
        // The power may go at any moment from here on: the writes must not be delayed.
        compiler_fence(Ordering::SeqCst);
        Ok(())
    }
}

fn newest<'p>(places: &'p [&mut [u8]; 2]) -> Option<Record<'p>> {
    let [even, odd] = places.each_ref().map(|place| read(place));
    match (even, odd) {
        (Some(even), Some(odd)) if odd.counter.wrapping_sub(even.counter) >> 31 == 0 => Some(odd),
        (even, odd) => even.or(odd),
    }
}

fn read(place: &[u8]) -> Option<Record<'_>> {
    let (&[l0, l1, c0, c1, c2, c3], body) = place.split_first_chunk::<HEADER>()?;
    let written = body.get(..usize::from(u16::from_le_bytes([l0, l1])))?;
    if checksum(written) ^ VERSION != u32::from_le_bytes([c0, c1, c2, c3]) {
        return None;
    }
    postcard::from_bytes(written).ok()
}
