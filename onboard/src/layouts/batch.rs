//! Blocks of rows that go down every tree together.
//!
//! Equal bytes give equal sums: integers add up in any order, and f32 leaves are added in the trees' order. What is
//! made ready for a tree (see [`masks`](super::masks), and its leaves as words) is for all rows of the block.

use super::block::{Block, LANES, Leaves, ROWS, TREES};
use super::leaves::BIAS;
use super::masks::{LEAVES, Masks};
use super::preorder;
use super::ranks;
use super::{Sections, built_in};
use palpate_shared::format::{Group, Layout, LeafType};

/// Blocks with fewer rows do not repay the preparation for a tree.
const ENOUGH: usize = 128;

/// The most values of a leaf that is made ready.
const VALUES: usize = 16;

/// A tree's leaves as words: with their shift, without their bias.
type Words = [i32; LEAVES * VALUES];

/// Room for [`Model::margins_of_rows`](crate::Model::margins_of_rows): as large as many chips' memory, so on a host rather than on a chip. What is in
/// it between two calls is of no importance.
pub struct Batch {
    /// Column by column, a row's ranks.
    ranks: [u8; 32 * ROWS],
    masks: [Masks; TREES],
    reached: [Leaves; TREES],
    words: [Words; TREES],
    /// Sums for one object.
    sums: [i32; ROWS],
}

impl Default for Batch {
    fn default() -> Self {
        Self::new()
    }
}

impl core::fmt::Debug for Batch {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Batch")
    }
}

/// Accumulator for one group, with its pending trees.
struct Sums<'a> {
    /// Row by row.
    sums: &'a mut [i32],
    /// Values of a leaf, and of a row.
    values: usize,
    leaf: LeafType,
    shift: u8,
    block: &'a Block<'a>,
    /// None if rows are too few for them.
    masks: Option<&'a mut [Masks; TREES]>,
    reached: &'a mut [Leaves; TREES],
    words: &'a mut [Words; TREES],
    /// Trees that wait to be added.
    waiting: usize,
    /// Pending trees that are also still to be looked up: a bit each.
    masked: u8,
}

impl Batch {
    /// Empty room.
    pub const fn new() -> Self {
        Self {
            ranks: [0; 32 * ROWS],
            masks: [const { Masks::new() }; TREES],
            reached: [[0; ROWS]; TREES],
            words: [[0; LEAVES * VALUES]; TREES],
            sums: [0; ROWS],
        }
    }

    /// The most rows of a block of this model.
    pub(crate) fn rows(model: &Sections<'_>) -> usize {
        let most = (32 * ROWS).checked_div(columns_of(model)).unwrap_or(ROWS).min(ROWS);
        most / LANES * LANES
    }

    /// Sets margins, one row for each row of `width` features, to sums as [`Model::sum`](crate::Model) gives them. Of a model
    /// of trees, and at most [`Batch::rows`].
    pub(crate) fn sum(&mut self, model: &Sections<'_>, features: &[i32], width: usize, margins: &mut [i32]) {
        let objects = model.objects();
        let Some(rows) = margins.len().checked_div(objects) else { return };
        let stride = rows.next_multiple_of(LANES);
        let Self { ranks, masks, reached, words, sums: of_one } = self;
        ranks::rank_rows(model, features, width, stride, ranks);
        let columns = columns_of(model);
        let ranks = ranks.get(..columns * stride).unwrap_or_default();
        let block = &Block { ranks, columns, stride, features, width };
        let (base, _) = model.base_and_priors();
        for margins in margins.chunks_exact_mut(objects) {
            for (margin, base) in margins.iter_mut().zip(base.as_chunks().0) {
                *margin = i32::from_le_bytes(*base);
            }
        }
        let mut masks = (rows >= ENOUGH).then_some(masks);
        let (mut nodes, mut leaves) = (model.nodes, model.leaves);
        for &bytes in model.groups.as_chunks().0 {
            let Some(group) = Group::from_bytes(bytes) else { continue };
            // Sums for one object stand together, or every tree would go through all margins.
            let (values, sums) = match group.object {
                None => (objects, &mut *margins),
                Some(object) => {
                    let margins = margins.iter().skip(object.into()).step_by(objects);
                    of_one.iter_mut().zip(margins).for_each(|(sum, margin)| *sum = *margin);
                    (1, of_one.get_mut(..rows).unwrap_or_default())
                }
            };
            let (leaf, shift) = (model.leaf, group.shift);
            let masks = masks.as_deref_mut();
            let mut sums = Sums { sums, values, leaf, shift, block, masks, reached, words, waiting: 0, masked: 0 };
            match model.layout {
                Layout::Compact if built_in::layout(Layout::Compact) => {
                    compact(&group, &mut nodes, &mut leaves, &mut sums);
                }
                Layout::Wide if built_in::layout(Layout::Wide) => {
                    wide(model, &group, &mut nodes, &mut leaves, &mut sums);
                }
                // Refused when the model was opened.
                _ => {}
            }
            sums.add_waiting();
            if let Some(object) = group.object {
                let margins = margins.iter_mut().skip(object.into()).step_by(objects);
                margins.zip(of_one.iter()).for_each(|(margin, sum)| *margin = *sum);
            }
        }
    }
}

/// Number of columns of a model.
fn columns_of(model: &Sections<'_>) -> usize {
    let axes = model.axes_and_cuts().0.iter();
    axes.map(|&[_, columns, ..]| usize::from(columns & 1) + usize::from(columns >> 1 & 1)).sum()
}

fn compact(group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], sums: &mut Sums<'_>) {
    let block = sums.block;
    for _ in 0..group.trees {
        let Some((tree, splits)) = preorder::split_off::<3>(nodes) else { return };
        let Some((tree_leaves, rest)) = leaves.split_at_checked((splits.len() + 1) * sums.leaf_length()) else {
            return;
        };
        *leaves = rest;
        if sums.look_up(|masks, block| masks.take_compact(splits, block)) {
            sums.push(tree_leaves);
            continue;
        }
        sums.add_each(tree_leaves, |row| {
            let (leaf, _) = preorder::tree(&mut { tree }, |[column, threshold, left]: [u8; 3]| {
                (block.rank(column, row) > threshold, usize::from(left))
            })?;
            Some(leaf)
        });
    }
}

fn wide(model: &Sections<'_>, group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], sums: &mut Sums<'_>) {
    let block = sums.block;
    let (cuts, _) = model.axes_and_cuts().1.as_chunks();
    for _ in 0..group.trees {
        let Some((tree, splits)) = preorder::split_off::<6>(nodes) else { return };
        let Some((tree_leaves, rest)) = leaves.split_at_checked((splits.len() + 1) * sums.leaf_length()) else {
            return;
        };
        *leaves = rest;
        sums.add_each(tree_leaves, |row| {
            let features = block.features.get(row * block.width..(row + 1) * block.width).unwrap_or_default();
            let (leaf, _) = preorder::tree(&mut { tree }, |split| preorder::wide_split(split, cuts, features))?;
            Some(leaf)
        });
    }
}

impl Sums<'_> {
    fn leaf_length(&self) -> usize {
        self.values * self.leaf.size()
    }

    /// Takes the next tree into the masks of its place, and looks its leaves up, now or with others; `false` if it has to be
    /// walked.
    fn look_up(&mut self, take: impl FnOnce(&mut Masks, &Block<'_>) -> Option<()>) -> bool {
        let masks = self.masks.as_deref_mut().and_then(|masks| masks.get_mut(self.waiting));
        let is_taken = masks.is_some_and(|masks| take(masks, self.block).is_some());
        self.masked |= u8::from(is_taken) << (self.waiting & 7);
        is_taken
    }

    /// Looks up what waits for it.
    fn look_up_masked(&mut self) {
        let Some(masks) = self.masks.as_deref_mut() else { return };
        if self.masked != (1 << TREES) - 1 || !Masks::look_up_all(masks, self.block, self.reached) {
            for (tree, (masks, reached)) in masks.iter().zip(&mut *self.reached).enumerate() {
                if self.masked >> (tree & 7) & 1 == 1 {
                    masks.look_up(self.block, reached);
                }
            }
        }
        self.masked = 0;
    }

    /// Adds the leaves of the next tree that are reached, sooner or later.
    fn push(&mut self, leaves: &[u8]) {
        let words = self.words.get_mut(self.waiting);
        let count = leaves.len().checked_div(self.leaf.size()).unwrap_or(0);
        // All leaves of a tree, and no more values than each has room for.
        let ready = words
            .and_then(|words| words.get_mut(..count))
            .filter(|_| self.values <= VALUES && count <= LEAVES * self.values);
        if let Some(words) = ready {
            decode(self.leaf, self.shift, leaves, words);
            self.waiting += 1;
            if self.waiting == TREES {
                self.add_waiting();
            }
            return;
        }
        let place = self.waiting;
        self.look_up_masked();
        self.add_waiting();
        let Some(reached) = self.reached.get(place) else { return };
        let (length, leaf, shift) = (self.leaf_length(), self.leaf, self.shift);
        for (sums, reached) in self.sums.chunks_exact_mut(self.values).zip(reached) {
            let start = usize::from(*reached) * length;
            add(leaf, shift, leaves.get(start..start + length), sums);
        }
    }

    /// Adds the leaf that each row reaches, now.
    fn add_each(&mut self, leaves: &[u8], reached: impl Fn(usize) -> Option<usize>) {
        self.add_waiting();
        let (length, leaf, shift) = (self.leaf_length(), self.leaf, self.shift);
        for (row, sums) in self.sums.chunks_exact_mut(self.values).enumerate() {
            let Some(start) = reached(row).map(|reached| reached * length) else { return };
            add(leaf, shift, leaves.get(start..start + length), sums);
        }
    }

    /// Adds the leaves of the trees that wait.
    fn add_waiting(&mut self) {
        self.look_up_masked();
        if self.leaf == LeafType::F32 {
            self.add_as(add_f32)
        } else {
            self.add_as(i32::wrapping_add)
        }
        self.waiting = 0;
    }

    #[inline(always)]
    fn add_as(&mut self, add: impl Fn(i32, i32) -> i32 + Copy) {
        match self.values {
            1 => self.add_of::<1>(add),
            2 => self.add_of::<2>(add),
            3 => self.add_of::<3>(add),
            4 => self.add_of::<4>(add),
            5 => self.add_of::<5>(add),
            6 => self.add_of::<6>(add),
            7 => self.add_of::<7>(add),
            8 => self.add_of::<8>(add),
            9 => self.add_of::<9>(add),
            10 => self.add_of::<10>(add),
            11 => self.add_of::<11>(add),
            12 => self.add_of::<12>(add),
            13 => self.add_of::<13>(add),
            14 => self.add_of::<14>(add),
            15 => self.add_of::<15>(add),
            16 => self.add_of::<16>(add),
            // None wait.
            _ => {}
        }
    }

    fn add_of<const COUNT: usize>(&mut self, add: impl Fn(i32, i32) -> i32 + Copy) {
        let rows = self.sums.as_chunks_mut::<COUNT>().0.iter_mut();
        let [words_a, words_b, words_c, words_d] = self.words.each_ref().map(leaves_of::<COUNT>);
        let [a, b, c, d] = &*self.reached;
        if self.waiting == TREES {
            for ((((sums, a), b), c), d) in rows.zip(a).zip(b).zip(c).zip(d) {
                let mut row = *sums;
                for leaf in [reached(words_a, *a), reached(words_b, *b), reached(words_c, *c), reached(words_d, *d)] {
                    row.iter_mut().zip(leaf).for_each(|(sum, value)| *sum = add(*sum, *value));
                }
                *sums = row;
            }
            return;
        }
        let trees = [(a, words_a), (b, words_b), (c, words_c)];
        for (leaves, words) in trees.into_iter().take(self.waiting) {
            for (sums, leaf) in self.sums.as_chunks_mut::<COUNT>().0.iter_mut().zip(leaves) {
                let leaf = reached(words, *leaf);
                sums.iter_mut().zip(leaf).for_each(|(sum, value)| *sum = add(*sum, *value));
            }
        }
    }
}

/// Words leaf by leaf.
#[inline(always)]
fn leaves_of<const COUNT: usize>(words: &Words) -> &[[i32; COUNT]; LEAVES] {
    words.as_chunks().0.first_chunk().unwrap_or(&[[0; COUNT]; LEAVES])
}

/// The leaf with this number, below 64.
#[inline(always)]
fn reached<const COUNT: usize>(words: &[[i32; COUNT]; LEAVES], leaf: u8) -> &[i32; COUNT] {
    words.get(usize::from(leaf) % LEAVES).unwrap_or(&[0; COUNT])
}

/// Sets words to the values of leaves: integers with their shift and without their bias, f32 as their bits.
fn decode(leaf: LeafType, shift: u8, leaves: &[u8], words: &mut [i32]) {
    match leaf {
        LeafType::I8 => words.iter_mut().zip(leaves).for_each(|(word, value)| *word = of_i8(*value, shift)),
        LeafType::I16 => {
            words.iter_mut().zip(leaves.as_chunks().0).for_each(|(word, value)| *word = of_i16(*value, shift));
        }
        LeafType::F32 => {
            words.iter_mut().zip(leaves.as_chunks().0).for_each(|(word, value)| *word = i32::from_le_bytes(*value));
        }
    }
}

/// Adds one leaf. Where sizes of subtrees contradict each other there may be none; a row by itself counts its bias even so.
#[inline(always)]
fn add(leaf: LeafType, shift: u8, values: Option<&[u8]>, sums: &mut [i32]) {
    let Some(values) = values else {
        if leaf == LeafType::I8 {
            sums.iter_mut().for_each(|sum| *sum = sum.wrapping_add(of_i8(0, shift)));
        }
        return;
    };
    match leaf {
        LeafType::I8 => {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum = sum.wrapping_add(of_i8(*value, shift)));
        }
        LeafType::I16 => {
            let values = values.as_chunks().0;
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum = sum.wrapping_add(of_i16(*value, shift)));
        }
        LeafType::F32 => {
            let values = values.as_chunks().0;
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum = add_f32(*sum, i32::from_le_bytes(*value)));
        }
    }
}

#[inline(always)]
fn of_i8(value: u8, shift: u8) -> i32 {
    (i32::from(value) - BIAS).wrapping_shl(shift.into())
}

#[inline(always)]
fn of_i16(value: [u8; 2], shift: u8) -> i32 {
    i32::from(i16::from_le_bytes(value)).wrapping_shl(shift.into())
}

/// Adds f32 values by their bits.
#[inline(always)]
fn add_f32(sum: i32, value: i32) -> i32 {
    (f32::from_bits(sum.cast_unsigned()) + f32::from_bits(value.cast_unsigned())).to_bits().cast_signed()
}
