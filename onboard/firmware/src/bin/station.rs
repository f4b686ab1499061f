//! A [`ProbeStation`] with effector and link, and models in flash: links only if nothing in it can panic; its size is
//! what all that takes.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;
use cortex_m_rt::entry;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use palpate_onboard::effector::Sensed;
use palpate_onboard::station::{Board, FlashStorage, MappedFlash, ProbeSettings, ProbeStation};

#[path = "../no_panic.rs"]
mod no_panic;

/// A board and a flash that the compiler knows nothing about.
struct Anything;

impl Board for Anything {
    type Error = Infallible;

    fn sense(&mut self) -> Sensed {
        black_box(Sensed::Nothing(0))
    }

    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(black_box(buffer).len())
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), Infallible> {
        black_box(frame);
        Ok(())
    }

    fn is_over(&mut self) -> bool {
        black_box(true)
    }
}

impl ErrorType for Anything {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Anything {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        black_box(bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        black_box(0)
    }
}

impl NorFlash for Anything {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        black_box(Ok(()))
    }

    fn write(&mut self, _: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        black_box(bytes);
        black_box(Ok(()))
    }
}

impl MappedFlash for Anything {
    fn bytes(&self) -> &[u8] {
        black_box(&[])
    }
}

#[entry]
fn main() -> ! {
    let bytes: &'static [u8] = black_box(&[]);
    if let Ok(storage) = FlashStorage::new(Anything) {
        let mut station = ProbeStation::<10, _>::open(bytes, storage, ProbeSettings::default());
        loop {
            let _ = black_box(station.step(&mut Anything));
            black_box(station.wait(0));
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
