//! Palpate on a Raspberry Pi Pico.
//!
//! | pin | what |
//! |---|---|
//! | GP2, GP3, GP4 | the three switches in their order along the row, each to ground |
//! | GP0, GP1 | UART to the host, 115,200 baud: `palpate watch /dev/ttyUSB0` |
//! | GP25 | the Pico's LED: lit from a recognition to the next touch |
//!
//! Another model: `PALPATE_MODEL=/path/to/model.palpate cargo run --release`. For another probe than the model's: its measures
//! in [`PROBE`] and [`MODEL_PROBE`].
#![no_std]
#![no_main]

use core::cell::RefCell;
use critical_section::Mutex;
use embedded_hal::digital::{OutputPin, StatefulOutputPin};
use embedded_io::Write;
use hal::gpio::bank0::{Gpio2, Gpio3, Gpio4};
use hal::gpio::{FunctionSioInput, Interrupt, Pin, PullUp};
use hal::pac::{self, interrupt};
use hal::uart::{DataBits, StopBits, UartConfig, UartPeripheral};
use hal::{Clock as _, Timer, fugit::RateExtU32};
use heapless::spsc::{Producer, Queue};
use palpate_onboard::Model;
use palpate_onboard::effector::{
    Active, Clock, Edge, Effector, Fault, Fingers, Geometry, Scale, Settings, Watcher, drain,
};
use palpate_onboard::station::Station;
use palpate_shared::link::{Decision, Device, DeviceEnd, Event, Progress, TouchMessage};
use panic_halt as _;
use rp2040_hal as hal;

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Objects that the model may have.
const OBJECTS: usize = 16;
/// The crystal on a Pico.
const CRYSTAL_HZ: u32 = 12_000_000;

/// The probe that the model was trained for, for an object 100 mm long (10 units): in micrometres, and a second.
const MODEL_PROBE: Geometry = Geometry { spacing: 15_000, speed: 100_000 };
/// The probe that is there; its speed can be measured with [`palpate_onboard::effector::Calibration`].
const PROBE: Geometry = MODEL_PROBE;

/// The second-stage boot loader, which the chip's ROM looks for at the start of the flash.
#[allow(unsafe_code)] // A linker section is how it gets there.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

/// A switch to ground.
type Switch<G> = Pin<G, FunctionSioInput, PullUp>;

/// The chip's microsecond timer.
#[derive(Clone, Copy)]
struct Micros(Timer);

impl Clock for Micros {
    fn micros(&self) -> u32 {
        self.0.get_counter_low()
    }
}

/// What the pin interrupt needs.
struct Interrupted {
    watcher: Watcher<Switch<Gpio2>, Switch<Gpio3>, Switch<Gpio4>>,
    edges: Producer<'static, Edge>,
    clock: Micros,
}

static INTERRUPTED: Mutex<RefCell<Option<Interrupted>>> = Mutex::new(RefCell::new(None));

#[hal::entry]
fn main() -> ! {
    match run() {
        Some(never) => match never {},
        // The chip is not as expected: stand still.
        None => loop {
            cortex_m::asm::wfi();
        },
    }
}

fn run() -> Option<core::convert::Infallible> {
    let mut pac = pac::Peripherals::take()?;
    let mut watchdog = hal::Watchdog::new(pac.WATCHDOG);
    let resets = &mut pac.RESETS;
    // Another number after each start: the ring oscillator's noise.
    let noise = hal::rosc::RingOscillator::new(pac.ROSC).initialize();
    let boot = (0..32).fold(0, |bits, _| bits << 1 | u32::from(noise.get_random_bit()));
    let clocks = hal::clocks::init_clocks_and_plls(
        CRYSTAL_HZ,
        pac.XOSC,
        pac.CLOCKS,
        pac.PLL_SYS,
        pac.PLL_USB,
        resets,
        &mut watchdog,
    )
    .ok()?;
    let sio = hal::Sio::new(pac.SIO);
    let pins = hal::gpio::Pins::new(pac.IO_BANK0, pac.PADS_BANK0, sio.gpio_bank0, resets);
    let clock = Micros(Timer::new(pac.TIMER, resets, &clocks));
    let config = UartConfig::new(115_200.Hz(), DataBits::Eight, None, StopBits::One);
    let wires = (pins.gpio0.into_function(), pins.gpio1.into_function());
    let uart = UartPeripheral::new(pac.UART0, wires, resets);
    let mut uart = uart.enable(config, clocks.peripheral_clock.freq()).ok()?;
    let mut led = pins.gpio25.into_push_pull_output();

    let Ok(model) = Model::new(MODEL) else {
        loop {
            led.toggle().ok()?;
            cortex_m::asm::delay(CRYSTAL_HZ);
        }
    };
    let scale = Scale::new(MODEL_PROBE, PROBE)?;
    let mut station = Station::<OBJECTS>::new(&model);
    let mut end = DeviceEnd::new(Progress::NONE, boot);
    let mut effector = Effector::new(Settings::default().for_model(&model, &scale));

    let queue = cortex_m::singleton!(: Queue<Edge, 64> = Queue::new())?;
    let (mut edges, mut received) = queue.split();
    let switches: (Switch<Gpio2>, Switch<Gpio3>, Switch<Gpio4>) =
        (pins.gpio2.reconfigure(), pins.gpio3.reconfigure(), pins.gpio4.reconfigure());
    for kind in [Interrupt::EdgeLow, Interrupt::EdgeHigh] {
        switches.0.set_interrupt_enabled(kind, true);
        switches.1.set_interrupt_enabled(kind, true);
        switches.2.set_interrupt_enabled(kind, true);
    }
    let fingers = Fingers::new(switches.0, switches.1, switches.2, Active::Low);
    let watcher = Watcher::start(fingers, &clock, &mut edges);
    let interrupted = Interrupted { watcher, edges, clock };
    critical_section::with(|cs| INTERRUPTED.replace(cs, Some(interrupted)));
    unmask_pins();
    end.tell(Event::Started, |frame| send(&mut uart, frame));

    // Not asleep between interrupts, because the UART's FIFO holds no more than 2.8 ms.
    loop {
        let mut buffer = [0; 32];
        if let Ok(count) = uart.read_raw(&mut buffer) {
            let bytes = buffer.get(..count).unwrap_or_default();
            end.receive(bytes, &mut station, |frame| send(&mut uart, frame));
        }
        while let Some(fault) = pin_fault() {
            effector.report(fault);
        }
        let event = match drain(&mut effector, &mut received, &clock) {
            Ok(Some(touch)) => {
                let touch = scale.apply(&touch);
                Some(match station.push(&touch, true) {
                    Ok(verdict) => {
                        let recognized = matches!(verdict.decision, Decision::Recognized(_));
                        // The LED's pin cannot fail.
                        let _ = led.set_state(recognized.into());
                        if verdict.decision != Decision::Undecided {
                            station.reset();
                        }
                        Event::Touch { touch: TouchMessage::from(&touch), verdict }
                    }
                    Err(refusal) => Event::Refused { touch: TouchMessage::from(&touch), refusal },
                })
            }
            Ok(None) => None,
            Err(fault) => Some(fault.into()),
        };
        if let Some(event) = event {
            end.tell(event, |frame| send(&mut uart, frame));
        }
    }
}

fn send(uart: &mut impl Write, frame: &[u8]) {
    // A UART takes every byte.
    let _ = uart.write_all(frame);
}

#[allow(unsafe_code)]
fn unmask_pins() {
    // SAFETY: no critical section of this program is made by masking this interrupt.
    unsafe { pac::NVIC::unmask(pac::Interrupt::IO_IRQ_BANK0) };
}

/// A pin that cannot be read; edges that did not fit into the queue are offered again.
fn pin_fault() -> Option<Fault> {
    critical_section::with(|cs| {
        let mut interrupted = INTERRUPTED.borrow_ref_mut(cs);
        let Interrupted { watcher, edges, clock } = interrupted.as_mut()?;
        watcher.service(clock, edges)
    })
}

/// One of the switches has opened or closed.
#[interrupt]
fn IO_IRQ_BANK0() {
    critical_section::with(|cs| {
        let mut interrupted = INTERRUPTED.borrow_ref_mut(cs);
        let Some(Interrupted { watcher, edges, clock }) = interrupted.as_mut() else { return };
        // First the cause, then the levels: an edge in between comes back as an interrupt.
        let (first, middle, last) = watcher.pins();
        for kind in [Interrupt::EdgeLow, Interrupt::EdgeHigh] {
            first.clear_interrupt(kind);
            middle.clear_interrupt(kind);
            last.clear_interrupt(kind);
        }
        watcher.interrupt(clock, edges);
    });
}
