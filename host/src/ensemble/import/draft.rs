//! An ensemble in f64, as most libraries have it, on the way to f32.

use super::{Imported, default_names, named};
use crate::ensemble::{Ensemble, Inputs, MAX_FEATURES, MAX_OBJECTS, Node, Origin, Output, Tree};
use crate::error::EnsembleProblem;
use std::collections::BTreeSet;

/// An ensemble that is being read.
#[derive(Default)]
pub(super) struct Draft {
    /// The features' names; empty for those that have none of their own.
    pub(super) features: Vec<String>,
    /// The outputs' names; empty for default names.
    pub(super) names: Vec<String>,
    /// What margins start from, in f64.
    pub(super) base: Vec<f64>,
    pub(super) trees: Vec<DraftTree>,
    pub(super) kind: String,
    pub(super) notes: Vec<String>,
    /// Whether the library adds f32 too, in an order of its own.
    pub(super) f32_sums: bool,
}

/// A tree whose leaves have values in f64.
pub(super) struct DraftTree {
    pub(super) nodes: Vec<DraftNode>,
    pub(super) output: Output,
}

pub(super) enum DraftNode {
    Split { feature: usize, threshold: f32, missing_left: bool, left: usize, right: usize },
    Leaf(Vec<f64>),
}

impl Draft {
    /// The ensemble in f32, checked.
    pub(super) fn finish(mut self, names: Option<&[String]>) -> Result<Ensemble, EnsembleProblem> {
        let outputs = self.base.len();
        if outputs > MAX_OBJECTS {
            return Err(EnsembleProblem::ObjectCount { count: outputs });
        }
        if self.names.is_empty() {
            self.names = default_names(outputs);
        }
        let count = self.features.len();
        if count > MAX_FEATURES {
            let used = self.used_features();
            return Err(EnsembleProblem::FeatureCount { count, used, most: MAX_FEATURES });
        }
        for (index, name) in self.features.iter_mut().enumerate() {
            if name.is_empty() {
                *name = Inputs::default_name(index);
            }
        }
        let rounding = self.rounding();
        let objects = named(names, self.names)?;
        let base_margins = self.base.iter().map(|&base| base as f32).collect();
        let trees = self.trees.into_iter().map(DraftTree::finish).collect();
        let imported = Imported { kind: self.kind, rounding, notes: self.notes };
        let origin = Origin { imported: Some(imported), ..Origin::default() };
        let ensemble = Ensemble { inputs: Inputs::Rows(self.features), objects, base_margins, trees, origin };
        ensemble.check()?;
        Ok(ensemble)
    }

    pub(super) fn used_features(&self) -> usize {
        let nodes = self.trees.iter().flat_map(|tree| &tree.nodes);
        let features = nodes.filter_map(|node| match node {
            DraftNode::Split { feature, .. } => Some(feature),
            DraftNode::Leaf(_) => None,
        });
        features.collect::<BTreeSet<_>>().len()
    }

    /// The farthest that a margin in f32 can be from the same in f64: what leaves lose, and half an ulp of the largest
    /// partial sum at each addition. NaN for leaves that are not finite, which are refused.
    fn rounding(&self) -> f64 {
        let lost = |value: f64| (value - f64::from(value as f32)).abs();
        let mut worst = 0.0_f64;
        for (object, &base) in self.base.iter().enumerate() {
            let sums = if self.f32_sums { 2.0 } else { 1.0 };
            let (mut sum, mut range) = (lost(base), base.abs());
            for tree in &self.trees {
                let position = match tree.output {
                    Output::One(own) if own == object => 0,
                    Output::One(_) => continue,
                    Output::Each => object,
                };
                let values = tree.nodes.iter().filter_map(|node| match node {
                    DraftNode::Leaf(values) => values.get(position).copied(),
                    DraftNode::Split { .. } => None,
                });
                let of_tree = values.fold((0.0, 0.0), |(most, largest), value: f64| {
                    (f64::max(most, lost(value)), f64::max(largest, value.abs()))
                });
                sum += of_tree.0;
                range += of_tree.1;
                sum += sums * range * f64::from(f32::EPSILON) / 2.0;
            }
            worst = worst.max(sum);
        }
        worst
    }
}

impl DraftTree {
    fn finish(self) -> Tree {
        let node = |node| match node {
            DraftNode::Split { feature, threshold, missing_left, left, right } => {
                Node::Split { feature, threshold, missing_left, left, right }
            }
            DraftNode::Leaf(values) => Node::Leaf(values.into_iter().map(|value| value as f32).collect()),
        };
        Tree { nodes: self.nodes.into_iter().map(node).collect(), output: self.output }
    }

    /// A tree of leaves that name their targets. A leaf has one value, if all leaves of the tree are for the same
    /// target, or else one for each, of which those that it does not name are 0.
    pub(super) fn of_targets(nodes: Vec<Targeted>, outputs: usize) -> Self {
        let mut targets = nodes.iter().filter_map(|node| match node {
            Targeted::Leaf(values) => Some(values.iter().map(|(target, _)| *target)),
            Targeted::Split { .. } => None,
        });
        let first = targets.next().and_then(|mut of_leaf| of_leaf.next());
        let same = nodes.iter().all(|node| match node {
            Targeted::Leaf(values) => values.len() <= 1 && values.iter().all(|(target, _)| Some(*target) == first),
            Targeted::Split { .. } => true,
        });
        let output = first.filter(|_| same).map_or(Output::Each, Output::One);
        let node = |node| match node {
            Targeted::Split { feature, threshold, missing_left, left, right } => {
                DraftNode::Split { feature, threshold, missing_left, left, right }
            }
            Targeted::Leaf(values) if same => DraftNode::Leaf(vec![values.first().map_or(0.0, |(_, value)| *value)]),
            Targeted::Leaf(values) => {
                let mut leaf = vec![0.0; outputs];
                for (target, value) in values {
                    // Targets were checked when they were read.
                    if let Some(slot) = leaf.get_mut(target) {
                        *slot += value;
                    }
                }
                DraftNode::Leaf(leaf)
            }
        };
        Self { nodes: nodes.into_iter().map(node).collect(), output }
    }
}

/// A node whose leaf's values name their targets.
#[derive(Clone)]
pub(super) enum Targeted {
    Split { feature: usize, threshold: f32, missing_left: bool, left: usize, right: usize },
    Leaf(Vec<(usize, f64)>),
}
