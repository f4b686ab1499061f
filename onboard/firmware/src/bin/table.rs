//! Touches with a position from a host, verdicts and places back: links only if nothing in it can panic.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;
use cortex_m_rt::entry;
use embedded_io::{ErrorType, Read, Write};
use palpate_onboard::station::{NoStorage, Table, serve_with};

#[path = "../no_panic.rs"]
mod no_panic;

/// A line that the compiler knows nothing about.
struct Anything;

impl ErrorType for Anything {
    type Error = Infallible;
}

impl Read for Anything {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(black_box(buffer).len())
    }
}

impl Write for Anything {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        Ok(black_box(buffer).len())
    }

    // The default panics where nothing is written.
    fn write_all(&mut self, buffer: &[u8]) -> Result<(), Infallible> {
        black_box(buffer);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

#[entry]
fn main() -> ! {
    let mut table = Table::<14_336, 32, 16>::new();
    let _ = serve_with::<10, _, _, _>(black_box(&[]), &mut NoStorage, &mut table, 0, &mut Anything);
    loop {
        cortex_m::asm::wfi();
    }
}
