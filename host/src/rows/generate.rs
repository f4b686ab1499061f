//! Rows at which an ensemble decides: made from its splits.

use crate::ensemble::{Ensemble, Node, Tree};

/// Values at which a comparison may go wrong, for every feature.
const SPECIAL: [f32; 9] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 0.0, -0.0, 1e-42, -1e-42];

/// Rows that lead to every split of the ensemble, with its feature at the threshold, one step to each side of it
/// (`step` says which values these are), and missing; and rows with one feature missing, infinite or subnormal. The other
/// features are those of `rows` in turn, as far as the way to the split allows.
pub fn generate(ensemble: &Ensemble, rows: &[f32], step: impl Fn(usize, f32) -> [f32; 3], mut see: impl FnMut(&[f32])) {
    let features = ensemble.inputs.count();
    let zeros = vec![0.0; features];
    let given: Vec<&[f32]> = rows.chunks_exact(features).collect();
    let mut turn = 0;
    let mut next = || {
        turn += 1;
        given.get(turn % given.len().max(1)).copied().unwrap_or(&zeros)
    };
    for tree in &ensemble.trees {
        for (split, bounds) in splits(tree, features) {
            let &Node::Split { feature, threshold, .. } = split else { continue };
            let mut row = next().to_vec();
            bounds.iter().zip(&mut row).for_each(|(bounds, value)| *value = bounds.clamp(*value));
            for value in step(feature, threshold).into_iter().chain([f32::NAN]) {
                row[feature] = value;
                see(&row);
            }
        }
    }
    for feature in 0..features {
        for value in SPECIAL {
            let mut row = next().to_vec();
            row[feature] = value;
            see(&row);
        }
    }
    for value in SPECIAL {
        see(&vec![value; features]);
    }
}

/// Which values of a feature lead to a node: at least `low`, below `high`.
#[derive(Clone, Copy)]
struct Bounds {
    low: f32,
    high: f32,
}

impl Bounds {
    const ALL: Self = Self { low: f32::NEG_INFINITY, high: f32::INFINITY };

    /// The value, or the nearest that leads to the node.
    fn clamp(self, value: f32) -> f32 {
        if self.low == f32::NEG_INFINITY && self.high == f32::INFINITY {
            return value;
        }
        // A missing value may go elsewhere: something in between instead.
        let value = if value.is_nan() { self.low.max(self.high.next_down()) } else { value };
        if value < self.low {
            self.low
        } else if value >= self.high {
            self.high.next_down()
        } else {
            value
        }
    }
}

/// The splits of a tree, each with the bounds of every feature on the way to it.
fn splits(tree: &Tree, features: usize) -> impl Iterator<Item = (&Node, Vec<Bounds>)> {
    let mut waiting = vec![(0, vec![Bounds::ALL; features])];
    std::iter::from_fn(move || {
        loop {
            let (index, bounds) = waiting.pop()?;
            let node = tree.nodes.get(index)?;
            if let &Node::Split { feature, threshold, left, right, .. } = node {
                let mut of_left = bounds.clone();
                of_left[feature].high = of_left[feature].high.min(threshold);
                let mut of_right = bounds.clone();
                of_right[feature].low = of_right[feature].low.max(threshold);
                waiting.extend([(right, of_right), (left, of_left)]);
                return Some((node, bounds));
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::{Inputs, Origin, Output};

    #[test]
    fn every_split_is_reached_and_decided_both_ways() {
        let split =
            |feature, threshold, left, right| Node::Split { feature, threshold, missing_left: true, left, right };
        let leaf = |value: f32| Node::Leaf(vec![value]);
        let nodes = vec![
            split(0, 5.0, 1, 2),
            split(1, -1.0, 3, 4),
            split(0, 9.0, 5, 6),
            leaf(1.0),
            split(0, 1.0, 7, 8),
            leaf(2.0),
            leaf(3.0),
            leaf(4.0),
            leaf(5.0),
        ];
        let ensemble = Ensemble {
            inputs: Inputs::unnamed(2),
            objects: vec!["value".into()],
            base_margins: vec![0.0],
            trees: vec![Tree { nodes, output: Output::One(0) }],
            origin: Origin::default(),
        };
        let mut reached = std::collections::BTreeSet::new();
        let mut count = 0;
        let around = |_, threshold: f32| [threshold.next_down(), threshold, threshold.next_up()];
        generate(&ensemble, &[7.0, 7.0], around, |row| {
            count += 1;
            reached.insert(ensemble.margins_of_features(row)[0].to_bits());
        });
        assert_eq!(reached.len(), 5, "every leaf");
        assert_eq!(count, 4 * 4 + 9 * 2 + 9);
    }
}
