//! The full model: boosted trees in f32 as the trainer left them.
//!
//! [`train::train`] makes an [`Ensemble`] from a [`Dataset`](crate::touches::Dataset), and [`load`] reads one. Ensembles and
//! their files are those of `palpate_trees`; what touches state of themselves is a [`TouchOrigin`] in their attributes.

#[cfg(all(test, feature = "train"))]
mod file_tests;
mod origin;
#[cfg(feature = "train")]
pub mod train;

pub use origin::{StatedProbe, TouchOrigin, compiled_trained_on};
pub(crate) use origin::{object_of, stroke_of};
pub use palpate_trees::ensemble::*;

use crate::error::Result;
use std::path::Path;

/// Reads an ensemble, over touches or over rows, and checks its statements about touches.
///
/// # Errors
/// As [`Ensemble::load`]; [`EnsembleProblem::Attribute`] for statements that this
/// crate did not write.
pub fn load(path: impl AsRef<Path>) -> Result<Ensemble> {
    let path = path.as_ref();
    checked(path, Ensemble::load(path)?)
}

/// An ensemble that was read from `path`, if its statements about touches can be read.
pub(crate) fn checked(path: &Path, ensemble: Ensemble) -> Result<Ensemble> {
    TouchOrigin::of(&ensemble.origin).map_err(|problem| crate::Error::from(problem).in_file(path))?;
    Ok(ensemble)
}
