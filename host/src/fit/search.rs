//! The candidate that explains recorded touches best, and how far from it one still may be.

use super::candidate::{Hypothesis, NUMBERS};
use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;

/// Objective of the search: the logarithm of the likelihood of a candidate.
type Likelihood<'a> = &'a (dyn Fn(&Hypothesis) -> f64 + Sync);

/// A candidate, and the logarithm of its likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Best {
    pub(super) candidate: Hypothesis,
    pub(super) log_likelihood: f64,
}

/// Iterations of a search at most.
const ITERATIONS: u64 = 900;
/// A search ends when the corners of its simplex are this close in nats: that of the best candidate, and one on the way to the
/// end of an interval, where a hundredth changes nothing that is printed.
const CLOSE: [f64; 2] = [2e-4, 5e-3];
/// Twice the loss of log-likelihood at the ends of an interval of 95 %: 3.84, the quantile of chi squared with one
/// degree of freedom, and more, because the tables come from touches that are simulated and smoothed. With 3.84, 47 of
/// 56 intervals of probes that were known held the speed, offsets and noise.
pub(super) const QUANTILE: f64 = 5.5;
/// From how many points of a grid a search starts.
const STARTS: usize = 3;

struct Cost<'a> {
    likelihood: Likelihood<'a>,
    /// A number that is not searched, and its value.
    fixed: Option<(usize, f64)>,
}

impl Cost<'_> {
    fn numbers(&self, free: &[f64]) -> [f64; NUMBERS] {
        let mut numbers = [0.0; NUMBERS];
        let mut free = free.iter();
        for (index, number) in numbers.iter_mut().enumerate() {
            *number = match self.fixed {
                Some((fixed, value)) if fixed == index => value,
                _ => free.next().copied().unwrap_or_default(),
            };
        }
        numbers
    }
}

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, free: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(-(self.likelihood)(&Hypothesis::of(&self.numbers(free))))
    }
}

/// Nelder–Mead from `start`, repeated from where it ended until that gains nothing; the number `fixed` keeps its value.
fn climb(likelihood: Likelihood<'_>, start: [f64; NUMBERS], fixed: Option<usize>, size: f64) -> ([f64; NUMBERS], f64) {
    let fixed_number = fixed.map(|index| (index, start[index]));
    let (mut best, mut value, mut size) = (start, likelihood(&Hypothesis::of(&start)), size);
    for _ in 0..6 {
        let cost = Cost { likelihood, fixed: fixed_number };
        let free = |numbers: &[f64; NUMBERS]| -> Vec<f64> {
            let kept = numbers.iter().enumerate().filter(|(index, _)| Some(*index) != fixed);
            kept.map(|(_, number)| *number).collect()
        };
        let corner = free(&best);
        let mut simplex = vec![corner.clone(); corner.len() + 1];
        simplex.iter_mut().skip(1).enumerate().for_each(|(index, corner)| corner[index] += size);
        let found =
            NelderMead::new(simplex).with_sd_tolerance(CLOSE[usize::from(fixed.is_some())]).and_then(|solver| {
                Executor::new(cost, solver).configure(|state| state.max_iters(ITERATIONS)).timer(false).run()
            });
        // The search itself cannot fail: its cost function does not.
        let Ok(found) = found else { break };
        let Some(numbers) = found.state().get_best_param() else { break };
        let cost = Cost { likelihood, fixed: fixed_number };
        let numbers = cost.numbers(numbers);
        let gained = likelihood(&Hypothesis::of(&numbers)) - value;
        if gained > 0.0 {
            (best, value) = (numbers, value + gained);
        }
        if gained < 0.02 {
            break;
        }
        size *= 0.5;
    }
    (best, value)
}

/// The best candidate near this one.
pub(super) fn near(likelihood: Likelihood<'_>, start: &Hypothesis) -> Best {
    let (numbers, log_likelihood) = climb(likelihood, start.numbers(), None, 0.7);
    Best { candidate: Hypothesis::of(&numbers), log_likelihood }
}

/// The best candidate, from the best points of a grid.
pub(super) fn best(likelihood: Likelihood<'_>, more: Option<Hypothesis>) -> Best {
    let mut starts: Vec<([f64; NUMBERS], f64)> = Vec::new();
    for factor in [0.85, 0.93, 1.0, 1.08, 1.17] {
        for middle in [-6.0, -2.0, 2.0, 6.0] {
            for third in [-5.0, 0.0, 5.0] {
                for noise in [1.5, 5.0] {
                    let candidate = Hypothesis { factor, late: [0.0, middle, third], noise, missed: [0.01; 3] };
                    starts.push((candidate.numbers(), likelihood(&candidate)));
                }
            }
        }
    }
    starts.sort_by(|a, b| b.1.total_cmp(&a.1));
    starts.truncate(STARTS);
    starts.extend(more.map(|candidate| (candidate.numbers(), likelihood(&candidate))));
    let climbed = starts.into_iter().map(|(start, _)| climb(likelihood, start, None, 1.0));
    let (numbers, log_likelihood) = climbed.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(([0.0; NUMBERS], f64::NAN));
    Best { candidate: Hypothesis::of(&numbers), log_likelihood }
}

/// End of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ends {
    /// The candidates at the lower and at the upper end; none where the likelihood does not say how far one may go.
    pub(super) ends: [Option<Hypothesis>; 2],
    /// A better candidate than the best so far, if one was found on the way.
    pub(super) better: Option<Best>,
}

impl Ends {
    /// The interval of number `index`, widened by another source of uncertainty that is independent of it: half widths add
    /// up in quadrature.
    pub(super) fn widened(mut self, index: usize, center: f64, adds: f64) -> Self {
        for (end, sign) in self.ends.iter_mut().zip([-1.0, 1.0]) {
            let Some(end) = end else { continue };
            let mut numbers = end.numbers();
            numbers[index] = center + sign * (numbers[index] - center).hypot(adds);
            // A share of missed contacts cannot be below 0.
            if index >= 4 {
                numbers[index] = numbers[index].max(0.0);
            }
            *end = Hypothesis::of(&numbers);
        }
        self
    }
}

/// The interval of number `index` by profile likelihood: as far as the best candidates with other values of it explain the
/// touches nearly as well. Method: Venzon and Moolgavkar, A method for computing profile-likelihood-based confidence
/// intervals, Applied Statistics 37 (1988), here by secants.
pub(super) fn interval(likelihood: Likelihood<'_>, best: &Best, index: usize) -> Ends {
    let center = best.candidate.numbers();
    let mut better: Option<Best> = None;
    let root = QUANTILE.sqrt();
    let mut end = |sign: f64| -> Option<Hypothesis> {
        // A share of missed contacts cannot be below 0.
        let floor = (index >= 4 && sign < 0.0).then_some(0.0);
        let (mut step, mut from) = (0.3, center);
        // The farthest value that is still inside, and the nearest outside, each with its signed root.
        let (mut inside, mut outside): ((f64, f64), Option<(f64, f64)>) = ((0.0, 0.0), None);
        let mut candidate = None;
        for _ in 0..14 {
            let mut start = from;
            start[index] = center[index] + sign * step;
            let at_floor = floor.is_some_and(|floor| start[index] <= floor);
            if at_floor {
                start[index] = 0.0;
                step = center[index].abs();
            }
            let (numbers, value) = climb(likelihood, start, Some(index), 0.4);
            if value > best.log_likelihood + 0.05 {
                better = Some(Best { candidate: Hypothesis::of(&numbers), log_likelihood: value });
            }
            let here = (2.0 * (best.log_likelihood - value)).max(0.0).sqrt();
            candidate = Some(Hypothesis::of(&numbers));
            if (here - root).abs() < 0.08 || at_floor && here < root {
                return candidate;
            }
            if here < root {
                (inside, from) = ((step, here), numbers);
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
