//! An ensemble over two features as a table of margins over their thresholds.

use super::leaves::BIAS;
use super::ranks::Cuts;
use super::{Sections, built_in};
use palpate_shared::format::{Axis, LeafType};

/// The number of cells of a grid: for each of its two axes, one between any two thresholds, one at either end, and one
/// for a missing value.
pub(crate) fn cells(model: &Sections<'_>) -> Option<usize> {
    let (&[first, second], _) = model.axes_and_cuts() else { return None };
    let side = |bytes| Axis::from_bytes(bytes).map(|axis| usize::from(axis.count) + 2);
    Some(side(first)? * side(second)?)
}

/// The margins of the cell that the features fall into, in units or as the bits of f32 values.
///
/// Cost: two binary searches of about 12 instructions per step on a Cortex-M4, 25 on a Cortex-M0+; then four or five
/// instructions per object.
#[inline(never)]
pub(crate) fn look_up(model: &Sections<'_>, features: &[i32], margins: &mut [i32]) {
    let (axes, cuts) = model.axes_and_cuts();
    let mut cuts = Cuts(cuts);
    let mut cell = 0;
    for axis in axes {
        let &[.., count] = axis;
        let count = usize::from(count);
        let place = cuts.rank(axis, features).map_or(count + 1, usize::from);
        cell = cell * (count + 2) + place;
    }
    read(model, cell, margins);
}

/// The margins in a cell of a table, in units or as the bits of f32 values.
#[inline(always)]
pub(super) fn read(model: &Sections<'_>, cell: usize, margins: &mut [i32]) {
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
