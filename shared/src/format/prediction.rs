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

/// Rule that turns margins of a model over rows into a class or a value: 8 bytes, 4 more where margins are averaged, and 8 for
/// each output where they have scales and offsets of their own. A model without this section has the
/// [default](Prediction::default).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Function that turns a scaled margin into a value.
    pub link: Link,
    /// True if the last of several largest margins names the class, and not the first.
    pub last_of_ties: bool,
    /// Factor that turns a margin into the library's: positive and finite. Where outputs have an [`OutputScale`], the largest
    /// of theirs.
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
/// Set in the byte of the link where each output has an [`OutputScale`].
const OWN_SCALES: u8 = 0x40;

impl Prediction {
    /// Bytes of the section where margins are not divided, nor have scales of their own.
    pub(crate) const LENGTH: usize = 8;

    /// Hands the section's content to `put`; `scales` are those of all outputs, or none.
    pub fn write(self, scales: &[OutputScale], put: &mut impl FnMut(&[u8])) {
        let [a, b, c, d] = self.scale.to_le_bytes();
        let averaged = if self.average == 1 { 0 } else { AVERAGED };
        let own = if scales.is_empty() { 0 } else { OWN_SCALES };
        put(&[self.link.code() | averaged | own, self.last_of_ties.into(), self.targets.into(), 0, a, b, c, d]);
        if self.average != 1 {
            put(&self.average.to_le_bytes());
        }
        for OutputScale { scale, offset } in scales {
            put(&scale.to_le_bytes());
            put(&offset.to_le_bytes());
        }
    }

    /// Reads the section of a model with this number of outputs; `None` for a link that does not exist, a scale that is not
    /// positive and finite, an offset that is not finite, a division by 0, or too few bytes. Bytes after the known ones are
    /// ignored.
    ///
    /// Cost: a few instructions, and for each output where these have scales of their own. Cannot fail otherwise.
    pub fn from_bytes(bytes: &[u8], outputs: usize) -> Option<Self> {
        let (&[link, ties, targets, _, a, b, c, d], rest) = bytes.split_first_chunk()?;
        let scale = positive([a, b, c, d])?;
        let average = if link & AVERAGED == 0 { 1 } else { u32::from_le_bytes(*rest.first_chunk()?) };
        let has_scales = || (0..outputs).all(|output| OutputScale::of(bytes, output).is_some());
        if ties > 1 || average == 0 || link & OWN_SCALES != 0 && !has_scales() {
            return None;
        }
        let (last_of_ties, targets) = (ties == 1, targets == 1);
        let link = Link::from_code(link & !(AVERAGED | OWN_SCALES))?;
        Some(Self { link, last_of_ties, scale, targets, average })
    }
}

/// Scale and offset of an output of a regression: the library's margin is the model's, times the scale, plus the offset. Integers
/// hold the leaves without it, so that they keep the digits of small differences of large values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputScale {
    /// Factor: positive and finite.
    pub scale: f32,
    /// Addend: finite.
    pub offset: f32,
}

impl OutputScale {
    /// Bytes in the section of a [`Prediction`].
    pub const LENGTH: usize = 8;

    /// The scale and offset of an output in the content of a section; `None` if it states none that makes sense.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn of(section: &[u8], output: usize) -> Option<Self> {
        let link = section.first().filter(|link| *link & OWN_SCALES != 0)?;
        let first = if link & AVERAGED == 0 { Prediction::LENGTH } else { Prediction::LENGTH + 4 };
        let &[a, b, c, d, e, f, g, h] = section.get(first..)?.as_chunks().0.get(output)?;
        let offset = u32::from_le_bytes([e, f, g, h]);
        let is_finite = offset << 1 < f32::INFINITY.to_bits() << 1;
        Some(Self { scale: positive([a, b, c, d])?, offset: f32::from_bits(offset) }).filter(|_| is_finite)
    }
}

/// A number that is positive and finite, found out without floating point.
fn positive(bytes: [u8; 4]) -> Option<f32> {
    let bits = u32::from_le_bytes(bytes);
    (bits.wrapping_sub(1) < f32::INFINITY.to_bits() - 1).then_some(f32::from_bits(bits))
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
    pub(crate) const LENGTH: usize = 8;

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
        written(|put| prediction.write(&[], put))
    }

    #[test]
    fn sections_are_read_back_and_what_makes_no_sense_is_refused() {
        for &link in Link::ALL {
            for (last_of_ties, average, length) in [(false, 1, 8), (true, 1, 8), (false, 500, 12)] {
                let prediction = Prediction { link, last_of_ties, scale: 64.0, targets: !last_of_ties, average };
                let bytes = content(prediction);
                assert_eq!((bytes.len(), Prediction::from_bytes(&bytes, 1)), (length, Some(prediction)));
            }
        }
        // A reader of eight bytes knows no such link.
        let averaged = content(Prediction { average: 500, ..Prediction::default() });
        assert_eq!(Link::from_code(averaged[0]), None);
        assert_eq!(Prediction::from_bytes(&averaged[..11], 1), None, "too short");
        assert_refused(&averaged, &[(8, &[0; 4])], |bytes| Prediction::from_bytes(bytes, 1).is_some());
        let bytes = content(Prediction::default());
        assert_eq!(Prediction::from_bytes(&bytes[..7], 1), None);
        assert_refused(&bytes, &[(0, &[5]), (1, &[2])], |bytes| Prediction::from_bytes(bytes, 1).is_some());
        for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(Prediction::from_bytes(&content(Prediction { scale, ..Prediction::default() }), 1), None);
        }
        for (average, first) in [(1, 8), (5, 12)] {
            let prediction = Prediction { average, targets: true, scale: 4.0, ..Prediction::default() };
            let scales = [(0.5, 1.5e9), (4.0, -0.0)].map(|(scale, offset)| OutputScale { scale, offset });
            let bytes = written(|put| prediction.write(&scales, put));
            assert_eq!((bytes.len(), Prediction::from_bytes(&bytes, 2)), (first + 16, Some(prediction)));
            assert_eq!(
                [0, 1, 2].map(|output| OutputScale::of(&bytes, output)),
                [Some(scales[0]), Some(scales[1]), None]
            );
            assert_eq!(Prediction::from_bytes(&bytes, 3), None, "scales of two outputs");
            let damage: [(usize, &[u8]); 4] = [
                (first, &[0; 4]),
                (first + 8, &f32::INFINITY.to_le_bytes()),
                (first + 4, &f32::NAN.to_le_bytes()),
                (first + 12, &f32::NEG_INFINITY.to_le_bytes()),
            ];
            assert_refused(&bytes, &damage, |bytes| Prediction::from_bytes(bytes, 2).is_some());
        }
        assert_eq!(OutputScale::of(&bytes, 0), None);
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
