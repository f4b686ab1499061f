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
//!
//! Erased bytes are 0xff or, as on an STM32L0 or L1, 0. A start without a record erases a sector and looks; after that the
//! records say it.

use super::record::{self, ERASED, Found};
use super::storage::{Place, Storage};
use core::fmt;
use embedded_storage::nor_flash::NorFlash;
use palpate_shared::link::NotStored;

/// Flash that the chip's bus also reads as memory.
///
/// The driver may stand for a part of the chip's flash; what it calls 0 is the first byte of [`MappedFlash::bytes`].
///
/// Flash with error correction (STM32L4, G4, H7, U5) does not return a word that a power cut left half written, but raises
/// an interrupt or a bus fault, and every start reads such words. The program needs a handler that clears the error and goes
/// on: what was read then fails its checksum. This was not tried on such a chip.
pub trait MappedFlash: NorFlash {
    /// All of it, as it is now.
    fn bytes(&self) -> &[u8];

    /// Called before each erase, of up to eight in one [`Storage::store`]: each may take seconds where sectors are large, so
    /// this is the place to feed a watchdog.
    fn before_erase(&mut self) {}
}

/// Attempts to erase a sector, or to read a record.
const ATTEMPTS: usize = 2;

/// Sectors that are tried for a record. Where all of them fail, one is tried for each record that follows, until one
/// succeeds, or until the log was gone through as many times in vain: then none any more.
const SECTORS_TRIED: usize = 4;

/// Values that erased bytes may have.
const VALUES: [u8; 2] = [ERASED, 0];

/// The longest word that is written at once.
const MAX_WRITE_SIZE: usize = 64;

/// Reason why a flash cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashError {
    /// The log has to be at least two whole sectors, and within the flash; see [`FlashStorage::SECTOR`].
    Log,
    /// The flash reads as memory of another length than its driver says.
    Mapping,
    /// Bytes of a sector that was just erased are neither all 0xff nor all 0.
    Erased,
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Log => "the log is not at least two whole sectors of the flash: see FlashStorage::SECTOR",
            Self::Mapping => "the flash reads as memory of another length than its driver says",
            Self::Erased => "erased bytes of the flash read neither as 0xff nor as 0: use another flash, or Memory",
        })
    }
}

impl core::error::Error for FlashError {}

/// Records and models in NOR flash; `RECORD` is [`record_length`](super::record_length) of the most objects, or more.
///
/// A flash whose words do not divide 64 bytes, or whose sectors are no whole words, does not compile.
///
/// Wear: records are appended, so a sector is erased once it is full of them, and each sector of the log is in turn; the
/// README of the firmware states for how many touches. RAM: `RECORD` bytes, and a few numbers.
#[derive(Debug)]
pub struct FlashStorage<F, const RECORD: usize> {
    flash: F,
    /// Bytes of the log.
    log: usize,
    /// The value of erased bytes.
    erased: u8,
    /// Offset of the newest record.
    newest: Option<usize>,
    counter: u32,
    /// Offset of the next record, after the newest.
    next: usize,
    /// The sector that was tried last.
    tried: usize,
    /// Sectors that failed since one succeeded.
    failed: usize,
    buffer: [u8; RECORD],
}

impl<F: MappedFlash, const RECORD: usize> FlashStorage<F, RECORD> {
    /// Bytes of a sector of the log: as many of the flash's own as a record takes, one unless they are as small as the 256
    /// bytes of a SAMD21.
    pub const SECTOR: usize = {
        let divides = F::WRITE_SIZE > 0 && MAX_WRITE_SIZE.is_multiple_of(F::WRITE_SIZE);
        assert!(divides, "the words that the flash writes at once do not divide 64 bytes");
        let is_whole = F::ERASE_SIZE > 0 && F::ERASE_SIZE.is_multiple_of(F::WRITE_SIZE);
        assert!(is_whole, "a sector of the flash is not a whole number of the words that it writes at once");
        assert!(RECORD > 0, "records have no bytes: see record_length");
        RECORD.next_multiple_of(F::ERASE_SIZE)
    };

    /// Uses a flash: the first `log` bytes for records, the rest for two models. Finds the newest record.
    ///
    /// Cost: the checksums of the first record in each sector and of all in two, byte by byte. No erased
    /// flash is needed: bytes that are not a record, read twice, are ignored. Without a record in the log a sector is erased.
    ///
    /// # Errors
    /// [`FlashError`].
    pub fn new(flash: F, log: usize) -> Result<Self, FlashError> {
        if flash.bytes().len() != flash.capacity() || u32::try_from(flash.capacity()).is_err() {
            return Err(FlashError::Mapping);
        }
        if !log.is_multiple_of(Self::SECTOR) || log / Self::SECTOR < 2 || log > flash.capacity() {
            return Err(FlashError::Log);
        }
        let (erased, buffer) = (ERASED, [0; RECORD]);
        let mut storage = Self { flash, log, erased, newest: None, counter: 0, next: 0, tried: 0, failed: 0, buffer };
        for value in VALUES {
            storage.erased = value;
            if storage.find() {
                return Ok(storage);
            }
        }
        storage.probe()?;
        Ok(storage)
    }

    /// The flash again.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The sector behind another one.
    const fn following(&self, sector: usize) -> usize {
        if sector + 1 < self.log / Self::SECTOR { sector + 1 } else { 0 }
    }

    /// Finds the newest record, if there is one.
    fn find(&mut self) -> bool {
        let mut best: Option<(u32, usize)> = None;
        // A sector that has records has one at its start.
        for sector in 0..self.log / Self::SECTOR {
            let start = sector * Self::SECTOR;
            if let Some(found) = self.record(start, start + Self::SECTOR)
                && best.is_none_or(|(counter, _)| found.is_newer_than(counter))
            {
                best = Some((found.counter, sector));
            }
        }
        // The first record of the sector that was written last may be unreadable now.
        let mut sector = best.map_or(0, |(_, sector)| sector);
        for _ in 0..if best.is_some() { 2 } else { SECTORS_TRIED } {
            self.scan(sector);
            sector = self.following(sector);
        }
        self.newest.is_some()
    }

    /// Looks through a sector for records that are newer than the newest so far, also behind some that cannot be read.
    fn scan(&mut self, sector: usize) {
        let (mut at, end) = (sector * Self::SECTOR, (sector + 1) * Self::SECTOR);
        while at < end {
            let Some(found) = self.record(at, end) else {
                at += F::WRITE_SIZE;
                continue;
            };
            let (counter, behind) = (found.counter, at + found.length.next_multiple_of(F::WRITE_SIZE));
            if self.newest.is_none() || found.is_newer_than(self.counter) {
                (self.newest, self.counter, self.next, self.tried) = (Some(at), counter, behind, sector);
            }
            at = behind;
        }
    }

    /// Finds the value of erased bytes, in a log that has no records; the first one goes into the sector that was erased.
    fn probe(&mut self) -> Result<(), FlashError> {
        let mut result = Err(FlashError::Erased);
        for sector in (0..self.log / Self::SECTOR).take(SECTORS_TRIED) {
            for _ in 0..ATTEMPTS {
                let (start, end) = (sector * Self::SECTOR, (sector + 1) * Self::SECTOR);
                if !self.erase_once(start, end) {
                    // It stores nothing now, but it may be able to later on.
                    result = Ok(());
                    continue;
                }
                for value in VALUES {
                    self.erased = value;
                    if self.is_erased(start, end) {
                        (self.tried, self.next) = (sector, start);
                        return Ok(());
                    }
                }
            }
        }
        self.erased = ERASED;
        result
    }

    fn record(&self, at: usize, end: usize) -> Option<Found<'_>> {
        (0..ATTEMPTS).find_map(|_| record::read(self.flash.bytes().get(at..end)?, self.erased))
    }

    #[inline(never)] // It has many callers.
    fn is_erased(&self, from: usize, to: usize) -> bool {
        self.flash.bytes().get(from..to).is_some_and(|bytes| bytes.iter().all(|&byte| byte == self.erased))
    }

    /// Erases whole sectors, and returns the driver's answer.
    fn erase_once(&mut self, start: usize, end: usize) -> bool {
        self.flash.before_erase();
        let (Ok(from), Ok(to)) = (u32::try_from(start), u32::try_from(end)) else { return false };
        self.flash.erase(from, to).is_ok()
    }

    /// Erases whole sectors, and says whether they are erased.
    fn erase(&mut self, start: usize, end: usize) -> bool {
        // What counts is what can be read.
        (0..ATTEMPTS).any(|_| self.erase_once(start, end) && self.is_erased(start, end))
    }

    /// Writes the record in the buffer into erased flash, under another number than any before, and says whether it is
    /// there: then it is the newest.
    fn write_record(&mut self, at: usize, length: usize) -> bool {
        self.counter = self.counter.wrapping_add(1);
        let numbered = record::number(&mut self.buffer, self.counter, self.erased);
        let written = numbered.and_then(|()| write(&mut self.flash, at, self.buffer.get(..length)?));
        if written.is_some() {
            (self.newest, self.next, self.failed) = (Some(at), at + length.next_multiple_of(F::WRITE_SIZE), 0);
        }
        written.is_some()
    }

    /// Offset of a place for models.
    fn start(&self, place: Place) -> usize {
        match place {
            Place::First => self.log,
            Place::Second => self.log + self.room(),
        }
    }
}

/// Writes bytes into erased flash, the last word filled up; `None` unless they can be read there then.
fn write<F: MappedFlash>(flash: &mut F, at: usize, bytes: &[u8]) -> Option<()> {
    let (words, rest) = bytes.split_at_checked(bytes.len() / F::WRITE_SIZE * F::WRITE_SIZE)?;
    flash.write(u32::try_from(at).ok()?, words).ok()?;
    if !rest.is_empty() {
        let mut word = [ERASED; MAX_WRITE_SIZE];
        word.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        flash.write(u32::try_from(at + words.len()).ok()?, word.get(..F::WRITE_SIZE)?).ok()?;
    }
    (flash.bytes().get(at..at + bytes.len()) == Some(bytes)).then_some(())
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
            if !self.erase(fresh, fresh + F::ERASE_SIZE) {
                return Err(NotStored);
            }
            fresh += F::ERASE_SIZE;
        }
        write(&mut self.flash, from, bytes).ok_or(NotStored)
    }

    fn sector(&self) -> usize {
        F::ERASE_SIZE
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
        if self.failed >= SECTORS_TRIED * (self.log / Self::SECTOR) {
            return Err(NotStored);
        }
        let length = record::write(&mut self.buffer, fill).ok_or(NotStored)?;
        let current = self.newest.map(|newest| newest / Self::SECTOR);
        let at = self.next;
        // A sector is erased as a whole before its first record: what is erased here can be written.
        let fits = at + length <= (current.unwrap_or(self.tried) + 1) * Self::SECTOR;
        let end = at + length.next_multiple_of(F::WRITE_SIZE);
        if fits && self.is_erased(at, end) && self.write_record(at, length) {
            return Ok(());
        }
        for _ in 0..if self.failed == 0 { SECTORS_TRIED } else { 1 } {
            let next = self.following(self.tried);
            self.tried = if Some(next) == current { self.following(next) } else { next };
            let at = self.tried * Self::SECTOR;
            if self.erase(at, at + Self::SECTOR) && self.write_record(at, length) {
                return Ok(());
            }
            self.failed += 1;
        }
        // One of them may hold the record although it says that it does not, and sectors go by their first record: nothing
        // newer may follow in the one before.
        self.next = current.map_or(0, |sector| (sector + 1) * Self::SECTOR);
        Err(NotStored)
    }
}
