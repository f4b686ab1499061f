//! Code that the tests between the crates share.

pub mod abuse;
pub mod bad_line;
pub mod casts;
pub mod chips;
pub mod desk;
pub mod flash;
#[path = "../../onboard/firmware/src/identity.rs"]
pub mod identity;
#[path = "../../onboard/firmware/src/located.rs"]
pub mod located;
pub mod mutants;
pub mod page;
pub mod pins;
pub mod precision;
pub mod random;
pub mod replay;
pub mod scripts;
pub mod sections;
pub mod stated;
pub mod streams;
pub mod unaligned;
pub mod vectors;
pub mod wide;

/// The project's root.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A model of ten objects, whose fingers may touch a second apart.
pub const HOUSEHOLD: &[u8] = include_bytes!("../../models/household.palpate");

/// Number of repetitions: the one in the variable PALPATE_REPETITIONS, or `few`.
#[must_use]
pub fn repetitions(few: usize) -> usize {
    std::env::var("PALPATE_REPETITIONS").map_or(few, |count| count.parse().expect("PALPATE_REPETITIONS is a number"))
}
