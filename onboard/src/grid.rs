//! An ensemble over two features as a table of margins over their thresholds.

use crate::leaves::BIAS;
use crate::model::Model;
use crate::ranks::{Cuts, at_or_missing, rank_in};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::LeafType;

/// The margins of the cell that the features fall into, in units or as the bits of f32 values.
///
/// Cost: two binary searches of about 12 instructions a step on a Cortex-M4, 25 on a Cortex-M0+; then four or five
/// instructions an object.
#[inline(never)]
pub(crate) fn look_up(model: &Model<'_>, features: &[i32], margins: &mut [i32]) {
    let mut cuts = Cuts::new(model);
    let mut cell = 0;
    for &[feature, _, width, count] in model.axes.as_chunks().0 {
        let window = cuts.next(width, count);
        let value = at_or_missing(features, feature);
        let count = usize::from(count);
        let place = if value == MISSING_FEATURE { count + 1 } else { rank_in(window, width, value).into() };
        cell = cell * (count + 2) + place;
    }
    let leaves = model.leaves.get(cell * margins.len() * model.leaf.size()..).unwrap_or_default();
    match model.leaf {
        LeafType::I8 => put(margins, leaves, |[value]| i32::from(value) - BIAS),
        LeafType::I16 => put(margins, leaves, |value| i16::from_le_bytes(value).into()),
        LeafType::F32 if model.is_float() => put(margins, leaves, i32::from_le_bytes),
        LeafType::F32 => {}
    }
}

#[inline(always)]
fn put<const SIZE: usize>(margins: &mut [i32], leaves: &[u8], value_of: impl Fn([u8; SIZE]) -> i32) {
    for (margin, value) in margins.iter_mut().zip(leaves.as_chunks().0) {
        *margin = value_of(*value);
    }
}
