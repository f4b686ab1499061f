//! One error: what is wrong, where, and what to do.

pub use palpate_simulator::error::*;
