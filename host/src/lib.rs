//! Recognise objects by touch: simulate a three-fingered probe, train, compile and evaluate.
//!
//! The data's way through this crate:
//!
//! ```text
//! mesh ──► scene ──► approach ──► contact times ──► touch ──► ensemble ──► compiled model ──► verdicts
//! ```
//!
//! A touch's features come from [`palpate_shared`], verdicts from [`palpate_onboard`]: the same lines of code that run
//! on the chip.

pub mod approach;
pub mod capture;
pub mod cast;
pub mod compile;
pub mod dataset;
pub mod emulated;
pub mod ensemble;
pub mod error;
pub mod evaluate;
pub mod folds;
pub mod link;
pub mod mesh;
pub mod model_file;
pub mod noise;
pub mod obj;
pub mod objects;
pub mod output;
pub mod parity;
pub mod progress;
mod random;
pub mod render;
pub mod report;
pub mod run;
pub mod scene;
pub mod source;
pub mod sweep;
#[cfg(test)]
mod synthetic;
pub mod train;
pub mod tune;
pub mod view;
pub mod watch;

pub use error::{Error, Result};
