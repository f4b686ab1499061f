//! Palpate on a Raspberry Pi Pico with embassy: asleep until a switch moves, a byte comes or something is due.
#![no_std]
#![no_main]

use core::cell::RefCell;
use core::convert::Infallible;
use critical_section::Mutex;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_futures::select::{select, select3};
use embassy_rp::gpio::{Input, Pull};
use embassy_rp::interrupt;
use embassy_rp::interrupt::{InterruptExt, Priority};
use embassy_rp::peripherals::UART0;
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart, Config, Error};
use embassy_rp::{bind_interrupts, clocks::RoscRng, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use embedded_hal::digital::{ErrorType, InputPin};
use embedded_io_async::Read;
use palpate_onboard::effector::{Active, Clock, Fingers, Sensed, Watcher};
use palpate_onboard::station::{Board, NoStorage, ProbeSettings, ProbeStation};
use panic_halt as _;

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Name of the program on the link.
const PROGRAM: &str = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
/// Objects that the model may have.
const OBJECTS: usize = 16;

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
});

/// The chip's microsecond timer.
struct Micros;

impl Clock for Micros {
    fn micros(&self) -> u32 {
        Instant::now().as_micros() as u32
    }
}

/// The level of a pin, whose edges a task waits for.
struct Level(u8);

impl ErrorType for Level {
    type Error = Infallible;
}

impl InputPin for Level {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(pac::SIO.gpio_in(0).read() >> self.0 & 1 == 1)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|is_high| !is_high)
    }
}

/// The switches, which an interrupt watches while the main task recognizes, sends or sleeps.
static SWITCHES: Mutex<RefCell<Option<Watcher<Level, Level, Level>>>> = Mutex::new(RefCell::new(None));
/// One of them has moved.
static MOVED: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// The executor in that interrupt.
static ABOVE: InterruptExecutor = InterruptExecutor::new();

fn with<T>(act: impl FnOnce(&mut Watcher<Level, Level, Level>) -> T) -> Option<T> {
    critical_section::with(|cs| SWITCHES.borrow_ref_mut(cs).as_mut().map(act))
}

#[allow(unsafe_code)] // An interrupt that nothing else uses, enabled by the executor's start.
#[interrupt]
unsafe fn SWI_IRQ_1() {
    // SAFETY: as above.
    unsafe { ABOVE.on_interrupt() }
}

/// Notes the time of each edge.
#[embassy_executor::task]
async fn watch(mut pins: [Input<'static>; 3]) {
    loop {
        let [first, middle, last] = &mut pins;
        // Levels and not edges: one that changes after this look wakes at once.
        let [a, b, c] = [&*first, &*middle, &*last].map(Input::is_high);
        let _ = with(|watcher| watcher.interrupt(&Micros));
        MOVED.signal(());
        select3(turn(first, a), turn(middle, b), turn(last, c)).await;
    }
}

/// The signal between approaches, and the link.
struct Pico {
    /// GP5, low while no approach is under way: from the robot's controller, or a button to ground.
    over: Input<'static>,
    /// Last state of that signal that the station has seen.
    was_over: bool,
    uart: BufferedUart,
    /// Bytes from the host that the station has not taken yet.
    received: [u8; 32],
    count: usize,
}

impl Board for Pico {
    type Error = Error;

    fn sense(&mut self) -> Sensed {
        with(|watcher| watcher.sense(&Micros)).unwrap_or(Sensed::Nothing(0))
    }

    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let count = core::mem::take(&mut self.count).min(buffer.len());
        buffer.iter_mut().zip(self.received).take(count).for_each(|(to, from)| *to = from);
        Ok(count)
    }

    fn send(&mut self, mut frame: &[u8]) -> Result<(), Error> {
        while !frame.is_empty() {
            let sent = self.uart.blocking_write(frame)?;
            frame = frame.get(sent..).unwrap_or_default();
        }
        Ok(())
    }

    fn is_over(&mut self) -> bool {
        self.was_over = self.over.is_low();
        self.was_over
    }
}

impl Pico {
    /// Sleeps until a switch moves, the signal changes, a byte comes, or `wait` microseconds are over.
    async fn sleep(&mut self, wait: u32) {
        let Self { over, was_over, uart, received, count } = self;
        // A level and not an edge: one that changed while nobody waited wakes at once.
        let moved = select(MOVED.wait(), turn(over, !*was_over));
        // A garbled byte is an error, and missing: the host sends it again. After one the driver receives nothing more until
        // `read` is called, or `consume` after `fill_buf`.
        if let Some(read) = palpate_embassy::sleep(moved, uart.read(received), wait).await {
            *count = read.unwrap_or(0);
        }
    }
}

async fn turn(pin: &mut Input<'static>, is_high: bool) {
    if is_high { pin.wait_for_low().await } else { pin.wait_for_high().await }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let Some(send) = cortex_m::singleton!(: [u8; 256] = [0; 256]) else { return };
    // All that a host sends without an answer fits: 8 commands and a question.
    let Some(receive) = cortex_m::singleton!(: [u8; 2048] = [0; 2048]) else { return };
    let uart = BufferedUart::new(chip.UART0, chip.PIN_0, chip.PIN_1, Interrupts, send, receive, Config::default());
    let fingers = Fingers::new(Level(2), Level(3), Level(4), Active::Low);
    let pins = [Input::new(chip.PIN_2, Pull::Up), Input::new(chip.PIN_3, Pull::Up), Input::new(chip.PIN_4, Pull::Up)];
    let over = Input::new(chip.PIN_5, Pull::Up);
    critical_section::with(|cs| SWITCHES.replace(cs, Some(Watcher::start(fingers, &Micros))));
    interrupt::SWI_IRQ_1.set_priority(Priority::P1);
    let Ok(watch) = watch(pins) else { return };
    ABOVE.start(interrupt::SWI_IRQ_1).spawn(watch);
    let mut pico = Pico { over, was_over: false, uart, received: [0; 32], count: 0 };
    let settings = ProbeSettings { boot: RoscRng.next_u32(), program: PROGRAM, ..ProbeSettings::default() };
    let mut station = ProbeStation::<OBJECTS>::open(MODEL, NoStorage, settings);
    loop {
        // What could not be sent the host asks for again.
        let happened = station.step(&mut pico).unwrap_or_else(|failed| failed.happened);
        if happened.is_none() {
            pico.sleep(station.wait(Micros.micros())).await;
        }
    }
}
