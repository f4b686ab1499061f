//! Errors, with the place and a remedy. Each room has its own problems; one error holds any of them, and the place.

pub use crate::calibrate::error::*;
pub use crate::capture::error::*;
#[cfg(feature = "train")]
pub use crate::ensemble::train::error::*;
pub use crate::evaluate::error::*;
#[cfg(feature = "train")]
pub use crate::fit::error::*;
pub use crate::locate::error::*;
#[cfg(feature = "train")]
pub use crate::teach::error::*;
pub use crate::touches::error::*;
pub use palpate_simulator::error::*;
pub use palpate_trees::error::*;
