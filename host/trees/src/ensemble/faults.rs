//! Faults of trees that readers of files, the check of an ensemble and the compiler find, in words. Nodes are counted from 0.

use super::MAX_FEATURES;
use crate::error::{Error, problem};
use std::fmt::Display;

/// Advice on an ensemble that contradicts itself.
pub(super) const DAMAGED: &str = "The ensemble is damaged or was changed by hand; train or export it again.";

/// A tree without a root.
pub(crate) fn no_nodes() -> Error {
    problem!("it has no nodes").fix(DAMAGED)
}

/// A tree that adds to an object that does not exist.
pub(crate) fn object(object: impl Display, objects: usize) -> Error {
    problem!("it is for object {object} of {objects}").fix(DAMAGED)
}

/// A node with two parents, or one that is its own ancestor.
pub(crate) fn reached_twice(node: usize) -> Error {
    problem!("node {node} is reached twice: the tree has a cycle or a shared branch").fix(DAMAGED)
}

/// A split on a feature that does not exist.
pub(crate) fn feature(node: usize, feature: impl Display, features: usize) -> Error {
    problem!("node {node}: it splits on feature {feature}, but there are {features}").fix(DAMAGED)
}

/// A threshold that nothing can be compared with.
pub(crate) fn threshold(node: usize, threshold: f32) -> Error {
    problem!("node {node}: its threshold {threshold} is not finite").fix(DAMAGED)
}

/// A child that does not exist.
pub(crate) fn child(node: usize, side: &str, child: impl Display, nodes: usize) -> Error {
    problem!("node {node}: its {side} child {child} is not one of {nodes} nodes").fix(DAMAGED)
}

/// A column of a tree without one entry for each node.
pub(super) fn column(column: &str, found: usize, wanted: usize) -> Error {
    problem!("{column} has {found} entries instead of {wanted}").fix(DAMAGED)
}

/// A count that is written as something else.
pub(super) fn count(name: &str, text: &str) -> Error {
    problem!("{name} is {text:?}, not a count").fix(DAMAGED)
}

/// More features in trees than a model can have, or none at all.
pub(crate) fn feature_count(count: usize, used: usize) -> Error {
    problem!("its trees use {used} of its {count} features, and not 1 to {MAX_FEATURES}")
        .fix(format!("Train on the features that matter, at most {MAX_FEATURES}."))
}

/// An ensemble that adds nothing.
pub(crate) fn no_trees() -> Error {
    problem!("it has no trees").fix(DAMAGED)
}

/// A file of another library that contradicts itself.
pub(crate) fn damaged(kind: &str, what: impl Display) -> Error {
    problem!("not a whole model in the format {kind}: {what}")
        .fix("Save the model again with the library that trained it.")
}
