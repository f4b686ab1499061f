//! Lowers a forest, and writes it in preorder.

use super::axes::{Axes, visit};
use super::container::too_large;
use super::forest::Forest;
use super::lowered::Lowered;
use super::merge::{Merged, Source, merge};
use super::parts::Parts;
use super::quantize::Scale;
use super::share::share;
use super::trees::{self, Leaves, Sections};
use crate::error::{Result, problem};
use palpate_shared::format::{Layout, LeafType};

/// The most different thresholds: two bytes number them.
const MAX_THRESHOLDS: usize = 1 << 16;

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

    /// The layout that numbers the trees' columns, thresholds and splits.
    ///
    /// # Errors
    /// Names what there is too much of.
    pub(super) fn layout(&self) -> Result<Layout> {
        let trees = &self.forest.trees;
        let splits = trees.iter().map(|tree| tree.splits).max().unwrap_or_default();
        if u16::try_from(splits).is_err() {
            return Err(problem!("the ensemble has a tree with {splits} splits, and a model's can have 65,535")
                .fix("Train with fewer leaves in a tree."));
        }
        if u16::try_from(self.runs.len()).is_err() {
            return Err(too_large());
        }
        // Columns and left subtrees are numbered in a byte.
        let mut is_narrow = self.axes.columns <= 256;
        trees.iter().for_each(|tree| visit(&tree.root, &mut |split| is_narrow &= split.left_splits <= 255));
        if is_narrow {
            return Ok(Layout::Compact);
        }
        let thresholds = self.axes.cuts().len();
        if thresholds <= MAX_THRESHOLDS {
            Ok(Layout::Wide)
        } else {
            Err(problem!("the ensemble has {thresholds} different thresholds, and a model can have 65,536").fix(
                "Round the features to the sensor's resolution before training, or compare whole numbers (`export --scale`, \
                 in Python `scales`), which makes thresholds equal; or train fewer trees. Splits may be as many.",
            ))
        }
    }

    /// The trees in a layout, equal leaves once where that is smaller.
    pub(super) fn write(&self, layout: Layout) -> Parts {
        let mut leaves = Leaves::new(self.leaf, &self.scale);
        let Sections { axes, cuts, nodes } = match layout {
            Layout::Wide => trees::wide(self, &mut leaves),
            Layout::Compact | Layout::Code => trees::compact(self, &mut leaves),
        };
        let parts = Parts {
            axes,
            cuts,
            groups: trees::groups(self),
            nodes,
            leaves: leaves.into_bytes(),
            base: self.base.clone(),
            unit: self.scale.unit,
            ..Parts::default()
        };
        share(parts, self.leaf)
    }
}
