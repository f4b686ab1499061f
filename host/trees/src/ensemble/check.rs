//! Checks of an ensemble that was not read from a file: a reader checks while it reads.

use super::columns::MAX_NAME;
use super::{Ensemble, Inputs, Node, Output, Tree};
use crate::error::{EnsembleProblem, NameProblem, TreeProblem};
use std::collections::HashSet;

/// The most objects that a compiled model can distinguish.
pub const MAX_OBJECTS: usize = 256;
/// The most features that a compiled model can have.
pub const MAX_FEATURES: usize = 256;

impl Ensemble {
    /// Checks an ensemble that was put together by hand: 2 to 256 objects (over rows of 1 to 256 features also one) with
    /// names that a file can hold, a base margin for each, at least one tree; in each tree a root, children and features in range, no node reached twice, finite
    /// leaves, thresholds that are numbers (finite ones where the model computes its features), and as many values in a leaf as the tree's [`Output`] says.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), EnsembleProblem> {
        match &self.inputs {
            Inputs::Computed(_) => check_names(&self.objects)?,
            Inputs::Rows(features) => {
                if self.objects.len() != 1 {
                    check_names(&self.objects)?;
                }
                check_features(features, self)?;
            }
        }
        let objects = self.objects.len();
        let finite = self.base_margins.iter().filter(|margin| margin.is_finite()).count();
        if finite != objects || self.base_margins.len() != objects {
            return Err(EnsembleProblem::BaseMargins { found: finite, objects });
        }
        if self.trees.is_empty() {
            return Err(EnsembleProblem::NoTrees);
        }
        let features = self.inputs.count();
        let infinite = self.schema().is_none();
        for (number, tree) in self.trees.iter().enumerate() {
            tree.check(features, objects, infinite)
                .map_err(|problem| EnsembleProblem::Tree { tree: number, problem })?;
        }
        Ok(())
    }
}

impl Tree {
    fn check(&self, features: usize, objects: usize, infinite: bool) -> Result<(), TreeProblem> {
        let nodes = self.nodes.len();
        let wanted = match self.output {
            Output::One(object) if object >= objects => {
                return Err(TreeProblem::Object { object: object as u64, objects });
            }
            Output::One(_) => 1,
            Output::Each => objects,
        };
        if nodes == 0 {
            return Err(TreeProblem::NoNodes);
        }
        let mut reached = vec![false; nodes];
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            if std::mem::replace(&mut reached[node], true) {
                return Err(TreeProblem::ReachedTwice { node });
            }
            match &self.nodes[node] {
                Node::Leaf(values) => check_leaf(node, values, wanted)?,
                &Node::Split { feature, threshold, left, right, .. } => {
                    if feature >= features {
                        return Err(TreeProblem::Feature { node, feature: feature as u64, features });
                    }
                    if threshold.is_nan() || !(infinite || threshold.is_finite()) {
                        return Err(TreeProblem::Threshold { node, threshold });
                    }
                    for (side, child) in [("right", right), ("left", left)] {
                        if child >= nodes {
                            let child = i64::try_from(child).unwrap_or(i64::MAX);
                            return Err(TreeProblem::Child { node, side, child, nodes });
                        }
                        waiting.push(child);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns an error unless a leaf has as many values as wanted, all of them finite.
pub(crate) fn check_leaf(node: usize, values: &[f32], wanted: usize) -> Result<(), TreeProblem> {
    if values.len() != wanted {
        return Err(TreeProblem::LeafValues { node, found: values.len(), wanted });
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(TreeProblem::LeafValue { node, value }),
        None => Ok(()),
    }
}

/// Returns an error unless these can be the names of an ensemble's features.
fn check_features(names: &[String], ensemble: &Ensemble) -> Result<(), EnsembleProblem> {
    if !(1..=MAX_FEATURES).contains(&names.len()) {
        let splits = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match node {
            Node::Split { feature, .. } => Some(feature),
            Node::Leaf(_) => None,
        });
        let used = splits.collect::<HashSet<_>>().len();
        return Err(EnsembleProblem::FeatureCount { count: names.len(), used, most: MAX_FEATURES });
    }
    for name in names {
        if name.len() > MAX_NAME || name.chars().any(char::is_control) {
            return Err(EnsembleProblem::FeatureName { name: name.clone() });
        }
    }
    Ok(())
}

/// Returns an error unless these names can be an ensemble's objects.
pub fn check_names(names: &[String]) -> Result<(), EnsembleProblem> {
    if !(2..=MAX_OBJECTS).contains(&names.len()) {
        return Err(EnsembleProblem::ObjectCount { count: names.len() });
    }
    let mut seen = HashSet::new();
    for name in names {
        let why = if name.is_empty() {
            NameProblem::Empty
        } else if name.chars().any(char::is_control) {
            NameProblem::Control
        } else if name.len() > MAX_NAME {
            NameProblem::Long
        } else if !seen.insert(name) {
            NameProblem::Twice
        } else {
            continue;
        };
        return Err(EnsembleProblem::ObjectName { name: name.clone(), why });
    }
    Ok(())
}
