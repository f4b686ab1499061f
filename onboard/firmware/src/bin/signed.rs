//! Cost of the check of a signed model: instructions, stack and flash. Without the feature `signed` every signature is taken
//! as good, so the difference in flash is that of the check.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_firmware::meter::{self, Meter};
use palpate_firmware::{exit, fail, println, sections::Sections};

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));

/// The first test of RFC 8032: the key, and its signature of nothing.
#[cfg(feature = "signed")]
const KEY: [u8; 32] = [
    0xd7, 0x5a, 0x98, 0x01, 0x82, 0xb1, 0x0a, 0xb7, 0xd5, 0x4b, 0xfe, 0xd3, 0xc9, 0x64, 0x07, 0x3a, 0x0e, 0xe1, 0x72,
    0xf3, 0xda, 0xa6, 0x23, 0x25, 0xaf, 0x02, 0x1a, 0x68, 0xf7, 0x07, 0x51, 0x1a,
];
const SIGNATURE: [u8; 64] = [
    0xe5, 0x56, 0x43, 0x00, 0xc3, 0x60, 0xac, 0x72, 0x90, 0x86, 0xe2, 0xcc, 0x80, 0x6e, 0x82, 0x8a, 0x84, 0x87, 0x7f,
    0x1e, 0xb8, 0xe5, 0xd9, 0x74, 0xd8, 0x73, 0xe0, 0x65, 0x22, 0x49, 0x01, 0x55, 0x5f, 0xb8, 0x82, 0x15, 0x90, 0xa3,
    0x3b, 0xac, 0xc6, 0x1e, 0x39, 0x70, 0x1c, 0xf9, 0xb4, 0x6b, 0xd2, 0x5b, 0xf5, 0xf0, 0x59, 0x5b, 0xbe, 0x24, 0x65,
    0x51, 0x41, 0x43, 0x8e, 0x7a, 0x10, 0x0b,
];

/// The function for `station::Signed::verify`.
#[cfg(feature = "signed")]
fn verify(signed: &[u8], signature: &[u8; 64]) -> bool {
    let signature = ed25519_compact::Signature::new(*signature);
    ed25519_compact::PublicKey::new(KEY).verify(signed, &signature).is_ok()
}

#[cfg(not(feature = "signed"))]
fn verify(_: &[u8], _: &[u8; 64]) -> bool {
    true
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { fail() };
    let mut meter = Meter::new(peripherals.SYST);
    // A signature of other bytes is rejected at the very end.
    let is_wrong = || verify(black_box(MODEL), black_box(&SIGNATURE));
    if !verify(black_box(&[]), black_box(&SIGNATURE)) || cfg!(feature = "signed") && is_wrong() {
        fail();
    }
    let (_, instructions) = meter.once(is_wrong);
    println!("a signature of {} bytes: {:9} {:6}", MODEL.len(), instructions, meter::stack(is_wrong));
    println!("flash {}", Sections::of_this_image().flash());
    exit()
}
