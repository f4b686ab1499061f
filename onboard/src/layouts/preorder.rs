//! Trees with their splits in preorder: missing nodes take no byte.
//!
//! A tree is the number of its splits, then the splits, each with the number of splits in its left subtree; its leaves
//! are in order, so going right skips as many leaves as splits, plus one.

use super::built_in;
use super::leaves::{BLOCK, Sum};
use super::ranks::{Ranks, at_or_missing};
use crate::bytes::{at, take};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::Group;

/// Numbers of leaves that are kept.
pub(crate) type Reached = [u16; BLOCK];

/// Checks that a group's splits, of `node` bytes each, and leaves are there, and moves `nodes` and `leaves` past them.
pub(crate) fn check(group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], leaf: usize, node: usize) -> Option<()> {
    for _ in 0..group.trees {
        let (&splits, rest) = nodes.split_first_chunk()?;
        *nodes = rest;
        let splits = usize::from(u16::from_le_bytes(splits));
        take(nodes, splits * node)?;
        take(leaves, (splits + 1) * leaf)?;
    }
    Some(())
}

/// Leaves that are numbers of a table, kept until there are enough of them to add together.
struct Numbers<'a> {
    numbers: &'a mut Reached,
    count: usize,
}

impl Numbers<'_> {
    /// Keeps a number.
    fn put(&mut self, number: u16, sum: &mut Sum<'_>) {
        if self.count == self.numbers.len() {
            self.add(sum);
        }
        if let Some(place) = self.numbers.get_mut(self.count) {
            *place = number;
            self.count += 1;
        }
    }

    /// Adds the leaves that were kept.
    fn add(&mut self, sum: &mut Sum<'_>) {
        if let Some((shared, numbers)) = sum.shared().zip(self.numbers.get(..self.count)) {
            sum.add_reached(shared.values(), numbers, sum.leaf_length());
        }
        self.count = 0;
    }
}

/// Adds up a group of compact trees, and moves `nodes` and `leaves` past it. A split has three bytes: column,
/// threshold, splits in the left subtree.
///
/// Cost: some instructions for each step and each tree; then the leaves, those that are shared all together.
#[inline(never)]
pub(crate) fn add_compact(
    group: &Group,
    ranks: &Ranks,
    reached: &mut Reached,
    nodes: &mut &[u8],
    leaves: &mut &[u8],
    sum: &mut Sum<'_>,
) {
    let mut numbers = Numbers { numbers: reached, count: 0 };
    for _ in 0..group.trees {
        let Some((leaf, splits)) = tree(nodes, |[column, threshold, left]: [u8; 3]| {
            let right = at(ranks, usize::from(column)) > threshold;
            (right, usize::from(left))
        }) else {
            return;
        };
        add_leaf(leaf, splits, leaves, sum, &mut numbers);
    }
    if built_in::SHARED_LEAVES {
        numbers.add(sum);
    }
}

/// Adds up a group of wide trees, and moves `nodes` and `leaves` past it. A split has six bytes: feature, where a
/// missing value goes (1 = left), the threshold's number, splits in the left subtree.
///
/// Cost: twice that of a compact tree's steps; then the leaves, those that are shared all together.
#[inline(never)]
pub(crate) fn add_wide(
    cuts: &[u8],
    group: &Group,
    features: &[i32],
    reached: &mut Reached,
    nodes: &mut &[u8],
    leaves: &mut &[u8],
    sum: &mut Sum<'_>,
) {
    let (cuts, _) = cuts.as_chunks();
    let mut numbers = Numbers { numbers: reached, count: 0 };
    for _ in 0..group.trees {
        let Some((leaf, splits)) = tree(nodes, |split| wide_split(split, cuts, features)) else { return };
        add_leaf(leaf, splits, leaves, sum, &mut numbers);
    }
    if built_in::SHARED_LEAVES {
        numbers.add(sum);
    }
}

/// Returns true if a wide split goes right, and the number of splits in its left subtree.
#[inline(always)]
pub(super) fn wide_split(
    [feature, missing_left, a, b, c, d]: [u8; 6],
    cuts: &[[u8; 4]],
    features: &[i32],
) -> (bool, usize) {
    let value = at_or_missing(features, feature);
    let cut = cuts.get(usize::from(u16::from_le_bytes([a, b]))).map_or(0, |cut| i32::from_le_bytes(*cut));
    let right = if value == MISSING_FEATURE { missing_left == 0 } else { value >= cut };
    (right, usize::from(u16::from_le_bytes([c, d])))
}

/// Splits the next tree off: all of its bytes, and its splits.
#[cfg(feature = "rows")]
pub(super) fn split_off<'m, const SIZE: usize>(nodes: &mut &'m [u8]) -> Option<(&'m [u8], &'m [[u8; SIZE]])> {
    let (&count, rest) = nodes.split_first_chunk()?;
    let length = usize::from(u16::from_le_bytes(count)) * SIZE;
    let (splits, rest) = rest.split_at_checked(length)?;
    let tree = nodes.get(..2 + length)?;
    *nodes = rest;
    Some((tree, splits.as_chunks().0))
}

/// Walks the next tree; `split` says whether a split goes right, and how many splits are in its left subtree. Gives the
/// leaf and the number of splits.
pub(super) fn tree<const SIZE: usize>(
    nodes: &mut &[u8],
    split: impl Fn([u8; SIZE]) -> (bool, usize),
) -> Option<(usize, usize)> {
    let (&count, rest) = nodes.split_first_chunk()?;
    let count = usize::from(u16::from_le_bytes(count));
    let (mut splits, rest) = rest.split_at_checked(count * SIZE)?;
    *nodes = rest;
    let (mut leaf, mut below) = (0, count);
    // Splits get fewer with every step, so this ends even where the subtrees' sizes contradict each other.
    while below > 0 {
        let Some((&bytes, after)) = splits.split_first_chunk() else { break };
        let (right, left) = split(bytes);
        if right {
            splits = after.get(left * SIZE..).unwrap_or_default();
            leaf += left + 1;
            below = below.saturating_sub(left + 1);
        } else {
            splits = after;
            below = left;
        }
    }
    Some((leaf, count))
}

fn add_leaf(leaf: usize, splits: usize, leaves: &mut &[u8], sum: &mut Sum<'_>, numbers: &mut Numbers<'_>) {
    let length = sum.stored_length();
    let Some((tree, rest)) = leaves.split_at_checked((splits + 1) * length) else { return };
    *leaves = rest;
    if let Some(shared) = sum.shared() {
        numbers.put(shared.number(tree, leaf), sum);
    } else if let Some(leaf) = tree.get(leaf * length..leaf * length + length) {
        sum.add(leaf);
    }
}
