//! State that interrupts and the main loop share: the switches, the line to the host, the alarm that wakes.

use crate::line::{self, Line};
use core::cell::RefCell;
use critical_section::{CriticalSection, Mutex};
use embedded_hal::digital::InputPin;
use hal::Timer;
use hal::fugit::ExtU32;
use hal::gpio::bank0::{Gpio0, Gpio1, Gpio2, Gpio3, Gpio4, Gpio5};
use hal::gpio::{FunctionSioInput, FunctionUart, Interrupt, Pin, PullDown, PullUp};
use hal::pac::{self, UART0, interrupt};
use hal::timer::{Alarm, Alarm0};
use hal::uart::{Enabled, UartPeripheral};
use palpate_onboard::effector::{Active, Clock, Fingers, Sensed, Watcher};
use rp2040_hal as hal;

/// A switch to ground.
type Switch<G> = Pin<G, FunctionSioInput, PullUp>;
/// The three switches.
pub(crate) type Switches = (Switch<Gpio2>, Switch<Gpio3>, Switch<Gpio4>);
/// The signal that no approach is under way, to ground: from the robot's controller, or a button.
pub(crate) type Over = Switch<Gpio5>;
/// The link's wires.
pub(crate) type Wires = (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>);

/// The UART on them.
pub(crate) type Uart = UartPeripheral<Enabled, UART0, Wires>;

/// Bytes that may wait for the main loop: more than a host sends without an answer, the longest request and its repetitions.
pub(crate) const WAITING: usize = 2048;

/// The chip's microsecond timer.
#[derive(Clone, Copy)]
struct Micros(Timer);

impl Clock for Micros {
    fn micros(&self) -> u32 {
        self.0.get_counter_low()
    }
}

pub(crate) struct Shared {
    watcher: Watcher<Switch<Gpio2>, Switch<Gpio3>, Switch<Gpio4>>,
    over: Over,
    /// The signal as the main loop has last seen it.
    was_over: bool,
    clock: Micros,
    pub line: Line,
    alarm: Alarm0,
}

static SHARED: Mutex<RefCell<Option<Shared>>> = Mutex::new(RefCell::new(None));

/// Does something with what is shared, with interrupts held back.
pub(crate) fn with<T>(act: impl FnOnce(&mut Shared) -> T) -> Option<T> {
    critical_section::with(|cs| within(cs, act))
}

fn within<T>(cs: CriticalSection<'_>, act: impl FnOnce(&mut Shared) -> T) -> Option<T> {
    SHARED.borrow_ref_mut(cs).as_mut().map(act)
}

/// Begins to watch and to listen.
#[allow(unsafe_code)]
pub(crate) fn start(switches: Switches, over: Over, line: Line, mut alarm: Alarm0, timer: Timer) {
    for kind in [Interrupt::EdgeLow, Interrupt::EdgeHigh] {
        over.set_interrupt_enabled(kind, true);
        switches.0.set_interrupt_enabled(kind, true);
        switches.1.set_interrupt_enabled(kind, true);
        switches.2.set_interrupt_enabled(kind, true);
    }
    alarm.enable_interrupt();
    let clock = Micros(timer);
    let fingers = Fingers::new(switches.0, switches.1, switches.2, Active::Low);
    let watcher = Watcher::start(fingers, &clock);
    let shared = Shared { watcher, over, was_over: false, clock, line, alarm };
    critical_section::with(|cs| SHARED.replace(cs, Some(shared)));
    for interrupt in [pac::Interrupt::IO_IRQ_BANK0, line::INTERRUPT, pac::Interrupt::TIMER_IRQ_0] {
        // SAFETY: no critical section of this program is made by masking an interrupt.
        unsafe { pac::NVIC::unmask(interrupt) };
    }
}

/// Returns the messages of the switches.
pub(crate) fn sense() -> Sensed {
    with(|shared| shared.watcher.sense(&shared.clock)).unwrap_or(Sensed::Nothing(0))
}

/// True while the signal says that no approach is under way.
pub(crate) fn is_over() -> bool {
    with(|shared| {
        shared.was_over = shared.over.is_low().unwrap_or(false);
        shared.was_over
    })
    .unwrap_or(false)
}

/// Reads bytes that the UART has received; returns their number.
pub(crate) fn receive(buffer: &mut [u8]) -> usize {
    let mut count = 0;
    for slot in buffer {
        let Some(byte) = with(|shared| shared.line.pop()).flatten() else { break };
        *slot = byte;
        count += 1;
    }
    count
}

/// Does something with the flash, which nothing may read meanwhile. What the switches did is found afterwards, and not
/// taken for a contact time.
pub(crate) fn while_nobody_looks(act: impl FnOnce()) {
    critical_section::with(|cs| {
        act();
        within(cs, |shared| shared.watcher.interrupt_late(&shared.clock));
    });
}

/// Sleeps until an interrupt, or for as long as `wait` of [`ProbeStation`](palpate_onboard::station::ProbeStation) says.
pub(crate) fn sleep(wait: impl FnOnce(u32) -> u32) {
    critical_section::with(|cs| {
        let busy = within(cs, |shared| {
            // Never so soon that the alarm is missed.
            let now = shared.clock.micros();
            let wait = shared.line.longest_sleep(wait(now), now).max(20);
            let set = shared.alarm.schedule(wait.micros()).is_ok();
            let is_seen = shared.over.is_low().unwrap_or(false) == shared.was_over;
            !(set && is_seen && shared.watcher.is_idle() && shared.line.is_empty())
        });
        // With interrupts held back none can come between the look and the sleep; a pending one ends the sleep.
        if busy == Some(false) {
            cortex_m::asm::wfi();
        }
    });
}

/// One of the switches has opened or closed, or the signal has changed.
#[interrupt]
fn IO_IRQ_BANK0() {
    with(|shared| {
        // First the cause, then the levels: an edge in between comes back as an interrupt.
        let (first, middle, last) = shared.watcher.pins();
        for kind in [Interrupt::EdgeLow, Interrupt::EdgeHigh] {
            first.clear_interrupt(kind);
            middle.clear_interrupt(kind);
            last.clear_interrupt(kind);
            shared.over.clear_interrupt(kind);
        }
        shared.watcher.interrupt(&shared.clock);
        shared.line.edge(shared.clock.micros());
    });
}

/// It is time to wake.
#[interrupt]
fn TIMER_IRQ_0() {
    with(|shared| shared.alarm.clear_interrupt());
}
