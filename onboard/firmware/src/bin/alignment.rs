//! The recognizer where a load from an address that is not aligned is a fault, as on every Cortex-M0 and M0+: with a model
//! at a multiple of four, and one byte behind it. Prints what the host's test computes as well.
//!
//! `PALPATE_MEMORY=microbit.x cargo build --release --target thumbv6m-none-eabi --bin alignment`, for QEMU's `microbit`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::{exit, fail, identity, println};
use palpate_onboard::Model;

/// Bytes that start one behind a multiple of four.
#[repr(C, align(4))]
struct Shifted<T: ?Sized> {
    before: u8,
    bytes: T,
}

static ALIGNED: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
static SHIFTED: &Shifted<[u8]> = &Shifted { before: 0, bytes: *include_bytes!(env!("PALPATE_MODEL")) };

#[entry]
fn main() -> ! {
    for bytes in [ALIGNED, &SHIFTED.bytes] {
        let Ok(model) = Model::new(bytes) else {
            println!("the model cannot be read (before it stands {})", SHIFTED.before);
            fail()
        };
        println!("at {}: {:08x}", bytes.as_ptr().addr() % 4, identity::digest(&model));
    }
    exit()
}
