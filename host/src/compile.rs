//! From an ensemble to the bytes that the chip reads: `palpate_trees::compile`, with the ensemble's statements about touches.

pub use palpate_trees::compile::*;

use crate::ensemble::{Ensemble, TouchOrigin};
use crate::error::{Error, Result};
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

/// The settings, with the ensemble's statements about touches.
fn stated(ensemble: &Ensemble, settings: &Settings) -> Result<Settings> {
    let stated = TouchOrigin::of(&ensemble.origin)?.stated(&ensemble.objects);
    let priors = match &stated.outputs {
        Some(outputs) => Some(priors(outputs, settings.priors.as_deref())?),
        None => settings.priors.clone(),
    };
    Ok(Settings { stated, priors, ..settings.clone() })
}

/// Priors of outputs: those of their objects, or of the outputs themselves, and the outputs' shares.
fn priors(outputs: &[(u8, f64)], priors: Option<&[f64]>) -> Result<Vec<f64>> {
    let objects = outputs.last().map_or(0, |(object, _)| usize::from(*object) + 1);
    let of = |(output, (object, share)): (usize, &(u8, f64))| match priors {
        None => Some(*share),
        Some(priors) if priors.len() == objects => Some(priors[usize::from(*object)] * share),
        Some(priors) => priors.get(output).copied().filter(|_| priors.len() == outputs.len()),
    };
    let found: Option<Vec<f64>> = outputs.iter().enumerate().map(of).collect();
    found.ok_or_else(|| {
        Error::setting("priors", priors.map_or(0, <[f64]>::len), format!("{objects} numbers, one for each object"))
    })
}
