//! Rows of a sequence: the feature that is their number, and the rows that a model takes.

use super::f32_key;
use crate::MISSING_FEATURE;

/// Feature that is the number of a row in its sequence, which whoever follows the sequence counts: 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// The feature.
    pub feature: u8,
    /// The whole number that a row counts as, at least 1; without meaning in a model that compares f32 values.
    pub step: i32,
}

impl Position {
    /// Bytes of the section.
    pub const LENGTH: usize = 8;
    /// The largest number: those after it count as this one. f32 holds all up to it.
    pub const MOST: u32 = 1 << 24;

    /// The section's content.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let [a, b, c, d] = self.step.to_le_bytes();
        [self.feature, 0, 0, 0, a, b, c, d]
    }

    /// Reads a section; `None` if it is too short, its feature is beyond these, or its step below 1. Bytes after those that
    /// are known are ignored.
    pub fn from_bytes(bytes: &[u8], features: usize) -> Option<Self> {
        let (&[feature, _, _, _, a, b, c, d], _) = bytes.split_first_chunk()?;
        let step = i32::from_le_bytes([a, b, c, d]);
        (usize::from(feature) < features && step > 0).then_some(Self { feature, step })
    }

    /// The feature of the row with this number; the first row of a sequence has number 1.
    ///
    /// Cost: a conversion to f32 or a multiplication. Cannot fail.
    pub const fn of(self, number: u32, is_real: bool) -> i32 {
        let number = if number < Self::MOST { number } else { Self::MOST };
        if is_real { f32_key(number as f32) } else { number.cast_signed().saturating_mul(self.step) }
    }
}

/// Values of a feature that a model takes in a row of a sequence: 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The least: a whole number, or the key of an f32 value.
    pub low: i32,
    /// The largest.
    pub high: i32,
    /// True if the feature may be missing.
    pub may_miss: bool,
    /// The most rows one after the other with the same value, or without one; 0 for any number.
    pub most_equal: u32,
}

/// Reason why a feature is not within its [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// The value is below the least or above the largest.
    Outside,
    /// It is missing.
    Missing,
    /// It has stayed the same for more rows than the limit.
    Stuck,
}

impl Limits {
    /// Bytes of a feature.
    pub(crate) const LENGTH: usize = 12;
    /// The flag of a feature that may be missing, beside the most equal rows.
    const MAY_MISS: u32 = 1 << 31;
    /// Limits that every value keeps.
    pub const NONE: Self = Self { low: i32::MIN, high: i32::MAX, may_miss: true, most_equal: 0 };

    /// The feature's part of the section.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let flag = if self.may_miss { Self::MAY_MISS } else { 0 };
        let last = self.most_equal & !Self::MAY_MISS | flag;
        let numbers = [self.low.to_le_bytes(), self.high.to_le_bytes(), last.to_le_bytes()];
        let mut bytes = [0; Self::LENGTH];
        bytes.iter_mut().zip(numbers.into_iter().flatten()).for_each(|(to, from)| *to = from);
        bytes
    }

    fn from_bytes(bytes: &[u8; Self::LENGTH]) -> Self {
        let [low, high, last] = [0, 4, 8].map(|at| bytes.get(at..).and_then(<[u8]>::first_chunk).copied());
        let number = |bytes: Option<[u8; 4]>| i32::from_le_bytes(bytes.unwrap_or_default());
        let last = number(last).cast_unsigned();
        Self {
            low: number(low),
            high: number(high),
            may_miss: last & Self::MAY_MISS != 0,
            most_equal: last & !Self::MAY_MISS,
        }
    }

    /// Checks a value that has been the same in `equal` rows, including this one.
    ///
    /// Cost: a few instructions.
    ///
    /// # Errors
    /// [`Fault`].
    pub const fn check(self, value: i32, equal: u32) -> Result<(), Fault> {
        if value == MISSING_FEATURE && !self.may_miss {
            Err(Fault::Missing)
        } else if value != MISSING_FEATURE && (value < self.low || value > self.high) {
            Err(Fault::Outside)
        } else if self.most_equal != 0 && equal > self.most_equal {
            Err(Fault::Stuck)
        } else {
            Ok(())
        }
    }
}

/// Rows that a model takes in a sequence: [`Limits`] of each feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guard<'a>(&'a [u8]);

impl<'a> Guard<'a> {
    /// Reads a section; `None` if it is too short for so many features. Bytes after those that are known are ignored.
    ///
    /// Cost: a few instructions.
    pub fn from_bytes(bytes: &'a [u8], features: usize) -> Option<Self> {
        bytes.get(..Limits::LENGTH * features).filter(|content| !content.is_empty()).map(Self)
    }

    /// The limits of each feature.
    pub fn limits(self) -> impl Iterator<Item = Limits> + 'a {
        self.0.as_chunks().0.iter().map(Limits::from_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_read_back_and_what_makes_no_sense_is_refused() {
        let position = Position { feature: 3, step: 10 };
        let bytes = position.to_bytes();
        assert_eq!(Position::from_bytes(&bytes, 4), Some(position));
        assert_eq!(Position::from_bytes(&bytes, 3), None);
        assert_eq!(Position::from_bytes(&bytes[..7], 4), None);
        assert_eq!(Position::from_bytes(&Position { step: 0, ..position }.to_bytes(), 4), None);
    }

    #[test]
    fn numbers_of_rows_are_exact_as_f32_and_end_at_the_largest() {
        let position = Position { feature: 0, step: 1_000 };
        assert_eq!([position.of(7, false), position.of(7, true)], [7_000, f32_key(7.0)]);
        assert_eq!(position.of(u32::MAX, false), i32::MAX);
        assert_eq!(position.of(u32::MAX, true), f32_key(16_777_216.0));
        assert_ne!(position.of(Position::MOST - 1, true), position.of(Position::MOST, true));
    }

    #[test]
    fn limits_are_read_back_and_kept() {
        let limits = Limits { low: -5, high: 9, may_miss: false, most_equal: 3 };
        let bytes = [limits.to_bytes(), Limits::NONE.to_bytes()].concat();
        let guard = Guard::from_bytes(&bytes, 2).unwrap();
        assert!(guard.limits().eq([limits, Limits::NONE]));
        assert_eq!(Guard::from_bytes(&bytes, 3), None);
        let of = |value, equal| limits.check(value, equal).err();
        assert_eq!(
            [of(-5, 1), of(9, 3), of(-6, 1), of(10, 1)],
            [None, None, Some(Fault::Outside), Some(Fault::Outside)]
        );
        assert_eq!([of(0, 4), of(MISSING_FEATURE, 1)], [Some(Fault::Stuck), Some(Fault::Missing)]);
        assert_eq!(Limits::NONE.check(MISSING_FEATURE, u32::MAX), Ok(()));
    }
}
