//! Features to ranks: where each value stands among the thresholds, looked up once per touch.

use super::Sections;
#[cfg(feature = "rows")]
use crate::bytes::at;
use crate::bytes::{Wrong, take};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Axis, Layout};

/// The rank of every column; beyond the model's columns, 0.
pub(crate) type Ranks = [u8; 256];

/// Checks that every axis is of a feature that exists, that columns can be numbered in a byte, that thresholds fill their
/// section, and that those of an axis ascend: where they do not, a rank is what one search or another makes of it.
pub(crate) fn check(model: &Sections<'_>, last_feature: u8) -> Result<(), Wrong> {
    let mut columns = 0;
    let (axes, mut cuts) = model.axes_and_cuts();
    for bytes in axes {
        let wrong = Wrong::Field(model.offset(bytes));
        let axis = Axis::from_bytes(*bytes).ok_or(wrong)?;
        columns += axis.columns.count();
        if axis.feature > last_feature || columns > 256 {
            return Err(wrong);
        }
        let own = take(&mut cuts, axis.cuts_length()).ok_or(Wrong::Section(model.offset(cuts)))?;
        if !ascends(own, axis.width.into()) {
            return Err(wrong);
        }
    }
    // Wide splits number thresholds of four bytes throughout; the others have axes.
    let ends =
        if model.layout == Layout::Wide { axes.is_empty() && cuts.len().is_multiple_of(4) } else { cuts.is_empty() };
    if ends { Ok(()) } else { Err(Wrong::Section(model.offset(cuts))) }
}

/// True if no threshold of `width` bytes is below the one before.
#[inline(never)]
fn ascends(mut cuts: &[u8], width: usize) -> bool {
    let mut last = i32::MIN;
    while let Some(cut) = take(&mut cuts, width) {
        let next = number_apart(cut);
        if next < last {
            return false;
        }
        last = next;
    }
    true
}

/// Ranks of a row of features in all of the model's columns.
///
/// Cost: a binary search in each axis's thresholds; three times as much where thresholds are not aligned.
pub(crate) fn rank(model: &Sections<'_>, features: &[i32], ranks: &mut Ranks) {
    let mut column = 0_u8;
    let mut put = |rank: u8| {
        if let Some(place) = ranks.get_mut(usize::from(column)) {
            *place = rank;
        }
        column = column.wrapping_add(1);
    };
    let (axes, cuts) = model.axes_and_cuts();
    let mut cuts = Cuts(cuts);
    for axis in axes {
        let rank = cuts.rank(axis, features);
        // The bits of `Columns`: where a missing value goes left, and right.
        let &[_, columns, ..] = axis;
        if columns & 1 != 0 {
            put(rank.unwrap_or(0));
        }
        if columns & 2 != 0 {
            put(rank.unwrap_or(u8::MAX));
        }
    }
}

/// Ranks of many rows of `width` features: column by column, `stride` ranks each, which is a multiple of [`ABREAST`].
#[cfg(feature = "rows")]
pub(crate) fn rank_rows(model: &Sections<'_>, features: &[i32], width: usize, stride: usize, ranks: &mut [u8]) {
    let (axes, cuts) = model.axes_and_cuts();
    let mut cuts = Cuts(cuts);
    let mut columns = ranks.chunks_exact_mut(stride.max(1));
    for axis in axes {
        let &[feature, kinds, size, count] = axis;
        // Of the largest number there are all that there is room for: only that number passes them, and it is held down.
        let mut table = [i32::MAX; 256];
        let of_axis = cuts.of(axis).chunks_exact(usize::from(size).max(1));
        table.iter_mut().zip(of_axis).for_each(|(entry, cut)| *entry = number(cut));
        let mut put = |missing: u8| {
            let Some(column) = columns.next() else { return };
            let rows = features.chunks(ABREAST * width.max(1)).zip(column.as_chunks_mut().0);
            for (rows, ranks) in rows {
                let mut values = [MISSING_FEATURE; ABREAST];
                let rows = rows.chunks_exact(width.max(1));
                values.iter_mut().zip(rows).for_each(|(value, row)| *value = at_or_missing(row, feature));
                *ranks = ranks_among(&table, count, &values);
                for (rank, value) in ranks.iter_mut().zip(values) {
                    *rank = if value == MISSING_FEATURE { missing } else { *rank };
                }
            }
        };
        if kinds & 1 != 0 {
            put(0);
        }
        if kinds & 2 != 0 {
            put(u8::MAX);
        }
    }
}

/// Values whose ranks are searched in step: a search takes the same steps for every value, without a branch, and none
/// waits for another's loads.
#[cfg(feature = "rows")]
const ABREAST: usize = 8;

/// Number of an axis's `count` thresholds that are at or below each value.
#[cfg(feature = "rows")]
fn ranks_among(table: &[i32; 256], count: u8, values: &[i32; ABREAST]) -> [u8; ABREAST] {
    let mut passed = [0_usize; ABREAST];
    let steps = count.checked_ilog2().map_or(0, |steps| steps + 1);
    for step in (0..steps).rev() {
        for (passed, value) in passed.iter_mut().zip(values) {
            let next = (*passed + (1 << step)).wrapping_sub(1) & 255;
            *passed += usize::from(at(table, next) <= *value) << step;
        }
    }
    passed.map(|passed| {
        let [passed, ..] = passed.to_le_bytes();
        passed.min(count)
    })
}

/// A threshold.
#[inline(always)]
fn number(cut: &[u8]) -> i32 {
    let sign = cut.last().map_or(0, |last| -i32::from(last >> 7));
    cut.iter().rfold(sign, |sum, byte| sum << 8 | i32::from(*byte))
}

/// Reads a number in one place of the image, for rare cases.
#[inline(never)]
fn number_apart(cut: &[u8]) -> i32 {
    number(cut)
}

/// The feature's value, or missing beyond the end of a row.
pub(crate) fn at_or_missing(features: &[i32], feature: u8) -> i32 {
    features.get(usize::from(feature)).copied().unwrap_or(MISSING_FEATURE)
}

/// The thresholds of a model's axes, one after the other.
struct Cuts<'m>(&'m [u8]);

impl<'m> Cuts<'m> {
    /// The rank of a row's feature among the thresholds of the next axis; `None` if the feature is missing.
    #[inline(always)]
    fn rank(&mut self, axis: &[u8; Axis::LENGTH], features: &[i32]) -> Option<u8> {
        let &[feature, _, width, _] = axis;
        let value = at_or_missing(features, feature);
        let rank = rank_in(self.of(axis), width, value);
        (value != MISSING_FEATURE).then_some(rank)
    }

    /// The thresholds of the next axis.
    #[inline(always)]
    fn of(&mut self, &[_, _, width, count]: &[u8; Axis::LENGTH]) -> &'m [u8] {
        let length = usize::from(width) * usize::from(count);
        let Some((cuts, rest)) = self.0.split_at_checked(length) else { return &[] };
        self.0 = rest;
        cuts
    }
}

/// Number of an axis's thresholds, of `width` bytes each, that are at or below `value`.
///
/// Thresholds of two or four bytes are loaded at once where they are aligned, which the exporter ensures if the model is aligned.
// By itself, so that all that it needs is in registers on a Cortex-M0+.
#[inline(never)]
fn rank_in(cuts: &[u8], width: u8, value: i32) -> u8 {
    if width == 2
        && let Ok(cuts) = bytemuck::try_cast_slice(cuts)
    {
        search(cuts, value, |cut: i16| i16::from_le(cut).into())
    } else if width == 4
        && let Ok(cuts) = bytemuck::try_cast_slice(cuts)
    {
        search(cuts, value, i32::from_le)
    } else {
        search_bytes(cuts, width.into(), value)
    }
}

/// A binary search.
#[inline(always)]
fn search<T: Copy>(cuts: &[T], value: i32, number: impl Fn(T) -> i32 + Copy) -> u8 {
    // Most axes of small ensembles have a few.
    let mut step = if cuts.len() < 16 { 8 } else { 128 };
    while step > cuts.len() {
        step >>= 1;
    }
    // The last threshold that was passed; before that, a threshold before the first.
    let mut passed = usize::MAX;
    while step > 0 {
        let next = passed.wrapping_add(step);
        if cuts.get(next).is_some_and(|cut| number(*cut) <= value) {
            passed = next;
        }
        step >>= 1;
    }
    let [rank, ..] = passed.wrapping_add(1).to_le_bytes();
    rank
}

/// Searches thresholds of any width and alignment.
#[inline(never)]
fn search_bytes(cuts: &[u8], width: usize, value: i32) -> u8 {
    let (mut rank, mut step) = (0_u8, 128_u8);
    while step > 0 {
        let end = usize::from(rank | step) * width;
        if cuts.get(end.wrapping_sub(width)..end).is_some_and(|cut| number_apart(cut) <= value) {
            rank |= step;
        }
        step >>= 1;
    }
    rank
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rank among thresholds of `width` bytes.
    fn rank(cuts: &[u8], width: u8, value: i32) -> u8 {
        let mut axes = Cuts(cuts);
        let count = u8::try_from(cuts.len() / usize::from(width)).unwrap();
        rank_in(axes.of(&[0, 0, width, count]), width, value)
    }

    #[test]
    fn a_rank_counts_the_thresholds_at_or_below_a_value() {
        let cuts = [250, 3, 3, 7];
        let ranks = [(-7, 0), (-6, 1), (2, 1), (3, 3), (6, 3), (7, 4), (i32::MAX, 4), (i32::MIN + 1, 0)];
        for (value, expected) in ranks {
            assert_eq!(rank(&cuts, 1, value), expected, "{value}");
        }
        assert_eq!(rank(&[], 2, 5), 0);
    }

    #[test]
    fn a_rank_is_right_for_every_number_of_thresholds_an_axis_can_have() {
        for count in 0..=255_i32 {
            // Aligned.
            let cuts: std::vec::Vec<i32> = (0..count).map(|i| 10 * (i / 2 + i)).collect();
            for value in (-5..10 * (count + count / 2) + 10).step_by(5) {
                let expected = cuts.iter().filter(|&&cut| cut <= value).count();
                assert_eq!(usize::from(rank(bytemuck::cast_slice(&cuts), 4, value)), expected, "{value} of {count}");
            }
        }
    }

    #[test]
    fn a_rank_is_the_same_in_every_width() {
        let cuts: std::vec::Vec<i32> = (-60..60).map(|i| i * 2).collect();
        for value in -130..130 {
            let expected = cuts.iter().filter(|&&cut| cut <= value).count();
            for width in 1..=4_u8 {
                let bytes: std::vec::Vec<u8> =
                    cuts.iter().flat_map(|cut| cut.to_le_bytes().into_iter().take(usize::from(width))).collect();
                assert_eq!(usize::from(rank(&bytes, width, value)), expected);
                // Not aligned.
                let shifted = [&[0; 1], &*bytes].concat();
                assert_eq!(usize::from(rank(&shifted[1..], width, value)), expected);
            }
        }
    }
}
