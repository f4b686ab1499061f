//! Search for the tree of a compiled model that adds another leaf than the ensemble's.

use super::reference::Reference;
use crate::ensemble::Ensemble;
use crate::prove::{Reached, leaves_at};
use palpate_onboard::Model;

/// The first tree, in the ensemble's order, whose leaf for this row differs between the model and the ensemble.
/// `None` if there is none, or the model has no trees.
pub(super) fn first_different_tree(
    model: &Model<'_>,
    reference: &Reference<'_>,
    ensemble: &Ensemble,
    row: &[f64],
) -> Option<usize> {
    let encoded = reference.encoder.row(row);
    let reached = leaves_at(model, ensemble, &encoded, |tree| reference.leaf_node(tree, row, &encoded)).ok()?;
    let different = reached.iter().filter_map(|Reached { source, step, values: own, expected }| {
        // Half a step for each tree, or nothing with f32 leaves.
        let slack = 0.501 * step * source.trees.len() as f64;
        let differs = own.iter().zip(expected).any(|(own, expected)| (own - expected).abs() > slack);
        source.trees.first().filter(|_| differs).copied()
    });
    different.min()
}
