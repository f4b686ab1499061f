//! Errors, with the place and a remedy. Each room has its own problems; one error holds any of them, and the place.

pub use crate::locate::error::*;
pub use palpate_simulator::error::*;
