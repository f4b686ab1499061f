//! Features to ranks: where each value stands among the thresholds, looked up once a touch.

use crate::model::Model;
use palpate_shared::MISSING_FEATURE;

/// The rank of every column; beyond the model's columns, 0.
pub(crate) type Ranks = [u8; 256];

/// Ranks of a row of features in all of the model's columns.
///
/// Cost: about 13 instructions a step of a binary search in each axis's thresholds on a Cortex-M4, 24 on a Cortex-M0+,
/// and 150.
pub(crate) fn rank(model: &Model<'_>, features: &[i32], ranks: &mut Ranks) {
    let mut columns = ranks.iter_mut();
    let mut cuts = Cuts::new(model);
    for &[feature, axis_columns, width, count] in model.axes.as_chunks().0 {
        let window = cuts.next(width, count);
        let value = at_or_missing(features, feature);
        let there = if value == MISSING_FEATURE { None } else { Some(rank_in(window, width, value)) };
        // The bits of `Columns`: where a missing value goes left, and right.
        for (bit, missing) in [(1, 0), (2, u8::MAX)] {
            if axis_columns & bit != 0
                && let Some(column) = columns.next()
            {
                *column = there.unwrap_or(missing);
            }
        }
    }
}

/// The feature's value, or missing beyond the end of a row.
pub(crate) fn at_or_missing(features: &[i32], feature: u8) -> i32 {
    features.get(usize::from(feature)).copied().unwrap_or(MISSING_FEATURE)
}

/// The thresholds of a model's axes, one after the other.
pub(crate) struct Cuts<'m> {
    /// The model's bytes.
    bytes: &'m [u8],
    /// Where the next axis's thresholds start.
    next: usize,
}

impl<'m> Cuts<'m> {
    pub(crate) fn new(model: &Model<'m>) -> Self {
        Self { bytes: model.bytes, next: model.offset(model.cuts) }
    }

    /// The thresholds of the next axis, which has `count` of them of `width` bytes, and the four bytes of the model before
    /// them: so each threshold is read as the upper end of a word, whatever its width.
    #[inline(always)]
    pub(crate) fn next(&mut self, width: u8, count: u8) -> &'m [u8] {
        let start = self.next.wrapping_sub(4);
        self.next = self.next.wrapping_add(usize::from(width) * usize::from(count));
        self.bytes.get(start..self.next).unwrap_or_default()
    }
}

/// How many of an axis's thresholds (see [`Cuts::next`]) are at or below `value`.
#[inline(never)]
pub(crate) fn rank_in(window: &[u8], width: u8, value: i32) -> u8 {
    let width = usize::from(width);
    let below = u32::try_from(32_usize.wrapping_sub(8 * width) & 31).unwrap_or(0);
    let (mut rank, mut step) = (0_u32, 128_u32);
    while step > 0 {
        // Were the thresholds from here to the next step's end passed? A word that ends where a threshold does starts
        // as far behind the window's start as that many thresholds are long.
        let [passed, ..] = (rank | step).to_le_bytes();
        let last = usize::from(passed) * width;
        let last = window.get(last..last + 4).and_then(<[u8]>::first_chunk);
        if last.is_some_and(|word| i32::from_le_bytes(*word) >> below <= value) {
            rank |= step;
        }
        step >>= 1;
    }
    let [rank, ..] = rank.to_le_bytes();
    rank
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rank among thresholds of `width` bytes, with something else before them.
    fn rank(cuts: &[u8], width: u8, value: i32) -> u8 {
        let bytes = [&[0xa5; 4], cuts].concat();
        let mut axes = Cuts { bytes: &bytes, next: 4 };
        rank_in(axes.next(width, u8::try_from(cuts.len() / usize::from(width)).unwrap()), width, value)
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
    fn a_rank_is_the_same_in_every_width() {
        let cuts: std::vec::Vec<i32> = (-60..60).map(|i| i * 2).collect();
        for value in -130..130 {
            let expected = cuts.iter().filter(|&&cut| cut <= value).count();
            for width in 1..=4_u8 {
                let bytes: std::vec::Vec<u8> =
                    cuts.iter().flat_map(|cut| cut.to_le_bytes().into_iter().take(usize::from(width))).collect();
                assert_eq!(usize::from(rank(&bytes, width, value)), expected);
            }
        }
    }
}
