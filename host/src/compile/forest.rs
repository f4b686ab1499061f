//! An ensemble that was checked, with thresholds as the integers that the chip compares.

use crate::ensemble::{Ensemble, Node, Output, Tree};
use crate::error::{Error, Result};
use palpate_shared::format::{Key, f32_key};

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
    pub(super) descriptor: Option<palpate_shared::Descriptor>,
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
        if !(1..=256).contains(&objects) || ensemble.base_margins.len() != objects {
            return Err(wrong(format!("{objects} objects and {} base margins", ensemble.base_margins.len())));
        }
        let features = raw_features.unwrap_or(ensemble.descriptor.feature_count());
        if !(1..=256).contains(&features) {
            return Err(Error::argument(format!("{features} features"), "A model has 1 to 256 features."));
        }
        let key = if raw_features.is_some() { Key::Real } else { Key::Whole };
        let mut trees = Vec::with_capacity(ensemble.trees.len());
        for (index, tree) in ensemble.trees.iter().enumerate() {
            let place = |what: String| wrong(format!("tree {index}: {what}"));
            let values = match tree.output {
                Output::One(object) if object < objects => 1,
                Output::One(object) => return Err(place(format!("object {object} of {objects}"))),
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
                return Err(wrong(format!(
                    "the margin of object {object} can reach {range:e} nats (the largest single value is {largest:e}), beyond the {MARGIN_RANGE} that a model can hold"
                )));
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
    fn branch(&mut self, index: usize, depth: usize) -> Result<(Branch<'a>, usize, usize), String> {
        if depth > MAX_DEPTH {
            return Err(format!("it is deeper than {MAX_DEPTH} splits"));
        }
        let node = self.tree.nodes.get(index).ok_or_else(|| format!("there is no node {index}"))?;
        self.left = self.left.checked_sub(1).ok_or_else(|| format!("node {index} is reached twice"))?;
        match node {
            Node::Leaf(values) => {
                if values.len() != self.values {
                    return Err(format!("leaf {index} has {} values instead of {}", values.len(), self.values));
                }
                for &value in values {
                    if !value.is_finite() {
                        return Err(format!("leaf {index} has the value {value}"));
                    }
                    self.largest = self.largest.max(value.abs());
                }
                Ok((Branch::Leaf(values), 0, 0))
            }
            &Node::Split { feature, threshold, missing_left, left, right } => {
                if feature >= self.features || threshold.is_nan() {
                    return Err(format!("split {index} is at {threshold} of feature {feature} of {}", self.features));
                }
                let (left, left_splits, left_depth) = self.branch(left, depth + 1)?;
                let (right, right_splits, right_depth) = self.branch(right, depth + 1)?;
                let split = Split {
                    feature: u8::try_from(feature).map_err(|e| e.to_string())?,
                    cut: cut(threshold, self.key),
                    missing_left,
                    left,
                    right,
                    left_splits,
                };
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

fn wrong(what: String) -> Error {
    Error::data(format!("cannot compile the ensemble: {what}"), "Train it again, or check the program that wrote it.")
}
