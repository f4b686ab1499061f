//! Regressions of any size of target: their leaves as a power of two makes them fit, which f32 does without rounding.

use super::forest::MARGIN_RANGE;
use crate::ensemble::{Ensemble, Imported, Node};
use std::borrow::Cow;

/// Margins that stay below this are scaled up: a unit has 2^-24 nats at least.
const SMALL: f64 = 1.0 / 16.0;

/// The ensemble with margins that a model can hold, if it is a regression over rows: its scale makes them what they were.
pub(super) fn scaled(ensemble: &Ensemble) -> Cow<'_, Ensemble> {
    let is_value = ensemble.objects.len() == 1 || ensemble.prediction().targets;
    let is_regression = ensemble.schema().is_none() && is_value;
    let range = range(ensemble);
    if !is_regression || !range.is_finite() || range == 0.0 || (SMALL..=MARGIN_RANGE).contains(&range) {
        return Cow::Borrowed(ensemble);
    }
    // From half of the range to all of it; or around 1.
    let most = if range > MARGIN_RANGE { MARGIN_RANGE } else { 1.0 };
    // A unit times the scale stays a normal number. Targets below 1e-30 keep fewer digits in integer leaves, as the
    // model's error says.
    let exponent = (range / most).log2().ceil().clamp(-100.0, 126.0);
    let factor = (-exponent).exp2() as f32;
    let mut scaled = ensemble.clone();
    let leaves = scaled.trees.iter_mut().flat_map(|tree| &mut tree.nodes).filter_map(|node| match node {
        Node::Leaf(values) => Some(values),
        Node::Split { .. } => None,
    });
    leaves.flatten().chain(&mut scaled.base_margins).for_each(|value| *value *= factor);
    let imported = scaled.origin.imported.get_or_insert_with(Imported::default);
    imported.prediction.scale *= exponent.exp2() as f32;
    Cow::Owned(scaled)
}

/// Largest distance of a margin from 0.
fn range(ensemble: &Ensemble) -> f64 {
    let largest =
        |node: &Node| node.leaf().unwrap_or_default().iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    let of_tree = ensemble.trees.iter().map(|tree| f64::from(tree.nodes.iter().map(largest).fold(0.0, f32::max)));
    of_tree.sum::<f64>() + ensemble.base_margins.iter().fold(0.0_f64, |most, base| most.max(f64::from(base.abs())))
}
