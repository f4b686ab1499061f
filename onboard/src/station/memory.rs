//! Memory that is written like RAM and keeps its content.

use super::record::{self, ERASED, Found};
use super::storage::{Place, Storage};
use core::sync::atomic::{Ordering, compiler_fence};
use palpate_shared::link::NotStored;

/// Memory that is written like RAM: battery-backed or FRAM, or RAM where it must survive resets but no power cuts.
/// Every slice may be empty: then the chip does without.
///
/// Writes have to reach the memory by themselves: behind a data cache, as of a Cortex-M7, the region must be write-through or
/// not cached, or a power cut takes the records that are still in the cache.
#[derive(Debug)]
pub struct Memory<'a> {
    /// Two places for models from the host: one in use, one being filled.
    pub models: [&'a mut [u8]; 2],
    /// Two places for records, of [`record_length`](super::record_length) bytes each, written in turns.
    pub records: [&'a mut [u8]; 2],
}

impl Memory<'_> {
    fn found(&self) -> Option<Found<'_>> {
        let [even, odd] = self.records.each_ref().map(|place| record::read(place, ERASED));
        match (even, odd) {
            (Some(even), Some(odd)) if odd.is_newer_than(even.counter) => Some(odd),
            (even, odd) => even.or(odd),
        }
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

    fn record_length(&self) -> usize {
        let [even, odd] = self.records.each_ref().map(|place| place.len());
        // One place alone cannot be written without a moment at which nothing is whole.
        if even == 0 || odd == 0 { even.max(odd).min(1) } else { even.min(odd) }
    }

    fn newest(&self) -> Option<(u32, &[u8])> {
        self.found().map(|found| (found.counter, found.record))
    }

    fn store(&mut self, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored> {
        if self.record_length() == 0 {
            return Ok(());
        }
        let counter = self.found().map_or(0, |found| found.counter).wrapping_add(1);
        let [even, odd] = &mut self.records;
        let place = if counter.is_multiple_of(2) { even } else { odd };
        record::write(place, fill).ok_or(NotStored)?;
        record::number(place, counter, ERASED).ok_or(NotStored)?;
        // The power may go at any moment from here on: the writes must not be delayed.
        compiler_fence(Ordering::SeqCst);
        Ok(())
    }
}
