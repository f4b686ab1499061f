//! Search for the tree of a compiled model that adds another leaf than the ensemble's: trees are tried one by one, in
//! copies of the model in which all other leaves are 0.

use super::reference::{self, Reference};
use crate::compile;
use crate::ensemble::{Ensemble, Output};
use crate::rows::Encoder;
use palpate_onboard::Model;
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH, Layout, LeafType, checksum};
use std::ops::Range;

/// The first tree, in the ensemble's order, whose leaf for this row differs between the model and the ensemble.
/// `None` if there is none, or the model is a table and has no trees.
pub(super) fn first_different_tree(
    model: &Model<'_>,
    reference: &Reference<'_>,
    ensemble: &Ensemble,
    row: &[f64],
) -> Option<usize> {
    // Each leaf's values where the leaf is, so that those of one tree alone can be changed.
    let plain = compile::unshared(model).ok()?;
    let plain = plain.as_deref().map(Model::new).transpose().ok()?;
    let model = plain.as_ref().unwrap_or(model);
    let scales = if let Encoder::Scaled(scales) = &reference.encoder { Some(scales.as_slice()) } else { None };
    let order = compile::order(ensemble, model.leaf_type(), scales, &compile::ends_of_walks(model), None).ok()?;
    let leaves = leaves(model)?;
    if order.len() != leaves.len() {
        return None;
    }
    let encoded = reference.encoder.row(row);
    // Of shares of votes.
    let scale = ensemble.prediction().scale;
    let mut different = order.iter().zip(&leaves).filter_map(|(source, leaves)| {
        // Trees that were merged are of one object.
        let &number = source.trees.first()?;
        let tree = ensemble.trees.get(number)?;
        let unit = reference::unit(model) * f64::from(leaves.shift).exp2();
        let bytes = isolated(model, &leaves.bytes);
        let own = reference::margins(&Model::new(&bytes).ok()?, &encoded);
        let leaf = |object: usize| {
            let own = |&number: &usize| f64::from(reference.leaf(number, row, &encoded)[object] * scale);
            source.trees.iter().map(own).sum::<f64>() - f64::from(source.offset) * unit
        };
        // Half a unit of the leaf of each tree, or nothing.
        let slack = match model.leaf_type() {
            LeafType::F32 => 0.0,
            LeafType::I8 | LeafType::I16 => 0.501 * unit * source.trees.len() as f64,
        };
        let expected = |object: usize| match tree.output {
            Output::One(own) => {
                if own == object {
                    leaf(0)
                } else {
                    0.0
                }
            }
            Output::Each => leaf(object),
        };
        let differs = own.iter().enumerate().any(|(object, own)| (own - expected(object)).abs() > slack);
        differs.then_some(number)
    });
    let first = different.next()?;
    Some(different.fold(first, usize::min))
}

/// Leaves of a tree, and their shift.
struct Leaves {
    bytes: Range<usize>,
    shift: u8,
}

/// The leaves of each tree, in the model's order.
fn leaves(model: &Model<'_>) -> Option<Vec<Leaves>> {
    if matches!(model.layout(), Layout::Grid | Layout::Patterns) {
        return None;
    }
    let length = usize::try_from(model.header().leaves_length()).ok()?;
    let mut at = model.bytes().len() - CHECKSUM_LENGTH - length;
    let mut found = Vec::new();
    for (group, trees) in compile::leaves_of_trees(model) {
        let values = if group.object.is_some() { 1 } else { model.object_count() };
        for leaves in trees {
            let end = at + leaves * values * model.leaf_type().size();
            found.push(Leaves { bytes: at..end, shift: group.shift });
            at = end;
        }
    }
    Some(found)
}

/// The model with no leaves but these, and margins that start from 0.
fn isolated(model: &Model<'_>, keep: &Range<usize>) -> Vec<u8> {
    let mut bytes = model.bytes().to_vec();
    let header = model.header();
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    let base = HEADER_LENGTH + length(header.text_length()) + length(header.optional_length());
    bytes[base..base + 4 * model.object_count()].fill(0);
    let end = bytes.len() - CHECKSUM_LENGTH;
    let start = end - length(header.leaves_length());
    // Bytes are stored with 128 added.
    let zero = if model.leaf_type() == LeafType::I8 { 128 } else { 0 };
    bytes[start..keep.start].fill(zero);
    bytes[keep.end..end].fill(zero);
    let sum = checksum(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&sum);
    bytes
}
