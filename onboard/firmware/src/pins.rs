//! Three pins that a host plays, and the clock that goes with them: QEMU's mps2 machines have GPIO ports that nothing
//! can drive from outside, so a port register and its interrupt are emulated here, and all after them is what runs on a
//! board.
//!
//! The host sends six bytes for each edge over the second UART: finger (0, 1, 2), level (0, 1), time in microseconds (u32,
//! little endian). The time counts as the clock's, the level is put into the port register, and the pin interrupt is
//! pended, as a port does. Finger 3 is not an edge: time passes. Nor is finger 4: the power goes, and comes back. Finger 5
//! is the signal that no approach is under way.

use crate::chip::{self, PIN_CHANGED, SWITCHES};
use crate::uart::{Port, Uart};
use core::cell::RefCell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::{NVIC, SCB};
use critical_section::Mutex;
use embedded_hal::digital::{ErrorType, InputPin};
use palpate_onboard::effector::{Active, Clock, Fingers, Sensed, Watcher};

/// Microseconds.
static TIME: AtomicU32 = AtomicU32::new(0);
/// True while the pin interrupt still has to look at an edge.
static EDGE: AtomicBool = AtomicBool::new(false);
/// The pin of the signal that no approach is under way.
const OVER: u8 = 5;
/// True once that signal has changed, until the main loop has looked.
static SIGNALED: AtomicBool = AtomicBool::new(false);
/// Signal that no approach is under way, as the main loop last saw it.
static SEEN_OVER: AtomicBool = AtomicBool::new(false);
/// Time at which the main loop last found that nothing more had happened.
static SEEN: AtomicU32 = AtomicU32::new(u32::MAX);

/// A pin of the emulated port.
struct Pin(u8);

impl ErrorType for Pin {
    type Error = Infallible;
}

impl InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(SWITCHES.load(Ordering::Relaxed) >> (self.0 & 31) & 1 == 1)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

/// The clock that the host plays.
struct PlayedClock;

impl Clock for PlayedClock {
    fn micros(&self) -> u32 {
        TIME.load(Ordering::Relaxed)
    }
}

static WATCHER: Mutex<RefCell<Option<Watcher<Pin, Pin, Pin>>>> = Mutex::new(RefCell::new(None));

/// Begins to watch the pins.
pub fn watch() {
    let fingers = Fingers::new(Pin(0), Pin(1), Pin(2), Active::High);
    critical_section::with(|cs| WATCHER.replace(cs, Some(Watcher::start(fingers, &PlayedClock))));
    chip::unmask(PIN_CHANGED);
}

/// The pin interrupt.
pub fn changed() {
    with(|watcher| watcher.interrupt(&PlayedClock));
    EDGE.store(false, Ordering::Relaxed);
}

/// Returns the messages of the pins to the main loop.
pub fn sense() -> Sensed {
    let sensed = with(|watcher| watcher.sense(&PlayedClock)).unwrap_or(Sensed::Nothing(0));
    if let Sensed::Nothing(now) = sensed {
        SEEN.store(now, Ordering::Relaxed);
    }
    sensed
}

/// True while no approach is under way, as a robot's controller would say.
///
/// On a board hardly any time passes between [`sense`] and this. Here the played time may have jumped in between; a signal
/// that came with the jump waits for the next pass, which knows its time.
pub fn is_over() -> bool {
    critical_section::with(|_| {
        if SEEN.load(Ordering::Relaxed) == TIME.load(Ordering::Relaxed) {
            SEEN_OVER.store(SWITCHES.load(Ordering::Relaxed) >> OVER & 1 == 1, Ordering::Relaxed);
            SIGNALED.store(false, Ordering::Relaxed);
        }
        SEEN_OVER.load(Ordering::Relaxed)
    })
}

/// True if the pins have no message.
pub fn is_idle() -> bool {
    !SIGNALED.load(Ordering::Relaxed) && with(|watcher| watcher.is_idle()).unwrap_or(true)
}

fn with<T>(act: impl FnOnce(&mut Watcher<Pin, Pin, Pin>) -> T) -> Option<T> {
    critical_section::with(|cs| WATCHER.borrow_ref_mut(cs).as_mut().map(act))
}

/// The host's hand on the pins, which moves in a timer's interrupt: at any instruction of the main loop, and of the pin
/// interrupt, which it may interrupt.
struct Player {
    uart: Uart,
    received: [u8; 6],
    count: usize,
    /// Time has passed, and goes on when the main loop has seen it: no board's approach is faster than its main loop.
    passes: bool,
    random: u32,
}

static PLAYER: Mutex<RefCell<Option<Player>>> = Mutex::new(RefCell::new(None));

/// Begins to play.
pub fn play() {
    let player = Player { uart: Uart::take(Port::Pins), received: [0; 6], count: 0, passes: true, random: 1 };
    critical_section::with(|cs| PLAYER.replace(cs, Some(player)));
    chip::yield_to_others(PIN_CHANGED);
    chip::unmask(chip::TIMER);
    chip::set_timer(1_000);
}

/// The timer's interrupt: one edge.
pub fn tick() {
    // The pin interrupt comes soon after an edge; edges are further apart than that, also where the emulator is halted on
    // the way and this timer runs on. And a main loop that has fallen behind catches up between touches. The signal lasts
    // longer than any pass through the main loop, so it does not change again before the main loop has looked.
    let unseen = EDGE.load(Ordering::Relaxed) || SIGNALED.load(Ordering::Relaxed);
    let busy = unseen || with(|watcher| watcher.waiting() > 32).unwrap_or(true);
    let wait = critical_section::with(|cs| {
        let mut player = PLAYER.borrow_ref_mut(cs);
        let player = player.as_mut()?;
        if !busy {
            player.play();
        }
        // Xorshift: any number of cycles up to the length of a pass through the main loop.
        player.random ^= player.random << 13;
        player.random ^= player.random >> 17;
        player.random ^= player.random << 5;
        Some(50 + player.random % 4_096)
    });
    if let Some(cycles) = wait {
        chip::set_timer(cycles);
    }
}

impl Player {
    /// Plays one edge, if one has come.
    fn play(&mut self) {
        if self.passes && SEEN.load(Ordering::Relaxed) != TIME.load(Ordering::Relaxed) {
            return;
        }
        self.passes = false;
        while let Some(slot) = self.received.get_mut(self.count) {
            let Some(byte) = self.uart.receive() else { return };
            *slot = byte;
            self.count += 1;
        }
        let [finger, level, t0, t1, t2, t3] = self.received;
        // Some way into what the main loop makes of that time.
        if finger == 4 && self.random.is_multiple_of(16) {
            SCB::sys_reset();
        } else if finger == 4 {
            return;
        }
        self.count = 0;
        self.passes = finger == 3;
        TIME.store(u32::from_le_bytes([t0, t1, t2, t3]), Ordering::Relaxed);
        if finger < 3 || finger == OVER {
            let levels = SWITCHES.load(Ordering::Relaxed) & !(1 << finger);
            SWITCHES.store(levels | u32::from(level & 1) << finger, Ordering::Relaxed);
            if finger == OVER {
                SIGNALED.store(true, Ordering::Relaxed);
            }
            EDGE.store(true, Ordering::Relaxed);
            NVIC::pend(PIN_CHANGED);
        }
    }
}
