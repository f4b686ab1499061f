//! Checks of an ensemble that was not read from a file: a reader checks while it reads.

use super::columns::MAX_NAME;
use super::faults::{self, DAMAGED};
use super::{Ensemble, Inputs, Node, Output, Tree};
use crate::error::{Error, Result, problem};
use std::collections::HashSet;

/// The most objects that a compiled model can distinguish.
pub const MAX_OBJECTS: usize = 256;
/// The most features that a compiled model can have.
pub(crate) const MAX_FEATURES: usize = 256;

impl Ensemble {
    /// Checks an ensemble that was put together by hand: 2 to 256 objects (over rows of 1 to 256 features also one) with
    /// names that a file can hold, a base margin for each, at least one tree; in each tree a root, children and features in range, no node reached twice, finite
    /// leaves, thresholds that are numbers (finite ones where the model computes its features), and as many values in a leaf as the tree's [`Output`] says.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<()> {
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
            return Err(problem!("it has {finite} finite base margins for {objects} objects").fix(DAMAGED));
        }
        if self.trees.is_empty() {
            return Err(faults::no_trees());
        }
        let features = self.inputs.count();
        let infinite = self.schema().is_none();
        for (number, tree) in self.trees.iter().enumerate() {
            tree.check(features, objects, infinite).map_err(|error| error.within(format_args!("tree {number}: ")))?;
        }
        Ok(())
    }
}

impl Tree {
    fn check(&self, features: usize, objects: usize, infinite: bool) -> Result<()> {
        let nodes = self.nodes.len();
        let wanted = match self.output {
            Output::One(object) if object >= objects => return Err(faults::object(object, objects)),
            Output::One(_) => 1,
            Output::Each => objects,
        };
        if nodes == 0 {
            return Err(faults::no_nodes());
        }
        let mut reached = vec![false; nodes];
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            if std::mem::replace(&mut reached[node], true) {
                return Err(faults::reached_twice(node));
            }
            match &self.nodes[node] {
                Node::Leaf(values) => check_leaf(node, values, wanted)?,
                &Node::Split { feature, threshold, left, right, .. } => {
                    if feature >= features {
                        return Err(faults::feature(node, feature, features));
                    }
                    if threshold.is_nan() || !(infinite || threshold.is_finite()) {
                        return Err(faults::threshold(node, threshold));
                    }
                    for (side, child) in [("right", right), ("left", left)] {
                        if child >= nodes {
                            return Err(faults::child(node, side, child, nodes));
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
pub(crate) fn check_leaf(node: usize, values: &[f32], wanted: usize) -> Result<()> {
    if values.len() != wanted {
        return Err(problem!("leaf {node} has {} values instead of {wanted}", values.len()).fix(DAMAGED));
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(problem!("leaf {node} has the value {value}, which is not finite").fix(DAMAGED)),
        None => Ok(()),
    }
}

/// Returns an error unless these can be the names of an ensemble's features.
fn check_features(names: &[String], ensemble: &Ensemble) -> Result<()> {
    if !(1..=MAX_FEATURES).contains(&names.len()) {
        let splits = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match node {
            Node::Split { feature, .. } => Some(feature),
            Node::Leaf(_) => None,
        });
        let used = splits.collect::<HashSet<_>>().len();
        return Err(faults::feature_count(names.len(), used));
    }
    for name in names {
        if name.len() > MAX_NAME || name.chars().any(char::is_control) {
            return Err(problem!(
                "the feature's name {name:?} is longer than {MAX_NAME} bytes or has a control character in it"
            )
            .fix("Give the feature a shorter name before training."));
        }
    }
    Ok(())
}

/// Advice on the names of objects.
const NAMES: &str = "Use 2 to 256 different names of at most 255 bytes, without tabs and line ends.";

/// A number of objects that no ensemble can have.
pub(super) fn object_count(count: usize) -> Error {
    problem!("it names {count} objects").fix(NAMES)
}

/// Returns an error unless these names can be an ensemble's objects.
pub fn check_names(names: &[String]) -> Result<()> {
    if !(2..=MAX_OBJECTS).contains(&names.len()) {
        return Err(object_count(names.len()));
    }
    let mut seen = HashSet::new();
    for name in names {
        let wrong = if name.is_empty() {
            problem!("an object has an empty name")
        } else if name.chars().any(char::is_control) {
            problem!("the object's name {name:?} has a control character in it")
        } else if name.len() > MAX_NAME {
            problem!("the object's name {name:?} has more than {MAX_NAME} bytes")
        } else if !seen.insert(name) {
            problem!("it has the object {name:?} twice")
        } else {
            continue;
        };
        return Err(wrong.fix(NAMES));
    }
    Ok(())
}
