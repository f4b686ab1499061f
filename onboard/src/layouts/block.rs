//! A block of rows: their ranks, column by column.

use crate::bytes::at;

/// The most rows of a block.
pub(super) const ROWS: usize = 2048;

/// Rows between two checks that there are more.
pub(super) const LANES: usize = 16;

/// Trees whose leaves are added together.
pub(super) const TREES: usize = 4;

/// The leaf that each row reaches.
pub(super) type Leaves = [u8; ROWS];

/// Rows that go through a model together.
pub(super) struct Block<'a> {
    /// Column by column.
    pub(super) ranks: &'a [u8],
    /// Number of columns.
    pub(super) columns: usize,
    /// Ranks of a column, those of no row at its end: a multiple of [`LANES`].
    pub(super) stride: usize,
    /// Row by row.
    pub(super) features: &'a [i32],
    /// Features of a row.
    pub(super) width: usize,
}

impl Block<'_> {
    /// The ranks of a column.
    pub(super) fn column(&self, column: u8) -> &[[u8; LANES]] {
        let ranks = self.ranks.get(usize::from(column) * self.stride..).unwrap_or_default();
        ranks.get(..self.stride).unwrap_or_default().as_chunks().0
    }

    /// The rank of a row; 0 beyond the columns.
    pub(super) fn rank(&self, column: u8, row: usize) -> u8 {
        at(self.ranks, usize::from(column) * self.stride + row)
    }
}
