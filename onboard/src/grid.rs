//! An ensemble over two features as a table of margins over their thresholds.

use crate::bytes::take;
use crate::leaves::Sum;
use crate::model::Model;
use crate::ranks::{at_or_missing, rank};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::Axis;

/// Adds the margins of the cell that the features fall into.
///
/// Cost: two binary searches of about ten instructions a step, and five an object.
#[inline(never)]
pub(crate) fn add(model: &Model<'_>, features: &[i32], sum: &mut Sum<'_>) {
    let mut cuts = model.cuts;
    let mut cell = 0;
    for &bytes in model.axes.as_chunks().0 {
        let Some(axis) = Axis::from_bytes(bytes) else { return };
        let Some(cuts) = take(&mut cuts, axis.cuts_length()) else { return };
        let value = at_or_missing(features, axis.feature);
        let count = usize::from(axis.count);
        let place = if value == MISSING_FEATURE { count + 1 } else { usize::from(rank(cuts, axis.width, value)) };
        cell = cell * (count + 2) + place;
    }
    let length = sum.leaf_length();
    if let Some(margins) = model.leaves.get(cell * length..).and_then(|rest| rest.get(..length)) {
        sum.add(margins);
    }
}
