//! Code that the tests between the crates share.

pub mod abuse;
pub mod desk;
pub mod flash;
#[path = "../../onboard/firmware/src/identity.rs"]
pub mod identity;
#[path = "../../onboard/firmware/src/located.rs"]
pub mod located;
pub mod mutants;
pub mod pins;
pub mod plain;
pub mod random;
pub mod replay;
pub mod scripts;
pub mod sections;
pub mod stated;
pub mod streams;
pub mod unaligned;
pub mod vectors;
