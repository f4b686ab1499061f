//! Errors, with the place and a remedy. Each room has its own problems; one error holds any of them, and the place.

pub use crate::calibrate::{CalibrateProblem, Supplied};
pub use crate::capture::CaptureProblem;
pub use crate::chip::ChipProblem;
#[cfg(feature = "train")]
pub use crate::ensemble::train::TrainProblem;
pub use crate::evaluate::EvaluateProblem;
#[cfg(feature = "train")]
pub use crate::fit::FitProblem;
pub use crate::locate::LocateProblem;
#[cfg(feature = "train")]
pub use crate::teach::TeachProblem;
pub use crate::touches::TouchesProblem;
#[cfg(feature = "train")]
pub use crate::tune::TuneProblem;
pub use palpate_simulator::error::*;
pub use palpate_trees::error::*;
