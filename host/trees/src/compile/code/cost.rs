//! Size and speed of trees as C, estimated by counting columns, comparisons, leaves and calls.
//!
//! The numbers are fitted to what arm-none-eabi-gcc makes at `-Os` of 50 models, from 8 to 15,000 splits, and to the counts of
//! emulated chips, within 15 % of them. Five other models were 16 to 57 % off, so that the ignored test of this folder, which asks
//! for 15 %, fails: those without a split, by votes, and of categories or missing values. Where keys are compared, a compiler makes a
//! comparison that comes again in a function only once.

use super::columns::Kind;
use super::program::{CodeNode, CodeTree, Program};
use crate::compile::cost::Instructions;
use std::collections::{BTreeMap, HashSet};

/// Instructions of the parts of a program on one processor.
struct Costs {
    /// The call.
    call: f64,
    /// An object's base and margin.
    object: f64,
    /// A column of keys, one that is made alone, and one of several.
    key: [f64; 2],
    /// A column of ranks by conversion; by search, and each step of that.
    grid: f64,
    search: (f64, f64),
    /// A function that adds up trees of an object.
    function: f64,
    /// A comparison of keys: of the first 16, and of the others.
    key_step: [f64; 2],
    /// A comparison of ranks.
    step: f64,
    /// An addition to one of the two sums of a leaf, with ranks.
    addition: f64,
    /// A value of a leaf with one for each object; a leaf that is a vote.
    value: f64,
    vote: f64,
}

const M4F: Costs = Costs {
    call: 4.0,
    object: 6.0,
    key: [9.0, 15.6],
    grid: 28.0,
    search: (30.0, 2.5),
    function: 7.7,
    key_step: [2.8, 4.1],
    step: 2.5,
    addition: 1.8,
    value: 7.4,
    vote: 32.0,
};

const M0_PLUS: Costs = Costs {
    call: 3.0,
    object: 6.5,
    key: [10.0, 19.9],
    grid: 52.0,
    search: (41.0, 3.9),
    function: 10.0,
    key_step: [3.0, 4.9],
    step: 3.0,
    addition: 1.0,
    value: 9.2,
    vote: 36.0,
};

/// Comparisons and additions of one walk through all trees.
#[derive(Clone, Copy, Default)]
struct Work {
    comparisons: f64,
    additions: f64,
}

/// Comparisons of a function, each with how often a row makes it.
type Comparisons = BTreeMap<(usize, u8), f64>;

impl Program {
    /// Estimate of the bytes of flash that the C code takes on a Cortex-M4F, its constants included.
    pub fn flash(&self) -> usize {
        let has_keys = self.has_keys();
        let (mut different, mut splits) = (0, 0);
        for trees in self.functions() {
            let mut comparisons = Comparisons::new();
            trees.iter().for_each(|tree| tree.root.comparisons(1.0, &mut comparisons));
            different += comparisons.len();
            splits += trees.iter().map(|tree| tree.root.count()).sum::<usize>();
        }
        let cuts: usize = match has_keys {
            true => 0,
            false => self
                .columns
                .iter()
                .filter(|own| matches!(own.kind, Kind::Search { .. }))
                .map(|own| own.cuts.len())
                .sum(),
        };
        let mut leaves = HashSet::new();
        for tree in self.trees.iter().filter(|tree| tree.object.is_none()) {
            tree.root.leaves(&mut |values| _ = leaves.insert(values));
        }
        let fits = leaves.iter().all(|values| values.iter().all(|value| i8::try_from(*value).is_ok()));
        let table = leaves.len() * self.objects() * if fits { 1 } else { 2 };
        let of_splits = if has_keys { 18 * different + 3 * splits } else { 10 * different + 5 * splits };
        22 * self.objects() + 13 * self.columns.len() + 19 * self.runs().count() + 4 * cuts + of_splits + table
    }

    /// About how many instructions a row takes, from features to margins, where either side of a split is as likely.
    pub(in super::super) fn instructions(&self) -> Instructions {
        let mut work = Work::default();
        for trees in self.functions() {
            let mut comparisons = Comparisons::new();
            for tree in trees {
                tree.root.comparisons(1.0, &mut comparisons);
                work.additions += tree.additions(&|left, right| (left + right) / 2.0);
            }
            work.comparisons += self.made(&comparisons);
        }
        self.instructions_of(work)
    }

    /// The most that a row takes.
    pub(in super::super) fn instructions_of_longest_ways(&self) -> Instructions {
        let mut work = Work::default();
        for trees in self.functions() {
            let mut comparisons = Comparisons::new();
            let mut steps = 0.0;
            for tree in trees {
                tree.root.comparisons(1.0, &mut comparisons);
                steps += tree.root.sum(1.0, &|_| 0.0, &f64::max);
                work.additions += tree.additions(&f64::max);
            }
            work.comparisons += if self.has_keys() { steps.min(comparisons.len() as f64) } else { steps };
        }
        self.instructions_of(work)
    }

    /// Instructions for a row of keys.
    #[cfg(test)]
    pub(super) fn instructions_of_row(&self, keys: &[i32]) -> Instructions {
        let ranks = self.ranks(keys);
        let mut work = Work::default();
        for trees in self.functions() {
            let mut comparisons = Comparisons::new();
            for tree in trees {
                let mut node = &tree.root;
                while let CodeNode::Split(split) = node {
                    *comparisons.entry((split.column, split.at)).or_default() += 1.0;
                    node = if ranks[split.column] <= split.at { &split.left } else { &split.right };
                }
                if let (CodeNode::Leaf(values), Some(_)) = (node, tree.object) {
                    work.additions += additions(values[0]);
                }
            }
            work.comparisons += self.made(&comparisons);
        }
        self.instructions_of(work)
    }

    /// The trees of each function.
    fn functions(&self) -> impl Iterator<Item = Vec<&CodeTree>> {
        let ones = (0..self.objects()).flat_map(move |object| self.chunks(object));
        ones.chain(self.trees.iter().filter(|tree| tree.object.is_none()).map(|tree| vec![tree]))
    }

    /// Comparisons that a row makes in a function.
    fn made(&self, comparisons: &Comparisons) -> f64 {
        let has_keys = self.has_keys();
        comparisons.values().map(|&count| if has_keys { count.min(1.0) } else { count }).sum()
    }

    fn instructions_of(&self, work: Work) -> Instructions {
        let on = |costs: &Costs| self.cost(costs, work).round() as u64;
        Instructions { m4f: on(&M4F), m0_plus: Some(on(&M0_PLUS)) }
    }

    fn cost(&self, costs: &Costs, work: Work) -> f64 {
        let has_keys = self.has_keys();
        let rank = |kind: Kind| match kind {
            Kind::Grid { .. } => costs.grid,
            Kind::Search { steps } => costs.search.0 + costs.search.1 * f64::from(steps),
        };
        let columns: f64 = match has_keys {
            true => self.runs().map(|run| costs.key[usize::from(run.len() > 1)] * run.len() as f64).sum(),
            false => self.columns.iter().map(|column| rank(column.kind)).sum(),
        };
        let functions: usize = (0..self.objects()).map(|object| self.chunks(object).len()).sum();
        let comparisons = match has_keys {
            true => {
                let first = work.comparisons.min(16.0);
                costs.key_step[0] * first + costs.key_step[1] * (work.comparisons - first)
            }
            false => costs.step * work.comparisons + costs.addition * work.additions,
        };
        let vectors = self.trees.iter().filter(|tree| tree.object.is_none()).count() as f64;
        let leaf = if self.vote().is_some() { costs.vote } else { costs.value * self.objects() as f64 };
        let objects = costs.object * self.objects() as f64;
        costs.call + objects + columns + costs.function * functions as f64 + comparisons + vectors * leaf
    }
}

impl CodeTree {
    /// Additions of the leaf that is reached, where `below` joins those of a split's sides.
    fn additions(&self, below: &dyn Fn(f64, f64) -> f64) -> f64 {
        if self.object.is_none() { 0.0 } else { self.root.sum(0.0, &|values| additions(values[0]), below) }
    }
}

impl CodeNode {
    /// Adds the chance of each comparison, where either side of a split is as likely.
    fn comparisons(&self, chance: f64, all: &mut Comparisons) {
        if let Self::Split(split) = self {
            *all.entry((split.column, split.at)).or_default() += chance;
            split.left.comparisons(chance / 2.0, all);
            split.right.comparisons(chance / 2.0, all);
        }
    }
}

/// Additions of a leaf, which is 256 · high + low.
fn additions(value: i32) -> f64 {
    f64::from(u8::from(value >> 8 != 0) + u8::from(value & 255 != 0))
}
