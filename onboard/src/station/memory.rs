//! Memory that is written like RAM and keeps its content.

use super::record::{ERASED, Newest, RECORD_LENGTH, Record};
use super::storage::{Loaded, NotStored, Place, Storage};
use core::sync::atomic::{Ordering, compiler_fence};

/// Memory that is written like RAM: battery-backed or FRAM, or RAM where it must survive resets but no power cuts.
/// The places for models may be empty: then no model can be loaded.
///
/// Writes have to reach the memory by themselves: behind a data cache, as of a Cortex-M7, the region must be write-through or
/// not cached, or a power cut takes what is still in the cache.
#[derive(Debug)]
pub struct Memory<'a> {
    /// Two places for models from the host: one in use, one being filled.
    pub models: [&'a mut [u8]; 2],
    /// Two places for records of loads, written in turns.
    pub records: [&'a mut [u8; RECORD_LENGTH]; 2],
}

impl Memory<'_> {
    fn newest(&self) -> Newest {
        let mut newest = Newest::default();
        self.records.iter().filter_map(|place| Record::read(&place[..], ERASED)).for_each(|record| newest.see(record));
        newest
    }
}

impl Storage for Memory<'_> {
    fn room(&self) -> usize {
        let [first, second] = &self.models;
        first.len().min(second.len())
    }

    fn model(&self, place: Place) -> &[u8] {
        let [first, second] = &self.models;
        match place {
            Place::First => first,
            Place::Second => second,
        }
    }

    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored> {
        let [first, second] = &mut self.models;
        let all = match place {
            Place::First => first,
            Place::Second => second,
        };
        let end = offset.checked_add(bytes.len()).ok_or(NotStored)?;
        all.get_mut(offset..end).ok_or(NotStored)?.copy_from_slice(bytes);
        Ok(())
    }

    fn loaded(&self) -> Option<Loaded> {
        self.newest().whole(self)
    }

    fn keep(&mut self, loaded: Loaded) -> Result<(), NotStored> {
        let counter = self.newest().of_all().map_or(0, |newest| newest.counter).wrapping_add(1);
        let [even, odd] = &mut self.records;
        let place = if counter.is_multiple_of(2) { even } else { odd };
        **place = Record { loaded, counter }.to_bytes(ERASED);
        // The power may go at any moment from here on: the writes must not be delayed.
        compiler_fence(Ordering::SeqCst);
        Ok(())
    }
}
