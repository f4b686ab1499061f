//! An ensemble in f64, as most libraries have it, on the way to f32.

use super::draft_node::DraftNode;
use super::options::{default_names, named};
use super::spelled_out::spelled_out;
use super::votes;
use crate::ensemble::{
    Ensemble, Exact, Imported, Inputs, MAX_OBJECTS, Node, Output, Probability, Provenance, Threshold, Tree,
    check::object_count, columns,
};
use crate::error::Result;
use palpate_shared::format::Prediction;
use std::collections::BTreeMap;

/// An ensemble that is being read.
#[derive(Default)]
pub(super) struct Draft {
    /// The features' names; empty for those that have none of their own.
    pub(super) features: Vec<String>,
    /// The outputs' names; empty for default names.
    pub(super) names: Vec<String>,
    /// Starting values of the margins, in f64.
    pub(super) base: Vec<f64>,
    pub(super) trees: Vec<DraftTree>,
    pub(super) kind: String,
    pub(super) notes: Vec<String>,
    /// True if the library, too, adds in f32, in another order.
    pub(super) f32_sums: bool,
    /// True if it compares values in f64.
    pub(super) compares_f64: bool,
    /// Rule by which the library's `predict` turns margins into a class or a value.
    pub(super) prediction: Prediction,
    /// Rule by which its `predict_proba` turns margins into probabilities.
    pub(super) probability: Probability,
    /// The numbers that stand for a missing value, beside NaN.
    pub(super) sentinel: Option<[f32; 2]>,
    /// Divisor of the library's raw scores that makes log-odds of them, whose softmax are its probabilities.
    pub(super) divisor: Option<f64>,
    /// Categories of columns, by the numbers that stand for them.
    pub(super) categories: BTreeMap<usize, Vec<String>>,
}

/// A tree whose leaves have values in f64.
pub(in crate::ensemble) struct DraftTree {
    pub(in crate::ensemble) nodes: Vec<DraftNode>,
    pub(in crate::ensemble) output: Output,
}

impl Draft {
    /// The ensemble in f32, checked.
    pub(super) fn finish(mut self, names: Option<&[String]>) -> Result<Ensemble> {
        for (number, tree) in self.trees.iter_mut().enumerate() {
            let name = |feature: usize| self.features.get(feature).cloned().unwrap_or_default();
            tree.nodes = spelled_out(std::mem::take(&mut tree.nodes), number, name)?;
        }
        let outputs = self.base.len();
        if outputs > MAX_OBJECTS {
            return Err(object_count(outputs));
        }
        if self.names.is_empty() {
            self.names = default_names(outputs, self.prediction.targets);
        }
        let base = self.base.clone();
        let leaves = self.leaves();
        if let Some(scale) = self.count_votes() {
            self.prediction.scale = scale;
        }
        self.divide();
        let scale = f64::from(self.prediction.scale);
        let rounding = self.rounding(&base, &leaves, scale);
        let is_regression = outputs == 1 || self.prediction.targets;
        let exact = (is_regression && (self.compares_f64 || !self.f32_sums)).then(|| self.exact());
        let objects = named(names, self.names)?;
        let base_margins = self.base.iter().map(|&base| base as f32).collect();
        let mut thresholds = Vec::new();
        let mut trees = Vec::with_capacity(self.trees.len());
        for tree in self.trees {
            let (tree, own) = tree.finish();
            trees.push(tree);
            thresholds.push(own);
        }
        let is_single =
            |threshold: &Threshold| !threshold.inclusive && f64::from(threshold.value as f32) == threshold.value;
        if thresholds.iter().flatten().all(is_single) {
            thresholds.clear();
        }
        let (features, columns) = columns::features(self.features, &mut trees, &mut self.notes)?;
        let imported = Imported {
            kind: self.kind,
            rounding,
            notes: self.notes,
            prediction: self.prediction,
            probability: self.probability,
            sentinel: self.sentinel,
            thresholds,
            columns,
            compares_f64: self.compares_f64,
            exact,
            categories: self.categories,
        };
        let origin = Provenance { imported: Some(imported), ..Provenance::default() };
        let ensemble = Ensemble { inputs: Inputs::Rows(features), objects, base_margins, trees, origin };
        ensemble.check()?;
        Ok(ensemble)
    }

    /// Makes log-odds of raw scores: margins are divided, and the scale makes the library's of them again.
    fn divide(&mut self) {
        let Some(divisor) = self.divisor.filter(|divisor| *divisor != 1.0) else { return };
        let nodes = self.trees.iter_mut().flat_map(|tree| &mut tree.nodes);
        let leaves = nodes.filter_map(|node| if let DraftNode::Leaf(values) = node { Some(values) } else { None });
        leaves.flatten().chain(&mut self.base).for_each(|value| *value /= divisor);
        self.prediction.scale = divisor as f32;
    }

    /// Turns shares of votes into whole numbers, if all trees vote and start from nothing: see [`votes::count`].
    fn count_votes(&mut self) -> Option<f32> {
        let starts = self.base.iter().any(|&base| base != 0.0);
        if starts || self.prediction.targets || self.trees.iter().any(|tree| tree.output != Output::Each) {
            return None;
        }
        let trees = self.trees.len();
        let nodes = self.trees.iter_mut().flat_map(|tree| &mut tree.nodes);
        let leaves = nodes.filter_map(|node| if let DraftNode::Leaf(values) = node { Some(values) } else { None });
        let mut leaves: Vec<_> = leaves.collect();
        votes::count(self.base.len(), trees, &mut leaves)
    }

    /// The values of all leaves, tree by tree.
    fn leaves(&self) -> Vec<Vec<Vec<f64>>> {
        let leaf = |node: &DraftNode| match node {
            DraftNode::Leaf(values) => Some(values.clone()),
            DraftNode::Split { .. } | DraftNode::Set { .. } => None,
        };
        self.trees.iter().map(|tree| tree.nodes.iter().filter_map(leaf).collect()).collect()
    }

    /// The numbers that are added, in f64.
    fn exact(&self) -> Exact {
        let leaf = |node: &DraftNode| match node {
            DraftNode::Leaf(values) => values.clone(),
            DraftNode::Split { .. } | DraftNode::Set { .. } => Vec::new(),
        };
        let leaves = self.trees.iter().map(|tree| tree.nodes.iter().map(leaf).collect()).collect();
        Exact { base: self.base.clone(), leaves }
    }

    /// The farthest that a margin in f32, times `scale`, can be from the library's, which starts from `base` and adds
    /// `leaves`: what leaves lose, and half an ulp of the largest partial sum at each addition. NaN for leaves that are
    /// not finite, which are refused.
    fn rounding(&self, base: &[f64], leaves: &[Vec<Vec<f64>>], scale: f64) -> f64 {
        let lost = |library: f64, own: f64| (library - f64::from(own as f32) * scale).abs();
        let mut worst = 0.0_f64;
        for (object, (&base, &own)) in base.iter().zip(&self.base).enumerate() {
            let sums = if self.f32_sums { 2.0 } else { 1.0 };
            let (mut sum, mut range) = (lost(base, own), base.abs());
            for (tree, leaves) in self.trees.iter().zip(leaves) {
                let position = match tree.output {
                    Output::One(own) if own == object => 0,
                    Output::One(_) => continue,
                    Output::Each => object,
                };
                let own = tree.nodes.iter().filter_map(|node| match node {
                    DraftNode::Leaf(values) => values.get(position).copied(),
                    DraftNode::Split { .. } | DraftNode::Set { .. } => None,
                });
                let values = leaves.iter().filter_map(|values| values.get(position).copied()).zip(own);
                let of_tree = values.fold((0.0, 0.0), |(most, largest), (value, own): (f64, f64)| {
                    (f64::max(most, lost(value, own)), f64::max(largest, value.abs()))
                });
                sum += of_tree.0;
                range += of_tree.1;
                sum += sums * range * f64::from(f32::EPSILON) / 2.0;
            }
            // Shares of votes are a product.
            let product = if scale == 1.0 { 0.0 } else { range * f64::from(f32::EPSILON) };
            worst = worst.max(sum + product);
        }
        worst
    }
}

impl DraftTree {
    /// The tree in f32, and the threshold of each node as the file has it.
    pub(in crate::ensemble) fn finish(self) -> (Tree, Vec<Threshold>) {
        let none = Threshold::below(0.0);
        let node = |node| match node {
            DraftNode::Split { feature, threshold, missing_left, left, right } => match threshold.single() {
                Some(single) => (Node::Split { feature, threshold: single, missing_left, left, right }, threshold),
                None => {
                    // Every number is at or below infinity, infinity too: nothing is below minus infinity.
                    let (nothing, left, right) = (f32::NEG_INFINITY, right, left);
                    let missing_left = !missing_left;
                    let node = Node::Split { feature, threshold: nothing, missing_left, left, right };
                    (node, Threshold::below(f64::NEG_INFINITY))
                }
            },
            DraftNode::Leaf(values) => (Node::Leaf(values.into_iter().map(|value| value as f32).collect()), none),
            // Spelled out before.
            DraftNode::Set { .. } => (Node::Leaf(Vec::new()), none),
        };
        let (nodes, thresholds) = self.nodes.into_iter().map(node).unzip();
        (Tree { nodes, output: self.output }, thresholds)
    }

    /// A tree of leaves that name their targets. A leaf has one value, if all leaves of the tree are for the same
    /// target, or else one for each; those that it does not name are 0.
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
    Split { feature: usize, threshold: Threshold, missing_left: bool, left: usize, right: usize },
    Leaf(Vec<(usize, f64)>),
}
