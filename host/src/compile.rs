//! From an ensemble to the bytes that the chip reads: `palpate_trees::compile`, with what an ensemble states of its touches.

pub use palpate_trees::compile::*;

use crate::ensemble::{Ensemble, TouchOrigin};
use crate::error::Result;
use palpate_trees::compile as trees;

/// Compiles an ensemble. The model states the ensemble's own probe, or the published one where the ensemble states none.
///
/// # Errors
/// As [`palpate_trees::compile::compile`]; [`EnsembleProblem::Attribute`](crate::error::EnsembleProblem::Attribute) if the
/// ensemble states something of its touches that cannot be read.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    trees::compile(ensemble, &stated(ensemble, settings)?)
}

/// Compiles an ensemble to at most `most` bytes, as [`compile`].
///
/// # Errors
/// As [`palpate_trees::compile::compile_within`], and as [`compile`].
pub fn compile_within(ensemble: &Ensemble, settings: &Settings, most: usize) -> Result<Compiled> {
    trees::compile_within(ensemble, &stated(ensemble, settings)?, most)
}

/// The settings, with what the ensemble states of its touches.
fn stated(ensemble: &Ensemble, settings: &Settings) -> Result<Settings> {
    Ok(Settings { stated: TouchOrigin::of(&ensemble.origin)?.stated(&ensemble.objects), ..settings.clone() })
}
