//! Quantities as users write them, each number with its unit.

use crate::error::{Error, Result, problem};
use std::ops::RangeInclusive;

/// A kind of number, in the unit that [`Noise`](super::Noise) has it in.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Units; a number is multiplied with the first factor, then divided by the second. A number is written in the first
    /// unit that keeps its bits.
    units: &'static [(&'static str, f64, f64)],
    /// The range of numbers, and the same in words.
    pub(super) range: RangeInclusive<f64>,
    pub(super) allowed: &'static str,
    /// Texts that can be read: "an angle such as 5deg".
    pub(super) example: &'static str,
    /// Words for a number, rounded as they need it.
    pub(super) said: fn(f64) -> String,
}

/// A duration of at least 0 such as `5ms`, `300us` or `0.005s`, in microseconds.
pub(super) const DURATION: Quantity = Quantity {
    // Seconds come last: each of the units ends in `s`.
    units: &[("ms", 1e3, 1.0), ("us", 1.0, 1.0), ("s", 1e6, 1.0)],
    range: 0.0..=f64::MAX,
    allowed: "a duration of at least 0",
    example: "a duration such as 5ms, 300us or 0.005s",
    said: |micros| format!("{} ms", micros / 1e3),
};

/// A duration by which something is early, or late if it is negative.
pub(super) const SHIFT: Quantity = Quantity {
    range: f64::MIN..=f64::MAX,
    allowed: "a duration",
    said: |micros| {
        let side = if micros > 0.0 { "early" } else { "late" };
        // Tenths of a millisecond are enough, unless there are fewer.
        let tenths = (micros.abs() / 100.0).round() * 100.0;
        format!("{} {side}", (DURATION.said)(if tenths > 0.0 { tenths } else { micros.abs() }))
    },
    ..DURATION
};

/// A length of at least 0 such as `1mm` or `300um`, in micrometers.
pub const LENGTH: Quantity = Quantity {
    units: &[("mm", 1e3, 1.0), ("um", 1.0, 1.0)],
    range: 0.0..=f64::MAX,
    allowed: "a length of at least 0",
    example: "a length such as 1mm or 300um",
    said: |micrometers| format!("{} mm", micrometers / 1e3),
};

/// An angle of at least 0 such as `5deg` or `5°`, in degrees.
pub const ANGLE: Quantity = Quantity {
    units: &[("deg", 1.0, 1.0), ("°", 1.0, 1.0)],
    range: 0.0..=180.0,
    allowed: "degrees from 0 to 180",
    example: "an angle such as 5deg",
    said: |degrees| format!("{degrees}°"),
};

/// An angle without an upper limit.
pub(super) const TURN: Quantity = Quantity { range: 0.0..=f64::MAX, allowed: "an angle of at least 0", ..ANGLE };

/// A share of at least 0 such as `2%` or `0.02`.
pub const SHARE: Quantity = Quantity {
    units: &[("%", 1.0, 100.0), ("", 1.0, 1.0)],
    range: 0.0..=1.0,
    allowed: "a share from 0 to 1",
    example: "a share such as 2% or 0.02",
    said: |share| format!("{} %", (1e6 * share).round() / 1e4),
};

/// A share of a speed that leaves some of it.
pub(super) const SPEED_SHARE: Quantity = Quantity { range: 0.0..=0.9, allowed: "a share from 0 to 0.9", ..SHARE };

/// A factor without a unit.
pub(super) const FACTOR: Quantity = Quantity {
    units: &[("", 1.0, 1.0)],
    range: f64::MIN_POSITIVE..=f64::MAX,
    allowed: "a number greater than 0",
    example: "a number greater than 0 such as 0.98",
    said: |factor| factor.to_string(),
};

impl Quantity {
    /// The number of a text, if it is one. Ranges are not checked, except that only some numbers may be negative.
    pub fn read(&self, text: &str) -> Option<f64> {
        let text = text.trim();
        let (sign, text) = match text.strip_prefix('-') {
            Some(rest) if *self.range.start() < 0.0 => (-1.0, rest.trim()),
            _ => (1.0, text),
        };
        let (number, times, over) =
            self.units.iter().find_map(|(unit, times, over)| Some((text.strip_suffix(unit)?, times, over)))?;
        let number = number.trim().parse().ok().filter(|number: &f64| *number >= 0.0 && number.is_finite())?;
        Some(sign * (number * times / over))
    }

    /// The number of a text.
    ///
    /// # Errors
    /// With an example, if the text is something else.
    pub(in crate::probe) fn parse(&self, text: &str) -> Result<f64> {
        self.read(text).ok_or_else(|| not_such(text, self.example))
    }

    /// A text that reads as this number to the last bit.
    pub(super) fn written(&self, number: f64) -> String {
        let mut texts = self.units.iter().map(|(unit, times, over)| format!("{}{unit}", number * over / times));
        texts.find(|text| self.read(text) == Some(number)).unwrap_or_else(|| number.to_string())
    }
}

/// A text is nothing such as this.
pub(super) fn not_such(text: &str, example: &str) -> Error {
    problem!("{text:?} is not a quantity with its unit").fix(format!("Give {example}."))
}
