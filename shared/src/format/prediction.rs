//! Prediction of a model over rows: how a margin becomes a value, which class wins a tie, and which numbers stand for a
//! missing value.

use crate::MISSING_FEATURE;

codes! {
    /// Function that turns the margin of a regression into the value that its library predicts.
    Link {
        /// The margin itself.
        Identity = 0, "identity";
        /// 1 / (1 + e^-x): of targets between 0 and 1.
        Logistic = 1, "logistic";
        /// e^x: of positive targets, as with Poisson, gamma or Tweedie losses.
        Exponential = 2, "exponential";
        /// x · |x|: of targets whose square root was learned.
        Square = 3, "square";
        /// ln(1 + e^x).
        Softplus = 4, "softplus";
    }
}

/// Rule that turns margins of a model over rows into a class or a value: 8 bytes, or 12 where margins are averaged. A model
/// without this section has the [default](Prediction::default).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Function that turns a scaled margin into a value.
    pub link: Link,
    /// True if the last of several largest margins names the class, and not the first.
    pub last_of_ties: bool,
    /// Factor that turns a margin into the library's: positive and finite.
    pub scale: f32,
    /// True if each output is a target with a value of its own, and none is a class.
    pub targets: bool,
    /// Divisor of a scaled margin before the link: the number of trees added if their mean is predicted, otherwise 1; never
    /// 0.
    pub average: u32,
}

impl Default for Prediction {
    fn default() -> Self {
        Self { link: Link::Identity, last_of_ties: false, scale: 1.0, targets: false, average: 1 }
    }
}

/// Set in the byte of the link where margins are divided first. Whoever does not know it finds a link that does not exist.
const AVERAGED: u8 = 0x80;

impl Prediction {
    /// Bytes of the section where margins are not divided.
    pub const LENGTH: usize = 8;

    /// Hands the section's content to `put`.
    pub fn write(self, put: &mut impl FnMut(&[u8])) {
        let [a, b, c, d] = self.scale.to_le_bytes();
        let averaged = if self.average == 1 { 0 } else { AVERAGED };
        put(&[self.link.code() | averaged, self.last_of_ties.into(), self.targets.into(), 0, a, b, c, d]);
        if self.average != 1 {
            put(&self.average.to_le_bytes());
        }
    }

    /// Reads a section; `None` for a link that does not exist, a scale that is not positive and finite, a division by 0, or
    /// too few bytes. Bytes after the known ones are ignored.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&[link, ties, targets, _, a, b, c, d], rest) = bytes.split_first_chunk()?;
        let scale = u32::from_le_bytes([a, b, c, d]);
        let average = if link & AVERAGED == 0 { 1 } else { u32::from_le_bytes(*rest.first_chunk()?) };
        // Positive and finite, without floating point.
        if ties > 1 || scale.wrapping_sub(1) >= f32::INFINITY.to_bits() - 1 || average == 0 {
            return None;
        }
        let (last_of_ties, targets) = (ties == 1, targets == 1);
        let link = Link::from_code(link & !AVERAGED)?;
        Some(Self { link, last_of_ties, scale: f32::from_bits(scale), targets, average })
    }
}

/// Features that stand for a missing value, as the library took them in training: 8 bytes. Both ends belong to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sentinel {
    /// The least: a whole number, or the key of an f32 value.
    pub low: i32,
    /// The largest.
    pub high: i32,
}

impl Sentinel {
    /// Bytes of the section.
    pub const LENGTH: usize = 8;

    /// The section's content.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let [[a, b, c, d], [e, f, g, h]] = [self.low.to_le_bytes(), self.high.to_le_bytes()];
        [a, b, c, d, e, f, g, h]
    }

    /// Reads a section; `None` if it is too short or its ends are in the wrong order. Bytes after those that are known
    /// are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&[a, b, c, d, e, f, g, h], _) = bytes.split_first_chunk()?;
        let (low, high) = (i32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h]));
        (low <= high).then_some(Self { low, high })
    }

    /// The feature, or [`MISSING_FEATURE`] if it stands for a missing value.
    pub const fn or_missing(self, feature: i32) -> i32 {
        if self.low <= feature && feature <= self.high { MISSING_FEATURE } else { feature }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::{assert_refused, written};

    fn content(prediction: Prediction) -> std::vec::Vec<u8> {
        written(|put| prediction.write(put))
    }

    #[test]
    fn sections_are_read_back_and_what_makes_no_sense_is_refused() {
        for &link in Link::ALL {
            for (last_of_ties, average, length) in [(false, 1, 8), (true, 1, 8), (false, 500, 12)] {
                let prediction = Prediction { link, last_of_ties, scale: 64.0, targets: !last_of_ties, average };
                let bytes = content(prediction);
                assert_eq!((bytes.len(), Prediction::from_bytes(&bytes)), (length, Some(prediction)));
            }
        }
        // A reader of eight bytes knows no such link.
        let averaged = content(Prediction { average: 500, ..Prediction::default() });
        assert_eq!(Link::from_code(averaged[0]), None);
        assert_eq!(Prediction::from_bytes(&averaged[..11]), None, "too short");
        assert_refused(&averaged, &[(8, &[0; 4])], |bytes| Prediction::from_bytes(bytes).is_some());
        let bytes = content(Prediction::default());
        assert_eq!(Prediction::from_bytes(&bytes[..7]), None);
        assert_refused(&bytes, &[(0, &[5]), (1, &[2])], |bytes| Prediction::from_bytes(bytes).is_some());
        for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(Prediction::from_bytes(&content(Prediction { scale, ..Prediction::default() })), None);
        }
        let sentinel = Sentinel { low: -3, high: 3 };
        assert_eq!(Sentinel::from_bytes(&sentinel.to_bytes()), Some(sentinel));
        assert_eq!(Sentinel::from_bytes(&Sentinel { low: 1, high: 0 }.to_bytes()), None);
        assert_eq!(Sentinel::from_bytes(&sentinel.to_bytes()[..7]), None);
        assert_eq!(
            [-4, -3, 0, 3, 4].map(|x| sentinel.or_missing(x)),
            [-4, MISSING_FEATURE, MISSING_FEATURE, MISSING_FEATURE, 4]
        );
    }
}
