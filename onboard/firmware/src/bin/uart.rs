//! Recognizes touches that a host sends over the UART: `palpate link` at the other end.
//!
//! A model comes from the host (`palpate link PORT --load model.palpate`) and lies in RAM that keeps its content through
//! resets. With the feature `locate` it may be one of maps, for touches with a position.
#![no_std]
#![no_main]

use cortex_m_rt::{entry, exception};
use palpate_firmware::chip::{self, Interrupt};
use palpate_firmware::uart::{Port, Uart};
use palpate_onboard::station::serve_with;

/// Objects that a model may have.
const OBJECTS: usize = 16;

#[entry]
fn main() -> ! {
    let mut uart = Uart::take(Port::Link);
    let mut memory = chip::take_memory();
    #[cfg(feature = "locate")]
    let located = &mut palpate_onboard::station::Table::<14_336, 32, OBJECTS>::new();
    #[cfg(not(feature = "locate"))]
    let located = ();
    match serve_with::<OBJECTS, _, _, _>(&[], &mut memory, located, chip::count_start(), &mut uart) {
        // The UART has no end.
        Ok(()) | Err(_) => palpate_firmware::fail(),
    }
}

/// Every interrupt is handled here, so that the image needs no interrupt table per chip.
#[allow(unsafe_code)] // cortex-m-rt wants the word; nothing in it needs it.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    if Interrupt::from_number(number) == chip::LINK_RECEIVED {
        Port::Link.received();
    }
}
