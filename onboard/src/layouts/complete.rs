//! Trees filled up to their depth: a walk without a branch.
//!
//! A tree of depth D has 2^D slots: slot 1 is the root, the children of slot i are 2i and 2i + 1, and the column
//! of slot 0 is the number of the root, 1: read and not known, it keeps the compiler from splitting slots into constant
//! and variable parts, which costs an addition forevery load. A split goes right where the column's rank is above its
//! threshold. What comes out after D steps, less 2^D, is the leaf. A group has the columns of all slots of all its
//! trees, one byte each, then the thresholds in the same way: as two pointers that move together, they need no arithmetic between
//! the loads.

use super::leaves::{BLOCK, Sum};
use super::ranks::Ranks;
use crate::bytes::{at, take};
use core::hint::black_box;
use palpate_shared::format::Group;

/// Numbers of leaves, counted through all trees of a block.
pub(crate) type Reached = [u16; BLOCK];

/// Checks that a group's splits and leaves are there, and moves `nodes` and `leaves` past them.
pub(crate) fn check(group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], leaf: usize) -> Option<()> {
    let trees = usize::try_from(group.trees).ok()?;
    // Two bytes per slot; compared like this nothing can overflow.
    if trees > nodes.len() >> 1 >> (group.depth & 15) {
        return None;
    }
    let slots = trees << (group.depth & 15);
    take(nodes, 2 * slots)?;
    take(leaves, slots.checked_mul(leaf)?)?;
    Some(())
}

/// Adds up a group of complete trees, and moves `nodes` and `leaves` past it.
///
/// Cost: a few instructions for each step and each tree; then the leaves, with a few more for each tree where they are
/// shared. `compile/cost.rs` of the host has the numbers, which the firmware's `evaluator` checks.
pub(crate) fn add(
    group: &Group,
    ranks: &Ranks,
    reached: &mut Reached,
    nodes: &mut &[u8],
    leaves: &mut &[u8],
    sum: &mut Sum<'_>,
) {
    let depth = group.depth;
    let mut trees = usize::try_from(group.trees).unwrap_or(0);
    let (leaf_length, stored_length) = (sum.leaf_length(), sum.stored_length());
    let slots = trees << depth;
    let Some((mut columns, rest)) = nodes.split_at_checked(slots) else { return };
    let Some((mut thresholds, rest)) = rest.split_at_checked(slots) else { return };
    *nodes = rest;
    while trees > 0 {
        let block = trees.min(BLOCK);
        let slots = block << depth;
        let Some((block_columns, rest)) = columns.split_at_checked(slots) else { return };
        columns = rest;
        let Some((block_thresholds, rest)) = thresholds.split_at_checked(slots) else { return };
        thresholds = rest;
        let Some((block_leaves, rest)) = leaves.split_at_checked(stored_length * slots) else { return };
        *leaves = rest;
        let Some(reached) = reached.get_mut(..block) else { return };
        walk(depth, block_columns, block_thresholds, ranks, reached);
        if let Some(shared) = sum.shared() {
            reached.iter_mut().for_each(|leaf| *leaf = shared.number(block_leaves, usize::from(*leaf)));
            sum.add_reached(shared.values(), reached, leaf_length);
        } else {
            sum.add_reached(block_leaves, reached, leaf_length);
        }
        trees -= block;
    }
}

/// Cortex-M, on which the compiler makes branches of comparisons.
const ARM: bool = cfg!(target_arch = "arm");

/// Walks trees, and numbers the leaves that are reached through all of them.
fn walk(depth: u8, columns: &[u8], thresholds: &[u8], ranks: &Ranks, reached: &mut [u16]) {
    match depth {
        // The usual depths, written out.
        4 => walk_fixed::<4, 16>(columns, thresholds, ranks, reached),
        5 => walk_fixed::<5, 32>(columns, thresholds, ranks, reached),
        6 => walk_fixed::<6, 64>(columns, thresholds, ranks, reached),
        _ => walk_any(depth, columns, thresholds, ranks, reached),
    }
}

/// Trees of depth `DEPTH`, with `SLOTS` = 2^`DEPTH`.
#[inline(never)]
fn walk_fixed<const DEPTH: usize, const SLOTS: usize>(
    columns: &[u8],
    thresholds: &[u8],
    ranks: &Ranks,
    reached: &mut [u16],
) {
    let trees = columns.as_chunks::<SLOTS>().0.iter().zip(thresholds.as_chunks::<SLOTS>().0);
    // As two bytes, or the compiler would find columns by it.
    let mut first = low(SLOTS).wrapping_neg();
    for (leaf, (columns, thresholds)) in reached.iter_mut().zip(trees) {
        // Otherwise the compiler addresses both by one running offset, which costs an addition per step.
        let thresholds = black_box(thresholds);
        *leaf = first.wrapping_add(low(last_slot::<DEPTH, SLOTS>(columns, thresholds, ranks)));
        first = first.wrapping_add(low(SLOTS));
    }
}

/// The slot below the tree that is reached. The compiler sees that a slot after s steps is below 2^(s + 1), and leaves out
/// the bounds checks.
#[inline(always)]
fn last_slot<const DEPTH: usize, const SLOTS: usize>(
    columns: &[u8; SLOTS],
    thresholds: &[u8; SLOTS],
    ranks: &Ranks,
) -> usize {
    let mut slot = usize::from(at(columns, 0)) & 1;
    // Written out, so that the steps are not left as a loop where size is optimized for.
    slot = if DEPTH > 0 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 1 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 2 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 3 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 4 { step(columns, thresholds, ranks, slot) } else { slot };
    slot = if DEPTH > 5 { step(columns, thresholds, ranks, slot) } else { slot };
    // Elsewhere, the compiler would put it together a second time out of every step's direction.
    if ARM { slot } else { black_box(slot) }
}

/// Trees of any depth.
#[inline(never)]
fn walk_any(depth: u8, columns: &[u8], thresholds: &[u8], ranks: &Ranks, reached: &mut [u16]) {
    let slots = 1_usize << (depth & 15);
    let trees = columns.chunks_exact(slots).zip(thresholds.chunks_exact(slots));
    let mut first = low(slots).wrapping_neg();
    for (leaf, (columns, thresholds)) in reached.iter_mut().zip(trees) {
        let mut slot = 1;
        // Both are as long as there are slots, so what ends the walk is the bounds check, once for each step.
        while let (Some(&column), Some(&threshold)) = (columns.get(slot), thresholds.get(slot)) {
            slot = child(ranks, column, threshold, slot);
        }
        *leaf = first.wrapping_add(low(slot));
        first = first.wrapping_add(low(slots));
    }
}

/// A number below 2^16.
#[inline(always)]
fn low(number: usize) -> u16 {
    let [a, b, ..] = number.to_le_bytes();
    u16::from_le_bytes([a, b])
}

/// From a slot to one of its children.
#[inline(always)]
fn step(columns: &[u8], thresholds: &[u8], ranks: &Ranks, slot: usize) -> usize {
    child(ranks, at(columns, slot), at(thresholds, slot), slot)
}

/// From a slot with this column and threshold to one of its children.
#[inline(always)]
fn child(ranks: &Ranks, column: u8, threshold: u8, slot: usize) -> usize {
    if !ARM {
        return (slot << 1) + usize::from(at(ranks, usize::from(column)) > threshold);
    }
    let rank = isize::from(i16::from(at(ranks, usize::from(column))));
    // All ones for right, instead of a comparison, which the compiler would turn into branches.
    let right = (isize::from(i16::from(threshold)) - rank) >> 8;
    (slot << 1).wrapping_sub(right.cast_unsigned())
}
