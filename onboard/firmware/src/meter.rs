//! Counts instructions and stack.
//!
//! QEMU with `-icount shift=0` lets one instruction take one virtual nanosecond, so SysTick at 25 MHz ticks once in 40
//! instructions: a repeatable count. [`Meter::measure`] repeats what it measures until a tick is worth less than one
//! instruction, and takes off its own loop, which it measures in the same way.
//!
//! ```ignore
//! let mut meter = Meter::new(cortex_m::Peripherals::take().unwrap().SYST);
//! let instructions = meter.measure(|| model.margins(&touch, &mut margins));
//! let bytes = meter::stack(|| model.margins(&touch, &mut margins));
//! ```

use crate::chip;
use core::hint::black_box;
use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// Instructions that pass in one tick of SysTick.
const PER_TICK: u64 = 40;
/// SysTick counts down from here.
const RELOAD: u32 = 0x00ff_ffff;
/// Ticks that one measurement should take at least.
const LONG_ENOUGH: u64 = 40_000;

/// An instruction counter made of SysTick.
pub struct Meter {
    timer: SYST,
    loop_ticks_per_million: u64,
}

impl Meter {
    /// Starts SysTick, measures what measuring costs, and checks itself on loops of known length.
    ///
    /// # Panics
    /// If a thousand instructions do not count as a thousand: the emulator runs without `-icount shift=0`.
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut meter = Self { timer, loop_ticks_per_million: 0 };
        meter.loop_ticks_per_million = meter.ticks(1_000_000, &mut || black_box(()));
        // A loop of two instructions.
        let [short, long] = [500, 1_000].map(|n| meter.measure(|| cortex_m::asm::delay(n)));
        assert!(long - short == 1_000, "1000 instructions count as {}: is -icount shift=0 set?", long - short);
        meter
    }

    /// Instructions that one call of `f` takes, its result included, the call itself not. Right to one instruction.
    ///
    /// `f` runs often (until 1.6 million instructions have passed), so let it leave things as it found them. Whatever
    /// could be computed once for all calls should go through [`black_box`].
    ///
    /// # Panics
    /// If one call takes longer than SysTick counts: 670 million instructions.
    pub fn measure<T>(&mut self, mut f: impl FnMut() -> T) -> u64 {
        let mut once = || {
            black_box(f());
        };
        let first = self.ticks(1, &mut once).max(1);
        let repeats = (LONG_ENOUGH / first + 1) as u32;
        let ticks = self.ticks(repeats, &mut once);
        let millionths = (ticks * 1_000_000).saturating_sub(self.loop_ticks_per_million * u64::from(repeats));
        let instructions = millionths * PER_TICK / u64::from(repeats);
        (instructions + 500_000) / 1_000_000
    }

    /// The result of `f`, which runs once, and its instructions, to about a hundred: for what cannot be repeated.
    ///
    /// # Panics
    /// Like [`Meter::measure`].
    pub fn once<T>(&mut self, f: impl FnOnce() -> T) -> (Option<T>, u64) {
        let (mut f, mut result) = (Some(f), None);
        let ticks = self.ticks(1, &mut || result = f.take().map(|f| f()));
        (result, ticks * PER_TICK)
    }

    /// Instructions that `f` takes for one of `items`, on average over all of them.
    ///
    /// # Panics
    /// Like [`Meter::measure`], for all items together, or when there is no item.
    pub fn mean<I, T>(&mut self, items: &[I], mut f: impl FnMut(&I) -> T) -> u64 {
        assert!(!items.is_empty(), "no items to measure with");
        let all = self.measure(|| {
            for item in items {
                black_box(f(black_box(item)));
            }
        });
        let walk = self.measure(|| {
            for item in items {
                black_box(black_box(item));
            }
        });
        let count = items.len() as u64;
        (all.saturating_sub(walk) + count / 2) / count
    }

    /// Ticks that `repeats` calls take. The dynamic call keeps the loop the same for any function.
    #[inline(never)]
    fn ticks(&mut self, repeats: u32, f: &mut dyn FnMut()) -> u64 {
        self.timer.clear_current();
        // Reading the control register clears the flag that says that the counter has wrapped.
        self.timer.has_wrapped();
        let start = SYST::get_current();
        for _ in 0..repeats {
            f();
        }
        let end = SYST::get_current();
        assert!(!self.timer.has_wrapped(), "one call takes too long for SysTick");
        u64::from(start.wrapping_sub(end) & RELOAD)
    }
}

/// Bytes of stack that one call of `f` takes, the frames of this function's callers not included: everything below is
/// painted, `f` runs, and the paint that is left is counted. Right to four bytes.
pub fn stack<T>(f: impl FnOnce() -> T) -> usize {
    let empty = painted(|| ());
    painted(f).saturating_sub(empty)
}

#[inline(never)]
fn painted<T>(f: impl FnOnce() -> T) -> usize {
    let area = chip::paint_stack();
    call(f);
    chip::used_stack(area)
}

#[inline(never)]
fn call<T>(f: impl FnOnce() -> T) {
    black_box(f());
}
