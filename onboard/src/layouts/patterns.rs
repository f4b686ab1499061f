//! An ensemble over contact patterns as one table of margins for each of them.
//!
//! A pattern fixes which differences of contact times exist, so each table has only the axes of those: κ and slope where
//! all three fingers touched, slope where both outer ones did, the pair's difference where the middle and one outer
//! finger did, and none elsewhere. No cell is for a missing value.

use super::Sections;
use super::ranks::{Cuts, at_or_missing};
use palpate_shared::Descriptor;
use palpate_shared::format::Axis;

/// The patterns without a difference of times: no contact, an outer finger alone, the middle finger alone.
const SINGLE: usize = 3;

/// The number of cells of all tables. `None` unless the descriptor is contacts-curvature and its differences κ, slope
/// and pair have one axis each, in this order.
pub(crate) fn cells(model: &Sections<'_>) -> Option<usize> {
    let (&[curvature, slope, pair], _) = model.axes_and_cuts() else { return None };
    let side = |bytes, feature| {
        let axis = Axis::from_bytes(bytes).filter(|axis| axis.feature == feature)?;
        Some(usize::from(axis.count) + 1)
    };
    let sides = [side(curvature, 1)?, side(slope, 2)?, side(pair, 3)?];
    let is_known = model.header().descriptor() == Descriptor::ContactsCurvature.code();
    is_known.then_some(start_of_all(sides) + sides[0] * sides[1])
}

/// The first cell of the table of full touches, which is the last table.
fn start_of_all([_, slope, pair]: [usize; 3]) -> usize {
    SINGLE + pair + slope
}

/// The cell that the features fall into. A pattern without a code
/// counts as no contact, and a difference that is missing although its pattern has it as the smallest.
///
/// Cost: three binary searches, of a load and a comparison a step where an axis has many thresholds.
#[inline(never)]
pub(crate) fn cell(model: &Sections<'_>, features: &[i32]) -> usize {
    let (axes, cuts) = model.axes_and_cuts();
    let mut cuts = Cuts(cuts);
    let (mut sides, mut places) = ([1; 3], [0; 3]);
    for ((axis, side), place) in axes.iter().zip(&mut sides).zip(&mut places) {
        let &[feature, .., count] = axis;
        *place = usize::from(cuts.rank_of(axis, at_or_missing(features, feature)));
        *side = usize::from(count) + 1;
    }
    let [curvature, slope, pair] = places;
    match at_or_missing(features, 0) {
        1 => 1,
        2 => 2,
        3 => SINGLE + pair,
        4 => SINGLE + sides[2] + slope,
        5 => start_of_all(sides) + curvature * sides[1] + slope,
        _ => 0,
    }
}
