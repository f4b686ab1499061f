//! The layouts that walk trees: complete, compact and wide.

use super::axes::{Axes, cuts_bytes, visit};
use super::forest::{Branch, Forest, Split, each_leaf};
use super::lowered::{Lowered, Run};
use super::quantize::Scale;
use crate::ensemble::Output;
use palpate_shared::format::{Axis, Group, Layout, LeafType};

/// Rule for writing leaves.
pub(super) struct Leaves<'a> {
    leaf: LeafType,
    scale: &'a Scale,
    bytes: Vec<u8>,
}

impl<'a> Leaves<'a> {
    pub(super) fn new(leaf: LeafType, scale: &'a Scale) -> Self {
        Self { leaf, scale, bytes: Vec::new() }
    }

    /// Adds a leaf so many times.
    pub(super) fn push(&mut self, values: &[f32], shift: u8, times: usize) {
        let start = self.bytes.len();
        for &value in values {
            let integer = self.scale.integer(value, shift);
            match self.leaf {
                LeafType::I8 => self.bytes.push((integer + 128) as u8),
                LeafType::I16 => self.bytes.extend((integer as i16).to_le_bytes()),
                LeafType::F32 => self.bytes.extend(value.to_le_bytes()),
            }
        }
        let end = self.bytes.len();
        (1..times).for_each(|_| self.bytes.extend_from_within(start..end));
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Sections of trees, except their groups and leaves.
pub(super) struct Sections {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) nodes: Vec<u8>,
}

/// Groups of trees. Integers add up in any order, so trees are sorted by shift, object and depth; f32 leaves keep the
/// order in which each object's margin adds them.
pub(super) fn runs(forest: &Forest<'_>, leaf: LeafType, scale: &Scale) -> Vec<Run> {
    let object = |tree: usize| match forest.trees[tree].output {
        // There are at most 256 objects.
        Output::One(object) => Some(object as u8),
        Output::Each => None,
    };
    let mut order: Vec<usize> = (0..forest.trees.len()).collect();
    let depth = |tree: usize| if leaf == LeafType::F32 { 0 } else { forest.trees[tree].depth.max(1) };
    if leaf != LeafType::F32 {
        order.sort_by_key(|&tree| (std::cmp::Reverse(scale.shifts[tree]), object(tree), depth(tree)));
    } else if order.iter().all(|&tree| object(tree).is_some()) {
        order.sort_by_key(|&tree| object(tree));
    }
    let mut runs: Vec<Run> = Vec::new();
    for tree in order {
        let (object, shift) = (object(tree), scale.shifts[tree]);
        match runs.last_mut() {
            Some(run) if (run.object, run.shift, depth(run.trees[0])) == (object, shift, depth(tree)) => {
                run.trees.push(tree);
            }
            _ => runs.push(Run { object, shift, trees: vec![tree] }),
        }
    }
    runs
}

/// The groups of a layout.
pub(super) fn groups(lowered: &Lowered<'_>, layout: Layout) -> Vec<Group> {
    let group = |run: &Run| {
        let depth = if layout == Layout::Complete { run.depth(&lowered.forest) as u8 } else { 0 };
        Group { depth, shift: run.shift, object: run.object, trees: run.trees.len() as u32 }
    };
    lowered.runs.iter().map(group).collect()
}

/// Every tree filled up to its group's depth.
pub(super) fn complete(lowered: &Lowered<'_>, leaves: &mut Leaves<'_>) -> Sections {
    let mut nodes = Vec::new();
    for run in &lowered.runs {
        let depth = run.depth(&lowered.forest);
        let (mut columns, mut thresholds) = (Vec::new(), Vec::new());
        for &tree in &run.trees {
            let mut slots = vec![(0, 0); 1 << depth];
            // The number of the root; see `palpate_onboard`'s walk.
            slots[0].0 = 1;
            fill(&lowered.forest.trees[tree].root, &mut slots, &lowered.axes, 1, depth, run.shift, leaves);
            columns.extend(slots.iter().map(|slot| slot.0));
            thresholds.extend(slots.iter().map(|slot| slot.1));
        }
        nodes.append(&mut columns);
        nodes.append(&mut thresholds);
    }
    Sections { nodes, ..records(&lowered.axes) }
}

/// Writes a branch into the slots below `slot`, `levels` deep; a leaf further up is repeated, and the splits above its
/// copies are left at 0, which goes right.
fn fill(
    branch: &Branch<'_>,
    slots: &mut [(u8, u8)],
    axes: &Axes,
    slot: usize,
    levels: usize,
    shift: u8,
    leaves: &mut Leaves<'_>,
) {
    match branch {
        Branch::Leaf(values) => leaves.push(values, shift, 1 << levels),
        Branch::Split(split) => {
            let (column, threshold) = axes.place(split);
            slots[slot] = (column as u8, threshold);
            fill(&split.left, slots, axes, 2 * slot, levels - 1, shift, leaves);
            fill(&split.right, slots, axes, 2 * slot + 1, levels - 1, shift, leaves);
        }
    }
}

/// Splits in preorder, three bytes each.
pub(super) fn compact(lowered: &Lowered<'_>, leaves: &mut Leaves<'_>) -> Sections {
    let nodes = preorder(lowered, leaves, |split, nodes| {
        let (column, threshold) = lowered.axes.place(split);
        nodes.extend([column as u8, threshold, split.left_splits as u8]);
    });
    Sections { nodes, ..records(&lowered.axes) }
}

/// Splits in preorder, six bytes each.
pub(super) fn wide(lowered: &Lowered<'_>, leaves: &mut Leaves<'_>) -> Sections {
    let cuts = lowered.axes.cuts();
    let nodes = preorder(lowered, leaves, |split, nodes| {
        let number = cuts.partition_point(|&cut| cut < split.cut) as u16;
        nodes.extend([split.feature, u8::from(split.missing_left)]);
        nodes.extend(number.to_le_bytes());
        nodes.extend((split.left_splits as u16).to_le_bytes());
    });
    Sections { axes: Vec::new(), cuts: cuts.into_iter().flat_map(i32::to_le_bytes).collect(), nodes }
}

/// Writes trees in preorder.
fn preorder(lowered: &Lowered<'_>, leaves: &mut Leaves<'_>, put: impl Fn(&Split<'_>, &mut Vec<u8>)) -> Vec<u8> {
    let mut nodes = Vec::new();
    for run in &lowered.runs {
        for &tree in &run.trees {
            let tree = &lowered.forest.trees[tree];
            nodes.extend((tree.splits as u16).to_le_bytes());
            visit(&tree.root, &mut |split| put(split, &mut nodes));
            each_leaf(&tree.root, &mut |values| leaves.push(values, run.shift, 1));
        }
    }
    nodes
}

/// The axes and their thresholds, without splits.
fn records(axes: &Axes) -> Sections {
    let cuts = axes.axes.iter().flat_map(|(axis, cuts)| cuts_bytes(*axis, cuts)).collect();
    Sections { axes: axes.axes.iter().map(|(axis, _)| *axis).collect(), cuts, nodes: Vec::new() }
}
