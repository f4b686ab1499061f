//! Weights of evidence by the number of rows.

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
    use crate::format::tests::written;
    use std::vec::Vec;

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
