//! Features as whole numbers of the user's units: for chips without a float unit.

use super::Rows;
use crate::ensemble::{Ensemble, Node};

/// What whole numbers do to a feature.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Effect {
    /// The feature's name.
    pub feature: String,
    /// Units that make up 1.
    pub scale: f32,
    /// Its different thresholds.
    pub thresholds: usize,
    /// Those that stay different in whole units.
    pub different: usize,
    /// The farthest that a value can be from a threshold and still go the other way: half a unit for its rounding, and
    /// nothing where each threshold lies right between two whole units.
    pub largest_step: f64,
}

/// The different thresholds of a feature, in order.
fn thresholds(ensemble: &Ensemble, feature: usize) -> Vec<f32> {
    let nodes = ensemble.trees.iter().flat_map(|tree| &tree.nodes);
    let of_feature = nodes.filter_map(|node| match *node {
        Node::Split { feature: own, threshold, .. } if own == feature => Some(threshold),
        _ => None,
    });
    let mut thresholds: Vec<f32> = of_feature.collect();
    thresholds.sort_unstable_by(f32::total_cmp);
    thresholds.dedup();
    thresholds
}

/// A threshold of a feature that is no whole number, if there is one: such a feature needs a scale. Halves, which trainers
/// put between whole numbers, and the f32 after a whole number, which stands for "at or below", are none.
pub fn fraction(ensemble: &Ensemble, feature: usize) -> Option<f32> {
    let is_fraction = |threshold: f32| {
        let twice = 2.0 * f64::from(threshold);
        threshold.is_finite() && (twice - twice.round()).abs() > 1e-6 * twice.abs().max(1.0)
    };
    thresholds(ensemble, feature).into_iter().find(|&threshold| is_fraction(threshold))
}

/// What scales do to each feature that the ensemble uses.
pub fn effects(ensemble: &Ensemble, scales: &[f32]) -> Vec<Effect> {
    let names = ensemble.inputs.names();
    let effect = |(feature, (name, &scale)): (usize, (&str, &f32))| {
        let thresholds = thresholds(ensemble, feature);
        let units = |threshold: &f32| f64::from(*threshold) * f64::from(scale);
        let mut cuts: Vec<f64> = thresholds.iter().map(|threshold| units(threshold).ceil()).collect();
        cuts.dedup();
        // A value of n − 1/2 to n + 1/2 units is n. The split is below n = ⌈c⌉, so between ⌈c⌉ − 1/2 and c values go the
        // other way than they would.
        let step = |threshold: &f32| (units(threshold).ceil() - 0.5 - units(threshold)).abs() / f64::from(scale);
        let largest_step = thresholds.iter().filter(|threshold| threshold.is_finite()).map(step).fold(0.0, f64::max);
        let (thresholds, different) = (thresholds.len(), cuts.len());
        Effect { feature: name.into(), scale, thresholds, different, largest_step }
    };
    let all = names.into_iter().zip(scales).enumerate().map(effect);
    all.filter(|effect| effect.thresholds > 0).collect()
}

/// The most whole digits of a value in its units: as many as f32 holds.
const LARGEST: f64 = 1e7;

/// For each feature the smallest power of ten with which every value of the rows is a whole number, up to the largest with
/// which none is beyond ten million: f32 holds no more digits.
pub fn fit(ensemble: &Ensemble, rows: &Rows) -> Vec<f32> {
    let of_feature = |feature: usize| {
        let values: Vec<f64> =
            rows.iter().map(|row| f64::from(row[feature])).filter(|value| value.is_finite()).collect();
        let thresholds = thresholds(ensemble, feature).into_iter().map(f64::from);
        let finite = values.iter().copied().chain(thresholds.filter(|threshold| threshold.is_finite()));
        let largest = finite.map(f64::abs).fold(0.0, f64::max);
        let mut scale = 1.0;
        let is_whole = |scale: f64| {
            values.iter().all(|value| {
                let units = value * scale;
                // Decimals are not exact in f32.
                (units - units.round()).abs() <= units.abs().max(1.0) * 2.0 * f64::from(f32::EPSILON)
            })
        };
        while !is_whole(scale) && largest * scale * 10.0 <= LARGEST && scale < 1e30 {
            scale *= 10.0;
        }
        scale as f32
    };
    (0..ensemble.inputs.count()).map(of_feature).collect()
}
