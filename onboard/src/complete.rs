//! Trees filled up to their depth: a walk without a branch.
//!
//! A tree of depth D has 2^D bytes with the splits' columns, then 2^D with their thresholds; slot 1 is the root, the
//! children of slot i are 2i and 2i + 1, and slot 0 is free. A split goes right where the column's rank is at least its
//! threshold. What comes out after D steps, less 2^D, is the leaf.

use crate::bytes::{at, take};
use crate::leaves::Sum;
use crate::ranks::Ranks;
use palpate_shared::format::Group;

/// Trees walked before their leaves are added: a few, so that code for walking is not repeated for every type of leaf.
const BLOCK: usize = 16;

/// Adds up a group of complete trees, and moves `nodes` and `leaves` behind it.
///
/// Cost: five instructions a step, and about ten a tree; then the leaves.
pub(crate) fn add(group: &Group, ranks: &Ranks, nodes: &mut &[u8], leaves: &mut &[u8], sum: &mut Sum<'_>) {
    let depth = group.depth;
    let mut trees = usize::try_from(group.trees).unwrap_or(0);
    while trees > 0 {
        let mut reached = [0; BLOCK];
        let block = trees.min(BLOCK);
        let Some(block_nodes) = take(nodes, block << (depth + 1)) else { return };
        walk_block(depth, block_nodes, ranks, &mut reached);
        let Some(block_leaves) = take(leaves, sum.leaf_length() * block << depth) else { return };
        sum.add_complete(depth, block_leaves, reached.get(..block).unwrap_or_default());
        trees -= block;
    }
}

fn walk_block(depth: u8, nodes: &[u8], ranks: &Ranks, reached: &mut [u8; BLOCK]) {
    match depth {
        1 => walk::<1, 2, 4>(nodes, ranks, reached),
        2 => walk::<2, 4, 8>(nodes, ranks, reached),
        3 => walk::<3, 8, 16>(nodes, ranks, reached),
        4 => walk::<4, 16, 32>(nodes, ranks, reached),
        5 => walk::<5, 32, 64>(nodes, ranks, reached),
        6 => walk::<6, 64, 128>(nodes, ranks, reached),
        7 => walk::<7, 128, 256>(nodes, ranks, reached),
        _ => walk::<8, 256, 512>(nodes, ranks, reached),
    }
}

/// Walks trees of depth `DEPTH`, with `SLOTS` = 2^`DEPTH` and `BYTES` = 2 · `SLOTS`. The compiler sees that an index
/// after s steps is below 2^(s + 1), and leaves out the bounds checks.
#[inline(never)]
fn walk<const DEPTH: usize, const SLOTS: usize, const BYTES: usize>(
    nodes: &[u8],
    ranks: &Ranks,
    reached: &mut [u8; BLOCK],
) {
    let (trees, _) = nodes.as_chunks::<BYTES>();
    for (tree, leaf) in trees.iter().zip(reached) {
        let mut slot = 1;
        for _ in 0..DEPTH {
            let rank = at(ranks, usize::from(at(tree, slot)));
            let right = rank >= at(tree, SLOTS + slot);
            slot = 2 * slot + usize::from(right);
        }
        *leaf = u8::try_from(slot & (SLOTS - 1)).unwrap_or(0);
    }
}
