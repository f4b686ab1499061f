//! Recognizes from three switches on three pins, and reports every touch and fault to a host over the UART
//! (`palpate link PORT`). A verdict ends an object; the next touch begins another.
//!
//! A model is built in; another: `PALPATE_MODEL=/path/to/model.palpate cargo build --release --bin gpio`, or over the
//! link: `palpate link PORT --load model.palpate`.
#![no_std]
#![no_main]

use core::convert::Infallible;
use cortex_m_rt::{entry, exception};
use embedded_io::Write;
use palpate_firmware::chip::{self, Interrupt};
use palpate_firmware::pins;
use palpate_firmware::uart::{Port, Uart};
use palpate_onboard::effector::Sensed;
use palpate_onboard::station::{Board, ProbeSettings, ProbeStation};

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Name of the program on the link.
const PROGRAM: &str = concat!("palpate-firmware gpio ", env!("CARGO_PKG_VERSION"));
/// Objects that a model may have.
const OBJECTS: usize = 16;

/// The link; the pins are the interrupt's.
struct Chip(Uart);

impl Board for Chip {
    type Error = Infallible;

    fn sense(&mut self) -> Sensed {
        pins::sense()
    }

    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.0.receive_all(buffer))
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), Infallible> {
        self.0.write_all(frame)
    }

    fn is_over(&mut self) -> bool {
        pins::is_over()
    }
}

#[entry]
fn main() -> ! {
    let mut chip = Chip(Uart::take(Port::Link));
    let memory = chip::take_memory();
    let settings = ProbeSettings { boot: chip::count_start(), program: PROGRAM, ..ProbeSettings::default() };
    let mut station = ProbeStation::<OBJECTS, _>::open(MODEL, memory, settings);
    if station.model().is_none() {
        palpate_firmware::println!("no model is built in: build with PALPATE_MODEL=/path/to/model.palpate");
        palpate_firmware::fail()
    }
    pins::watch();
    pins::play();
    loop {
        let Ok(happened) = station.step(&mut chip);
        if happened.is_none() {
            // On a board: also for ProbeStation::wait. Here time passes when the host says so.
            chip::sleep_unless(|| chip.0.is_ready() || !pins::is_idle());
        }
    }
}

/// Every interrupt is handled here, so that the image needs no interrupt table per chip.
#[allow(unsafe_code)] // cortex-m-rt wants the word; nothing in it needs it.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    match Interrupt::from_number(number) {
        chip::LINK_RECEIVED => Port::Link.received(),
        chip::PINS_RECEIVED => Port::Pins.received(),
        chip::PIN_CHANGED => pins::changed(),
        chip::TIMER => pins::tick(),
        _ => {}
    }
}
