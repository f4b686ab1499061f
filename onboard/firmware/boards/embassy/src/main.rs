//! Palpate on a Raspberry Pi Pico with embassy: asleep until a switch moves, a byte comes or something is due.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_futures::select::select4;
use embassy_rp::gpio::{Input, Pull};
use embassy_rp::peripherals::UART0;
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart, Config, Error};
use embassy_rp::{bind_interrupts, clocks::RoscRng};
use embassy_time::Instant;
use embedded_io_async::BufRead;
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

/// The switches and the link.
struct Pico {
    watcher: Watcher<Input<'static>, Input<'static>, Input<'static>>,
    /// GP5, low while no approach is under way: from the robot's controller, or a button to ground.
    over: Input<'static>,
    /// That signal as the station has last seen it.
    was_over: bool,
    uart: BufferedUart,
    /// Bytes from the host that the station has not taken yet.
    received: [u8; 32],
    count: usize,
}

impl Board for Pico {
    type Error = Error;

    fn sense(&mut self) -> Sensed {
        self.watcher.sense(&Micros)
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
    async fn sleep(&mut self, wait: u32) -> Result<(), Error> {
        let Self { watcher, over, was_over, uart, received, count } = self;
        // Levels and not edges: one that changed while nobody waited wakes at once.
        let [a, b, c] = watcher.is_high();
        let (first, middle, last) = watcher.pins();
        let moved = select4(turn(first, a), turn(middle, b), turn(last, c), turn(over, !*was_over));
        if let Some(bytes) = palpate_embassy::sleep(moved, uart.fill_buf(), wait).await {
            let bytes = bytes?;
            *count = bytes.len().min(received.len());
            received.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
            uart.consume(*count);
        }
        watcher.interrupt(&Micros);
        Ok(())
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
    let (first, middle) = (Input::new(chip.PIN_2, Pull::Up), Input::new(chip.PIN_3, Pull::Up));
    let last = Input::new(chip.PIN_4, Pull::Up);
    let watcher = Watcher::start(Fingers::new(first, middle, last, Active::Low), &Micros);
    let over = Input::new(chip.PIN_5, Pull::Up);
    let mut pico = Pico { watcher, over, was_over: false, uart, received: [0; 32], count: 0 };
    let settings = ProbeSettings { boot: RoscRng.next_u32(), program: PROGRAM, ..ProbeSettings::default() };
    let Ok(mut station) = ProbeStation::<OBJECTS>::open(MODEL, NoStorage, settings) else { return };
    loop {
        // What could not be sent the host asks for again.
        let happened = station.step(&mut pico).unwrap_or_else(|failed| failed.happened);
        if happened.is_none() {
            let wait = station.wait(Micros.micros());
            // What was garbled on the line is missing, and the host sends it again.
            let _ = pico.sleep(wait).await;
        }
    }
}
