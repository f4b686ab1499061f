//! The only place with `unsafe`: what the chip and the linker know and Rust does not.
#![allow(unsafe_code)]

use core::ptr::{addr_of, addr_of_mut, read_volatile, write_volatile};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use palpate_onboard::station::{Memory, RECORD_LENGTH};

// Symbols that cortex-m-rt's linker script defines; only their addresses mean anything.
unsafe extern "C" {
    static __vector_table: u32;
    static __etext: u32;
    static __srodata: u32;
    static __erodata: u32;
    static __sdata: u32;
    static __edata: u32;
    static __sbss: u32;
    static __ebss: u32;
    static __sheap: u32;
    // From memory.x.
    static mut _retained_start: u8;
    static _retained_end: u8;
}

/// The address of a linker symbol. Taking it reads nothing.
macro_rules! address {
    ($symbol:ident) => {
        addr_of!($symbol) as usize
    };
}

/// Bytes of (vector table and code, constants, initialized statics, zeroed statics).
pub(crate) fn section_sizes() -> [usize; 4] {
    [
        address!(__etext) - address!(__vector_table),
        address!(__erodata) - address!(__srodata),
        address!(__edata) - address!(__sdata),
        address!(__ebss) - address!(__sbss),
    ]
}

const PAINT: u32 = 0xdead_5afe;
/// Depth to which the stack is painted, in bytes.
const PAINTED: usize = 32 * 1024;
/// Left unpainted below the stack pointer for the painting itself.
const MARGIN: usize = 64;

/// The painted part of the stack.
#[derive(Clone, Copy)]
pub(crate) struct Painted {
    low: usize,
    high: usize,
}

/// Paints the unused stack below the caller, at most 32 KB of it.
#[inline(never)]
pub(crate) fn paint_stack() -> Painted {
    let high = (cortex_m::register::msp::read() as usize - MARGIN) & !3;
    let low = high.saturating_sub(PAINTED).max(address!(__sheap));
    for address in (low..high).step_by(4) {
        // SAFETY: from the end of the statics to below the stack pointer there is RAM that nobody uses: the images
        // have no heap, and an interrupt would only scrub off paint.
        unsafe { write_volatile(address as *mut u32, PAINT) };
    }
    Painted { low, high }
}

/// Bytes from the lowest address where the paint has gone to the top of the painted area.
#[inline(never)]
pub(crate) fn used_stack(area: Painted) -> usize {
    // SAFETY: the same words that `paint_stack` wrote.
    let scrubbed = (area.low..area.high).step_by(4).find(|&a| unsafe { read_volatile(a as *const u32) } != PAINT);
    area.high - scrubbed.unwrap_or(area.high)
}

/// The memory that keeps its content through a reset, once.
///
/// # Panics
/// The second time.
fn take_retained() -> &'static mut [u8] {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    // A load and a store, as thumbv6m has no swap; interrupts do not call this.
    assert!(!TAKEN.load(Ordering::Relaxed), "the retained memory is taken once");
    TAKEN.store(true, Ordering::Relaxed);
    let length = addr_of!(_retained_end) as usize - addr_of!(_retained_start) as usize;
    // SAFETY: memory.x sets this region aside, so nothing else lies in it, and it is handed out once. It is RAM, so
    // any content is valid bytes.
    unsafe { core::slice::from_raw_parts_mut(addr_of_mut!(_retained_start), length) }
}

/// The memory that keeps its content through a reset, once, with places for two models and two records.
///
/// # Panics
/// The second time.
pub fn take_memory() -> Memory<'static> {
    let retained = take_retained();
    let Some((first_record, rest)) = retained.split_first_chunk_mut::<RECORD_LENGTH>() else { crate::fail() };
    let Some((second_record, rest)) = rest.split_first_chunk_mut::<RECORD_LENGTH>() else { crate::fail() };
    // Aligned, as models are read fastest.
    let (first_model, second_model) = rest.split_at_mut(rest.len() / 8 * 4);
    Memory { models: [first_model, second_model], records: [first_record, second_record] }
}

/// Starts so far, from any number on. It outlasts a reset: nothing initializes it.
#[unsafe(link_section = ".uninit.starts")]
static STARTS: AtomicU32 = AtomicU32::new(0);

/// Another number after each start. Call it once.
pub fn count_start() -> u32 {
    // A load and a store, as thumbv6m has no sum in place.
    let starts = STARTS.load(Ordering::Relaxed).wrapping_add(1);
    STARTS.store(starts, Ordering::Relaxed);
    starts
}

/// The levels of three switches, a bit each. They outlast a reset, as switches do: nothing initializes them.
#[unsafe(link_section = ".uninit.switches")]
pub(crate) static SWITCHES: AtomicU32 = AtomicU32::new(0);

/// The emulated machines' external RAM, 16 MB of it, where QEMU's `-device loader,addr=0x21000000` puts what an image is
/// to work on. Only for images that run only there.
pub fn loaded() -> &'static [u8] {
    // SAFETY: both machines have RAM there, which memory.x does not mention, so nobody writes to it; RAM holds bytes.
    unsafe { core::slice::from_raw_parts(core::ptr::without_provenance(0x2100_0000), 16 << 20) }
}

/// An interrupt's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupt(u16);

/// The link's UART has received a byte.
pub const LINK_RECEIVED: Interrupt = Interrupt(0);
/// The UART over which a host plays the pins has received a byte.
pub const PINS_RECEIVED: Interrupt = Interrupt(2);
/// The first timer is at 0.
pub const TIMER: Interrupt = Interrupt(8);
/// A pin has changed: the first GPIO port's combined interrupt.
pub const PIN_CHANGED: Interrupt = Interrupt(6);

impl Interrupt {
    /// The interrupt with this number, as `DefaultHandler` gets it.
    pub const fn from_number(number: i16) -> Self {
        Self(number as u16)
    }
}

// SAFETY: the number is what the NVIC counts from 0, forevery number.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self.0
    }
}

/// Lets the timer interrupt once, after `cycles`.
pub(crate) fn set_timer(cycles: u32) {
    const BASE: usize = 0x4000_0000;
    let (control, value_now, reload, clear) = (0x0, 0x4, 0x8, 0xc);
    for (register, value) in [(control, 0), (clear, 1), (reload, cycles), (value_now, cycles), (control, 0b1001)] {
        // SAFETY: the machine's CMSDK timer has these registers, any value may be written, and it reaches no memory.
        unsafe { write_volatile((BASE + register) as *mut u32, value) };
    }
}

/// Lets this interrupt, and no other that was not given this, be interrupted by others.
pub(crate) fn yield_to_others(interrupt: Interrupt) {
    // SAFETY: no critical section of the images is made by priorities. Nobody else holds the NVIC.
    unsafe { cortex_m::Peripherals::steal().NVIC.set_priority(interrupt, 0xc0) };
}

/// Lets an interrupt come.
pub(crate) fn unmask(interrupt: Interrupt) {
    // SAFETY: unmasking can break a critical section that was made by masking; the images make theirs with PRIMASK.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt) };
}

/// Holds an interrupt back.
pub(crate) fn mask(interrupt: Interrupt) {
    cortex_m::peripheral::NVIC::mask(interrupt);
}

/// Sleeps until an interrupt, unless there is something to do already. With interrupts held back none can come between the
/// look and the sleep, and a pending one ends the sleep.
pub fn sleep_unless(busy: impl FnOnce() -> bool) {
    critical_section::with(|_| {
        if !busy() {
            cortex_m::asm::wfi();
        }
    });
}

/// The registers of a UART (CMSDK APB UART).
#[derive(Clone, Copy, Debug)]
pub(crate) struct UartRegisters {
    base: usize,
}

impl UartRegisters {
    /// The link's UART.
    pub(crate) const FIRST: Self = Self { base: 0x4000_4000 };
    /// The UART over which a host plays the pins.
    pub(crate) const SECOND: Self = Self { base: 0x4000_5000 };

    const DATA: usize = 0x0;
    const STATE: usize = 0x4;
    const CONTROL: usize = 0x8;
    const INTERRUPT: usize = 0xc;
    const BAUD_DIVIDER: usize = 0x10;

    const TRANSMIT_FULL: u32 = 1;
    const RECEIVE_FULL: u32 = 2;

    fn load(self, register: usize) -> u32 {
        // SAFETY: both bases are those of UARTs of the machine, which have these registers; reading them is harmless.
        unsafe { read_volatile((self.base + register) as *const u32) }
    }

    fn store(self, register: usize, value: u32) {
        // SAFETY: as above, and any value may be written: a UART reaches no memory.
        unsafe { write_volatile((self.base + register) as *mut u32, value) };
    }

    /// Transmitter, receiver and the receive interrupt on.
    pub(crate) fn enable(self, baud_divider: u32) {
        self.store(Self::BAUD_DIVIDER, baud_divider);
        self.store(Self::CONTROL, 0b1011);
    }

    /// A received byte.
    pub(crate) fn read(self) -> Option<u8> {
        (self.load(Self::STATE) & Self::RECEIVE_FULL != 0).then(|| self.load(Self::DATA) as u8)
    }

    /// Sends a byte, if the one before is gone.
    pub(crate) fn write(self, byte: u8) -> bool {
        let free = self.load(Self::STATE) & Self::TRANSMIT_FULL == 0;
        if free {
            self.store(Self::DATA, u32::from(byte));
        }
        free
    }

    /// Takes the receive interrupt's cause away.
    pub(crate) fn clear_received(self) {
        self.store(Self::INTERRUPT, 2);
    }
}
