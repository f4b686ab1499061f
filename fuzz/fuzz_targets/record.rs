//! Any bytes where a chip keeps records and models, in RAM and in flash: it starts, and stores the next records.
#![no_main]

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use libfuzzer_sys::fuzz_target;
use palpate_onboard::station::{FlashStorage, MappedFlash, Memory, Station, Storage, record_length};
use palpate_shared::Touch;
use palpate_shared::link::{Device, checksum};

static MODEL: &[u8] = include_bytes!("../../models/household.palpate");
const RECORD: usize = record_length(16);
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
    // As they are, and as the body of a record with a right checksum.
    let mut whole = u16::try_from(bytes.len()).unwrap_or(0).to_le_bytes().to_vec();
    whole.extend((checksum(bytes) ^ 3).to_le_bytes());
    whole.extend(bytes);
    for bytes in [bytes, &whole] {
        let mut places = [vec![0; RECORD.max(bytes.len())], vec![0; RECORD]];
        places[0][..bytes.len()].copy_from_slice(bytes);
        let [first, second] = &mut places;
        let (mut a, mut b) = ([0; 256], [0; 256]);
        start(Memory { models: [&mut a, &mut b], records: [first, second] });
        let mut cells = vec![0xff; 6 * SECTOR];
        let length = bytes.len().min(cells.len());
        cells[..length].copy_from_slice(&bytes[..length]);
        start(FlashStorage::<_, RECORD>::new(Flash(cells), 2 * SECTOR).expect("a flash as it should be"));
    }
});

/// Starts, touches, stores; stored records are there.
fn start(storage: impl Storage) {
    let Ok((mut station, progress, starts)) = Station::<16, _>::open(MODEL, storage) else {
        panic!("records are long enough")
    };
    let _ = station.push(&Touch::from_micros([30_000, 0, 50_000]), true);
    station.store(&progress).expect("nothing is worn out");
    let counter = station.into_storage().newest().map(|(counter, _)| counter);
    assert_eq!(counter, Some(starts.wrapping_add(1)));
}
