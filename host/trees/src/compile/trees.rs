//! Trees in preorder, with splits of three bytes or of six.

use super::axes::{Axes, cuts_bytes, visit};
use super::forest::{Forest, Split, each_leaf};
use super::lowered::{Lowered, Run};
use super::quantize::Scale;
use crate::ensemble::Output;
use palpate_shared::format::{Axis, Group, LeafType};

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

    /// Adds a leaf.
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

/// Sections of trees, except their groups and leaves.
pub(super) struct Sections {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) nodes: Vec<u8>,
}

/// Groups of trees. Integers add up in any order, so trees are sorted by shift and object; f32 leaves keep the order in
/// which each object's margin adds them.
pub(super) fn runs(forest: &Forest<'_>, leaf: LeafType, scale: &Scale) -> Vec<Run> {
    let object = |tree: usize| match forest.trees[tree].output {
        // There are at most 256 objects.
        Output::One(object) => Some(object as u8),
        Output::Each => None,
    };
    let mut order: Vec<usize> = (0..forest.trees.len()).collect();
    if leaf != LeafType::F32 {
        order.sort_by_key(|&tree| (std::cmp::Reverse(scale.shifts[tree]), object(tree)));
    } else if order.iter().all(|&tree| object(tree).is_some()) {
        order.sort_by_key(|&tree| object(tree));
    }
    let mut runs: Vec<Run> = Vec::new();
    for tree in order {
        let (object, shift) = (object(tree), scale.shifts[tree]);
        match runs.last_mut() {
            Some(run) if (run.object, run.shift) == (object, shift) => run.trees.push(tree),
            _ => runs.push(Run { object, shift, trees: vec![tree] }),
        }
    }
    runs
}

/// The groups of the trees.
pub(super) fn groups(lowered: &Lowered<'_>) -> Vec<Group> {
    let group = |run: &Run| Group { shift: run.shift, object: run.object, trees: run.trees.len() as u32 };
    lowered.runs.iter().map(group).collect()
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
            each_leaf(&tree.root, &mut |values| leaves.push(values, run.shift));
        }
    }
    nodes
}

/// The axes and their thresholds, without splits.
fn records(axes: &Axes) -> Sections {
    let cuts = axes.axes.iter().flat_map(|(axis, cuts)| cuts_bytes(*axis, cuts)).collect();
    Sections { axes: axes.axes.iter().map(|(axis, _)| *axis).collect(), cuts, nodes: Vec::new() }
}
