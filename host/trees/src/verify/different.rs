//! Search for the tree of a compiled model that adds another leaf than the ensemble's.

use super::reference::Reference;
use crate::ensemble::Ensemble;
use crate::prove::leaves_at;
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
    // Share of a vote.
    let scale = f64::from(ensemble.prediction().scale);
    let leaves = leaves_at(model, ensemble, &encoded).ok()?;
    let different = leaves.iter().filter_map(|(source, step, values)| {
        let differs = values.iter().enumerate().any(|(value, own)| {
            let leaf = |&tree: &usize| f64::from(reference.leaf(tree, row, &encoded)[value]) * scale;
            let expected = source.trees.iter().map(leaf).sum::<f64>() - f64::from(source.offset) * step;
            // Half a step for each tree, or nothing with f32 leaves.
            (own - expected).abs() > 0.501 * step * source.trees.len() as f64
        });
        source.trees.first().filter(|_| differs).copied()
    });
    different.min()
}
