//! The full model: boosted trees in f32 as the trainer left them.
//!
//! [`Ensemble::save`] and [`Ensemble::load`] write and read an [`Ensemble`] as XGBoost's JSON; [`import`] reads what other
//! libraries trained on rows of features of any kind; [`compile`](crate::compile::compile) turns it into the bytes that the
//! chip reads.

mod check;
pub(crate) mod columns;
pub(crate) mod faults;
pub mod import;
mod inputs;
mod nodes;
mod origin;
mod values;
mod xgboost;

pub(crate) use check::{MAX_FEATURES, check_leaf};
pub use check::{MAX_OBJECTS, check_names};
#[cfg(test)]
pub(crate) use inputs::computed;
pub use inputs::{Inputs, Occurring, Schema};
pub use nodes::Threshold;
pub(crate) use origin::{Columns, Exact, Imported};
pub use origin::{Probability, Provenance};
pub(crate) use values::TOLERATED;

use palpate_shared::format::Prediction;
use std::borrow::Cow;

/// Boosted trees over features, with one margin for each object.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// The features.
    pub inputs: Inputs,
    /// The names of the objects (classes), or of the one output of a regression; a margin's position is its object's
    /// position here.
    pub objects: Vec<String>,
    /// Starting value of every margin, one for each object.
    pub base_margins: Vec<f32>,
    /// The trees, in the order in which their leaves are added.
    pub trees: Vec<Tree>,
    /// Facts about its training; changes no margin.
    pub origin: Provenance,
}

/// One tree; its root is node 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// Splits and leaves.
    pub nodes: Vec<Node>,
    /// Margins that the tree adds to.
    pub output: Output,
}

/// Margins that a tree adds to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A leaf has one value, for the object with this index.
    One(usize),
    /// A leaf has one value for each object.
    Each,
}

/// A node of a tree.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// Left if `feature < threshold` in f32; a missing value (NaN) follows `missing_left`.
    Split {
        /// Index of the feature.
        feature: usize,
        /// The threshold.
        threshold: f32,
        /// True if a missing value goes left.
        missing_left: bool,
        /// Index of the left child.
        left: usize,
        /// Index of the right child.
        right: usize,
    },
    /// Values that the tree adds: one value, or one for each object, as the tree's [`Output`] says.
    Leaf(Vec<f32>),
}

impl Node {
    /// A leaf's values.
    pub fn leaf(&self) -> Option<&[f32]> {
        match self {
            Self::Leaf(values) => Some(values),
            Self::Split { .. } => None,
        }
    }
}

impl Tree {
    /// The leaf that `features` (NaN where missing) reach.
    ///
    /// # Panics
    /// If a child's or a feature's index is out of range, which [`Ensemble::check`] rules out.
    pub(crate) fn leaf(&self, features: &[f32]) -> &[f32] {
        self.nodes[self.leaf_node(features)].leaf().unwrap_or_default()
    }

    /// The index of that leaf among the nodes.
    pub fn leaf_node(&self, features: &[f32]) -> usize {
        let mut index = 0;
        while let Node::Split { feature, threshold, missing_left, left, right } = &self.nodes[index] {
            let value = features[*feature];
            let goes_left = if value.is_nan() { *missing_left } else { value < *threshold };
            index = if goes_left { *left } else { *right };
        }
        index
    }
}

impl Ensemble {
    /// The margins of one row of features, in f32, leaves added in tree order to the base margins: the trainer's own
    /// prediction, bit for bit; times the [scale](Prediction::scale) that an imported ensemble states.
    ///
    /// # Panics
    /// If there are fewer features than the ensemble splits on, or it is one that [`Ensemble::check`] refuses.
    pub fn margins_of_features(&self, features: &[f32]) -> Vec<f32> {
        let known = self.known_features(features);
        self.margins_of_leaves(|_, tree| tree.leaf(&known))
    }

    /// The margins where `leaf` says which leaf of a tree is reached, given its number too.
    pub(crate) fn margins_of_leaves<'t>(&'t self, leaf: impl Fn(usize, &'t Tree) -> &'t [f32]) -> Vec<f32> {
        let mut margins = self.base_margins.clone();
        for (number, tree) in self.trees.iter().enumerate() {
            let leaf = leaf(number, tree);
            match tree.output {
                Output::One(object) => margins[object] += leaf[0],
                Output::Each => margins.iter_mut().zip(leaf).for_each(|(margin, value)| *margin += value),
            }
        }
        let scale = self.prediction().scale;
        if scale != 1.0 {
            margins.iter_mut().for_each(|margin| *margin *= scale);
        }
        margins
    }

    /// The features with NaN for those that stand for a missing value.
    pub(crate) fn known_features<'f>(&self, features: &'f [f32]) -> Cow<'f, [f32]> {
        let Some([low, high]) = self.origin.imported.as_ref().and_then(|imported| imported.sentinel) else {
            return Cow::Borrowed(features);
        };
        let known = |&value: &f32| if (low..=high).contains(&value) { f32::NAN } else { value };
        features.iter().map(known).collect()
    }

    /// Rule that turns margins into a class or a value.
    pub fn prediction(&self) -> Prediction {
        self.origin.imported.as_ref().map(|imported| imported.prediction).unwrap_or_default()
    }

    /// The threshold of a split as the file has it that the ensemble is from; `None` for a leaf, or a node that does not
    /// exist.
    pub fn threshold(&self, tree: usize, node: usize) -> Option<Threshold> {
        let Node::Split { threshold, .. } = self.trees.get(tree)?.nodes.get(node)? else { return None };
        let stated = self.origin.imported.as_ref().and_then(|imported| imported.thresholds.get(tree)?.get(node));
        Some(stated.copied().unwrap_or(Threshold::below(f64::from(*threshold))))
    }

    /// The schema of features that the model computes; none of rows.
    pub fn schema(&self) -> Option<&Schema> {
        self.inputs.schema()
    }

    /// Number of objects that can be named: all but the background.
    pub fn known_count(&self) -> usize {
        self.objects.len() - usize::from(self.origin.background && !self.objects.is_empty())
    }
}
