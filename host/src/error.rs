//! Errors, with the place and a remedy. Each room has its own problems; one error holds any of them, and the place.

pub use crate::capture::error::*;
pub use crate::chip::error::*;
#[cfg(feature = "train")]
pub use crate::ensemble::train::error::*;
pub use crate::evaluate::error::*;
pub use crate::locate::error::*;
pub use crate::touches::error::*;
pub use palpate_simulator::error::*;
pub use palpate_trees::error::*;
