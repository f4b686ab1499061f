//! Features to ranks: where each value stands among the thresholds, looked up once a touch.

use crate::bytes::{signed, take};
use crate::model::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Axis, Columns};

/// The rank of every column; beyond the model's columns, 0.
pub(crate) type Ranks = [u8; 256];

/// Ranks of a row of features in all of the model's columns.
///
/// Cost: about ten instructions a step of a binary search in each axis's thresholds.
pub(crate) fn ranks(model: &Model<'_>, features: &[i32]) -> Ranks {
    let mut ranks = [0; 256];
    let mut columns = ranks.iter_mut();
    let mut put = |rank: u8| {
        if let Some(column) = columns.next() {
            *column = rank;
        }
    };
    let mut cuts = model.cuts;
    for &bytes in model.axes.as_chunks().0 {
        let Some(axis) = Axis::from_bytes(bytes) else { continue };
        let Some(cuts) = take(&mut cuts, axis.cuts_length()) else { continue };
        let value = at_or_missing(features, axis.feature);
        let (left, right) = if value == MISSING_FEATURE {
            (0, 255)
        } else {
            let rank = rank(cuts, axis.width, value);
            (rank, rank)
        };
        if axis.columns != Columns::MissingRight {
            put(left);
        }
        if axis.columns != Columns::MissingLeft {
            put(right);
        }
    }
    ranks
}

/// The feature's value, or missing beyond the end of a row.
pub(crate) fn at_or_missing(features: &[i32], feature: u8) -> i32 {
    features.get(usize::from(feature)).copied().unwrap_or(MISSING_FEATURE)
}

/// How many of an axis's thresholds are at or below `value`.
pub(crate) fn rank(cuts: &[u8], width: u8, value: i32) -> u8 {
    let rank = match width {
        1 => rank_of_width::<1>(cuts, value),
        2 => rank_of_width::<2>(cuts, value),
        3 => rank_of_width::<3>(cuts, value),
        _ => rank_of_width::<4>(cuts, value),
    };
    u8::try_from(rank).unwrap_or(u8::MAX)
}

fn rank_of_width<const WIDTH: usize>(cuts: &[u8], value: i32) -> usize {
    let (cuts, _) = cuts.as_chunks::<WIDTH>();
    let mut rank = 0;
    let mut step = 128;
    while step > 0 {
        // Were the thresholds from here to the next step's end passed?
        if cuts.get(rank + step - 1).is_some_and(|cut| signed(cut) <= value) {
            rank += step;
        }
        step /= 2;
    }
    rank
}

#[cfg(test)]
mod tests {
    use super::*;

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
