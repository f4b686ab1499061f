//! An ensemble that was checked, with thresholds as the integers that the chip compares.

use crate::ensemble::{Ensemble, MAX_OBJECTS, Node, Output, Tree, check_leaf};
use crate::error::{CompileProblem, Error, Result, TreeProblem};
use palpate_shared::Descriptor;
use palpate_shared::format::{Key, f32_key};
use std::collections::BTreeSet;

/// Margins beyond ± this many nats are refused: e^16384 is sure enough.
pub(super) const MARGIN_RANGE: f64 = 16384.0;

/// Trees deeper than this are refused.
const MAX_DEPTH: usize = 64;

/// A checked ensemble.
pub(super) struct Forest<'a> {
    pub(super) base: &'a [f32],
    pub(super) trees: Vec<Branches<'a>>,
    pub(super) features: usize,
    pub(super) key: Key,
    pub(super) descriptor: Option<Descriptor>,
}

/// A tree of a checked ensemble.
pub(super) struct Branches<'a> {
    pub(super) root: Branch<'a>,
    pub(super) output: Output,
    pub(super) depth: usize,
    pub(super) splits: usize,
    /// The largest absolute value of a leaf.
    pub(super) largest: f32,
}

/// A split or a leaf.
pub(super) enum Branch<'a> {
    Leaf(&'a [f32]),
    Split(Box<Split<'a>>),
}

/// A split: left if the feature's key is below `cut`.
pub(super) struct Split<'a> {
    pub(super) feature: u8,
    pub(super) cut: i32,
    pub(super) missing_left: bool,
    pub(super) left: Branch<'a>,
    pub(super) right: Branch<'a>,
    /// Splits in the left subtree.
    pub(super) left_splits: usize,
}

impl<'a> Forest<'a> {
    pub(super) fn new(ensemble: &'a Ensemble, raw_features: Option<usize>) -> Result<Self> {
        let objects = ensemble.objects.len();
        let base_margins = ensemble.base_margins.len();
        if !(1..=MAX_OBJECTS).contains(&objects) || base_margins != objects {
            return Err(CompileProblem::Objects { objects, base_margins }.into());
        }
        let features = raw_features.unwrap_or(ensemble.descriptor.feature_count());
        if !(1..=256).contains(&features) {
            return Err(Error::setting("raw_features", features, "1 to 256"));
        }
        let key = if raw_features.is_some() { Key::Real } else { Key::Whole };
        let mut trees = Vec::with_capacity(ensemble.trees.len());
        for (index, tree) in ensemble.trees.iter().enumerate() {
            let place = |problem| CompileProblem::Tree { tree: index, problem };
            let values = match tree.output {
                Output::One(object) if object < objects => 1,
                Output::One(object) => {
                    return Err(place(TreeProblem::Object { object: object as u64, objects }).into());
                }
                Output::Each => objects,
            };
            let mut reader = Reader { tree, values, features, key, left: tree.nodes.len(), largest: 0.0 };
            let (root, splits, depth) = reader.branch(0, 0).map_err(place)?;
            trees.push(Branches { root, output: tree.output, depth, splits, largest: reader.largest });
        }
        let forest = Self {
            base: &ensemble.base_margins,
            trees,
            features,
            key,
            descriptor: raw_features.is_none().then_some(ensemble.descriptor),
        };
        forest.check_range()?;
        if let Some(descriptor) = forest.descriptor {
            check_thresholds(ensemble, descriptor)?;
        }
        Ok(forest)
    }

    pub(super) fn objects(&self) -> usize {
        self.base.len()
    }

    pub(super) fn splits(&self) -> usize {
        self.trees.iter().map(|tree| tree.splits).sum()
    }

    pub(super) fn leaves(&self) -> usize {
        self.trees.iter().map(|tree| tree.splits + 1).sum()
    }

    /// Every value of every leaf.
    pub(super) fn leaf_values(&self) -> impl Iterator<Item = f32> + Clone {
        let mut open: Vec<&Branch<'a>> = self.trees.iter().map(|tree| &tree.root).collect();
        let leaves = std::iter::from_fn(move || {
            loop {
                match open.pop()? {
                    Branch::Leaf(values) => return Some(*values),
                    Branch::Split(split) => open.extend([&split.left, &split.right]),
                }
            }
        });
        leaves.flatten().copied()
    }

    /// How far an object's margin can be from 0.
    pub(super) fn range(&self, object: usize) -> f64 {
        let base = f64::from(self.base[object].abs());
        self.trees_of(object).map(|tree| f64::from(tree.largest)).sum::<f64>() + base
    }

    /// The trees that add to an object's margin.
    pub(super) fn trees_of(&self, object: usize) -> impl Iterator<Item = &Branches<'a>> {
        self.trees.iter().filter(move |tree| tree.values_for(object))
    }

    fn check_range(&self) -> Result<()> {
        for object in 0..self.objects() {
            let range = self.range(object);
            if range.is_nan() || range > MARGIN_RANGE {
                let largest = self.trees.iter().map(|tree| tree.largest).fold(self.base[object].abs(), f32::max);
                return Err(CompileProblem::MarginRange { object, range, largest, most: MARGIN_RANGE }.into());
            }
        }
        Ok(())
    }
}

impl Branches<'_> {
    /// Whether the tree adds to an object's margin.
    pub(super) fn values_for(&self, object: usize) -> bool {
        match self.output {
            Output::One(own) => own == object,
            Output::Each => true,
        }
    }

    /// Which of a leaf's values is an object's.
    pub(super) fn value_of(&self, object: usize, leaf: &[f32]) -> f32 {
        match self.output {
            Output::One(_) => leaf[0],
            Output::Each => leaf[object],
        }
    }
}

struct Reader<'a> {
    tree: &'a Tree,
    values: usize,
    features: usize,
    key: Key,
    /// Nodes that may still be visited: one more is a node with two parents, or a loop.
    left: usize,
    largest: f32,
}

impl<'a> Reader<'a> {
    /// A branch, its splits and its depth.
    fn branch(&mut self, index: usize, depth: usize) -> Result<(Branch<'a>, usize, usize), TreeProblem> {
        if depth > MAX_DEPTH {
            return Err(TreeProblem::TooDeep { most: MAX_DEPTH });
        }
        let nodes = self.tree.nodes.len();
        let node = self.tree.nodes.get(index).ok_or(TreeProblem::NoNodes)?;
        self.left = self.left.checked_sub(1).ok_or(TreeProblem::ReachedTwice { node: index })?;
        match node {
            Node::Leaf(values) => {
                check_leaf(index, values, self.values)?;
                self.largest = values.iter().fold(self.largest, |largest, value| largest.max(value.abs()));
                Ok((Branch::Leaf(values), 0, 0))
            }
            &Node::Split { feature, threshold, missing_left, left, right } => {
                let features = self.features;
                let number = u8::try_from(feature).ok().filter(|_| feature < features);
                let number = number.ok_or(TreeProblem::Feature { node: index, feature: feature as u64, features })?;
                if threshold.is_nan() {
                    return Err(TreeProblem::Threshold { node: index, threshold });
                }
                for (side, child) in [("left", left), ("right", right)] {
                    if child >= nodes {
                        let child = i64::try_from(child).unwrap_or(i64::MAX);
                        return Err(TreeProblem::Child { node: index, side, child, nodes });
                    }
                }
                let (left, left_splits, left_depth) = self.branch(left, depth + 1)?;
                let (right, right_splits, right_depth) = self.branch(right, depth + 1)?;
                let split =
                    Split { feature: number, cut: cut(threshold, self.key), missing_left, left, right, left_splits };
                let depth = 1 + left_depth.max(right_depth);
                Ok((Branch::Split(Box::new(split)), 1 + left_splits + right_splits, depth))
            }
        }
    }
}

/// The integer threshold that splits keys as `threshold` splits their features.
fn cut(threshold: f32, key: Key) -> i32 {
    match key {
        // `as` keeps a value beyond an i32 at its limits, which features never reach.
        Key::Whole => (threshold.ceil() as i32).max(i32::MIN + 1),
        Key::Real => f32_key(threshold),
    }
}

/// Calls `see` on the values of every leaf, from left to right.
pub(super) fn each_leaf<'f>(branch: &'f Branch<'f>, see: &mut impl FnMut(&'f [f32])) {
    match branch {
        Branch::Leaf(values) => see(values),
        Branch::Split(split) => {
            each_leaf(&split.left, see);
            each_leaf(&split.right, see);
        }
    }
}

/// Refuses an ensemble that was trained on fractions, such as times in seconds: its thresholds fall together when they
/// become whole numbers. Trainers put thresholds at values of the data, which are whole, or halfway between two, so only
/// thresholds elsewhere count; a few that fall together harm nothing.
fn check_thresholds(ensemble: &Ensemble, descriptor: Descriptor) -> Result<()> {
    for (feature, &name) in descriptor.feature_names().iter().enumerate() {
        let splits = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match *node {
            Node::Split { feature: own, threshold, .. } if own == feature => Some(threshold),
            _ => None,
        });
        let mut thresholds: Vec<f32> = splits.collect();
        thresholds.sort_unstable_by(f32::total_cmp);
        thresholds.dedup();
        let rounded = thresholds.iter().map(|&threshold| cut(threshold, Key::Whole)).collect::<BTreeSet<_>>().len();
        let fell_together = |pair: &&[f32]| {
            cut(pair[0], Key::Whole) == cut(pair[1], Key::Whole) && pair.iter().any(|&threshold| is_fraction(threshold))
        };
        let lost = thresholds.windows(2).filter(fell_together).count();
        if 20 * lost > thresholds.len() {
            return Err(CompileProblem::Thresholds { feature: name, thresholds: thresholds.len(), rounded }.into());
        }
    }
    Ok(())
}

/// Whether a threshold is neither a whole number nor halfway between two, but for rounding in f32.
fn is_fraction(threshold: f32) -> bool {
    let twice = 2.0 * f64::from(threshold);
    (twice - twice.round()).abs() > 1e-6 * twice.abs().max(1.0)
}
