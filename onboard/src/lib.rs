//! Recognizes objects by touch on a microcontroller.
//!
//! ```text
//! Touch ──► features ──► ranks ──► trees ──► margins ──► evidence ──► Verdict
//! ```
//!
//! A [`Model`] is opened from bytes, which are checked once; a [`Recognizer`] turns each touch into margins, whole
//! numbers one for each object, adds them to the evidence, and stops as soon as one object is sure enough. All of it is
//! integer arithmetic (unless the model has f32 leaves), so every machine gives the same bits.
//!
//! `no_std`, without a heap and without `unsafe`; once a model has been validated nothing here can panic.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

mod aligned;
mod built_in;
mod bytes;
mod complete;
pub mod effector;
mod error;
mod evidence;
mod exp;
mod fixed;
mod grid;
mod leaves;
mod margins;
mod model;
mod preorder;
mod ranks;
mod recognizer;
mod snapshot;
pub mod station;
mod stopping;
mod validate;

pub use aligned::Aligned;
pub use error::ModelError;
pub use evidence::Posterior;
pub use exp::exp2_negative;
pub use model::Model;
pub use palpate_shared as shared;
pub use recognizer::{CapacityError, Recognizer, Verdict};
pub use snapshot::{SNAPSHOT_LENGTH, SnapshotError};
pub use stopping::Stopping;
