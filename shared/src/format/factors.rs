//! Leaves that share a table: a few factors in each leaf, and what makes margins of them.

/// The section of a model whose leaves hold a few *factors* instead of a value for each object: a weight for each object
/// and factor. What the leaves of a touch add up to, factor by factor, makes the margin of an object:
///
/// ```text
/// margin = base margin + (Σ weight · sum of the factor) >> shift
/// ```
///
/// Read in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factors<'a> {
    shift: u8,
    count: u8,
    /// Object by object a weight for each factor, as i8.
    weights: &'a [u8],
}

impl<'a> Factors<'a> {
    /// Bytes before the weights.
    pub const HEADER: usize = 4;
    /// The most factors of a leaf.
    pub const MOST: usize = 64;
    /// The largest shift.
    pub const MAX_SHIFT: u8 = 30;

    /// What stands before the weights. `count` is to be a multiple of four from 4 to [`Factors::MOST`], and `shift` at most
    /// [`Factors::MAX_SHIFT`].
    pub const fn header(count: u8, shift: u8) -> [u8; 4] {
        [count, shift, 0, 0]
    }

    /// Reads a section of a model with this many objects; `None` if a number is out of its range or there are too few
    /// bytes. Bytes after those that are known are ignored.
    ///
    /// Cost: about 30 instructions. Cannot fail otherwise.
    pub fn from_bytes(bytes: &'a [u8], objects: usize) -> Option<Self> {
        let (&[count, shift, _, _], rest) = bytes.split_first_chunk::<4>()?;
        if count == 0 || count & 3 != 0 || usize::from(count) > Self::MOST || shift > Self::MAX_SHIFT {
            return None;
        }
        // A model has at most 256 objects, which nine bits hold: nothing can overflow.
        let weights = rest.get(..(objects & 0x1ff).wrapping_mul(usize::from(count)))?;
        Some(Self { shift, count, weights })
    }

    /// How many numbers a leaf holds: a multiple of four up to [`Factors::MOST`].
    pub const fn count(&self) -> usize {
        self.count as usize
    }

    /// How far sums of products are shifted.
    pub const fn shift(&self) -> u8 {
        self.shift
    }

    /// The weights of an object, one for each factor, as i8; none for one that the model does not have.
    pub fn weights(&self, object: usize) -> &'a [u8] {
        let start = object.saturating_mul(self.count());
        self.weights.get(start..start.saturating_add(self.count())).unwrap_or_default()
    }

    /// Sets `margins`, one for each object, to the products of `sums`, one for each factor, and the objects' weights, shifted.
    ///
    /// Cost: about four instructions for each object and factor on a Cortex-M4, eight on a Cortex-M0+, and 18 to 24 for each object.
    /// Wraps around where the products leave 32 bits, which those of no model that was checked do.
    pub fn mix(&self, sums: &[i32], margins: &mut [i32]) {
        let (sums, _) = sums.as_chunks::<4>();
        let mut weights = self.weights.as_chunks::<4>().0.iter();
        for margin in margins {
            let mut sum = 0_i32;
            for (&[a, b, c, d], &[p, q, r, s]) in sums.iter().zip(&mut weights) {
                sum = add(add(add(add(sum, a, p), b, q), c, r), d, s);
            }
            *margin = sum >> (self.shift & 31);
        }
    }
}

/// Adds a product.
#[inline(always)]
const fn add(sum: i32, factor: i32, weight: u8) -> i32 {
    sum.wrapping_add(factor.wrapping_mul(weight.cast_signed() as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_is_the_sum_of_products_rounded_down() {
        // Two objects, four factors.
        let bytes = [4, 1, 0, 0, 1, 2, 3, 0xff, 0x80, 0, 0, 1, 9];
        let factors = Factors::from_bytes(&bytes, 2).unwrap();
        assert_eq!((factors.count(), factors.shift()), (4, 1));
        assert_eq!(factors.weights(1), [0x80, 0, 0, 1]);
        assert!(factors.weights(2).is_empty());
        let mut margins = [7; 2];
        factors.mix(&[1, 10, 100, 1_000], &mut margins);
        // 1 + 20 + 300 − 1000 = −679 and −128 + 1000 = 872, halved.
        assert_eq!(margins, [-340, 436]);
    }

    #[test]
    fn sections_that_make_no_sense_are_none() {
        let with = |count, shift, length| {
            let mut bytes = [0; 300];
            bytes[..4].copy_from_slice(&Factors::header(count, shift));
            Factors::from_bytes(&bytes[..length], 3).is_some()
        };
        assert!(with(4, 0, 16) && with(64, 30, 196) && with(4, 0, 300));
        assert!(!with(4, 0, 15) && !with(0, 0, 300) && !with(5, 0, 300) && !with(68, 0, 300) && !with(4, 31, 300));
        assert!(Factors::from_bytes(&[], 3).is_none());
    }
}
