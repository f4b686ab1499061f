//! Benefit of more approaches.

use super::Smoothing;
use super::balance::{Held, Judged, Named};
use super::held_out::{Division, Material};
use crate::error::Result;
use crate::progress::Progress;
use serde::Serialize;

/// Shares of the touches that are fitted on, besides nearly all of them.
const SHARES: [Division; 3] =
    [Division { parts: 8, used: 1 }, Division { parts: 4, used: 1 }, Division { parts: 2, used: 1 }];

/// The parts that are held out for the curve.
pub(super) fn parts() -> usize {
    SHARES.iter().map(|division| division.parts).sum()
}

/// Accuracy for an object after having been taught with ever more approaches.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Curve {
    /// From few approaches to nearly all that were recorded.
    pub points: Vec<Point>,
    /// The error that is expected with twice as many as were recorded: errors fall with a power of the number of
    /// approaches, which is fitted to the points.
    pub with_twice: f64,
}

/// A number of approaches, and the results with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Approaches to the object that were fitted on.
    pub approaches: usize,
    /// The share of its groups that are recognized, with a constant for this number.
    pub recognized: f64,
    /// The mean of its groups that are missed and of others' that are mistaken for it.
    pub error: f64,
}

impl Curve {
    pub(super) fn add(&mut self, approaches: usize, Named { right, wrong }: Named) {
        self.points.push(Point { approaches, recognized: right, error: f64::midpoint(1.0 - right, wrong) });
    }

    /// Adds the point for `share` of the approaches that were recorded, and extrapolates to twice as many.
    pub(super) fn finish(&mut self, recorded: usize, share: f64, named: Named) {
        self.add((recorded as f64 * share).round() as usize, named);
        self.with_twice = expected(&self.points, 2 * recorded);
    }
}

/// The error after a number of approaches: the line through the points' logarithms, by least squares, that does not rise.
pub(super) fn expected(points: &[Point], approaches: usize) -> f64 {
    // An error that was never seen is not 0.
    let of = |point: &Point| ((point.approaches.max(1) as f64).ln(), point.error.max(1e-3).ln());
    let count = points.len().max(1) as f64;
    let mean = points.iter().map(of).fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x / count, sum.1 + y / count));
    let (mut products, mut squares) = (0.0, 0.0);
    for (x, y) in points.iter().map(of) {
        products += (x - mean.0) * (y - mean.1);
        squares += (x - mean.0) * (x - mean.0);
    }
    let slope = if squares > 0.0 { (products / squares).min(0.0) } else { 0.0 };
    (mean.1 + slope * ((approaches.max(1) as f64).ln() - mean.0)).exp().min(1.0)
}

/// The points of every recorded object but the last. Each touch is held out once for each.
pub(super) fn curves(
    material: &Material,
    smoothings: &[Smoothing],
    judged: &impl Fn(&[Held]) -> Judged,
    progress: &dyn Progress,
) -> Result<Vec<Curve>> {
    let all: Vec<usize> = (0..smoothings.len()).collect();
    let mut curves = vec![Curve::default(); all.len()];
    for division in SHARES {
        let held = material.held_out(&all, smoothings, 1, division, progress)?;
        let drawn = judged(&held);
        for (index, curve) in curves.iter_mut().enumerate() {
            let given = held[material.known_count() + index].len();
            curve.add((given as f64 * division.share()).round() as usize, drawn.named(index));
        }
    }
    Ok(curves)
}
