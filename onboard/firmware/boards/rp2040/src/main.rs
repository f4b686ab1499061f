//! Palpate on a Raspberry Pi Pico.
//!
//! | pin | what |
//! |---|---|
//! | GP2, GP3, GP4 | the three switches in their order along the row, each to ground |
//! | GP5 | a button to ground that is pressed after an approach, or the robot's output that is low between approaches: those that touched nothing are told too. May stay open |
//! | GP0, GP1 | UART to the host, 115,200 baud: `palpate link /dev/ttyUSB0` |
//! | GP25 | the Pico's LED: lit from a recognition to the next touch |
//!
//! The host may load another model (`palpate link /dev/ttyUSB0 --load model.palpate`), which is kept in flash.
//! For another probe than the model's: its measures in [`PROBE`] and [`MODEL_PROBE`].
#![no_std]
#![no_main]

mod flash;
#[cfg_attr(feature = "dma", path = "dma.rs")]
#[cfg_attr(not(feature = "dma"), path = "fifo.rs")]
mod line;
mod shared;

use core::convert::Infallible;
use embedded_hal::digital::OutputPin;
use hal::uart::{DataBits, StopBits, UartConfig, UartPeripheral};
use hal::{Clock as _, Timer, fugit::RateExtU32, pac};
use line::Sender;
use palpate_onboard::effector::{Geometry, Scale, Sensed};
use palpate_onboard::station::{Board, FlashStorage, Happened, ProbeSettings, ProbeStation};
use panic_halt as _;
use rp2040_hal as hal;

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Name of the program on the link.
const PROGRAM: &str = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
/// Objects that the model may have.
const OBJECTS: usize = 16;
/// The crystal on a Pico.
const CRYSTAL_HZ: u32 = 12_000_000;

/// The probe that the model was trained for, for an object 100 mm long (10 units): in micrometres, and per second.
const MODEL_PROBE: Geometry = Geometry { spacing: 15_000, speed: 100_000 };
/// The probe that is there; its speed can be measured with [`palpate_onboard::effector::Calibration`].
const PROBE: Geometry = MODEL_PROBE;

/// The second-stage boot loader, which the chip's ROM looks for at the start of the flash.
#[allow(unsafe_code)] // A linker section is how it gets there.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

/// The parts that remain with the main loop.
struct Pico(Sender);

impl Board for Pico {
    type Error = Infallible;

    fn sense(&mut self) -> Sensed {
        shared::sense()
    }

    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(shared::receive(buffer))
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), Infallible> {
        self.0.send(frame);
        Ok(())
    }

    fn is_over(&mut self) -> bool {
        shared::is_over()
    }
}

#[hal::entry]
fn main() -> ! {
    let _ = run();
    // The chip or the model is not as expected: stand still.
    loop {
        cortex_m::asm::wfi();
    }
}

fn run() -> Option<Infallible> {
    let mut pac = pac::Peripherals::take()?;
    let mut watchdog = hal::Watchdog::new(pac.WATCHDOG);
    let resets = &mut pac.RESETS;
    // Another number after each start: the ring oscillator's noise.
    let noise = hal::rosc::RingOscillator::new(pac.ROSC).initialize();
    let boot = (0..32).fold(0, |bits, _| bits << 1 | u32::from(noise.get_random_bit()));
    let (system, usb) = (pac.PLL_SYS, pac.PLL_USB);
    let clocks =
        hal::clocks::init_clocks_and_plls(CRYSTAL_HZ, pac.XOSC, pac.CLOCKS, system, usb, resets, &mut watchdog).ok()?;
    let sio = hal::Sio::new(pac.SIO);
    let pins = hal::gpio::Pins::new(pac.IO_BANK0, pac.PADS_BANK0, sio.gpio_bank0, resets);
    let mut timer = Timer::new(pac.TIMER, resets, &clocks);
    let config = UartConfig::new(115_200.Hz(), DataBits::Eight, None, StopBits::One);
    let wires = (pins.gpio0.reconfigure(), pins.gpio1.reconfigure());
    let uart = UartPeripheral::new(pac.UART0, wires, resets).enable(config, clocks.peripheral_clock.freq()).ok()?;
    let mut led = pins.gpio25.into_push_pull_output();

    let storage = FlashStorage::new(flash::Flash::take()?).ok()?;
    let settings =
        ProbeSettings { scale: Scale::new(MODEL_PROBE, PROBE)?, boot, program: PROGRAM, ..ProbeSettings::default() };
    let mut station = ProbeStation::<OBJECTS, _>::open(MODEL, storage, settings);
    let switches = (pins.gpio2.reconfigure(), pins.gpio3.reconfigure(), pins.gpio4.reconfigure());
    let (line, sender) = line::open(uart, pac.DMA, resets);
    shared::start(switches, pins.gpio5.reconfigure(), line, timer.alarm_0()?, timer);
    let mut pico = Pico(sender);
    loop {
        let Ok(happened) = station.step(&mut pico);
        match happened {
            None => shared::sleep(|now| station.wait(now)),
            Some(touched @ Happened::Touched { .. }) => led.set_state(touched.recognized().is_some().into()).ok()?,
            Some(_) => {}
        }
    }
}
