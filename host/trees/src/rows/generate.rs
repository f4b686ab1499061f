//! Rows at which an ensemble decides: made from its splits.

use crate::ensemble::{Ensemble, Node, Threshold};

/// Values at which a comparison may go wrong, for every feature.
const SPECIAL: [f32; 9] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 0.0, -0.0, 1e-42, -1e-42];

/// Rows that lead to every split of the ensemble, with its feature at the threshold, one step to each side of it, and
/// missing; and rows with one feature missing, infinite or subnormal, or one that stands for a missing value. The other
/// features are those of `rows` in turn, as far as the way to the split allows.
///
/// `around` gives the last value below a threshold of a feature, the first at or above it, and the one after that.
pub fn generate(
    ensemble: &Ensemble,
    rows: &[f64],
    around: impl Fn(usize, Threshold) -> [f64; 3],
    mut see: impl FnMut(&[f64]),
) {
    let features = ensemble.inputs.count();
    let zeros = vec![0.0; features];
    let given: Vec<&[f64]> = rows.chunks_exact(features).collect();
    let mut turn = 0;
    let mut next = || {
        turn += 1;
        given.get(turn % given.len().max(1)).copied().unwrap_or(&zeros)
    };
    for tree in 0..ensemble.trees.len() {
        let mut waiting = vec![(0, vec![Bounds::ALL; features])];
        while let Some((index, bounds)) = waiting.pop() {
            let node = ensemble.trees.get(tree).and_then(|tree| tree.nodes.get(index));
            let (Some(&Node::Split { feature, left, right, .. }), Some(threshold)) =
                (node, ensemble.threshold(tree, index))
            else {
                continue;
            };
            let values = around(feature, threshold);
            let [last, first, _] = values;
            let mut row = next().to_vec();
            bounds.iter().zip(&mut row).for_each(|(bounds, value)| *value = bounds.clamp(*value));
            for value in values.into_iter().chain([f64::NAN]) {
                row[feature] = value;
                see(&row);
            }
            let (mut of_left, mut of_right) = (bounds.clone(), bounds);
            of_left[feature].last = of_left[feature].last.min(last);
            of_right[feature].first = of_right[feature].first.max(first);
            waiting.extend([(right, of_right), (left, of_left)]);
        }
    }
    let sentinel = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let special = SPECIAL.into_iter().chain(sentinel.into_iter().flatten());
    let special: Vec<f64> = special.map(f64::from).collect();
    for feature in 0..features {
        for &value in &special {
            let mut row = next().to_vec();
            row[feature] = value;
            see(&row);
        }
    }
    for value in special {
        see(&vec![value; features]);
    }
}

/// Values of a feature that lead to a node: from `first` to `last`.
#[derive(Clone, Copy)]
struct Bounds {
    first: f64,
    last: f64,
}

impl Bounds {
    const ALL: Self = Self { first: f64::NEG_INFINITY, last: f64::INFINITY };

    /// The value, or the nearest that leads to the node.
    fn clamp(self, value: f64) -> f64 {
        if self.first == f64::NEG_INFINITY && self.last == f64::INFINITY {
            return value;
        }
        // A missing value may go elsewhere: something in between instead.
        let value = if value.is_nan() { self.first.max(self.last) } else { value };
        if value < self.first {
            self.first
        } else if value > self.last {
            self.last
        } else {
            value
        }
    }
}
