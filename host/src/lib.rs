//! Recognize objects by touch: simulate a three-fingered probe, train, compile and evaluate.
//!
//! The data's way through this crate:
//!
//! ```text
//! mesh ──► scene ──► approach ──► contact times ──► touch ──► ensemble ──► compiled model ──► verdicts
//! ```
//!
//! A touch's features come from [`palpate_shared`], verdicts from [`palpate_onboard`]: the same lines of code that run
//! on the chip.

pub mod error;
pub mod output;
pub mod progress;
mod random;

pub mod capture;
pub mod chip;
pub mod compile;
pub mod ensemble;
pub mod evaluate;
pub mod mesh;
pub mod page;
pub mod probe;
pub mod report;
pub mod run;
pub mod touches;
pub mod tune;

pub use error::{Error, Result};
