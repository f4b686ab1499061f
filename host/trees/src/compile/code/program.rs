//! Trees over columns of ranks, with leaves in units: what every form of code is written from.

use super::super::axes::Axes;
use super::super::forest::Branch;
use super::super::lowered::Lowered;
use super::super::quantize::Scale;
use super::columns::{Column, Columns};
use crate::ensemble::Output;
use palpate_shared::format::{Key, LeafType, Sentinel};

/// With more splits than this, C compares ranks of one byte: they take fewer bytes than keys of four.
const KEYS: usize = 512;
/// Splits of a function: compilers take long for more.
const FUNCTION: usize = 800;

/// A program that adds up trees: from a row of features to margins in units.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Features of a row.
    pub(super) features: usize,
    /// Type of the features: whole numbers, or f32 values.
    pub(super) key: Key,
    /// Features that stand for a missing value.
    pub(super) sentinel: Option<Sentinel>,
    /// Margins before any tree, in units; one for each object.
    pub(super) base: Vec<i32>,
    /// Objects that can be named: all but a background.
    pub(super) known: usize,
    /// True if of several classes with the largest margin the last one counts.
    pub(super) last_of_ties: bool,
    /// Columns that splits compare, in the order in which it is stored.
    pub(super) columns: Vec<Column>,
    /// The trees.
    pub(super) trees: Vec<CodeTree>,
}

/// A tree.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CodeTree {
    /// The object whose margin its leaves add to; `None` where they have a value for each.
    pub(super) object: Option<usize>,
    pub(super) root: CodeNode,
}

/// A split or a leaf.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CodeNode {
    /// Values in units.
    Leaf(Vec<i32>),
    Split(Box<CodeSplit>),
}

/// A split: left where the column's rank is at most `at`, which is where its key is below `cut`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CodeSplit {
    pub(super) column: usize,
    pub(super) at: u8,
    pub(super) cut: i32,
    pub(super) left: CodeNode,
    pub(super) right: CodeNode,
}

/// Statements of a model that its code depends on.
pub(crate) struct Statements {
    pub(crate) sentinel: Option<Sentinel>,
    pub(crate) known: usize,
    pub(crate) last_of_ties: bool,
}

impl Program {
    /// The program of lowered trees; `None` where leaves are f32 or beyond two bytes, or there are more than 256 columns.
    pub(in super::super) fn new(lowered: &Lowered<'_>, stated: &Statements) -> Option<Self> {
        let Lowered { leaf, forest, scale, axes, .. } = lowered;
        if *leaf == LeafType::F32 || axes.columns > 256 {
            return None;
        }
        let columns = Columns::new(forest, axes, stated.sentinel.is_some());
        let trees = forest.trees.iter().zip(&scale.shifts).map(|(tree, &shift)| CodeTree {
            object: if let Output::One(object) = tree.output { Some(object) } else { None },
            root: node(&tree.root, scale, shift, axes, &columns),
        });
        let trees: Vec<CodeTree> = trees.collect();
        // Values of a vector are stored in two bytes.
        let mut fits = true;
        for tree in trees.iter().filter(|tree| tree.object.is_none()) {
            tree.root.leaves(&mut |values| fits &= values.iter().all(|value| i16::try_from(*value).is_ok()));
        }
        fits.then_some(Self {
            features: forest.features,
            key: forest.key,
            sentinel: stated.sentinel,
            base: lowered.base.clone(),
            known: stated.known,
            last_of_ties: stated.last_of_ties,
            columns: columns.columns,
            trees,
        })
    }

    /// Number of objects.
    pub(super) fn objects(&self) -> usize {
        self.base.len()
    }

    /// True if C compares keys, otherwise ranks.
    pub(super) fn has_keys(&self) -> bool {
        self.trees.iter().map(|tree| tree.root.count()).sum::<usize>() <= KEYS
    }

    /// Columns that C makes in one loop, one group after the other.
    pub(super) fn runs(&self) -> impl Iterator<Item = &[Column]> {
        let has_keys = self.has_keys();
        self.columns.chunk_by(move |a, b| a.missing_left == b.missing_left && (has_keys || a.kind == b.kind))
    }

    /// Trees of one object, those of a function together.
    pub(super) fn chunks(&self, object: usize) -> Vec<Vec<&CodeTree>> {
        let mut chunks: Vec<Vec<&CodeTree>> = Vec::new();
        let mut room = 0;
        for tree in self.trees.iter().filter(|tree| tree.object == Some(object)) {
            let size = tree.root.count();
            if room < size {
                chunks.push(Vec::new());
                room = FUNCTION.max(size);
            }
            room -= size;
            if let Some(chunk) = chunks.last_mut() {
                chunk.push(tree);
            }
        }
        chunks
    }

    /// The value of leaves that are one class's, if most leaves with a value for each object are such: votes. All others
    /// are short lists then.
    pub(super) fn vote(&self) -> Option<i32> {
        if self.objects() > 64 {
            return None;
        }
        let (mut of_one, mut all): (std::collections::BTreeMap<i32, usize>, usize) = Default::default();
        let mut fits = true;
        for tree in self.trees.iter().filter(|tree| tree.object.is_none()) {
            tree.root.leaves(&mut |values| {
                all += 1;
                fits &= values.iter().all(|value| (0..1 << 16).contains(value));
                let mut others = values.iter().filter(|value| **value != 0);
                if let (Some(&value), None) = (others.next(), others.next()) {
                    *of_one.entry(value).or_default() += 1;
                }
            });
        }
        let (value, count) = of_one.into_iter().max_by_key(|(_, count)| *count)?;
        (fits && 4 * count >= all).then_some(value)
    }

    /// Margins of a row of keys (missing: the least number), as the code computes them.
    #[cfg(test)]
    pub(super) fn margins(&self, keys: &[i32]) -> Vec<i32> {
        let ranks = self.ranks(keys);
        let mut margins = self.base.clone();
        for tree in &self.trees {
            tree.add(&ranks, &mut margins);
        }
        margins
    }

    /// The rank of every column.
    #[cfg(test)]
    pub(super) fn ranks(&self, keys: &[i32]) -> Vec<u8> {
        let missing = palpate_shared::MISSING_FEATURE;
        let known = |key: i32| self.sentinel.map_or(key, |sentinel| sentinel.or_missing(key));
        let key = |feature: u8| keys.get(usize::from(feature)).map_or(missing, |&key| known(key));
        self.columns.iter().map(|column| column.rank(key(column.feature))).collect()
    }
}

#[cfg(test)]
impl CodeTree {
    /// Adds the leaf that is reached.
    pub(super) fn add(&self, ranks: &[u8], margins: &mut [i32]) {
        let mut node = &self.root;
        loop {
            match node {
                CodeNode::Split(split) => {
                    node = if ranks[split.column] <= split.at { &split.left } else { &split.right };
                }
                CodeNode::Leaf(values) => {
                    let first = self.object.unwrap_or(0);
                    margins[first..].iter_mut().zip(values).for_each(|(margin, value)| *margin += value);
                    return;
                }
            }
        }
    }
}

impl CodeNode {
    /// Calls `see` on every leaf, from left to right.
    pub(super) fn leaves<'n>(&'n self, see: &mut impl FnMut(&'n [i32])) {
        match self {
            Self::Leaf(values) => see(values),
            Self::Split(split) => {
                split.left.leaves(see);
                split.right.leaves(see);
            }
        }
    }

    /// Its splits.
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Leaf(_) => 0,
            Self::Split(split) => 1 + split.left.count() + split.right.count(),
        }
    }

    /// A sum along the way to a leaf, of `split` for each split and of the leaf's own, where `below` joins those of a split's
    /// sides.
    pub(super) fn sum(&self, split: f64, leaf: &dyn Fn(&[i32]) -> f64, below: &dyn Fn(f64, f64) -> f64) -> f64 {
        match self {
            Self::Leaf(values) => leaf(values),
            Self::Split(own) => split + below(own.left.sum(split, leaf, below), own.right.sum(split, leaf, below)),
        }
    }
}

fn node(branch: &Branch<'_>, scale: &Scale, shift: u8, axes: &Axes, columns: &Columns) -> CodeNode {
    match branch {
        Branch::Leaf(values) => {
            CodeNode::Leaf(values.iter().map(|&value| scale.integer(value, shift) << shift).collect())
        }
        Branch::Split(split) => {
            let (column, index) = axes.place(split);
            let column = columns.place(column);
            CodeNode::Split(Box::new(CodeSplit {
                column,
                at: columns.columns[column].at(index),
                cut: split.cut,
                left: node(&split.left, scale, shift, axes, columns),
                right: node(&split.right, scale, shift, axes, columns),
            }))
        }
    }
}
