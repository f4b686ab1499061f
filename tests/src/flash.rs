//! Flash that wears, tears, errs and lies.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_write};
use palpate_onboard::station::MappedFlash;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::cell::{Cell, OnceCell};
use std::rc::Rc;

/// Bytes that are written at once.
pub const WORD: usize = 4;
/// Bytes that are erased at once.
pub const SECTOR: usize = 1024;

/// Fault in one step; a step is one word written, or one sector erased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The power goes before it.
    CutBefore,
    /// The power goes while it happens: some bits have changed.
    CutDuring,
    /// The power goes after it.
    CutAfter,
    /// It fails, and has done nothing.
    Refused,
    /// It fails halfway.
    Torn,
    /// It fails, but was done.
    RefusedThoughDone,
    /// It says that it is done, and did nothing.
    Nothing,
    /// It says that it is done, and did half.
    Half,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::CutBefore,
        Self::CutDuring,
        Self::CutAfter,
        Self::Refused,
        Self::Torn,
        Self::RefusedThoughDone,
        Self::Nothing,
        Self::Half,
    ];
}

/// Wrong data that a read returns once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misread {
    /// A bit of each byte is wrong.
    Flipped,
    /// All looks erased.
    Erased,
}

/// A flash's cells, which outlast its driver.
pub struct Cells {
    /// Their content.
    pub bytes: Vec<u8>,
    /// The value of erased bytes.
    pub erased_to: u8,
    /// Erases of each sector.
    pub erases: Vec<u32>,
    /// Erases of each sector after which it keeps some of its bits.
    pub endurance: Vec<u32>,
    /// Steps so far.
    pub steps: u64,
    /// Faults to come.
    pub faults: Vec<(u64, Fault)>,
    /// Reads so far.
    pub reads: Cell<u64>,
    /// The read that goes wrong, if one does.
    pub misread: Option<(u64, Misread)>,
    misread_as: OnceCell<Vec<u8>>,
    /// Off once a fault has cut it.
    pub power: Rc<Cell<bool>>,
    rng: ChaCha8Rng,
}

impl Cells {
    /// Cells that were never erased: they hold anything.
    pub fn new(sectors: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self::holding((0..sectors * SECTOR).map(|_| rng.random()).collect(), rng)
    }

    /// Cells that hold this.
    pub fn of(bytes: Vec<u8>) -> Self {
        Self::holding(bytes, ChaCha8Rng::seed_from_u64(0))
    }

    /// Cells that are erased to this value.
    pub fn erased_to(self, erased_to: u8) -> Self {
        Self { erased_to, ..self }
    }

    fn holding(bytes: Vec<u8>, rng: ChaCha8Rng) -> Self {
        let sectors = bytes.len() / SECTOR;
        let power = Rc::new(Cell::new(true));
        Self {
            bytes,
            erased_to: 0xff,
            erases: vec![0; sectors],
            endurance: vec![u32::MAX; sectors],
            steps: 0,
            faults: Vec::new(),
            reads: Cell::new(0),
            misread: None,
            misread_as: OnceCell::new(),
            power,
            rng,
        }
    }

    /// Does a step to the bytes from `at` on.
    fn step(&mut self, at: usize, wanted: &[u8]) -> Result<(), NorFlashErrorKind> {
        if !self.power.get() {
            return Err(NorFlashErrorKind::Other);
        }
        let step = self.steps;
        self.steps += 1;
        let fault = self.faults.iter().find(|(when, _)| *when == step).map(|(_, fault)| *fault);
        let share = match fault {
            Some(Fault::CutBefore | Fault::Refused | Fault::Nothing) => 0.0,
            Some(Fault::CutDuring | Fault::Torn | Fault::Half) => 0.5,
            _ => 1.0,
        };
        for (cell, &wanted) in self.bytes[at..at + wanted.len()].iter_mut().zip(wanted) {
            let mut changed = 0;
            for bit in 0..8 {
                changed |= u8::from(share == 1.0 || share > 0.0 && self.rng.random_bool(share)) << bit;
            }
            *cell = *cell & !changed | wanted & changed;
        }
        match fault {
            None | Some(Fault::Nothing | Fault::Half) => Ok(()),
            Some(Fault::Refused | Fault::Torn | Fault::RefusedThoughDone) => Err(NorFlashErrorKind::Other),
            Some(Fault::CutBefore | Fault::CutDuring | Fault::CutAfter) => {
                self.power.set(false);
                Err(NorFlashErrorKind::Other)
            }
        }
    }
}

/// The driver of a flash.
pub struct Driver<'c>(pub &'c mut Cells);

impl ErrorType for Driver<'_> {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Driver<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0.bytes[offset as usize..offset as usize + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.bytes.len()
    }
}

impl NorFlash for Driver<'_> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to).expect("whole sectors");
        for sector in from as usize / SECTOR..to as usize / SECTOR {
            let erased = self.0.erased_to;
            let mut wanted = [erased; SECTOR];
            if self.0.erases[sector] >= self.0.endurance[sector] {
                // Worn: some cells do not come back.
                for byte in wanted.iter_mut().skip(sector % 7).step_by(97) {
                    *byte = erased ^ 1;
                }
            }
            self.0.erases[sector] += 1;
            self.0.step(sector * SECTOR, &wanted)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len()).expect("whole words");
        let (words, rest) = bytes.as_chunks::<WORD>();
        assert!(rest.is_empty());
        for (index, word) in words.iter().enumerate() {
            let at = offset as usize + index * WORD;
            let cells: [u8; WORD] = self.0.bytes[at..at + WORD].try_into().expect("a word");
            // Worn cells aside, nothing is written twice.
            let worn = self.0.erases[at / SECTOR] > self.0.endurance[at / SECTOR];
            let erased = self.0.erased_to;
            assert!(worn || cells == [erased; WORD], "the word at {at} is not erased");
            // A bit that is programmed does not come back.
            let programmed = |i: usize| if erased == 0xff { word[i] & cells[i] } else { word[i] | cells[i] };
            self.0.step(at, &std::array::from_fn::<u8, WORD, _>(programmed))?;
        }
        Ok(())
    }
}

impl MappedFlash for Driver<'_> {
    fn bytes(&self) -> &[u8] {
        let Cells { bytes, erased_to, reads, misread, misread_as, .. } = &*self.0;
        let read = reads.replace(reads.get() + 1);
        match misread {
            Some((when, how)) if *when == read => misread_as.get_or_init(|| match how {
                Misread::Flipped => bytes.iter().map(|byte| byte ^ 0x10).collect(),
                Misread::Erased => vec![*erased_to; bytes.len()],
            }),
            _ => bytes,
        }
    }
}
