//! Trees that another program holds in memory, such as scikit-learn's, which no file holds.

use super::draft::{Draft, DraftTree};
use super::draft_node::DraftNode;
use crate::ensemble::{Ensemble, Output, Probability, Threshold, faults};
use crate::error::Result;
use palpate_shared::format::Prediction;

/// An ensemble in parts: what margins start from, and the trees that are added.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// The library and the kind of model, such as "scikit-learn HistGradientBoostingClassifier".
    pub kind: String,
    /// The features' names; an empty one for a feature that has none of its own.
    pub features: Vec<String>,
    /// The classes' names; empty for default names.
    pub names: Vec<String>,
    /// Starting values of the margins, one for each output.
    pub base: Vec<f64>,
    /// The trees, in the order in which they are added.
    pub trees: Vec<PartTree>,
    /// Notes for the user, each a sentence.
    pub notes: Vec<String>,
    /// Rule by which the library's `predict` turns margins into a class or a value.
    pub prediction: Prediction,
    /// Rule by which its `predict_proba` turns margins into probabilities.
    pub probability: Probability,
    /// True if the library compares values in f64, and does not round rows to f32 first.
    pub compares_f64: bool,
}

/// A tree as columns, one entry for each node; node 0 is its root.
#[derive(Clone, Debug, Default)]
pub struct PartTree {
    /// Output of its leaves, if each has one value; none if each has one for every output.
    pub output: Option<usize>,
    /// The child where `x <= threshold`; negative for a leaf.
    pub left: Vec<i64>,
    /// The other child.
    pub right: Vec<i64>,
    /// The feature that is compared.
    pub feature: Vec<i64>,
    /// The threshold, in f64.
    pub threshold: Vec<f64>,
    /// True if a missing value goes left.
    pub missing_left: Vec<bool>,
    /// Values, of each node as many as a leaf has.
    pub values: Vec<f64>,
}

impl Parts {
    /// The ensemble: comparisons are exact for every f32, and how far margins can be from the f64 sums is computed.
    ///
    /// # Errors
    /// For columns of unequal length, children and features out of range, a node that is reached
    /// twice, and everything that [`Ensemble::check`] refuses.
    pub fn into_ensemble(self, names: Option<&[String]>) -> Result<Ensemble> {
        let Self { kind, features, names: own, base, trees, notes, prediction, probability, compares_f64 } = self;
        let outputs = base.len();
        let trees = trees
            .into_iter()
            .enumerate()
            .map(|(number, tree)| tree.draft(outputs).map_err(|error| error.within(format_args!("tree {number}: "))))
            .collect::<Result<_, _>>()?;
        let draft = Draft { features, names: own, base, trees, kind, notes, ..Draft::default() };
        Draft { prediction, probability, compares_f64, ..draft }.finish(names)
    }
}

impl PartTree {
    fn draft(&self, outputs: usize) -> Result<DraftTree> {
        let nodes = self.left.len();
        let width = if self.output.is_some() { 1 } else { outputs };
        for (column, found, wanted) in [
            ("right", self.right.len(), nodes),
            ("feature", self.feature.len(), nodes),
            ("threshold", self.threshold.len(), nodes),
            ("missing_left", self.missing_left.len(), nodes),
            ("values", self.values.len(), nodes * width),
        ] {
            if found != wanted {
                return Err(faults::column(column, found, wanted));
            }
        }
        let index = |number: i64| usize::try_from(number).unwrap_or(usize::MAX);
        let node = |at: usize| {
            if self.left[at] < 0 {
                return DraftNode::Leaf(self.values[at * width..(at + 1) * width].to_vec());
            }
            let (feature, threshold, missing_left) =
                (index(self.feature[at]), self.threshold[at], self.missing_left[at]);
            let (left, right) = (index(self.left[at]), index(self.right[at]));
            DraftNode::Split { feature, threshold: Threshold::at_or_below(threshold), missing_left, left, right }
        };
        let output = self.output.map_or(Output::Each, Output::One);
        Ok(DraftTree { nodes: (0..nodes).map(node).collect(), output })
    }
}
