//! Leaves as indices into a table in which each leaf's values are stored once.

/// The table of a model whose leaves are shared, and how long a number is that stands for a leaf.
///
/// Only for trees that are walked: trees that are code have no leaves in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedLeaves<'a> {
    /// True if a number has two bytes, and not one.
    is_wide: bool,
    /// The values of leaf 0, then of leaf 1, and so on.
    values: &'a [u8],
}

/// Bytes of the section before the values.
const BEFORE_VALUES: usize = 4;

impl<'a> SharedLeaves<'a> {
    /// Reads a section; `None` if its numbers have neither one byte nor two.
    pub fn from_bytes(bytes: &'a [u8]) -> Option<Self> {
        let (&[width, ..], values) = bytes.split_first_chunk::<BEFORE_VALUES>()?;
        matches!(width, 1 | 2).then_some(Self { is_wide: width == 2, values })
    }

    /// Bytes in front of the values, where numbers have two bytes or one.
    pub const fn header(is_wide: bool) -> [u8; BEFORE_VALUES] {
        [1 + is_wide as u8, 0, 0, 0]
    }

    /// Bytes of a number: 1 or 2.
    pub const fn number_length(&self) -> usize {
        1 + self.is_wide as usize
    }

    /// The values of all leaves, one after the other.
    pub const fn values(&self) -> &'a [u8] {
        self.values
    }

    /// The number at `index` of the numbers in `leaves`; 0 beyond their end.
    ///
    /// Cost: a few instructions. Cannot fail.
    #[inline(always)]
    pub fn number(&self, leaves: &[u8], index: usize) -> u16 {
        let at = |index: usize| leaves.get(index).copied().unwrap_or_default();
        if self.is_wide { u16::from_le_bytes([at(2 * index), at(2 * index + 1)]) } else { at(index).into() }
    }

    /// The first of the numbers in `leaves` whose `length` bytes of values are not all in the table: which one it is.
    ///
    /// Cost: some instructions for each number. Cannot fail.
    pub fn first_unknown(&self, leaves: &[u8], length: usize) -> Option<usize> {
        let count = leaves.len() / self.number_length();
        // Below 2^26 for at most 256 values of four bytes.
        (0..count).find(|&index| (usize::from(self.number(leaves, index)) + 1) * length > self.values.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_one_byte_or_two_and_nothing_else() {
        for (width, expected) in [(0, None), (1, Some(1)), (2, Some(2)), (3, None)] {
            let bytes = [width, 0, 0, 0, 9];
            assert_eq!(SharedLeaves::from_bytes(&bytes).map(|shared| shared.number_length()), expected);
        }
        assert_eq!(SharedLeaves::from_bytes(&[1, 0, 0]), None);
        for is_wide in [false, true] {
            let header = SharedLeaves::header(is_wide);
            let shared = SharedLeaves::from_bytes(&header).unwrap();
            assert_eq!((shared.number_length(), shared.values()), (1 + usize::from(is_wide), &[][..]));
        }
    }

    #[test]
    fn a_number_is_known_if_all_of_its_values_are_in_the_table() {
        let narrow = SharedLeaves::from_bytes(&[1, 0, 0, 0, 1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!((narrow.number(&[7, 8], 1), narrow.number(&[7, 8], 2)), (8, 0));
        // Three leaves of two values, or two of three.
        assert_eq!(narrow.first_unknown(&[0, 2, 1], 2), None);
        assert_eq!(narrow.first_unknown(&[0, 2, 1], 3), Some(1));
        let wide = SharedLeaves::from_bytes(&[2, 0, 0, 0, 1, 2]).unwrap();
        assert_eq!(wide.number(&[0, 0, 1, 2], 1), 0x201);
        assert_eq!(wide.first_unknown(&[1, 0, 0, 0, 2, 0], 1), Some(2));
    }
}
