//! An ensemble over two features as a table of margins over their thresholds.

use crate::leaves::Sum;
use crate::model::Model;
use crate::ranks::{Cuts, at_or_missing, rank_in};
use palpate_shared::MISSING_FEATURE;

/// Adds the margins of the cell that the features fall into.
///
/// Cost: two binary searches of about 13 instructions a step on a Cortex-M4, 24 on a Cortex-M0+; then one leaf.
pub(crate) fn add(model: &Model<'_>, features: &[i32], sum: &mut Sum<'_>) {
    let mut cuts = Cuts::new(model);
    let mut cell = 0;
    for &[feature, _, width, count] in model.axes.as_chunks().0 {
        let window = cuts.next(width, count);
        let value = at_or_missing(features, feature);
        let count = usize::from(count);
        let place = if value == MISSING_FEATURE { count + 1 } else { rank_in(window, width, value).into() };
        cell = cell * (count + 2) + place;
    }
    let length = sum.leaf_length();
    if let Some(leaf) = model.leaves.get(cell * length..).and_then(|leaves| leaves.get(..length)) {
        sum.add(leaf);
    }
    let bias = sum.settle(1);
    sum.margins.iter_mut().for_each(|margin| *margin = margin.wrapping_sub(bias));
}
