//! A record of a load, and how it is recognized among other bytes.

use super::storage::{Loaded, Place, Storage};
use palpate_shared::link::checksum;

/// Bytes of a record of a load: length and place, the model's checksum, a counter, and a checksum of these.
pub const RECORD_LENGTH: usize = 16;

/// Set in the length of a model that is in the second place.
const SECOND: u32 = 1 << 31;

/// Version of the meaning of a record's bytes; part of its checksum, so that records of other versions count as
/// damaged.
const VERSION: u32 = 4;

/// The value of erased bytes of most flash. Records in memory of other kinds say this too.
pub(super) const ERASED: u8 = 0xff;

/// Addend of a record's checksum, by the value of erased bytes where the record is: it is how a start knows that value.
fn version(erased: u8) -> u32 {
    VERSION ^ u32::from(!erased) << 8
}

/// A record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) loaded: Loaded,
    pub(super) counter: u32,
}

impl Record {
    /// True if this record was written after that of this number.
    pub(super) const fn is_newer_than(self, counter: u32) -> bool {
        let ahead = self.counter.wrapping_sub(counter);
        ahead != 0 && ahead >> 31 == 0
    }

    /// The record at the start of `bytes`, whose erased value is `erased`, if there is a whole one.
    pub(super) fn read(bytes: &[u8], erased: u8) -> Option<Self> {
        let (stated, _) = bytes.first_chunk::<RECORD_LENGTH>()?.as_chunks::<4>();
        let &[length, of_model, counter, of_record] = stated.first_chunk()?;
        let is_whole = checksum([length, of_model, counter].as_flattened()) ^ version(erased);
        if is_whole != u32::from_le_bytes(of_record) {
            return None;
        }
        let length = u32::from_le_bytes(length);
        let place = if length & SECOND == 0 { Place::First } else { Place::Second };
        let loaded = Loaded { place, length: length & !SECOND, checksum: u32::from_le_bytes(of_model) };
        Some(Self { loaded, counter: u32::from_le_bytes(counter) })
    }

    /// The record's bytes, for memory whose erased value is `erased`.
    pub(super) fn to_bytes(self, erased: u8) -> [u8; RECORD_LENGTH] {
        let Loaded { place, length, checksum: of_model } = self.loaded;
        let mark = if place == Place::Second { SECOND } else { 0 };
        let stated = [length & !SECOND | mark, of_model, self.counter].map(u32::to_le_bytes);
        let of_record = checksum(stated.as_flattened()) ^ version(erased);
        let mut bytes = [0; RECORD_LENGTH];
        let words = stated.into_iter().chain([of_record.to_le_bytes()]).flatten();
        bytes.iter_mut().zip(words).for_each(|(to, from)| *to = from);
        bytes
    }
}

/// The newest record of each place, of all that are found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Newest([Option<Record>; 2]);

impl Newest {
    /// Takes in a record.
    pub(super) fn see(&mut self, record: Record) {
        let [first, second] = &mut self.0;
        let own = if record.loaded.place == Place::First { first } else { second };
        if own.is_none_or(|own| record.is_newer_than(own.counter)) {
            *own = Some(record);
        }
    }

    /// The newest of all.
    pub(super) fn of_all(&self) -> Option<Record> {
        let [first, second] = self.0;
        match (first, second) {
            (Some(first), Some(second)) if second.is_newer_than(first.counter) => Some(second),
            (first, second) => first.or(second),
        }
    }

    /// The newest whose model is whole: that of the newest record of all, or else of the newest one of the other place.
    pub(super) fn whole(&self, storage: &impl Storage) -> Option<Loaded> {
        let newest = self.of_all()?.loaded;
        let [first, second] = self.0;
        let other = if newest.place == Place::First { second } else { first };
        [Some(newest), other.map(|other| other.loaded)].into_iter().flatten().find(|loaded| is_whole(storage, *loaded))
    }
}

/// True if the model of a record is in its place.
fn is_whole(storage: &impl Storage, loaded: Loaded) -> bool {
    let length = usize::try_from(loaded.length).unwrap_or(usize::MAX);
    // What is read wrong once is read again.
    (0..2).any(|_| storage.model(loaded.place).get(..length).is_some_and(|bytes| checksum(bytes) == loaded.checksum))
}
