//! The candidate that explains recorded touches best, and how far from it one still may be.

use super::candidate::{Candidate, NUMBERS};
use nalgebra::{SMatrix, SVector, SymmetricEigen};
use rayon::prelude::*;

/// Objective of the search: the logarithm of the likelihood of a candidate.
pub(super) type Likelihood<'a> = &'a (dyn Fn(&Candidate) -> f64 + Sync);

/// Numbers of a candidate, and what is one for each pair of them.
type Numbers = SVector<f64, NUMBERS>;
type Pairs = SMatrix<f64, NUMBERS, NUMBERS>;

/// A candidate, and the logarithm of its likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Best {
    pub(super) candidate: Candidate,
    pub(super) log_likelihood: f64,
}

/// Steps of a search at most.
const STEPS: usize = 60;
/// A search ends when the next step promises a smaller gain, in nats.
const CLOSE: f64 = 2e-3;
/// The same at the ends of an interval, which need not be as exact.
const CLOSE_AT_END: f64 = 0.02;
/// The longest step of a number.
const LONGEST: f64 = 3.0;
/// How far to either side slopes are measured: farther than the cells of the tables, which have edges.
const SLOPE: f64 = 0.1;
/// The same for curvatures.
const CURVATURE: f64 = 0.3;
/// Twice the loss of log-likelihood at the ends of an interval of 95 %: 3.84, the quantile of chi squared with one
/// degree of freedom, and more, because the tables come from touches that are simulated and smoothed. With 3.84, 47 of
/// 56 intervals of probes that were known held the speed, offsets and noise.
pub(super) const QUANTILE: f64 = 5.5;
/// From how many points of a grid a search starts.
const STARTS: usize = 3;

/// The slope of the likelihood, by differences; that of the number `fixed` is 0.
fn slope(likelihood: Likelihood<'_>, at: &Numbers, fixed: Option<usize>) -> Numbers {
    let one = |index: usize| {
        if Some(index) == fixed {
            return 0.0;
        }
        let [low, high] = [-SLOPE, SLOPE].map(|way| {
            let mut there = *at;
            there[index] += way;
            likelihood(&Candidate::of(&there.into()))
        });
        (high - low) / (2.0 * SLOPE)
    };
    // Candidates that nothing can be said of have no slope.
    let slopes: Vec<f64> = (0..NUMBERS).into_par_iter().map(one).collect();
    Numbers::from_fn(|index, _| if slopes[index].is_finite() { slopes[index] } else { 0.0 })
}

/// The spread of the numbers about a maximum of the likelihood: the inverse of its curvatures, by differences. Where it is
/// not curved, as if it were a little.
fn spread(likelihood: Likelihood<'_>, at: &Numbers, value: f64) -> Pairs {
    let there = |ways: &[(usize, f64)]| {
        let mut there = *at;
        ways.iter().for_each(|(index, way)| there[*index] += way);
        likelihood(&Candidate::of(&there.into()))
    };
    let pairs: Vec<(usize, usize)> = (0..NUMBERS).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
    let curvature = |(i, j): &(usize, usize)| {
        let h = CURVATURE;
        let curved = if i == j {
            2.0 * value - there(&[(*i, h)]) - there(&[(*i, -h)])
        } else {
            (there(&[(*i, h), (*j, -h)]) + there(&[(*i, -h), (*j, h)])
                - there(&[(*i, h), (*j, h)])
                - there(&[(*i, -h), (*j, -h)]))
                / 4.0
        };
        curved / (h * h)
    };
    let curved: Vec<f64> = pairs.par_iter().map(curvature).collect();
    let mut curvatures = Pairs::identity();
    for ((i, j), curved) in pairs.into_iter().zip(curved) {
        let curved = if curved.is_finite() { curved } else { 0.0 };
        (curvatures[(i, j)], curvatures[(j, i)]) = (curved, curved);
    }
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(curvatures);
    eigenvectors * Pairs::from_diagonal(&eigenvalues.map(|curved| 1.0 / curved.max(0.02))) * eigenvectors.transpose()
}

/// The spread of the others where number `fixed` keeps its value.
fn spread_at(spread: &Pairs, fixed: usize) -> Pairs {
    let column = spread.column(fixed).into_owned();
    let mut left = spread - column * column.transpose() / spread[(fixed, fixed)];
    left.row_mut(fixed).fill(0.0);
    left.column_mut(fixed).fill(0.0);
    left
}

/// The maximum that is reached from `start`, where number `fixed` keeps its value; `spread` is what is known of the
/// likelihood's shape. Method: Broyden, Fletcher, Goldfarb and Shanno, with slopes by differences.
fn climb(
    likelihood: Likelihood<'_>,
    start: Numbers,
    fixed: Option<usize>,
    known: &Pairs,
    close: f64,
) -> (Numbers, f64) {
    let value_at = |at: &Numbers| likelihood(&Candidate::of(&(*at).into()));
    let (mut at, mut value, mut inverse) = (start, value_at(&start), *known);
    let mut rise = slope(likelihood, &at, fixed);
    let mut is_known = true;
    for _ in 0..STEPS {
        let mut step = inverse * rise;
        step *= (LONGEST / step.amax().max(1e-9)).min(1.0);
        let promised = step.dot(&rise);
        // A step is as good as half of what its slope promises.
        if promised.is_nan() || promised / 2.0 < close {
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
            (inverse, is_known) = (*known, true);
            continue;
        };
        let new = slope(likelihood, &there, fixed);
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

/// Spread of numbers of which nothing is known yet.
fn unknown() -> Pairs {
    0.1 * Pairs::identity()
}

/// The best candidate near this one.
pub(super) fn near(likelihood: Likelihood<'_>, start: &Candidate) -> Best {
    let (numbers, value) = climb(likelihood, start.numbers().into(), None, &unknown(), CLOSE);
    // Once more, with what is known of the shape there: long flat ridges end a first search too soon.
    let (numbers, log_likelihood) = climb(likelihood, numbers, None, &spread(likelihood, &numbers, value), CLOSE);
    Best { candidate: Candidate::of(&numbers.into()), log_likelihood }
}

/// The same, about as good, where the start is nearly the best: what it takes to compare likelihoods.
pub(super) fn again(likelihood: Likelihood<'_>, start: &Candidate) -> Best {
    let (numbers, log_likelihood) = climb(likelihood, start.numbers().into(), None, &unknown(), CLOSE_AT_END);
    Best { candidate: Candidate::of(&numbers.into()), log_likelihood }
}

/// The best candidate, from the best points of a grid.
pub(super) fn best(likelihood: Likelihood<'_>, more: Option<Candidate>) -> Best {
    let mut starts: Vec<Candidate> = Vec::new();
    for factor in [0.85, 0.93, 1.0, 1.08, 1.17] {
        for middle in [-6.0, -2.0, 2.0, 6.0] {
            for third in [-5.0, 0.0, 5.0] {
                for noise in [1.5, 5.0] {
                    starts.push(Candidate { factor, late: [0.0, middle, third], noise, missed: [0.01; 3] });
                }
            }
        }
    }
    let mut starts: Vec<(Candidate, f64)> =
        starts.into_par_iter().map(|candidate| (candidate, likelihood(&candidate))).collect();
    starts.sort_by(|a, b| b.1.total_cmp(&a.1));
    starts.truncate(STARTS);
    starts.extend(more.map(|candidate| (candidate, likelihood(&candidate))));
    let climbed: Vec<Best> = starts.par_iter().map(|(start, _)| near(likelihood, start)).collect();
    let best = climbed.into_iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
    best.unwrap_or(Best { candidate: Candidate::of(&[0.0; NUMBERS]), log_likelihood: f64::NAN })
}

/// Where an interval ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ends {
    /// The candidates at the lower and at the upper end; none where the likelihood does not say how far one may go.
    pub(super) ends: [Option<Candidate>; 2],
    /// A better candidate than the best so far, if one was found on the way.
    pub(super) better: Option<Best>,
}

/// The intervals of all numbers by profile likelihood: as far as the best candidates with other values of a number explain
/// the touches nearly as well. Method: Venzon and Moolgavkar, A method for computing profile-likelihood-based confidence
/// intervals, Applied Statistics 37 (1988), here by secants from where the curvatures at the maximum say.
pub(super) fn intervals(likelihood: Likelihood<'_>, best: &Best) -> Vec<Ends> {
    let spread = spread(likelihood, &best.candidate.numbers().into(), best.log_likelihood);
    (0..NUMBERS).into_par_iter().map(|index| interval(likelihood, best, &spread, index)).collect()
}

fn interval(likelihood: Likelihood<'_>, best: &Best, spread: &Pairs, index: usize) -> Ends {
    let center: Numbers = best.candidate.numbers().into();
    let mut better: Option<Best> = None;
    let root = QUANTILE.sqrt();
    let known = spread_at(spread, index);
    // Where the others go as this one does.
    let way = spread.column(index) / spread[(index, index)];
    let mut end = |sign: f64| -> Option<Candidate> {
        // A share of missed contacts cannot be below 0.
        let floor = (index >= 4 && sign < 0.0).then_some(0.0);
        let mut step = (root * spread[(index, index)].sqrt()).clamp(0.1, 4.0);
        // The farthest value that is still inside, where it is, and the nearest outside, each with its signed root.
        let (mut inside, mut at): ((f64, f64), Numbers) = ((0.0, 0.0), center);
        let (mut outside, mut candidate): (Option<(f64, f64)>, _) = (None, None);
        for _ in 0..14 {
            let mut start = at + way * (sign * (step - inside.0));
            start[index] = center[index] + sign * step;
            let at_floor = floor.is_some_and(|floor| start[index] <= floor);
            if at_floor {
                start[index] = 0.0;
                step = center[index].abs();
            }
            let (numbers, value) = climb(likelihood, start, Some(index), &known, CLOSE_AT_END);
            if value > best.log_likelihood + 0.05 {
                better = Some(Best { candidate: Candidate::of(&numbers.into()), log_likelihood: value });
            }
            let here = (2.0 * (best.log_likelihood - value)).max(0.0).sqrt();
            candidate = Some(Candidate::of(&numbers.into()));
            if (here - root).abs() < 0.08 || at_floor && here < root {
                return candidate;
            }
            if here < root {
                (inside, at) = ((step, here), numbers);
            } else {
                outside = Some((step, here));
            }
            let slope = |(at, height): (f64, f64)| (root - inside.1) * (at - inside.0) / (height - inside.1).max(1e-9);
            step = match outside {
                Some(outside) => {
                    inside.0 + slope(outside).clamp(0.1 * (outside.0 - inside.0), 0.9 * (outside.0 - inside.0))
                }
                // Nothing outside yet: as far as a straight line from the center says, and at most four times as far.
                None => (step * (root / here.max(0.05)) * 1.05).clamp(1.3 * step, 4.0 * step),
            };
            if step > 60.0 {
                return None;
            }
        }
        candidate
    };
    let ends = [end(-1.0), end(1.0)];
    Ends { ends, better }
}
