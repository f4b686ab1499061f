//! Trees filled up to their depth: a walk without a branch.
//!
//! A tree of depth D has 2^D slots: slot 1 is the root, the children of slot i are 2i and 2i + 1, and the column
//! of slot 0 is the number of the root, 1: read and not known, it keeps the compiler from splitting slots into constant
//! and variable parts, which costs an addition for every load. A split goes right where the column's rank is above its threshold. What comes out after D steps, less 2^D, is the
//! leaf. A group has the columns of all slots of all its trees, a byte each, then the thresholds likewise: as two
//! pointers that move together, they need no arithmetic between the loads.

use crate::bytes::{at, take};
use crate::leaves::Sum;
use crate::ranks::Ranks;
use palpate_shared::format::Group;

/// Trees walked before their leaves are added: a few, so that code for walking is not repeated for every type of leaf.
const BLOCK: usize = 32;

/// Adds up a group of complete trees, and moves `nodes` and `leaves` behind it.
///
/// Cost: five instructions a step, and about ten a tree; then the leaves.
#[inline(never)]
pub(crate) fn add(group: &Group, ranks: &Ranks, nodes: &mut &[u8], leaves: &mut &[u8], sum: &mut Sum<'_>) {
    let depth = group.depth;
    let mut trees = usize::try_from(group.trees).unwrap_or(0);
    let Some(mut columns) = take(nodes, trees << depth) else { return };
    let Some(mut thresholds) = take(nodes, trees << depth) else { return };
    let mut reached = [0; BLOCK];
    while trees > 0 {
        let block = trees.min(BLOCK);
        let Some(columns) = take(&mut columns, block << depth) else { return };
        let Some(thresholds) = take(&mut thresholds, block << depth) else { return };
        walk_block(depth, columns, thresholds, ranks, &mut reached);
        let Some(block_leaves) = take(leaves, (sum.leaf_length() * block) << depth) else { return };
        sum.add_complete(block_leaves, reached.get(..block).unwrap_or_default());
        trees -= block;
    }
}

fn walk_block(depth: u8, columns: &[u8], thresholds: &[u8], ranks: &Ranks, reached: &mut [u16; BLOCK]) {
    match depth {
        1 => walk::<1, 2>(columns, thresholds, ranks, reached),
        2 => walk::<2, 4>(columns, thresholds, ranks, reached),
        3 => walk::<3, 8>(columns, thresholds, ranks, reached),
        4 => walk::<4, 16>(columns, thresholds, ranks, reached),
        5 => walk::<5, 32>(columns, thresholds, ranks, reached),
        6 => walk::<6, 64>(columns, thresholds, ranks, reached),
        7 => walk::<7, 128>(columns, thresholds, ranks, reached),
        _ => walk::<8, 256>(columns, thresholds, ranks, reached),
    }
}

/// Walks trees of depth `DEPTH`, with `SLOTS` = 2^`DEPTH`, and numbers the leaves that are reached through all trees.
#[inline(never)]
fn walk<const DEPTH: usize, const SLOTS: usize>(
    columns: &[u8],
    thresholds: &[u8],
    ranks: &Ranks,
    reached: &mut [u16; BLOCK],
) {
    let trees = columns.as_chunks::<SLOTS>().0.iter().zip(thresholds.as_chunks::<SLOTS>().0);
    let mut first = 0;
    for (leaf, (columns, thresholds)) in reached.iter_mut().zip(trees) {
        *leaf = first + leaf_of::<DEPTH, SLOTS>(columns, thresholds, ranks);
        first += 1 << DEPTH;
    }
}

/// The leaf of a tree. The compiler sees that a slot after s steps is below 2^(s + 1), and leaves out the bounds checks;
/// not inlined, since in a loop over trees it finds worse ways to address slots.
#[inline(never)]
fn leaf_of<const DEPTH: usize, const SLOTS: usize>(
    columns: &[u8; SLOTS],
    thresholds: &[u8; SLOTS],
    ranks: &Ranks,
) -> u16 {
    let mut slot = usize::from(at(columns, 0)) & 1;
    // Written out, so that the steps are not left as a loop where size is optimised for.
    slot = if DEPTH > 0 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 1 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 2 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 3 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 4 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 5 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 6 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 7 { step(columns, thresholds, ranks, slot) } else { slot };
    u16::try_from(slot & (SLOTS - 1)).unwrap_or(0)
}

/// From a slot to one of its children.
#[inline(always)]
fn step<const SLOTS: usize>(columns: &[u8; SLOTS], thresholds: &[u8; SLOTS], ranks: &Ranks, slot: usize) -> usize {
    let rank = u32::from(at(ranks, usize::from(at(columns, slot))));
    // The borrow as a bit and not as a comparison, of which the compiler would make branches.
    let right = u32::from(at(thresholds, slot)).wrapping_sub(rank) >> 8 & 1;
    slot << 1 | usize::try_from(right).unwrap_or(0)
}
