//! Evidence of rows: the weight of a margin, and of rows together.

/// Evidence of a row for each object, by its margin: a table of values at equal distances, between which it is linear; it
/// stays the same below the first and from just before the last. For models whose margins are no log-probabilities, such as shares of votes.
///
/// 8 bytes, and one for each value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowEvidence<'a> {
    /// The margin of the first value, in units.
    pub start: i32,
    /// Its shifts.
    pub shifts: Shifts,
    values: &'a [u8],
}

/// Powers of two of a [`RowEvidence`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shifts {
    /// The lowest bits of a margin, which make no difference.
    pub dropped: u8,
    /// The bits between two values: a step is 2^(dropped + between) units.
    pub between: u8,
    /// A value is a multiple of 2^(between + scale) units.
    pub scale: u8,
}

impl Shifts {
    /// The largest sum of [`dropped`](Self::dropped) and [`between`](Self::between).
    pub const MOST_STEP: u8 = 26;
    /// The largest [`between`](Self::between).
    pub const MOST_BETWEEN: u8 = 15;
    /// The largest sum of [`between`](Self::between) and [`scale`](Self::scale): evidence of a row stays below 2^30
    /// units, as a margin does.
    pub const MOST_SCALE: u8 = 22;

    const fn are_valid(self) -> bool {
        let Self { dropped, between, scale } = self;
        between <= Self::MOST_BETWEEN && dropped <= Self::MOST_STEP - between && scale <= Self::MOST_SCALE - between
    }
}

impl<'a> RowEvidence<'a> {
    /// The most values.
    pub const MOST: usize = 129;
    /// The largest start, without its sign: margins stay within it.
    const MOST_START: u32 = 1 << 30;

    /// Hands the section's content before the values to `put`, then the values.
    pub fn write(start: i32, shifts: Shifts, values: &[u8], put: &mut impl FnMut(&[u8])) {
        put(&start.to_le_bytes());
        let last = u8::try_from(values.len().saturating_sub(1)).unwrap_or(u8::MAX);
        put(&[shifts.dropped, shifts.between, shifts.scale, last]);
        put(values);
    }

    /// Reads a section; `None` if it is too short, has fewer than two values or too many, values that fall, shifts or a
    /// start that are too large. Bytes after the known ones are ignored.
    ///
    /// Cost: a few instructions for each value.
    pub fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let table = Self::opened(bytes)?;
        let is_valid = (2..=Self::MOST).contains(&table.values.len())
            && table.start.unsigned_abs() <= Self::MOST_START
            && table.shifts.are_valid()
            // `is_sorted` links code that panics.
            && table.values.iter().zip(table.values.iter().skip(1)).all(|(value, next)| value <= next);
        is_valid.then_some(table)
    }

    /// Reopens a section that was read before; `None` if it is too short.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn opened(bytes: &'a [u8]) -> Option<Self> {
        let (&[a, b, c, d, dropped, between, scale, last], values) = bytes.split_first_chunk()?;
        let values = values.get(..usize::from(last) + 1)?;
        Some(Self { start: i32::from_le_bytes([a, b, c, d]), shifts: Shifts { dropped, between, scale }, values })
    }

    fn value(&self, at: usize) -> u32 {
        self.values.get(at).map_or(0, |value| u32::from(*value))
    }

    /// The number of values.
    pub const fn len(&self) -> usize {
        self.values.len()
    }

    /// True if there is none, as in no table that was read.
    pub const fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Evidence for a margin, in units: from 0 to 255 · 2^22.
    ///
    /// Cost: two values of the table and a multiplication; no loop. Cannot fail or overflow.
    #[inline]
    pub fn of(&self, margin: i32) -> i32 {
        let Shifts { dropped, between, scale } = self.shifts;
        let between = between & 15;
        let most = (self.values.len().saturating_sub(1) as u32) << between;
        // What is below the start counts as the start, and what is beyond the last value as just before it.
        let beyond = margin.max(self.start).wrapping_sub(self.start).cast_unsigned() >> (dropped & 31);
        let beyond = beyond.min(most.saturating_sub(1));
        let at = (beyond >> between) as usize;
        let (low, high) = (self.value(at), self.value(at + 1));
        // At most 255 · 2^15.
        let rest = beyond & !(u32::MAX << between);
        let sum = (low << between).wrapping_add(high.saturating_sub(low).wrapping_mul(rest));
        (sum << (scale & 31)).cast_signed()
    }
}

/// Weights of rows, or touches, that resemble each other: for their number, the weight of the sum of their
/// evidence where it is compared with a threshold. A threshold for the number of touches in another form, which needs no
/// more bits where evidence grows.
///
/// 2 bytes, and 2 for each weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Weights<'a>(&'a [u8]);

impl<'a> Weights<'a> {
    /// The most weights: two for each doubling of a number of 32 bits.
    pub const MOST: usize = 64;
    /// A weight of 1.
    pub const ONE: u32 = 1 << 16;

    /// Hands the section's content to `put`. Weights are in Q16, from 1 to [`Weights::ONE`].
    pub fn write(weights: &[u32], put: &mut impl FnMut(&[u8])) {
        put(&[u8::try_from(weights.len()).unwrap_or(u8::MAX), 0]);
        for weight in weights {
            let less_one = weight.saturating_sub(1);
            put(&u16::try_from(less_one).unwrap_or(u16::MAX).to_le_bytes());
        }
    }

    /// Reads a section; `None` if it is too short, or has no weight or too many. Bytes after those that are known are
    /// ignored.
    ///
    /// Cost: a few instructions.
    pub fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let (&[count, _], rest) = bytes.split_first_chunk()?;
        let count = usize::from(count);
        let weights = rest.get(..2 * count)?;
        (1..=Self::MOST).contains(&count).then_some(Self(weights))
    }

    /// The position of the weight for a number of touches, at least 1: 0, 2 or 3, 4 or 5 and so on for those from 1, 2, 3,
    /// 4, 6, 8, 12, 16 and so on. Position 1 stands for no number.
    pub const fn position(touches: u32) -> usize {
        let touches = if touches == 0 { 1 } else { touches };
        let doublings = 31 - touches.leading_zeros();
        let half = if doublings == 0 { 0 } else { touches >> (doublings - 1) & 1 };
        (2 * doublings + half) as usize
    }

    /// The weight of the evidence of this number of touches, in Q16; beyond the last one the last one.
    ///
    /// Cost: leading zeros, which a Cortex-M0+ counts in a routine, and a look at the table. Cannot fail.
    pub fn of(&self, touches: u32) -> u32 {
        let weights = self.0.as_chunks::<2>().0;
        let at = Self::position(touches).min(weights.len().saturating_sub(1));
        weights.get(at).map_or(Self::ONE, |weight| u32::from(u16::from_le_bytes(*weight)) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::{assert_refused, written};
    use std::vec::Vec;

    fn table(start: i32, [dropped, between, scale]: [u8; 3], values: &[u8]) -> Vec<u8> {
        written(|put| RowEvidence::write(start, Shifts { dropped, between, scale }, values, put))
    }

    #[test]
    fn evidence_is_linear_between_values_and_stays_the_same_beyond_their_ends() {
        let bytes = table(-100, [1, 3, 2], &[0, 100, 110, 110, 255]);
        let read = RowEvidence::from_bytes(&bytes).unwrap();
        assert_eq!(RowEvidence::from_bytes(&[&bytes[..], &[9; 3]].concat()), Some(read));
        assert_eq!(read.len(), 5);
        for (margin, expected) in [
            (i32::MIN, 0),
            (-(1 << 30), 0),
            (-101, 0),
            (-100, 0),
            (-99, 0),
            (-98, 100 * 4),
            (-84, 100 * 32),
            (-76, 105 * 32),
            (-68, 110 * 32),
            (-60, 110 * 32),
            (-52, 110 * 32),
            (-44, 110 * 32 + 145 * 16),
            (-36, 110 * 32 + 145 * 28),
            (1 << 30, 110 * 32 + 145 * 28),
            (i32::MAX, 110 * 32 + 145 * 28),
        ] {
            assert_eq!(read.of(margin), expected, "{margin}");
        }
    }

    #[test]
    fn evidence_never_falls_whatever_the_shifts_are() {
        for between in 0..=Shifts::MOST_BETWEEN {
            for dropped in 0..=Shifts::MOST_STEP - between {
                let bytes = table(-(1 << 30), [dropped, between, Shifts::MOST_SCALE - between], &[0, 0, 254, 255]);
                let read = RowEvidence::from_bytes(&bytes).unwrap();
                let step = dropped + between;
                let margins = (0..4_000_u32).map(|k| (-(1_i64 << 30) + (i64::from(k) << step) / 1_000) as i32);
                let found: Vec<i32> = margins.map(|margin| read.of(margin)).collect();
                assert!(found.is_sorted(), "{dropped} {between}");
                // Just before the last value.
                let last = ((254 << between) + (1 << between) - 1) << (Shifts::MOST_SCALE - between);
                assert_eq!((found[0], found[3_999]), (0, last));
            }
        }
    }

    #[test]
    fn tables_that_make_no_sense_are_refused() {
        let valid = table(0, [4, 3, 0], &[1, 2, 3]);
        let wrong = [(4, 24), (4, 255), (5, 16), (6, 20), (6, 255), (7, 0), (7, 3), (8, 3), (3, 0x41), (3, 0x80)];
        for (at, byte) in wrong {
            assert_refused(&valid, &[(at, &[byte])], |bytes| RowEvidence::from_bytes(bytes).is_some());
        }
        assert_eq!(RowEvidence::from_bytes(&valid[..10]), None);
        assert_eq!(RowEvidence::from_bytes(&table(0, [4, 0, 0], &[0; 130])), None);
        assert!(RowEvidence::from_bytes(&table(0, [4, 0, 0], &[0; 129])).is_some());
    }

    #[test]
    fn weights_are_of_halves_of_doublings() {
        let positions: Vec<usize> = (0..=16).map(Weights::position).collect();
        assert_eq!(positions, [0, 0, 2, 3, 4, 4, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7, 8]);
        assert_eq!(Weights::position(u32::MAX), 63);
        let bytes = written(|put| Weights::write(&[65_536, 65_536, 40_000, 1], put));
        let read = Weights::from_bytes(&bytes).unwrap();
        assert_eq!([0, 1, 2, 3, 4, u32::MAX].map(|touches| read.of(touches)), [65_536, 65_536, 40_000, 1, 1, 1]);
        assert_eq!(Weights::from_bytes(&bytes[..9]), None);
        assert_eq!(Weights::from_bytes(&[0, 0]), None);
        assert_eq!(Weights::from_bytes(&[65; 200]), None);
    }
}
