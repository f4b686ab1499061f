//! A quick climb to a near maximum of the likelihood, by slopes: for comparing layers, which have tables of their own.
//!
//! It stops at the nearest maximum. The probe itself is found by the slower search of [`search`](super::search).

use super::candidate::{Hypothesis, NUMBERS};
use super::search::{Best, Likelihood};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Numbers of a candidate, and values for each pair of them.
type Numbers = SVector<f64, NUMBERS>;
type Pairs = SMatrix<f64, NUMBERS, NUMBERS>;

/// Steps of a climb at most.
const STEPS: usize = 60;
/// A climb ends when the next step promises a smaller gain, in nats.
const CLOSE: f64 = 0.02;
/// The longest step of a number.
const LONGEST: f64 = 3.0;
/// Distance to either side over which slopes are measured: farther than the cells of the tables, which have edges.
const SLOPE: f64 = 0.1;

/// The best candidate near a start that is nearly the best.
pub(super) fn again(likelihood: Likelihood<'_>, start: &Hypothesis) -> Best {
    let (numbers, log_likelihood) = climb(likelihood, start.numbers().into());
    Best { candidate: Hypothesis::of(&numbers.into()), log_likelihood }
}

/// The slope of the likelihood, by differences.
fn slope(likelihood: Likelihood<'_>, at: &Numbers) -> Numbers {
    let one = |index: usize| {
        let [low, high] = [-SLOPE, SLOPE].map(|way| {
            let mut there = *at;
            there[index] += way;
            likelihood(&Hypothesis::of(&there.into()))
        });
        (high - low) / (2.0 * SLOPE)
    };
    // Candidates that nothing can be said of have no slope.
    let slopes: Vec<f64> = (0..NUMBERS).into_par_iter().map(one).collect();
    Numbers::from_fn(|index, _| if slopes[index].is_finite() { slopes[index] } else { 0.0 })
}

/// The maximum that is reached from `start`, about as exactly as it takes to compare likelihoods. Method: Broyden, Fletcher,
/// Goldfarb and Shanno, with slopes by differences.
fn climb(likelihood: Likelihood<'_>, start: Numbers) -> (Numbers, f64) {
    let unknown = 0.1 * Pairs::identity();
    let value_at = |at: &Numbers| likelihood(&Hypothesis::of(&(*at).into()));
    let (mut at, mut value, mut inverse) = (start, value_at(&start), unknown);
    let mut rise = slope(likelihood, &at);
    let mut is_known = true;
    for _ in 0..STEPS {
        let mut step = inverse * rise;
        step *= (LONGEST / step.amax().max(1e-9)).min(1.0);
        let promised = step.dot(&rise);
        // A step is as good as half of what its slope promises.
        if promised.is_nan() || promised / 2.0 < CLOSE {
            break;
        }
        let mut share = 1.0;
        let mut found = None;
        for _ in 0..6 {
            let there = at + step * share;
            let height = value_at(&there);
            if height > value + 0.05 * share * promised {
                found = Some((there, height));
                break;
            }
            share *= 0.35;
        }
        let Some((there, height)) = found else {
            if is_known {
                break;
            }
            (inverse, is_known) = (unknown, true);
            continue;
        };
        let new = slope(likelihood, &there);
        let (moved, fell) = (there - at, rise - new);
        let along = moved.dot(&fell);
        if along > 1e-6 {
            let left = Pairs::identity() - moved * fell.transpose() / along;
            inverse = left * inverse * left.transpose() + moved * moved.transpose() / along;
            is_known = false;
        }
        (at, value, rise) = (there, height, new);
    }
    (at, value)
}
