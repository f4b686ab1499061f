//! Features as whole numbers of the user's units: for chips without a float unit.

use super::Rows;
use crate::ensemble::{Ensemble, Node, Threshold};
use std::collections::BTreeSet;
use std::fmt;

/// Effect of whole numbers on a feature.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Effect {
    /// The feature's name.
    pub feature: String,
    /// Units that make up 1.
    pub scale: f32,
    /// Its different thresholds.
    pub thresholds: usize,
    /// Number of these that stay different in whole units.
    pub different: usize,
    /// The farthest that a value can be from a threshold and still go the other way: half a unit for its rounding, and
    /// nothing where each threshold lies right between two whole units.
    pub largest_step: f64,
    /// True if every value of the rows that the scales were fitted to is a whole number of units, up to the digits of
    /// f32, so that no row goes another way; `None` without such rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values_are_whole: Option<bool>,
}

/// Thresholds of a feature that the library compares in f64, and a model in f32.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Single {
    /// The feature's name.
    pub feature: String,
    /// Its different thresholds in the file.
    pub thresholds: usize,
    /// Number of these that stay different in f32.
    pub different: usize,
    /// About which share of rows goes another way at one of them: half a step of f32 at each, over the range of all.
    pub share: f64,
    /// Units in 1 with which whole numbers part more values than f32 does, if the file's own thresholds are known.
    pub scale: Option<f32>,
}

/// The share of rows from which on a user is told.
const NOTED: f64 = 1e-3;

impl fmt::Display for Single {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { feature, thresholds, different, share, scale } = self;
        write!(
            f,
            "{feature}: of {thresholds} thresholds {different} stay different in f32, and about 1 row in {:.0} goes another \
             way than in the library, which compares f64. ",
            (1.0 / share).max(1.0)
        )?;
        match scale {
            Some(scale) => write!(
                f,
                "A scale compares whole numbers instead (--scale {feature}={scale}, in Python {scale} for it in scales=)."
            ),
            None => f.write_str("Subtract what its values have in common before training."),
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { feature, scale, thresholds, different, largest_step, .. } = self;
        write!(
            f,
            "{feature}: {scale} units make up 1; of {thresholds} thresholds {different} stay different; a value within \
             {largest_step:e} of one may go the other way"
        )
    }
}

/// The different thresholds of a feature as the file has them, in order, each with the f32 that stands for it.
fn thresholds(ensemble: &Ensemble, feature: usize) -> Vec<(Threshold, f32)> {
    let mut thresholds = Vec::new();
    for (number, tree) in ensemble.trees.iter().enumerate() {
        for (index, node) in tree.nodes.iter().enumerate() {
            if let &Node::Split { feature: own, threshold: single, .. } = node
                && own == feature
                && let Some(threshold) = ensemble.threshold(number, index)
            {
                thresholds.push((threshold, single));
            }
        }
    }
    thresholds.sort_unstable_by(|(a, _), (b, _)| a.value.total_cmp(&b.value).then(a.inclusive.cmp(&b.inclusive)));
    thresholds.dedup_by_key(|(threshold, _)| (threshold.value.to_bits(), threshold.inclusive));
    thresholds
}

/// The features for which a share of rows worth a note goes another way than in a library that compares f64.
pub fn singles(ensemble: &Ensemble) -> Vec<Single> {
    let names = ensemble.inputs.names();
    let of_feature = names.into_iter().enumerate().filter_map(|(feature, name)| {
        let mut thresholds = thresholds(ensemble, feature);
        // Zeros that LightGBM takes as missing have thresholds of their own.
        thresholds.retain(|(own, _)| !own.is_beyond_all() && own.value.abs() > 1e-30);
        let [(first, _), .., (last, _)] = thresholds[..] else { return None };
        let half = |(_, single): &(Threshold, f32)| f64::from(single.abs().next_up() - single.abs()) / 2.0;
        // Thresholds are halfway between values: if those are f32, rows are too, such as arrays that LightGBM rounds.
        let is_of_f32 = |own: &(Threshold, f32)| {
            let quarters = own.0.value / (half(own) / 2.0);
            (quarters - quarters.round()).abs() < 1e-6
        };
        if thresholds.iter().all(is_of_f32) {
            return None;
        }
        let share = thresholds.iter().map(half).sum::<f64>() / (last.value - first.value);
        let different = thresholds.iter().map(|(_, single)| single.to_bits()).collect::<BTreeSet<_>>().len();
        let is_known = ensemble.origin.imported.as_ref().is_some_and(|imported| !imported.thresholds.is_empty());
        let scale = Some(mending(&thresholds)).filter(|_| is_known);
        Some(Single { feature: name.into(), thresholds: thresholds.len(), different, share, scale })
    });
    of_feature.filter(|single| ensemble.compares_f64() && single.share >= NOTED).collect()
}

/// 1 where thresholds are whole or halfway between whole numbers, otherwise the largest power of ten with which they fit 32 bits.
fn mending(thresholds: &[(Threshold, f32)]) -> f32 {
    let values = || thresholds.iter().map(|(own, _)| own.value.abs());
    let digits = (f64::from(i32::MAX) / values().fold(0.0, f64::max)).log10().floor();
    let most = if values().all(|value| (2.0 * value).fract() == 0.0) { digits.min(0.0) } else { digits };
    10.0_f64.powf(most) as f32
}

/// A threshold of a feature that is not a whole number, if there is one: such a feature needs a scale. Halves, which trainers
/// put between whole numbers, and the f32 after a whole number, which stands for "at or below", do not count.
pub fn fraction(ensemble: &Ensemble, feature: usize) -> Option<f64> {
    let is_fraction = |threshold: f64| {
        let twice = 2.0 * threshold;
        threshold.is_finite() && (twice - twice.round()).abs() > 1e-6 * twice.abs().max(1.0)
    };
    thresholds(ensemble, feature).into_iter().map(|(threshold, _)| threshold.value).find(|&value| is_fraction(value))
}

/// Effects of scales on each feature that the ensemble uses, and on the values of `rows` if they were fitted to some.
pub fn effects(ensemble: &Ensemble, scales: &[f32], rows: Option<&Rows>) -> Vec<Effect> {
    let names = ensemble.inputs.names();
    let effect = |(feature, (name, &scale)): (usize, (&str, &f32))| {
        let thresholds: Vec<Threshold> = thresholds(ensemble, feature).into_iter().map(|(own, _)| own).collect();
        let mut cuts: Vec<f64> = thresholds.iter().map(|threshold| threshold.units(scale)).collect();
        cuts.dedup();
        // A value of n − 1/2 to n + 1/2 units is n. The split is below n = ⌈c⌉, so between ⌈c⌉ − 1/2 and c values go the
        // other way than they would.
        let units = |threshold: &Threshold| threshold.value * f64::from(scale);
        let step = |threshold: &Threshold| (threshold.units(scale) - 0.5 - units(threshold)).abs() / f64::from(scale);
        let finite = thresholds.iter().filter(|threshold| !threshold.is_beyond_all());
        let largest_step = finite.map(step).fold(0.0, f64::max);
        let (thresholds, different) = (thresholds.len(), cuts.len());
        let values_are_whole = rows.map(|rows| rows.iter().all(|row| is_whole(row[feature], scale.into())));
        Effect { feature: name.into(), scale, thresholds, different, largest_step, values_are_whole }
    };
    let all = names.into_iter().zip(scales).enumerate().map(effect);
    all.filter(|effect| effect.thresholds > 0).collect()
}

/// True if a value is a whole number of units, up to the digits of f32, in which decimals are not exact. Missing and
/// infinite values are.
fn is_whole(value: f64, scale: f64) -> bool {
    let units = value * scale;
    !units.is_finite() || (units - units.round()).abs() <= units.abs().max(1.0) * 2.0 * f64::from(f32::EPSILON)
}

/// The most whole digits of a value in its units: as many as f32 holds.
const LARGEST: f64 = 1e7;

/// For each feature the smallest power of ten with which every value of the rows is a whole number, up to the largest with
/// which none is beyond ten million: f32 holds no more digits.
pub fn fit(ensemble: &Ensemble, rows: &Rows) -> Vec<f32> {
    let of_feature = |feature: usize| {
        let values: Vec<f64> = rows.iter().map(|row| row[feature]).filter(|value| value.is_finite()).collect();
        let thresholds = thresholds(ensemble, feature).into_iter().map(|(threshold, _)| threshold);
        let thresholds = thresholds.filter(|threshold| !threshold.is_beyond_all()).map(|threshold| threshold.value);
        let finite = values.iter().copied().chain(thresholds);
        let largest = finite.map(f64::abs).fold(0.0, f64::max);
        let mut scale = 1.0;
        while !values.iter().all(|&value| is_whole(value, scale)) && largest * scale * 10.0 <= LARGEST && scale < 1e30 {
            scale *= 10.0;
        }
        scale as f32
    };
    (0..ensemble.inputs.count()).map(of_feature).collect()
}
