//! NOR flash: records in a log that goes round its sectors, and two areas of whole sectors for models.
//!
//! ```text
//! │ log: sector │ sector │ … │ first model: whole sectors │ second model: as many │
//! ```
//!
//! The log is appended to. Where a record does not fit into a sector any more, the next sector is erased and goes on, so
//! all sectors wear alike. A record counts once it has been read back; one that cannot be written, or a sector that does
//! not erase any more, is passed over. The sector with the newest record is never erased. Each attempt to write a record
//! has a number of its own, so that of two that are whole the newer one counts, whatever the flash said of the other.

use super::record::{self, Found};
use super::storage::{Place, Storage};
use core::fmt;
use embedded_storage::nor_flash::NorFlash;
use palpate_shared::link::{CHUNK, NotStored};

/// Flash that the chip's bus also reads as memory.
///
/// The driver may stand for a part of the chip's flash; what it calls 0 is the first byte of [`MappedFlash::bytes`].
pub trait MappedFlash: NorFlash {
    /// All of it, as it is now.
    fn bytes(&self) -> &[u8];
}

/// Attempts to erase a sector, or to read a record.
const ATTEMPTS: usize = 2;

/// Sectors that are tried for a record. Where all of them fail, one is tried for each record that follows, until one
/// succeeds, or until the log was gone through as many times in vain: then none any more.
const SECTORS_TRIED: usize = 4;

/// The value of erased bytes.
const ERASED: u8 = 0xff;

/// The longest word that is written at once.
const MAX_WRITE_SIZE: usize = 64;

/// Reason why a flash cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashError {
    /// The log has to be at least two whole sectors, and within the flash.
    Log,
    /// The flash writes words of more than 64 bytes, or of none that divides a chunk and a sector.
    WriteSize,
    /// A record does not fit into a sector.
    Record,
    /// The flash reads as memory of another length than its driver says.
    Mapping,
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Log => "the log is not at least two whole sectors of the flash",
            Self::WriteSize => "the flash writes words that do not divide 64 bytes and a sector",
            Self::Record => "a record does not fit into a sector of the flash",
            Self::Mapping => "the flash reads as memory of another length than its driver says",
        })
    }
}

impl core::error::Error for FlashError {}

/// Records and models in NOR flash; `RECORD` is [`record_length`](super::record_length) of the most objects, or more.
///
/// Wear: records are appended, so a sector is erased once it is full of them, and each sector of the log is in turn; the
/// README of the firmware states for how many touches. RAM: `RECORD` bytes, and a few numbers.
#[derive(Debug)]
pub struct FlashStorage<F, const RECORD: usize> {
    flash: F,
    /// Bytes of the log.
    log: usize,
    /// Where the newest record is.
    newest: Option<usize>,
    counter: u32,
    /// Where the next record goes: behind the newest.
    next: usize,
    /// The sector that was tried last.
    tried: usize,
    /// Sectors that failed since one succeeded.
    failed: usize,
    buffer: [u8; RECORD],
}

impl<F: MappedFlash, const RECORD: usize> FlashStorage<F, RECORD> {
    /// Uses a flash: the first `log` bytes for records, the rest for two models. Finds the newest record.
    ///
    /// Cost: the checksums of the first record in each sector and of all in one, byte by byte. No erased
    /// flash is needed: what is no record, read twice, counts as nothing.
    ///
    /// # Errors
    /// [`FlashError`].
    pub fn new(flash: F, log: usize) -> Result<Self, FlashError> {
        if F::WRITE_SIZE > MAX_WRITE_SIZE || !CHUNK.is_multiple_of(F::WRITE_SIZE) {
            return Err(FlashError::WriteSize);
        }
        if F::ERASE_SIZE == 0 || !F::ERASE_SIZE.is_multiple_of(F::WRITE_SIZE) {
            return Err(FlashError::WriteSize);
        }
        if flash.bytes().len() != flash.capacity() || u32::try_from(flash.capacity()).is_err() {
            return Err(FlashError::Mapping);
        }
        if !log.is_multiple_of(F::ERASE_SIZE) || log / F::ERASE_SIZE < 2 || log > flash.capacity() {
            return Err(FlashError::Log);
        }
        // So that the end can be filled up to a whole word.
        if RECORD > F::ERASE_SIZE || !RECORD.is_multiple_of(F::WRITE_SIZE) {
            return Err(FlashError::Record);
        }
        let buffer = [ERASED; RECORD];
        let mut storage = Self { flash, log, newest: None, counter: 0, next: 0, tried: 0, failed: 0, buffer };
        // A sector that has records has one at its start.
        let newest = |storage: &Self, best: &mut Option<(u32, usize)>, sector: usize| {
            let start = sector * F::ERASE_SIZE;
            if let Some(found) = storage.record(start, start + F::ERASE_SIZE)
                && best.is_none_or(|(counter, _)| found.is_newer_than(counter))
            {
                *best = Some((found.counter, sector));
            }
        };
        let mut best = None;
        (0..log / F::ERASE_SIZE).for_each(|sector| newest(&storage, &mut best, sector));
        if let Some((_, sector)) = best {
            storage.scan(sector);
        }
        Ok(storage)
    }

    /// The flash again.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Finds the newest record in the sector that has it.
    fn scan(&mut self, sector: usize) {
        let (mut at, end) = (sector * F::ERASE_SIZE, (sector + 1) * F::ERASE_SIZE);
        self.tried = sector;
        while let Some(Found { counter, length, .. }) = self.record(at, end) {
            (self.newest, self.counter) = (Some(at), counter);
            at += length.next_multiple_of(F::WRITE_SIZE);
            self.next = at;
        }
    }

    fn record(&self, at: usize, end: usize) -> Option<Found<'_>> {
        (0..ATTEMPTS).find_map(|_| record::read(self.flash.bytes().get(at..end)?))
    }

    fn is_erased(&self, from: usize, to: usize) -> bool {
        self.flash.bytes().get(from..to).is_some_and(|bytes| bytes.iter().all(|&byte| byte == ERASED))
    }

    /// Erases a sector, and says whether it is erased.
    fn erase(&mut self, start: usize) -> bool {
        let end = start + F::ERASE_SIZE;
        for _ in 0..ATTEMPTS {
            let (Ok(from), Ok(to)) = (u32::try_from(start), u32::try_from(end)) else { return false };
            // What counts is what can be read.
            if self.flash.erase(from, to).is_ok() && self.is_erased(start, end) {
                return true;
            }
        }
        false
    }

    /// Writes the record in the buffer into erased flash, under another number than any before, and says whether it is
    /// there: then it is the newest.
    fn write_record(&mut self, at: usize, length: usize) -> bool {
        self.counter = self.counter.wrapping_add(1);
        let numbered = record::number(&mut self.buffer, self.counter);
        let (Ok(offset), Some(bytes)) = (u32::try_from(at), self.buffer.get(..length)) else { return false };
        let written = numbered.is_some() && self.flash.write(offset, bytes).is_ok();
        let is_there = written && self.flash.bytes().get(at..at + length) == Some(bytes);
        if is_there {
            (self.newest, self.next, self.failed) = (Some(at), at + length, 0);
        }
        is_there
    }

    /// Where a place for models starts.
    fn start(&self, place: Place) -> usize {
        match place {
            Place::First => self.log,
            Place::Second => self.log + self.room(),
        }
    }
}

impl<F: MappedFlash, const RECORD: usize> Storage for FlashStorage<F, RECORD> {
    fn room(&self) -> usize {
        let sectors = self.flash.capacity().saturating_sub(self.log) / F::ERASE_SIZE;
        sectors / 2 * F::ERASE_SIZE
    }

    fn model(&self, place: Place) -> &[u8] {
        let start = self.start(place);
        self.flash.bytes().get(start..start + self.room()).unwrap_or_default()
    }

    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored> {
        let within = offset.checked_add(bytes.len()).is_some_and(|end| end <= self.room());
        if !within || !offset.is_multiple_of(F::WRITE_SIZE) {
            return Err(NotStored);
        }
        let (from, to) = (self.start(place) + offset, self.start(place) + offset + bytes.len());
        let mut fresh = from.next_multiple_of(F::ERASE_SIZE);
        // What stands behind it in the sector, if the sector is the part's own, may be an earlier load's.
        let end = if from == fresh { to.next_multiple_of(F::ERASE_SIZE) } else { to };
        if self.flash.bytes().get(from..to) == Some(bytes) && self.is_erased(to, end) {
            // The power went after it was written.
            return Ok(());
        }
        if !self.is_erased(from, fresh.min(to)) {
            // The power went while it was written, and what stands before it in the sector would go with it.
            return Err(NotStored);
        }
        while fresh < to {
            if !self.erase(fresh) {
                return Err(NotStored);
            }
            fresh += F::ERASE_SIZE;
        }
        let (words, rest) = bytes.split_at_checked(bytes.len() / F::WRITE_SIZE * F::WRITE_SIZE).ok_or(NotStored)?;
        let at = u32::try_from(from).map_err(|_| NotStored)?;
        self.flash.write(at, words).map_err(|_| NotStored)?;
        if !rest.is_empty() {
            let mut word = [ERASED; MAX_WRITE_SIZE];
            word.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            let at = u32::try_from(from + words.len()).map_err(|_| NotStored)?;
            self.flash.write(at, word.get(..F::WRITE_SIZE).ok_or(NotStored)?).map_err(|_| NotStored)?;
        }
        if self.flash.bytes().get(from..to) == Some(bytes) { Ok(()) } else { Err(NotStored) }
    }

    fn record_length(&self) -> usize {
        RECORD
    }

    fn newest(&self) -> Option<(u32, &[u8])> {
        let found = self.record(self.newest?, self.log)?;
        Some((found.counter, found.record))
    }

    /// Cost: a record written and read back; where that fails, up to 4 sectors erased, twice each if they have to, and then
    /// one for each further record, until none is tried any more before the next start.
    fn store(&mut self, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored> {
        let sectors = self.log / F::ERASE_SIZE;
        if self.failed >= SECTORS_TRIED * sectors {
            return Err(NotStored);
        }
        self.buffer.fill(ERASED);
        let length = record::write(&mut self.buffer, fill).ok_or(NotStored)?.next_multiple_of(F::WRITE_SIZE);
        let current = self.newest.map(|newest| newest / F::ERASE_SIZE);
        let at = self.next;
        // A sector is erased as a whole before its first record: what is erased here can be written.
        let fits = current.is_some_and(|sector| at + length <= (sector + 1) * F::ERASE_SIZE);
        if fits && self.is_erased(at, at + length) && self.write_record(at, length) {
            return Ok(());
        }
        for _ in 0..if self.failed == 0 { SECTORS_TRIED } else { 1 } {
            let following = |sector| if sector + 1 < sectors { sector + 1 } else { 0 };
            let next = following(self.tried);
            self.tried = if Some(next) == current { following(next) } else { next };
            let at = self.tried * F::ERASE_SIZE;
            if self.erase(at) && self.write_record(at, length) {
                return Ok(());
            }
            self.failed += 1;
        }
        // One of them may hold the record although it says that it does not, and sectors go by their first record: nothing
        // newer may follow in the one before.
        self.next = current.map_or(0, |sector| (sector + 1) * F::ERASE_SIZE);
        Err(NotStored)
    }
}
