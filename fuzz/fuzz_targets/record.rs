//! Any bytes where a chip keeps records and models, in RAM and in flash: it starts, and keeps the next load.
#![no_main]

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use libfuzzer_sys::fuzz_target;
use palpate_onboard::station::{FlashStorage, Loaded, MappedFlash, Memory, Place, RECORD_LENGTH, Station, Storage};
use palpate_shared::Touch;
use palpate_shared::link::checksum;

static MODEL: &[u8] = include_bytes!("../../models/household.palpate");
const SECTOR: usize = 1024;

/// A flash in RAM.
struct Flash(Vec<u8>);

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0[offset as usize..offset as usize + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let cells = self.0[offset as usize..offset as usize + bytes.len()].iter_mut();
        cells.zip(bytes).for_each(|(cell, byte)| *cell &= byte);
        Ok(())
    }
}

impl MappedFlash for Flash {
    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

fuzz_target!(|bytes: &[u8]| {
    // As they are, and as records with a right checksum.
    let mut whole = bytes.to_vec();
    for record in whole.chunks_exact_mut(RECORD_LENGTH) {
        let (stated, sum) = record.split_at_mut(RECORD_LENGTH - 4);
        sum.copy_from_slice(&(checksum(stated) ^ 4).to_le_bytes());
    }
    for bytes in [bytes, &whole] {
        let mut places = [[0; RECORD_LENGTH]; 2];
        places.as_flattened_mut().iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let [first, second] = &mut places;
        let (mut a, mut b) = ([0; 256], [0; 256]);
        start(Memory { models: [&mut a, &mut b], records: [first, second] });
        let mut cells = vec![0xff; 6 * SECTOR];
        let length = bytes.len().min(cells.len());
        cells[..length].copy_from_slice(&bytes[..length]);
        start(FlashStorage::new(Flash(cells)).expect("a flash as it should be"));
    }
});

/// Starts, touches, and keeps a load, which is there then.
fn start(storage: impl Storage) {
    let mut station = Station::<16, _>::open(MODEL, storage);
    let _ = station.push(&Touch::from_micros([30_000, 0, 50_000]), true);
    let mut storage = station.into_storage();
    let loaded = Loaded { place: Place::Second, length: 4, checksum: checksum(&storage.model(Place::Second)[..4]) };
    storage.keep(loaded).expect("nothing is worn out");
    assert_eq!(storage.loaded(), Some(loaded));
}
