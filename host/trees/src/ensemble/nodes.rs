//! Code shared by the readers of other libraries' trees.

use super::{Node, faults};
use crate::error::Result;

/// A threshold as a library compares with it: in f64, at times including the threshold itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    /// The number that values are compared with.
    pub value: f64,
    /// True if a value that equals it goes left.
    pub inclusive: bool,
}

impl Threshold {
    /// The test `x <= value`.
    pub(crate) const fn at_or_below(value: f64) -> Self {
        Self { value, inclusive: true }
    }

    /// The test `x < value`.
    pub(crate) const fn below(value: f64) -> Self {
        Self { value, inclusive: false }
    }

    /// The threshold c with which `x < c` sends every f32 x to the same side. There is none for `x <= ∞`, which holds for
    /// every number.
    pub(crate) fn single(self) -> Option<f32> {
        match self {
            Self { value: f64::INFINITY, inclusive: true } => None,
            Self { value, inclusive: true } => Some(after(value)),
            Self { value, inclusive: false } => Some(from(value)),
        }
    }

    /// True if a value goes left.
    pub(crate) fn is_left(self, value: f64) -> bool {
        value < self.value || self.inclusive && value == self.value
    }

    /// True if all whole numbers of units are on one side: the other one is of missing and infinite values alone, as with
    /// CatBoost's border next to the least f32.
    pub(crate) fn is_beyond_all(self) -> bool {
        self.value.abs() >= f64::from(f32::MAX.next_down())
    }

    /// The least whole number of units that goes right, where `scale` units make up 1.
    pub(crate) fn units(self, scale: f32) -> f64 {
        let units = self.value * f64::from(scale);
        // A product within rounding of a whole number is that number.
        let whole = units.round();
        let units = if (units - whole).abs() <= 2.0 * f64::EPSILON * units.abs() { whole } else { units };
        if self.inclusive { units.floor() + 1.0 } else { units.ceil() }
    }
}

/// The threshold c with which `x < c` is `x <= threshold` for every f32 x: the f32 after the largest one that is not
/// above the threshold.
fn after(threshold: f64) -> f32 {
    // `as` rounds to nearest, and values beyond the range to infinity.
    let near = threshold as f32;
    let below = if f64::from(near) > threshold { near.next_down() } else { near };
    below.next_up()
}

/// The threshold c with which `x < c` is `x < threshold` for every f32 x: the smallest f32 that is not below it.
fn from(threshold: f64) -> f32 {
    let near = threshold as f32;
    if f64::from(near) < threshold { near.next_up() } else { near }
}

/// The nodes that the root leads to, in the file's order and numbered again: XGBoost leaves pruned nodes behind. Each
/// may be reached once only, which rules out cycles.
pub(super) fn reachable(count: usize, read: impl Fn(usize) -> Result<Node>) -> Result<Vec<Node>> {
    let mut found: Vec<Option<Node>> = vec![None; count];
    let mut waiting = vec![0];
    while let Some(position) = waiting.pop() {
        let Some(slot) = found.get_mut(position) else { return Err(faults::no_nodes()) };
        if slot.is_some() {
            return Err(faults::reached_twice(position));
        }
        let node = read(position)?;
        if let Node::Split { left, right, .. } = node {
            waiting.extend([right, left]);
        }
        *slot = Some(node);
    }
    let mut numbers = Vec::with_capacity(count);
    let mut next = 0;
    for node in &found {
        numbers.push(next);
        next += usize::from(node.is_some());
    }
    let renumbered = |node| match node {
        Node::Split { feature, threshold, missing_left, left, right } => {
            Node::Split { feature, threshold, missing_left, left: numbers[left], right: numbers[right] }
        }
        leaf @ Node::Leaf(_) => leaf,
    };
    Ok(found.into_iter().flatten().map(renumbered).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_or_below_a_double_is_below_the_next_single() {
        let cases = [0.0, -0.0, 1.0, 0.1, -0.1, 3.500_000_000_000_000_4, 1e-35, 1e-46, -1e-46, 3.4e38, 1e300, -1e300];
        for threshold in cases {
            let (at_most, below) = (after(threshold), from(threshold));
            let near = threshold as f32;
            let around =
                [near.next_down().next_down(), near.next_down(), near, near.next_up(), near.next_up().next_up()];
            for x in around.into_iter().chain([f32::MIN, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0]) {
                if x.is_nan() {
                    continue;
                }
                assert_eq!(x < at_most, f64::from(x) <= threshold, "{x:e} <= {threshold:e}");
                assert_eq!(x < below, f64::from(x) < threshold, "{x:e} < {threshold:e}");
            }
        }
    }
}
