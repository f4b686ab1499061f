//! The only place with `unsafe`: what the chip and the linker know and Rust does not.
#![allow(unsafe_code)]

use core::ptr::{addr_of, read_volatile, write_volatile};

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
    static _stack_start: u32;
}

/// The address of a linker symbol. Taking it reads nothing.
macro_rules! address {
    ($symbol:ident) => {
        addr_of!($symbol) as usize
    };
}

/// Bytes of (vector table and code, constants, initialised statics, zeroed statics).
pub fn section_sizes() -> [usize; 4] {
    [
        address!(__etext) - address!(__vector_table),
        address!(__erodata) - address!(__srodata),
        address!(__edata) - address!(__sdata),
        address!(__ebss) - address!(__sbss),
    ]
}

const PAINT: u32 = 0xdead_5afe;
/// How far down the stack is painted.
const PAINTED: usize = 32 * 1024;
/// Left unpainted below the stack pointer for the painting itself.
const MARGIN: usize = 64;

/// The painted part of the stack.
#[derive(Clone, Copy)]
pub struct Painted {
    low: usize,
    high: usize,
}

/// Paints the unused stack below the caller, at most 32 KB of it.
#[inline(never)]
pub fn paint_stack() -> Painted {
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
pub fn used_stack(area: Painted) -> usize {
    // SAFETY: the same words that `paint_stack` wrote.
    let scrubbed = (area.low..area.high).step_by(4).find(|&a| unsafe { read_volatile(a as *const u32) } != PAINT);
    area.high - scrubbed.unwrap_or(area.high)
}

/// Bytes of stack in use by the caller now, from the top of RAM down.
pub fn stack_depth() -> usize {
    address!(_stack_start) - cortex_m::register::msp::read() as usize
}
