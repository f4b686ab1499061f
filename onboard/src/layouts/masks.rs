//! Many rows at one tree: comparisons are looked up, not walked.
//!
//! A row that goes right at a split never reaches the leaves on the left. So all the splits of one column together leave a
//! set of leaves for each rank, one bit each; of the leaves that all columns leave, a row reaches the first. The sets are made
//! once for a tree, and cost a row one load per column then, instead of a chain of loads per step.

use super::block::{Block, LANES, Leaves, TREES};
use crate::bytes::at;

/// Leaves of the largest tree that is looked up.
pub(super) const LEAVES: usize = 64;

/// Columns that a tree may compare: with more, a walk is as fast.
const COLUMNS: usize = 8;

/// With so few columns in a model, every tree takes all of them, in their order: then several trees are looked up together,
/// and a rank is loaded once for all.
const FEW: usize = 4;

/// The leaves that are left, for each rank.
type Left = [u64; 256];

/// A tree's columns, and what each leaves.
pub(super) struct Masks {
    left: [Left; COLUMNS],
    columns: [u8; COLUMNS],
    used: usize,
    /// For each column its place among those that are used, or [`UNUSED`].
    places: [u8; 256],
}

/// The place of a column that is not used: none of [`COLUMNS`].
const UNUSED: u8 = u8::MAX;

impl Masks {
    pub(super) const fn new() -> Self {
        Self { left: [[0; 256]; COLUMNS], columns: [0; COLUMNS], used: 0, places: [UNUSED; 256] }
    }

    /// Takes a tree of the compact layout. `None` if it has to be walked.
    pub(super) fn take_compact(&mut self, splits: &[[u8; 3]], block: &Block<'_>) -> Option<()> {
        if splits.len() >= LEAVES {
            return None;
        }
        self.begin(block)?;
        // Subtrees that are still to come: how many splits, and the first leaf.
        let mut open = [(0, 0); LEAVES + 1];
        *open.first_mut()? = (splits.len(), 0);
        let mut last = 0_usize;
        for &[column, threshold, left] in splits {
            let left = usize::from(left);
            let (mut below, mut first) = *open.get(last)?;
            while below == 0 {
                last = last.checked_sub(1)?;
                (below, first) = *open.get(last)?;
            }
            // Sizes that contradict each other are left to the walk.
            let right = below.checked_sub(left + 1)?;
            self.split(column, threshold, ones(left + 1) << (first & 63), block)?;
            *open.get_mut(last)? = (right, first + left + 1);
            last += 1;
            *open.get_mut(last)? = (left, first);
        }
        self.finish();
        Some(())
    }

    /// Uses no column yet, or all of few.
    fn begin(&mut self, block: &Block<'_>) -> Option<()> {
        for &column in self.columns.get(..self.used).unwrap_or_default() {
            if let Some(place) = self.places.get_mut(usize::from(column)) {
                *place = UNUSED;
            }
        }
        self.used = 0;
        if block.columns <= FEW {
            for column in 0..block.columns {
                self.use_column(u8::try_from(column).ok()?)?;
            }
        }
        Some(())
    }

    /// Takes `left` from the ranks above a threshold.
    #[inline(always)]
    fn split(&mut self, column: u8, threshold: u8, left: u64, block: &Block<'_>) -> Option<()> {
        // Ranks beyond the model's columns are 0: below or at every threshold.
        let Some(above) = threshold.checked_add(1).filter(|_| usize::from(column) < block.columns) else {
            return Some(());
        };
        let mut place = at(&self.places, usize::from(column));
        if place == UNUSED {
            place = self.use_column(column)?;
        }
        *self.left.get_mut(usize::from(place))?.get_mut(usize::from(above))? &= !left;
        Some(())
    }

    /// A place for one more column; `None` if there are too many.
    #[inline(never)]
    fn use_column(&mut self, column: u8) -> Option<u8> {
        *self.columns.get_mut(self.used)? = column;
        self.left.get_mut(self.used)?.fill(u64::MAX);
        let place = u8::try_from(self.used).ok()?;
        *self.places.get_mut(usize::from(column))? = place;
        self.used += 1;
        Some(place)
    }

    /// Clears in every rank the bits that a rank below it has cleared.
    fn finish(&mut self) {
        let used = self.left.get_mut(..self.used).unwrap_or_default();
        // Two at a time: each is one chain of dependent steps.
        let (pairs, last) = used.as_chunks_mut();
        for [a, b] in pairs {
            let (mut left, mut other) = (u64::MAX, u64::MAX);
            for (a, b) in a.iter_mut().zip(b) {
                left &= *a;
                other &= *b;
                (*a, *b) = (left, other);
            }
        }
        for column in last {
            let mut left = u64::MAX;
            for rank in column {
                left &= *rank;
                *rank = left;
            }
        }
    }

    /// The leaf that every row of a block reaches.
    pub(super) fn look_up(&self, block: &Block<'_>, leaves: &mut Leaves) {
        match self.used {
            1 => self.look_up_in::<1>(block, leaves),
            2 => self.look_up_in::<2>(block, leaves),
            3 => self.look_up_in::<3>(block, leaves),
            4 => self.look_up_in::<4>(block, leaves),
            5 => self.look_up_in::<5>(block, leaves),
            6 => self.look_up_in::<6>(block, leaves),
            7 => self.look_up_in::<7>(block, leaves),
            8 => self.look_up_in::<8>(block, leaves),
            _ => leaves.fill(0),
        }
    }

    /// The leaf of every tree that every row of a block reaches; `false` if each tree has to be looked up by itself.
    pub(super) fn look_up_all(all: &[Self; TREES], block: &Block<'_>, leaves: &mut [Leaves; TREES]) -> bool {
        match block.columns {
            1 => Self::look_up_all_in::<1>(all, block, leaves),
            2 => Self::look_up_all_in::<2>(all, block, leaves),
            3 => Self::look_up_all_in::<3>(all, block, leaves),
            4 => Self::look_up_all_in::<4>(all, block, leaves),
            _ => return false,
        }
        true
    }

    fn look_up_all_in<const USED: usize>(all: &[Self; TREES], block: &Block<'_>, leaves: &mut [Leaves; TREES]) {
        let columns: [&[[u8; LANES]]; USED] = core::array::from_fn(|column| {
            let [column, ..] = column.to_le_bytes();
            block.column(column)
        });
        let [a, b, c, d] = leaves.each_mut().map(|leaves| leaves.as_chunks_mut::<LANES>().0.iter_mut());
        let [ma, mb, mc, md] = all.each_ref().map(|masks| masks.left.first_chunk::<USED>());
        let (Some(ma), Some(mb), Some(mc), Some(md)) = (ma, mb, mc, md) else { return };
        let leaves = a.zip(b).zip(c).zip(d).take(block.stride / LANES).enumerate();
        for (index, (((a, b), c), d)) in leaves {
            let ranks = columns.map(|column| column.get(index).unwrap_or(&[0; LANES]));
            for lane in 0..LANES {
                let ranks = ranks.map(|ranks| usize::from(at(ranks, lane)));
                let leaf = |left: &[Left; USED]| {
                    let mut all = u64::MAX;
                    for (left, rank) in left.iter().zip(ranks) {
                        all &= at(left, rank);
                    }
                    let [leaf, ..] = (all | 1 << 63).trailing_zeros().to_le_bytes();
                    leaf
                };
                for (leaves, leaf) in
                    [(&mut *a, leaf(ma)), (&mut *b, leaf(mb)), (&mut *c, leaf(mc)), (&mut *d, leaf(md))]
                {
                    if let Some(place) = leaves.get_mut(lane) {
                        *place = leaf;
                    }
                }
            }
        }
    }

    fn look_up_in<const USED: usize>(&self, block: &Block<'_>, leaves: &mut Leaves) {
        let (Some(left), Some(columns)) = (self.left.first_chunk::<USED>(), self.columns.first_chunk::<USED>()) else {
            return;
        };
        let columns = columns.map(|column| block.column(column));
        for (index, leaves) in leaves.as_chunks_mut::<LANES>().0.iter_mut().take(block.stride / LANES).enumerate() {
            let ranks = columns.map(|column| column.get(index).unwrap_or(&[0; LANES]));
            for (lane, leaf) in leaves.iter_mut().enumerate() {
                let mut all = u64::MAX;
                for (left, ranks) in left.iter().zip(ranks) {
                    all &= at(left, usize::from(at(ranks, lane)));
                }
                // There is always one; the compiler does not know it.
                [*leaf, ..] = (all | 1 << 63).trailing_zeros().to_le_bytes();
            }
        }
    }
}

/// This number of one bits, up to 63.
const fn ones(count: usize) -> u64 {
    (1_u64 << (count & 63)).wrapping_sub(1)
}
