//! A node of a tree that is being read.

use super::set::Set;
use crate::ensemble::Threshold;

/// A split by a threshold or by a set, or a leaf with its values in f64. Children are positions in the tree's nodes.
#[derive(Debug)]
pub(in crate::ensemble) enum DraftNode {
    Split {
        feature: usize,
        threshold: Threshold,
        missing_left: bool,
        left: usize,
        right: usize,
    },
    /// Categories: [`spelled_out`](super::spelled_out::spelled_out) makes splits by thresholds of it.
    Set {
        feature: usize,
        set: Set,
        missing_inside: bool,
        inside: usize,
        outside: usize,
    },
    Leaf(Vec<f64>),
}
