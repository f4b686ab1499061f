//! An ensemble over two features as a table of margins over their thresholds.

use super::leaves::BIAS;
use super::ranks::{Cuts, at_or_missing, rank_in};
use super::{Sections, built_in};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Axis, LeafType};

/// The number of cells of a grid: for each of its two axes, one between any two thresholds, one at either end, and one
/// for a missing value.
pub(crate) fn cells(model: &Sections<'_>) -> Option<usize> {
    let (&[first, second], _) = model.axes_and_cuts() else { return None };
    let side = |bytes| Axis::from_bytes(bytes).map(|axis| usize::from(axis.count) + 2);
    Some(side(first)? * side(second)?)
}

/// The cell that the features fall into.
///
/// Cost: two binary searches, of a load and a comparison a step where an axis has many thresholds.
#[inline(never)]
pub(crate) fn cell(model: &Sections<'_>, features: &[i32]) -> usize {
    let ([first, second], cuts) = model.axes_and_cuts() else { return 0 };
    let mut cuts = Cuts(cuts);
    let row = place(cuts.of(first), first, features);
    // All that are left.
    let column = place(cuts.0, second, features);
    let [.., count] = second;
    row * (usize::from(*count) + 2) + column
}

/// The place along an axis with these thresholds.
#[inline(always)]
fn place(cuts: &[u8], &[feature, _, width, count]: &[u8; Axis::LENGTH], features: &[i32]) -> usize {
    let value = at_or_missing(features, feature);
    let rank = rank_in(cuts, width, value);
    if value == MISSING_FEATURE { usize::from(count) + 1 } else { rank.into() }
}

/// The margins in a cell of a table, in units or as the bits of f32 values.
///
/// Cost: a few instructions for each object.
#[inline(never)]
pub(crate) fn read(model: &Sections<'_>, cell: usize, margins: &mut [i32]) {
    let leaves = model.leaves.get(cell * margins.len() * model.leaf.size()..).unwrap_or_default();
    match model.leaf {
        LeafType::I8 if built_in::leaf(LeafType::I8) => {
            put(margins, leaves, |[value]: [u8; 1]| i32::from(value) - BIAS)
        }
        LeafType::I16 if built_in::leaf(LeafType::I16) => {
            put(margins, leaves, |value: [u8; 2]| i16::from_le_bytes(value).into())
        }
        LeafType::F32 if built_in::leaf(LeafType::F32) => {
            put(margins, leaves, |value: [u8; 4]| i32::from_le_bytes(value))
        }
        // Refused when the model was opened.
        _ => {}
    }
}

/// Sets margins to what `value_of` makes of `SIZE` elements each.
#[inline(always)]
pub(crate) fn put<T: Copy, const SIZE: usize>(margins: &mut [i32], values: &[T], value_of: impl Fn([T; SIZE]) -> i32) {
    let (values, _) = values.as_chunks();
    let (pairs, last) = margins.as_chunks_mut();
    let after = values.get(2 * pairs.len());
    // Two at a time: half the steps, and no call that copies memory, which takes more flash than all of this.
    for ([first, second], &[a, b]) in pairs.iter_mut().zip(values.as_chunks().0) {
        *first = value_of(a);
        *second = value_of(b);
    }
    if let ([last], Some(&value)) = (last, after) {
        *last = value_of(value);
    }
}
