//! NOR flash: two sectors of records, and two areas of whole sectors for models.
//!
//! ```text
//! │ records │ records │ first model: whole sectors │ second model: as many │
//! ```
//!
//! Records are appended. Where a sector is full, or does not take a record, the other one is erased and goes on; that with the
//! newest record is never erased. A record counts once it has been read back. Each attempt to write one has a number of its own, so
//! that of two that are whole the newer one counts, whatever the flash said of the other.
//!
//! Erased bytes are 0xff or, as on an STM32L0 or L1, 0. A start without a record erases a sector and looks; after that the
//! records say it.

use super::record::{ERASED, Newest, RECORD_LENGTH, Record};
use super::storage::{Loaded, NotStored, Place, Storage};
use core::fmt;
use embedded_storage::nor_flash::NorFlash;

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

    /// Called before each erase: each may take seconds where sectors are large, so this is the place to feed a watchdog.
    fn before_erase(&mut self) {}
}

/// Attempts to erase a sector, or to read a record.
const ATTEMPTS: usize = 2;

/// Sectors of the log.
const SECTORS: usize = 2;

/// Values that erased bytes may have.
const VALUES: [u8; 2] = [ERASED, 0];

/// The longest word that is written at once.
const MAX_WRITE_SIZE: usize = 64;

/// Reason why a flash cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashError {
    /// The flash is shorter than two sectors of records; see [`FlashStorage::SECTOR`].
    Short,
    /// The flash reads as memory of another length than its driver says.
    Mapping,
    /// Bytes of a sector that was just erased are neither all 0xff nor all 0.
    Erased,
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Short => "the flash is shorter than two sectors of records: see FlashStorage::SECTOR",
            Self::Mapping => "the flash reads as memory of another length than its driver says",
            Self::Erased => "erased bytes of the flash read neither as 0xff nor as 0: use another flash, or Memory",
        })
    }
}

impl core::error::Error for FlashError {}

/// Records of loads and models in NOR flash.
///
/// A flash whose words do not divide 64 bytes, or whose sectors are no whole words, does not compile.
///
/// Wear: each load erases the sectors of its model, and once a sector is full of records the other one.
#[derive(Debug)]
pub struct FlashStorage<F> {
    flash: F,
    /// The value of erased bytes.
    erased: u8,
    /// Number of the last record that was written, or tried.
    counter: u32,
    /// The sector with the newest record; none without one.
    current: Option<usize>,
    /// Offset of the next record.
    next: usize,
}

impl<F: MappedFlash> FlashStorage<F> {
    /// Bytes that a record takes: whole words.
    const SLOT: usize = RECORD_LENGTH.next_multiple_of(F::WRITE_SIZE);

    /// Bytes of a sector of records: one of the flash's own, or as many as a record takes. Two of them come before the models.
    pub const SECTOR: usize = {
        let divides = F::WRITE_SIZE > 0 && MAX_WRITE_SIZE.is_multiple_of(F::WRITE_SIZE);
        assert!(divides, "the words that the flash writes at once do not divide 64 bytes");
        let is_whole = F::ERASE_SIZE > 0 && F::ERASE_SIZE.is_multiple_of(F::WRITE_SIZE);
        assert!(is_whole, "a sector of the flash is not a whole number of the words that it writes at once");
        Self::SLOT.next_multiple_of(F::ERASE_SIZE)
    };

    /// Bytes of both sectors.
    const LOG: usize = SECTORS * Self::SECTOR;

    /// Uses a flash: two sectors for records, the rest for two models. Finds the newest record.
    ///
    /// Cost: the checksums of all records, byte by byte. No erased flash is needed: bytes that are not a record, read twice, are
    /// ignored. Without a record a sector is erased.
    ///
    /// # Errors
    /// [`FlashError`].
    pub fn new(flash: F) -> Result<Self, FlashError> {
        if flash.bytes().len() != flash.capacity() || u32::try_from(flash.capacity()).is_err() {
            return Err(FlashError::Mapping);
        }
        if flash.capacity() < Self::LOG {
            return Err(FlashError::Short);
        }
        let mut storage = Self { flash, erased: ERASED, counter: 0, current: None, next: 0 };
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

    /// The records, with their offsets.
    fn records(&self) -> impl Iterator<Item = (usize, Record)> {
        let slots = Self::SECTOR / Self::SLOT;
        let offsets = (0..SECTORS * slots).map(move |slot| slot / slots * Self::SECTOR + slot % slots * Self::SLOT);
        offsets.filter_map(|at| {
            let record = (0..ATTEMPTS).find_map(|_| Record::read(self.flash.bytes().get(at..)?, self.erased))?;
            Some((at, record))
        })
    }

    /// Finds the newest record, if there is one.
    fn find(&mut self) -> bool {
        let newest = self.records().reduce(|best, next| if next.1.is_newer_than(best.1.counter) { next } else { best });
        if let Some((at, record)) = newest {
            (self.counter, self.current, self.next) = (record.counter, Some(at / Self::SECTOR), at + Self::SLOT);
        }
        newest.is_some()
    }

    /// Finds the value of erased bytes, where there are no records; the first one goes into the sector that was erased.
    fn probe(&mut self) -> Result<(), FlashError> {
        let mut result = Err(FlashError::Erased);
        for sector in 0..SECTORS {
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
                        self.next = start;
                        return Ok(());
                    }
                }
            }
        }
        self.erased = ERASED;
        result
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

    /// Writes a record into erased flash, under another number than any before, and says whether it is there: then it is the
    /// newest.
    fn write_record(&mut self, at: usize, loaded: Loaded) -> bool {
        self.counter = self.counter.wrapping_add(1);
        let record = Record { loaded, counter: self.counter }.to_bytes(self.erased);
        let written = write(&mut self.flash, at, &record).is_some();
        if written {
            (self.current, self.next) = (Some(at / Self::SECTOR), at + Self::SLOT);
        }
        written
    }

    /// Offset of a place for models.
    fn start(&self, place: Place) -> usize {
        match place {
            Place::First => Self::LOG,
            Place::Second => Self::LOG + self.room(),
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

impl<F: MappedFlash> Storage for FlashStorage<F> {
    fn room(&self) -> usize {
        let sectors = self.flash.capacity().saturating_sub(Self::LOG) / F::ERASE_SIZE;
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
            // It was written before, as where the power went after it.
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

    fn loaded(&self) -> Option<Loaded> {
        let mut newest = Newest::default();
        self.records().for_each(|(_, record)| newest.see(record));
        newest.whole(self)
    }

    /// Cost: a record written and read back; where the sector is full or does not take it, the other one erased, twice if it has
    /// to be.
    fn keep(&mut self, loaded: Loaded) -> Result<(), NotStored> {
        let (at, end) = (self.next, self.next + Self::SLOT);
        // A sector is erased as a whole before its first record: what is erased here can be written.
        let fits = end <= (self.current.unwrap_or(at / Self::SECTOR) + 1) * Self::SECTOR;
        if fits && self.is_erased(at, end) && self.write_record(at, loaded) {
            return Ok(());
        }
        let current = self.current;
        for sector in (0..SECTORS).filter(|sector| Some(*sector) != current) {
            let at = sector * Self::SECTOR;
            if self.erase(at, at + Self::SECTOR) && self.write_record(at, loaded) {
                return Ok(());
            }
        }
        Err(NotStored)
    }
}
