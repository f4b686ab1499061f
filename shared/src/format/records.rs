//! The small records between the header and the trees.

/// A sorted list of thresholds of one feature, which a feature's value is ranked in: four bytes.
///
/// A rank is the number of thresholds at or below the value, 0 to 255. Where a missing value goes is settled by the
/// rank that it gets: 0 goes left at every split, 255 right. So an axis gives one *column* of ranks for the splits that
/// send a missing value left, one for those that send it right, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis {
    /// The feature's index.
    pub feature: u8,
    /// The columns present.
    pub columns: Columns,
    /// Bytes per threshold: 1 to 4, little endian, signed.
    pub width: u8,
    /// Number of thresholds.
    pub count: u8,
}

/// The columns of an [`Axis`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns {
    /// One, in which a missing value has rank 0.
    MissingLeft,
    /// One, in which a missing value has rank 255.
    MissingRight,
    /// First the one, then the other.
    Both,
}

impl Columns {
    /// Number of columns.
    pub const fn count(self) -> u16 {
        match self {
            Self::Both => 2,
            Self::MissingLeft | Self::MissingRight => 1,
        }
    }
}

impl Axis {
    /// Bytes of an axis.
    pub const LENGTH: usize = 4;

    /// Reads an axis; `None` for columns or a width that do not exist.
    pub const fn from_bytes([feature, columns, width, count]: [u8; Self::LENGTH]) -> Option<Self> {
        let columns = match columns {
            1 => Columns::MissingLeft,
            2 => Columns::MissingRight,
            3 => Columns::Both,
            _ => return None,
        };
        if matches!(width, 1..=4) { Some(Self { feature, columns, width, count }) } else { None }
    }

    /// The axis's bytes.
    pub const fn to_bytes(self) -> [u8; Self::LENGTH] {
        let columns = match self.columns {
            Columns::MissingLeft => 1,
            Columns::MissingRight => 2,
            Columns::Both => 3,
        };
        [self.feature, columns, self.width, self.count]
    }

    /// Bytes of the axis's thresholds.
    pub fn cuts_length(self) -> usize {
        usize::from(self.width) * usize::from(self.count)
    }
}

/// Trees whose leaves are scaled in the same way: eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// Integer leaves count for their value times 2^shift.
    pub shift: u8,
    /// The object that a leaf's only value is for; `None` when a leaf has a value for each object.
    pub object: Option<u8>,
    /// Number of trees.
    pub trees: u32,
}

impl Group {
    /// Bytes of a group.
    pub const LENGTH: usize = 8;

    /// Reads a group; `None` when the flag for one-valued leaves is neither 0 nor 1.
    pub const fn from_bytes([_, shift, one, object, a, b, c, d]: [u8; Self::LENGTH]) -> Option<Self> {
        let object = match one {
            0 => None,
            1 => Some(object),
            _ => return None,
        };
        Some(Self { shift, object, trees: u32::from_le_bytes([a, b, c, d]) })
    }

    /// The group's bytes.
    pub const fn to_bytes(self) -> [u8; Self::LENGTH] {
        let (one, object) = match self.object {
            Some(object) => (1, object),
            None => (0, 0),
        };
        let [a, b, c, d] = self.trees.to_le_bytes();
        [0, self.shift, one, object, a, b, c, d]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_read_back_as_written() {
        for columns in [Columns::MissingLeft, Columns::MissingRight, Columns::Both] {
            let axis = Axis { feature: 200, columns, width: 3, count: 255 };
            assert_eq!(Axis::from_bytes(axis.to_bytes()), Some(axis));
        }
        for object in [None, Some(0), Some(255)] {
            let group = Group { shift: 2, object, trees: 70_000 };
            assert_eq!(Group::from_bytes(group.to_bytes()), Some(group));
        }
        assert_eq!(Axis::from_bytes([0, 0, 1, 1]), None);
        assert_eq!(Axis::from_bytes([0, 1, 5, 1]), None);
        assert_eq!(Group::from_bytes([1, 0, 2, 0, 0, 0, 0, 0]), None);
    }
}
