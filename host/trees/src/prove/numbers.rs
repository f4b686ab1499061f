//! The ensemble's numbers as a model's margins have them.

use super::boxes::{Keys, Rule, Step, Tree};
use super::format::Plain;
use crate::ensemble::{Ensemble, Node, Output, Threshold};
use crate::error::Result;

/// Leaves and base margins of an ensemble. Where the model states a scale and an offset for each output, leaves have the middle
/// between their tree's least and largest taken out, and every output is in the scale of the largest.
pub(super) struct Numbers<'n> {
    plain: &'n Plain,
    ensemble: &'n Ensemble,
    /// For each tree the middles of its leaves' values; empty where nothing was taken out.
    middles: Vec<Vec<f64>>,
}

impl<'n> Numbers<'n> {
    pub(super) fn new(plain: &'n Plain, ensemble: &'n Ensemble) -> Self {
        let middles =
            |tree| ensemble.ranges(tree).into_iter().map(|[least, most]| f64::midpoint(least, most)).collect();
        let trees = if plain.scales.is_empty() { 0 } else { ensemble.trees.len() };
        Self { plain, ensemble, middles: (0..trees).map(middles).collect() }
    }

    /// The ensemble's trees over keys, with the library's margins in their leaves.
    ///
    /// # Errors
    /// Errors of [`Tree::new`].
    pub(super) fn trees(&self) -> Result<Vec<Tree>> {
        let Self { plain: Plain { keys, .. }, ensemble, .. } = self;
        let step = |number: usize, index: usize, node: &Node| match node {
            Node::Leaf(_) => Step::Leaf(self.leaf(number, index)),
            &Node::Split { feature, threshold, missing_left, left, right } => {
                let own = ensemble.threshold(number, index).unwrap_or(Threshold::below(threshold.into()));
                let own = if *keys == Keys::Real { Threshold::below(threshold.into()) } else { own };
                Step::Split(Rule { feature, cut: keys.cut(feature, own), missing_left }, [left, right])
            }
        };
        let tree = |(number, tree): (usize, &crate::ensemble::Tree)| {
            let nodes = tree.nodes.iter().enumerate().map(|(index, node)| step(number, index, node)).collect();
            let object = match tree.output {
                Output::One(object) => Some(object),
                Output::Each => None,
            };
            Tree::new(nodes, object)
        };
        ensemble.trees.iter().enumerate().map(tree).collect()
    }

    /// The values of a leaf; none of a split.
    pub(super) fn leaf(&self, tree: usize, node: usize) -> Vec<f64> {
        let scale = f64::from(self.ensemble.prediction().scale);
        let Some(middles) = self.middles.get(tree) else {
            let values = self.ensemble.trees[tree].nodes[node].leaf().unwrap_or_default();
            return values.iter().map(|&value| f64::from(value) * scale).collect();
        };
        let output = self.ensemble.trees[tree].output;
        let value = |(value, own): (usize, f64)| self.held(output.of_value(value), (own - middles[value]) * scale);
        self.ensemble.values(tree, node).enumerate().map(value).collect()
    }

    /// The base margins, with what was taken out of leaves and is not in the offsets.
    pub(super) fn base(&self) -> Vec<f64> {
        let scale = f64::from(self.ensemble.prediction().scale);
        if self.plain.scales.is_empty() {
            return self.ensemble.base_margins.iter().map(|&base| f64::from(base) * scale).collect();
        }
        let mut base = self.ensemble.base();
        for (middles, tree) in self.middles.iter().zip(&self.ensemble.trees) {
            middles.iter().enumerate().for_each(|(value, middle)| base[tree.output.of_value(value)] += middle);
        }
        let rest = |(output, base): (usize, f64)| self.held(output, base * scale - self.plain.scales[output][1]);
        base.into_iter().enumerate().map(rest).collect()
    }

    /// A number of an output, rounded to f32 in the output's scale.
    fn held(&self, output: usize, number: f64) -> f64 {
        f64::from((number / self.plain.scales[output][0]) as f32) * self.plain.scale
    }
}
