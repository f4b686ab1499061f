//! Lowers a forest: from there a layout is costed without a byte being written, or written.

use super::axes::{Axes, visit};
use super::cost::{Instructions, Shape};
use super::forest::{Branch, Forest, each_leaf};
use super::lowered::Lowered;
use super::merge::{Merged, Source, merge};
use super::parts::Parts;
use super::quantize::Scale;
use super::share::{Sharing, share};
use super::trees::{self, Leaves, Sections};
use palpate_shared::format::{Axis, Group, HEADER_LENGTH, Layout, LeafType, MAX_COMPLETE_DEPTH};

impl<'f> Lowered<'f> {
    /// Lowers a forest for leaves of one type; `None` where they do not fit it.
    pub(super) fn new(forest: &Forest<'f>, leaf: LeafType) -> Option<Self> {
        let rounding = Scale::for_trees(forest, leaf)?;
        let Merged { forest, scale, base, sources } = merge(forest, leaf, &rounding);
        let axes = Axes::new(&forest);
        let runs = trees::runs(&forest, leaf, &scale);
        Some(Self { leaf, forest, scale, base, sources, axes, runs, rounding })
    }

    /// Trees of the ensemble that each tree stands for, in the order in which they are written.
    pub(super) fn order(&self) -> Vec<Source> {
        let trees = self.runs.iter().flat_map(|run| &run.trees);
        trees.map(|&tree| self.sources[tree].clone()).collect()
    }

    /// True if splits fit three bytes: columns and left subtrees are numbered in a byte.
    pub(super) fn is_narrow(&self) -> bool {
        let mut narrow = self.axes.columns <= 256;
        for tree in &self.forest.trees {
            visit(&tree.root, &mut |split| narrow &= split.left_splits <= 255);
        }
        narrow
    }

    /// True if the trees fit a layout.
    pub(super) fn fits(&self, layout: Layout) -> bool {
        let trees = &self.forest.trees;
        let are_short = || trees.iter().all(|tree| u16::try_from(tree.splits).is_ok());
        let fits = match layout {
            Layout::Complete => {
                self.axes.columns <= 256 && trees.iter().all(|tree| tree.depth <= usize::from(MAX_COMPLETE_DEPTH))
            }
            Layout::Compact => are_short() && self.is_narrow(),
            Layout::Wide => are_short() && self.axes.cuts().len() <= 1 << 16,
            Layout::Code | Layout::Grid | Layout::Patterns => false,
        };
        fits && u16::try_from(self.runs.len()).is_ok()
    }

    /// Lengths of a table of equal leaves, the same in every layout; `None` if there can be none.
    pub(super) fn sharing(&self) -> Option<Sharing> {
        let mut leaves = Leaves::new(self.leaf, &self.scale);
        for (tree, &shift) in self.forest.trees.iter().zip(&self.scale.shifts) {
            each_leaf(&tree.root, &mut |values| leaves.push(values, shift, 1));
        }
        let groups = trees::groups(self, Layout::Compact);
        Sharing::new(&groups, self.leaf, self.forest.objects(), &leaves.into_bytes())
    }

    /// Bytes of the model in a layout that fits, except those that all layouts share.
    pub(super) fn bytes(&self, layout: Layout, sharing: Option<Sharing>) -> usize {
        let objects = self.forest.objects();
        let (axes, cuts, split) = match layout {
            Layout::Wide => (0, 4 * self.axes.cuts().len(), 6),
            _ => (self.axes.axes.len(), self.axes.axes.iter().map(|(axis, _)| axis.cuts_length()).sum(), 3),
        };
        let mut trees = 0;
        for run in &self.runs {
            let values = if run.object.is_some() { 1 } else { objects };
            let leaf = sharing.map_or(values * self.leaf.size(), |sharing| sharing.number);
            let depth = run.depth(&self.forest);
            let tree = |&tree: &usize| match (layout, self.forest.trees[tree].splits) {
                (Layout::Complete, _) => (2 + leaf) << depth,
                (_, splits) => 2 + split * splits + leaf * (splits + 1),
            };
            trees += run.trees.iter().map(tree).sum::<usize>();
        }
        let records = Axis::LENGTH * axes + Group::LENGTH * self.runs.len() + 8 * objects;
        HEADER_LENGTH + records + cuts + trees + sharing.map_or(0, |sharing| sharing.section)
    }

    /// About how many instructions a row takes in a layout.
    pub(super) fn instructions(&self, layout: Layout, is_shared: bool) -> Instructions {
        let steps = || {
            let trees = self.runs.iter().flat_map(|run| &run.trees);
            trees.map(|&tree| steps(&self.forest.trees[tree].root)).collect()
        };
        Instructions::new(&Shape {
            layout,
            leaf: self.leaf,
            objects: self.forest.objects(),
            axes: self.axes.axes.len(),
            groups: &trees::groups(self, layout),
            steps: &if layout == Layout::Complete { Vec::new() } else { steps() },
            is_shared,
        })
    }

    /// The trees in a layout that fits.
    pub(super) fn write(self, layout: Layout, is_shared: bool, margin_error: f32) -> Parts {
        let mut leaves = Leaves::new(self.leaf, &self.scale);
        let Sections { axes, cuts, nodes } = match layout {
            Layout::Complete => trees::complete(&self, &mut leaves),
            Layout::Wide => trees::wide(&self, &mut leaves),
            Layout::Compact | Layout::Code | Layout::Grid | Layout::Patterns => trees::compact(&self, &mut leaves),
        };
        let parts = Parts {
            axes,
            cuts,
            groups: trees::groups(&self, layout),
            nodes,
            leaves: leaves.into_bytes(),
            shared: None,
            base: self.base,
            unit: self.scale.unit,
            margin_error,
        };
        if is_shared { share(parts, self.leaf) } else { parts }
    }
}

/// Steps to a leaf, if either side of a split is as likely.
fn steps(branch: &Branch<'_>) -> f64 {
    match branch {
        Branch::Leaf(_) => 0.0,
        Branch::Split(split) => 1.0 + (steps(&split.left) + steps(&split.right)) / 2.0,
    }
}
