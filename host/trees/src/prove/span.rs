//! Numbers that leaves of the ensemble add for some rows, and their possible roundings in a model.

use super::boxes::{Rows, Tree};
use super::format;

/// Values that leaves of the ensemble add for some rows: the least and the largest, and the first and last number of whole
/// steps to which each may be rounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
    steps: [f64; 2],
}

impl Span {
    const NONE: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY, steps: [f64::NEG_INFINITY, f64::INFINITY] };

    /// One value.
    pub(super) fn of(value: f64, step: f64) -> Self {
        let mut span = Self::NONE;
        span.or(value, step);
        span
    }

    /// A value that is a whole number of steps.
    pub(super) fn whole(steps: f64, step: f64) -> Self {
        Self { low: steps * step, high: steps * step, steps: [steps; 2] }
    }

    /// Another value of the same tree.
    fn or(&mut self, value: f64, step: f64) {
        (self.low, self.high) = (self.low.min(value), self.high.max(value));
        if step > 0.0 {
            // Halves may be rounded to either side.
            let [low, high] = format::steps(value, step);
            self.steps = [self.steps[0].max(low), self.steps[1].min(high)];
        }
    }

    /// The sum with a span of another tree.
    fn add(&mut self, other: Self) {
        (self.low, self.high) = (self.low + other.low, self.high + other.high);
        let is_none = |steps: [f64; 2]| steps[0] > steps[1];
        self.steps = if is_none(self.steps) || is_none(other.steps) {
            [f64::INFINITY, f64::NEG_INFINITY]
        } else {
            [self.steps[0] + other.steps[0], self.steps[1] + other.steps[1]]
        };
    }

    /// True if `model` is what all these values are rounded to, or all of them where nothing is rounded.
    pub(super) fn is(&self, model: f64, step: f64) -> bool {
        if step > 0.0 {
            let steps = (model / step).round();
            (self.steps[0]..=self.steps[1]).contains(&steps)
        } else {
            self.low == model && self.high == model
        }
    }

    /// The value that is farthest from `model`.
    pub(super) fn farthest(&self, model: f64) -> f64 {
        if (model - self.low).abs() > (self.high - model).abs() { self.low } else { self.high }
    }
}

/// Sums of the leaves that `rows` reach, of every tree by itself, from `start` on.
pub(super) fn spans(trees: &[&Tree], values: usize, start: Span, step: f64, rows: &mut Rows) -> Vec<Span> {
    let mut sums = vec![start; values];
    for tree in trees {
        let mut own = vec![Span::NONE; values];
        let done: Result<(), std::convert::Infallible> = tree.leaves(rows, &mut |leaf, _| {
            own.iter_mut().zip(leaf).for_each(|(own, &value)| own.or(value, step));
            Ok(())
        });
        let Ok(()) = done;
        sums.iter_mut().zip(own).for_each(|(sum, own)| sum.add(own));
    }
    sums
}
