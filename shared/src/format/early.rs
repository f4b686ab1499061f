//! Bounds with which the class of a row is known before all trees are walked.

/// A place in the walk of a model with integer leaves, and what may still happen after it: 8 bytes of the section, which has
/// one for each such place, in the order of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EarlyExit {
    /// Groups of trees before it.
    pub groups: u16,
    /// The most, in units, by which the trees after it change the difference between two margins.
    pub bound: u32,
}

impl EarlyExit {
    /// Bytes of one.
    pub const LENGTH: usize = 8;

    /// Its bytes in the section.
    pub const fn to_bytes(self) -> [u8; Self::LENGTH] {
        let ([a, b], [c, d, e, f]) = (self.groups.to_le_bytes(), self.bound.to_le_bytes());
        [a, b, 0, 0, c, d, e, f]
    }

    /// The one with these bytes. Cost: a few instructions.
    pub const fn from_bytes([a, b, _, _, c, d, e, f]: [u8; Self::LENGTH]) -> Self {
        Self { groups: u16::from_le_bytes([a, b]), bound: u32::from_le_bytes([c, d, e, f]) }
    }

    /// All of a section; bytes after the last whole one are ignored.
    pub fn all(section: &[u8]) -> impl Iterator<Item = Self> {
        section.as_chunks().0.iter().map(|bytes| Self::from_bytes(*bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_back() {
        let places = [EarlyExit { groups: 300, bound: 70_000 }, EarlyExit { groups: 301, bound: 0 }];
        let bytes = places.map(EarlyExit::to_bytes);
        assert!(EarlyExit::all(bytes.as_flattened()).eq(places));
        assert!(EarlyExit::all(&bytes.as_flattened()[..15]).eq([places[0]]));
    }
}
