//! From an ensemble to the bytes that the chip reads: `palpate_trees::compile`, with the ensemble's statements about touches.

pub use palpate_trees::compile::*;

#[cfg(feature = "train")]
use crate::ensemble::train;
use crate::ensemble::{self, Ensemble, OverTouches, TouchOrigin, import::Options};
use crate::error::{Error, Result};
use crate::touches::Longest;
use crate::with;
use palpate_onboard::Model;
use palpate_shared::format::{Length, MAGIC, Tag};
use palpate_trees::compile as trees;
use std::path::Path;

/// Models of more objects than this are usually compiled with leaves of one byte: `docs/measurements/growth.md`
/// has what that saves and what it costs.
#[cfg(feature = "train")]
const MANY: usize = 50;

/// The settings that an ensemble is compiled with unless others are asked for. Over touches leaves have one byte where they
/// were rounded to it, so that two would hold nothing more, and for more than 50 objects, where nearly all of a model is
/// leaves; all others have two.
#[cfg(feature = "train")]
pub fn usual(ensemble: &Ensemble) -> Settings {
    let is_small = || ensemble.objects.len() > MANY || train::is_rounded(ensemble, 8);
    let leaf = if ensemble.schema().is_some() && is_small() { Leaf::I8 } else { Leaf::I16 };
    with!(Settings::default(), leaf)
}

/// Whole weights of objects, for [`Recognizer::reset_to`](palpate_onboard::Recognizer::reset_to), from numbers in any unit.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) unless they are finite, none is below 0, and one is above.
pub fn weights(weights: &[f64]) -> Result<Vec<u32>> {
    let most = weights.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 || !weights.iter().all(|weight| *weight >= 0.0 && weight.is_finite()) {
        let allowed = "finite numbers, none below 0 and at least one above";
        return Err(Error::setting("weights", format!("{weights:?}"), allowed));
    }
    // 31 bits, and no object that is possible becomes impossible.
    let whole = |weight: &f64| (weight / most * f64::from(1_u32 << 31)).round().max(f64::from(u8::from(*weight > 0.0)));
    Ok(weights.iter().map(|weight| whole(weight) as u32).collect())
}

/// Compiles an ensemble. The model states the ensemble's own probe, or the published one where the ensemble states none.
///
/// # Errors
/// Errors of [`palpate_trees::compile::compile`], and if the ensemble states something of its touches that cannot be read.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    trees::compile(ensemble, &stated(ensemble, settings)?)
}

/// An ensemble with its own leaves, in f32: the model as which it is evaluated.
///
/// # Errors
/// Errors of [`compile`].
pub fn exact(ensemble: &Ensemble) -> Result<CompiledModel> {
    CompiledModel::from_bytes(compile(ensemble, &with!(Settings::default(), leaf = Leaf::F32))?.bytes)
}

/// Reads a model, or an ensemble as its [`exact`] model; the first bytes of the file say which it is.
///
/// # Errors
/// Errors of [`CompiledModel::read`] and [`ensemble::load`](ensemble::load()); an ensemble that does not compile.
pub fn read_any(path: impl AsRef<Path>) -> Result<CompiledModel> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the model", source))?;
    if bytes.starts_with(&MAGIC) {
        return CompiledModel::from_file(path, bytes);
    }
    let model = exact(&ensemble::read(path, &bytes, &Options::default())?).map_err(|error| error.in_file(path))?;
    CompiledModel::from_file(path, model.into_bytes())
}

/// Compiles an ensemble to at most `most` bytes, as [`compile`].
///
/// # Errors
/// Errors of [`palpate_trees::compile::compile_within`], and as [`compile`].
pub fn compile_within(ensemble: &Ensemble, settings: &Settings, most: usize) -> Result<Compiled> {
    trees::compile_within(ensemble, &stated(ensemble, settings)?, most)
}

/// The settings, with the ensemble's statements about touches.
fn stated(ensemble: &Ensemble, settings: &Settings) -> Result<Settings> {
    let origin = TouchOrigin::of(&ensemble.origin)?;
    let mut stated = origin.stated(&ensemble.objects);
    if ensemble.descriptor().is_none() {
        // Rows of features are no touches of any probe.
        stated.sections.retain(|section| section.tag == Tag::Outputs.code());
    }
    let priors = match &origin.outputs(&ensemble.objects) {
        Some(outputs) => Some(priors(outputs, settings.priors.as_deref())?),
        None => settings.priors.clone(),
    };
    Ok(with!(settings.clone(), stated, priors))
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

/// The longest time between two contacts that a model's touches can plausibly have, for finding times in another unit:
/// [`longest_time`], in words.
pub fn longest(model: &Model<'_>) -> Longest {
    let unit = model.probe().map_or(Length::Tenth, |probe| probe.length);
    Longest::of_scale("the model", longest_time(model), model.header().speed(), unit)
}

/// The longest time between two contacts that a model's touches can plausibly have, in seconds.
///
/// A model states its probe's spacing and speed. An object of at most 10 units on its longest side has a diagonal of at
/// most 10·√3, so that no contact comes later than (10·√3 + 2 · spacing) / speed after the first, and no feature of a
/// full touch is larger than twice that. A model with thresholds beyond was trained on larger objects, and takes up to
/// four times its largest threshold.
pub fn longest_time(model: &Model<'_>) -> f64 {
    let header = model.header();
    let of_ten_units = (10.0 * 3.0_f64.sqrt() + 2.0 * f64::from(header.spacing())) / f64::from(header.speed());
    let largest = thresholds(model).iter().fold(0.0_f64, |most, cut| most.max(f64::from(cut.unsigned_abs()) * 1e-6));
    if largest > 2.0 * of_ten_units { 4.0 * largest } else { of_ten_units }
}
