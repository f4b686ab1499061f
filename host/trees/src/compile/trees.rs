//! The layouts that walk trees: complete, compact and wide.

use super::axes::{Axes, cuts_bytes, visit};
use super::forest::{Branch, Forest, Split, each_leaf};
use super::quantize::Scale;
use crate::ensemble::Output;
use palpate_shared::format::{Axis, Group, LeafType, MAX_COMPLETE_DEPTH};
use std::collections::BTreeSet;

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

    pub(super) fn push(&mut self, values: &[f32], shift: u8) {
        for &value in values {
            let integer = self.scale.integer(value, shift);
            match self.leaf {
                LeafType::I8 => self.bytes.push((integer + 128) as u8),
                LeafType::I16 => self.bytes.extend((integer as i16).to_le_bytes()),
                LeafType::F32 => self.bytes.extend(value.to_le_bytes()),
            }
        }
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Sections of trees, except their leaves.
pub(super) struct Sections {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) groups: Vec<Group>,
    pub(super) nodes: Vec<u8>,
}

/// Trees that share a group, in order.
pub(super) struct Run {
    object: Option<u8>,
    shift: u8,
    trees: Vec<usize>,
}

/// Groups of trees. Integers add up in any order, so trees are sorted by shift, object and depth; f32 leaves keep the
/// order in which each object's margin adds them. `parts` are the numbers of the parts of the walk that trees are in: none
/// if it has one.
pub(super) fn runs(forest: &Forest<'_>, leaf: LeafType, scale: &Scale, parts: &[usize]) -> Vec<Run> {
    let part = |tree: usize| parts.get(tree).copied().unwrap_or(0);
    let object = |tree: usize| match forest.trees[tree].output {
        // There are at most 256 objects.
        Output::One(object) => Some(object as u8),
        Output::Each => None,
    };
    let mut order: Vec<usize> = (0..forest.trees.len()).collect();
    let depth = |tree: usize| if leaf == LeafType::F32 { 0 } else { forest.trees[tree].depth.max(1) };
    if leaf != LeafType::F32 {
        order.sort_by_key(|&tree| (part(tree), std::cmp::Reverse(scale.shifts[tree]), object(tree), depth(tree)));
    } else if order.iter().all(|&tree| object(tree).is_some()) {
        order.sort_by_key(|&tree| object(tree));
    }
    let mut runs: Vec<Run> = Vec::new();
    for tree in order {
        let (object, shift) = (object(tree), scale.shifts[tree]);
        match runs.last_mut() {
            Some(run)
                if (run.object, run.shift) == (object, shift)
                    && (depth(run.trees[0]), part(run.trees[0])) == (depth(tree), part(tree)) =>
            {
                run.trees.push(tree);
            }
            _ => runs.push(Run { object, shift, trees: vec![tree] }),
        }
    }
    runs
}

/// The numbers of all trees, in the order in which they are written.
pub(super) fn order(forest: &Forest<'_>, leaf: LeafType, scale: &Scale, parts: &[usize]) -> Vec<usize> {
    runs(forest, leaf, scale, parts).into_iter().flat_map(|run| run.trees).collect()
}

/// Every tree filled up to its group's depth; `None` if some are too deep or have too many thresholds.
pub(super) fn complete(forest: &Forest<'_>, axes: &Axes, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Sections> {
    if axes.columns > 256 || forest.trees.iter().any(|tree| tree.depth > usize::from(MAX_COMPLETE_DEPTH)) {
        return None;
    }
    let (mut groups, mut nodes) = (Vec::new(), Vec::new());
    for run in runs {
        let depth = run.trees.iter().map(|&tree| forest.trees[tree].depth).max()?.max(1);
        let (mut columns, mut thresholds) = (Vec::new(), Vec::new());
        for &tree in &run.trees {
            let mut slots = vec![(0, 0); 1 << depth];
            // The number of the root; see `palpate_onboard`'s walk.
            slots[0].0 = 1;
            fill(&forest.trees[tree].root, &mut slots, axes, 1, depth, run.shift, leaves);
            columns.extend(slots.iter().map(|slot| slot.0));
            thresholds.extend(slots.iter().map(|slot| slot.1));
        }
        nodes.append(&mut columns);
        nodes.append(&mut thresholds);
        groups.push(group(run, u8::try_from(depth).ok()?));
    }
    let (axes, cuts) = records(axes);
    Some(Sections { axes, cuts, groups, nodes })
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
        Branch::Leaf(values) => (0..1_usize << levels).for_each(|_| leaves.push(values, shift)),
        Branch::Split(split) => {
            let (column, threshold) = axes.place(split);
            slots[slot] = (column as u8, threshold);
            fill(&split.left, slots, axes, 2 * slot, levels - 1, shift, leaves);
            fill(&split.right, slots, axes, 2 * slot + 1, levels - 1, shift, leaves);
        }
    }
}

/// True if splits fit three bytes: columns and left subtrees are numbered in a byte.
pub(super) fn fits_narrow(forest: &Forest<'_>, axes: &Axes) -> bool {
    let mut narrow = axes.columns <= 256;
    for tree in &forest.trees {
        visit(&tree.root, &mut |split| narrow &= split.left_splits <= 255);
    }
    narrow
}

/// Splits in preorder, three bytes each; `None` if they do not fit.
pub(super) fn compact(forest: &Forest<'_>, axes: &Axes, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Sections> {
    if !fits_narrow(forest, axes) {
        return None;
    }
    let (groups, nodes) = preorder(forest, runs, leaves, |split, nodes| {
        let (column, threshold) = axes.place(split);
        nodes.extend([column as u8, threshold, split.left_splits as u8]);
    })?;
    let (axes, cuts) = records(axes);
    Some(Sections { axes, cuts, groups, nodes })
}

/// Splits in preorder, six bytes each; `None` if there are too many thresholds.
pub(super) fn wide(forest: &Forest<'_>, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Sections> {
    let mut cuts = BTreeSet::new();
    for tree in &forest.trees {
        visit(&tree.root, &mut |split| {
            cuts.insert(split.cut);
        });
    }
    let cuts: Vec<i32> = cuts.into_iter().collect();
    if cuts.len() > 1 << 16 {
        return None;
    }
    let (groups, nodes) = preorder(forest, runs, leaves, |split, nodes| {
        let number = cuts.partition_point(|&cut| cut < split.cut) as u16;
        nodes.extend([split.feature, u8::from(split.missing_left)]);
        nodes.extend(number.to_le_bytes());
        nodes.extend((split.left_splits as u16).to_le_bytes());
    })?;
    let cuts = cuts.into_iter().flat_map(i32::to_le_bytes).collect();
    Some(Sections { axes: Vec::new(), cuts, groups, nodes })
}

/// Writes trees in preorder.
fn preorder<'f>(
    forest: &'f Forest<'f>,
    runs: &[Run],
    leaves: &mut Leaves<'_>,
    put: impl Fn(&Split<'f>, &mut Vec<u8>),
) -> Option<(Vec<Group>, Vec<u8>)> {
    let (mut groups, mut nodes) = (Vec::new(), Vec::new());
    for run in runs {
        for &tree in &run.trees {
            let tree = &forest.trees[tree];
            nodes.extend(u16::try_from(tree.splits).ok()?.to_le_bytes());
            visit(&tree.root, &mut |split| put(split, &mut nodes));
            each_leaf(&tree.root, &mut |values| leaves.push(values, run.shift));
        }
        groups.push(group(run, 0));
    }
    Some((groups, nodes))
}

/// For each part of the walk but the last, the groups up to its end.
pub(super) fn groups_before(runs: &[Run], parts: &[usize]) -> Vec<u16> {
    let part = |run: &Run| run.trees.first().and_then(|&tree| parts.get(tree)).copied().unwrap_or(0);
    let last = runs.last().map_or(0, part);
    (0..last).map(|number| runs.partition_point(|run| part(run) <= number) as u16).collect()
}

fn records(axes: &Axes) -> (Vec<Axis>, Vec<u8>) {
    let cuts = axes.axes.iter().flat_map(|(axis, cuts)| cuts_bytes(*axis, cuts)).collect();
    (axes.axes.iter().map(|(axis, _)| *axis).collect(), cuts)
}

fn group(run: &Run, depth: u8) -> Group {
    Group { depth, shift: run.shift, object: run.object, trees: run.trees.len() as u32 }
}
