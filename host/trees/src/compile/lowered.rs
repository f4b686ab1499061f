//! A forest lowered to what a model and code have: merged trees, their scale, ranks and order.

use super::axes::Axes;
use super::forest::Forest;
use super::merge::Source;
use super::quantize::Scale;
use palpate_shared::format::LeafType;

/// A lowered forest.
pub(super) struct Lowered<'f> {
    pub(super) leaf: LeafType,
    /// Trees that are walked: fewer than the ensemble's, with the same sums, where there are such.
    pub(super) forest: Forest<'f>,
    /// Scale of the trees that are walked.
    pub(super) scale: Scale,
    /// Starting values of the margins: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    /// Trees of the ensemble that each one stands for.
    pub(super) sources: Vec<Source>,
    pub(super) axes: Axes,
    /// The trees in their order, in groups.
    pub(super) runs: Vec<Run>,
    /// Scale of the ensemble's own trees.
    pub(super) rounding: Scale,
}

/// Trees that share a group, in order.
pub(super) struct Run {
    pub(super) object: Option<u8>,
    pub(super) shift: u8,
    pub(super) trees: Vec<usize>,
}
