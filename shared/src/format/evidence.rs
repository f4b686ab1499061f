//! Evidence of rows: what a margin counts for, and how much rows count together.

/// Evidence of a row for each object, by its margin: a table of values at equal distances, between which it is linear, and
/// beyond whose ends it stays the same. For models whose margins are no log-probabilities, such as shares of votes.
///
/// 8 bytes, and 2 for each value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowEvidence<'a> {
    /// The margin of the first value, in units.
    pub start: i32,
    /// Between two values, a power of two of units.
    pub step_shift: u8,
    /// Values are multiples of a power of two of units.
    pub value_shift: u8,
    values: &'a [u8],
}

impl<'a> RowEvidence<'a> {
    /// Bytes before the values.
    pub const HEAD: usize = 8;
    /// The most values.
    pub const MOST: usize = 129;
    /// The largest [`step_shift`](Self::step_shift).
    pub const MOST_STEP_SHIFT: u8 = 26;
    /// The largest [`value_shift`](Self::value_shift): evidence of a row stays below 2^30 units, as a margin does.
    pub const MOST_VALUE_SHIFT: u8 = 14;
    /// The largest start, without its sign: margins stay within it.
    const MOST_START: u32 = 1 << 30;

    /// Hands the section's content before the values to `put`, then the values.
    pub fn write(start: i32, [step_shift, value_shift]: [u8; 2], values: &[i16], put: &mut impl FnMut(&[u8])) {
        put(&start.to_le_bytes());
        let last = u8::try_from(values.len().saturating_sub(1)).unwrap_or(u8::MAX);
        put(&[step_shift, value_shift, last, 0]);
        values.iter().for_each(|value| put(&value.to_le_bytes()));
    }

    /// Reads a section; `None` if it is too short, has fewer than two values or too many, values that fall, a shift or a
    /// start that is too large. Bytes after those that are known are ignored.
    ///
    /// Cost: a few instructions for each value.
    pub fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let table = Self::opened(bytes)?;
        let rises = |(a, b): (usize, usize)| table.value(a) <= table.value(b);
        let count = table.values.len() / 2;
        let is_valid = (2..=Self::MOST).contains(&count)
            && table.start.unsigned_abs() <= Self::MOST_START
            && table.step_shift <= Self::MOST_STEP_SHIFT
            && table.value_shift <= Self::MOST_VALUE_SHIFT
            && (1..count).all(|at| rises((at - 1, at)));
        is_valid.then_some(table)
    }

    /// The same of a section that was read before; `None` if it is too short.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn opened(bytes: &'a [u8]) -> Option<Self> {
        let (&[a, b, c, d, step_shift, value_shift, last, _], values) = bytes.split_first_chunk()?;
        let values = values.get(..2 * (usize::from(last) + 1))?;
        Some(Self { start: i32::from_le_bytes([a, b, c, d]), step_shift, value_shift, values })
    }

    fn value(&self, at: usize) -> i32 {
        self.values.as_chunks::<2>().0.get(at).map_or(0, |bytes| i16::from_le_bytes(*bytes).into())
    }

    /// The number of values.
    pub const fn len(&self) -> usize {
        self.values.len() / 2
    }

    /// True if there is none, as in no table that was read.
    pub const fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Evidence for a margin within ±2^30, in units.
    ///
    /// Cost: less than 40 instructions. Cannot fail or overflow.
    #[inline]
    pub fn of(&self, margin: i32) -> i32 {
        let step = self.step_shift & 31;
        // Both are within ±2^30. What is below the start counts as the start.
        let beyond = margin.saturating_sub(self.start).max(0).cast_unsigned();
        let at = (beyond >> step) as usize;
        let last = self.len().saturating_sub(1);
        if at >= last {
            return self.value(last) << (self.value_shift & 15);
        }
        let (low, high) = (self.value(at), self.value(at + 1));
        // 15 bits of the rest, and a rise of at most 16.
        let rest = (beyond & !(u32::MAX << step)) >> step.saturating_sub(15);
        let rise = high.saturating_sub(low).cast_unsigned();
        let part = (rise.wrapping_mul(rest) >> step.min(15)).cast_signed();
        low.wrapping_add(part) << (self.value_shift & 15)
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
    /// Bytes before the weights.
    pub const HEAD: usize = 2;
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
    /// Cost: some twenty instructions. Cannot fail.
    pub fn of(&self, touches: u32) -> u32 {
        let weights = self.0.as_chunks::<2>().0;
        let at = Self::position(touches).min(weights.len().saturating_sub(1));
        weights.get(at).map_or(Self::ONE, |weight| u32::from(u16::from_le_bytes(*weight)) + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn table(start: i32, shifts: [u8; 2], values: &[i16]) -> Vec<u8> {
        let mut bytes = Vec::new();
        RowEvidence::write(start, shifts, values, &mut |part| bytes.extend_from_slice(part));
        bytes
    }

    #[test]
    fn evidence_is_linear_between_values_and_stays_the_same_beyond_their_ends() {
        let bytes = table(-100, [4, 3], &[-32_768, -10, 0, 0, 32_767]);
        let read = RowEvidence::from_bytes(&bytes).unwrap();
        assert_eq!(RowEvidence::from_bytes(&[&bytes[..], &[9; 3]].concat()), Some(read));
        assert_eq!(read.len(), 5);
        for (margin, expected) in [
            (i32::MIN, -32_768 * 8),
            (-(1 << 30), -32_768 * 8),
            (-101, -32_768 * 8),
            (-100, -32_768 * 8),
            (-84, -80),
            (-76, -40),
            (-68, 0),
            (-60, 0),
            (-52, 0),
            (-44, 16_383 * 8),
            (-36, 32_767 * 8),
            (1 << 30, 32_767 * 8),
            (i32::MAX, 32_767 * 8),
        ] {
            assert_eq!(read.of(margin), expected, "{margin}");
        }
    }

    #[test]
    fn evidence_never_falls_whatever_the_shifts_are() {
        for step in 0..=RowEvidence::MOST_STEP_SHIFT {
            let bytes = table(-(1 << 30), [step, 14], &[-32_768, -32_768, 32_767, 32_767]);
            let read = RowEvidence::from_bytes(&bytes).unwrap();
            let margins = (0..4_000_u32).map(|k| (-(1_i64 << 30) + (i64::from(k) << step) / 1_000) as i32);
            let found: Vec<i32> = margins.map(|margin| read.of(margin)).collect();
            assert!(found.is_sorted(), "{step}");
            assert_eq!((found[0], found[3_999]), (-(1 << 29), 32_767 << 14));
        }
    }

    #[test]
    fn tables_that_make_no_sense_are_refused() {
        let valid = || table(0, [4, 0], &[1, 2, 3]);
        assert!(RowEvidence::from_bytes(&valid()).is_some());
        for (at, byte) in [(4, 27), (5, 15), (6, 0), (6, 3), (8, 3), (9, 1), (3, 0x41), (3, 0x80)] {
            let mut bytes = valid();
            bytes[at] = byte;
            assert_eq!(RowEvidence::from_bytes(&bytes), None, "{at}: {byte}");
        }
        assert_eq!(RowEvidence::from_bytes(&valid()[..13]), None);
        assert_eq!(RowEvidence::from_bytes(&table(0, [4, 0], &[0; 130])), None);
        assert!(RowEvidence::from_bytes(&table(0, [4, 0], &[0; 129])).is_some());
    }

    #[test]
    fn weights_are_of_halves_of_doublings() {
        let positions: Vec<usize> = (0..=16).map(Weights::position).collect();
        assert_eq!(positions, [0, 0, 2, 3, 4, 4, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7, 8]);
        assert_eq!(Weights::position(u32::MAX), 63);
        let mut bytes = Vec::new();
        Weights::write(&[65_536, 65_536, 40_000, 1], &mut |part| bytes.extend_from_slice(part));
        let read = Weights::from_bytes(&bytes).unwrap();
        assert_eq!([0, 1, 2, 3, 4, u32::MAX].map(|touches| read.of(touches)), [65_536, 65_536, 40_000, 1, 1, 1]);
        assert_eq!(Weights::from_bytes(&bytes[..9]), None);
        assert_eq!(Weights::from_bytes(&[0, 0]), None);
        assert_eq!(Weights::from_bytes(&[65; 200]), None);
    }
}
