//! Size and speed of trees as C, estimated by counting columns, comparisons, leaves and calls.
//!
//! The costs are fitted to what emulated chips count for code of arm-none-eabi-gcc at `-Os`: 194 models, from none to 15,000 splits,
//! within 11 % on a Cortex-M4F and within 15 % on a Cortex-M0+. An ignored test of this folder compares them with other models.
//! A compiler makes a comparison of keys that comes again in a function only once, and leaves out most of those whose result
//! follows from others.

use super::columns::{Column, Kind};
use super::program::{CodeNode, CodeTree, Program};
use crate::compile::cost::Instructions;
use palpate_shared::format::Key;
use std::collections::{HashMap, HashSet};

/// Instructions of the parts of a program on one processor.
struct Costs {
    /// The call.
    call: f64,
    /// An object's base and margin.
    object: f64,
    /// A loop over columns of keys; each column, where there are several; each column of f32 values.
    run: f64,
    key: f64,
    real: f64,
    /// A column whose features may be a sentinel.
    sentinel: f64,
    /// A column of ranks by conversion; by search, and each step of that.
    grid: f64,
    search: (f64, f64),
    /// A function that adds up trees of an object.
    function: f64,
    /// A comparison of keys; what one past the first [`KEPT`] of a function takes more; one whose result is known.
    new: f64,
    beyond: f64,
    known: f64,
    /// A comparison of ranks.
    step: f64,
    /// A leaf with a value for each object, and each value; a leaf that is a vote; a leaf that is a list, and each entry.
    leaf: f64,
    value: f64,
    vote: f64,
    list: f64,
    entry: f64,
}

const M4F: Costs = Costs {
    call: 3.5,
    object: 4.0,
    run: 5.2,
    key: 8.9,
    real: 4.2,
    sentinel: 5.8,
    grid: 18.5,
    search: (32.6, 2.2),
    function: 11.3,
    new: 3.3,
    beyond: 5.5,
    known: 1.1,
    step: 3.7,
    leaf: 5.3,
    value: 6.9,
    vote: 15.2,
    list: 18.8,
    entry: 9.2,
};

const M0_PLUS: Costs = Costs {
    call: 0.0,
    object: 5.7,
    run: 7.1,
    key: 11.4,
    real: 5.9,
    sentinel: 7.8,
    grid: 32.6,
    search: (36.9, 3.9),
    function: 9.8,
    new: 3.6,
    beyond: 5.6,
    known: 1.4,
    step: 3.8,
    leaf: 2.1,
    value: 9.0,
    vote: 18.0,
    list: 18.9,
    entry: 12.1,
};

/// Keys of a function that stay in registers, about.
const KEPT: usize = 7;

/// Rows that an estimate is the mean over.
const ROWS: usize = 100;

/// Comparisons that a row has made in a function, and from them the least and the greatest rank that each column may have.
#[derive(Default)]
struct Seen {
    made: HashSet<(usize, u8)>,
    ranks: HashMap<usize, (u8, u8)>,
    new: usize,
}

impl Seen {
    /// Instructions of a comparison of keys.
    fn compare(&mut self, column: usize, at: u8, rank: u8, costs: &Costs) -> f64 {
        if !self.made.insert((column, at)) {
            return 0.0;
        }
        let (least, greatest) = self.ranks.entry(column).or_insert((0, u8::MAX));
        let is_known = *greatest <= at || *least > at;
        if rank <= at {
            *greatest = at.min(*greatest);
        } else {
            *least = (at + 1).max(*least);
        }
        if is_known {
            return costs.known;
        }
        self.new += 1;
        costs.new + if self.new > KEPT { costs.beyond } else { 0.0 }
    }
}

impl Program {
    /// Estimate of the bytes of flash that the C code takes on a Cortex-M4F, its constants included.
    pub fn flash(&self) -> usize {
        let has_keys = self.has_keys();
        let (mut comparisons, mut splits) = (0, 0);
        for trees in self.functions() {
            comparisons += different(&trees);
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
        let of_splits = if has_keys { 18 * comparisons + 3 * splits } else { 10 * comparisons + 5 * splits };
        22 * self.objects() + 13 * self.columns.len() + 19 * self.runs().count() + 4 * cuts + of_splits + table
    }

    /// About how many instructions a row takes, from features to margins: the mean over rows in which a feature is as likely between
    /// any two thresholds next to each other, or beyond all of them.
    pub(in super::super) fn instructions(&self) -> Instructions {
        // Any numbers do that are spread out; these are of Knuth's linear congruential generator.
        let mut state = 1_u64;
        let mut place = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        let row = |_| {
            let places: Vec<u64> = (0..self.features).map(|_| place()).collect();
            let rank = |column: &Column| {
                let below = (places[usize::from(column.feature)] * (column.cuts.len() as u64 + 1)) >> 31;
                below.checked_sub(1).map_or(0, |last| column.at(last as u8).saturating_add(1))
            };
            self.columns.iter().map(rank).collect()
        };
        self.mean_instructions(&(0..ROWS).map(row).collect::<Vec<_>>())
    }

    /// The mean over rows of a rank for each column.
    pub(super) fn mean_instructions(&self, rows: &[Vec<u8>]) -> Instructions {
        let walk = Walk::new(self);
        self.on_each(|costs| rows.iter().map(|ranks| walk.of_row(ranks, costs)).sum::<f64>() / rows.len() as f64)
    }

    /// The most that a row takes.
    pub(in super::super) fn instructions_of_longest_ways(&self) -> Instructions {
        let walk = Walk::new(self);
        self.on_each(|costs| walk.longest(costs))
    }

    /// Instructions that all rows take, and those of `walk`.
    fn on_each(&self, walk: impl Fn(&Costs) -> f64) -> Instructions {
        let on = |costs| (self.fixed(costs) + walk(costs)).round() as u64;
        Instructions { m4f: on(&M4F), m0_plus: Some(on(&M0_PLUS)) }
    }

    /// The trees of each function.
    fn functions(&self) -> impl Iterator<Item = Vec<&CodeTree>> {
        let ones = (0..self.objects()).flat_map(move |object| self.chunks(object));
        ones.chain(self.trees.iter().filter(|tree| tree.object.is_none()).map(|tree| vec![tree]))
    }

    /// Instructions of columns, calls and base margins.
    fn fixed(&self, costs: &Costs) -> f64 {
        let columns = self.columns.len() as f64;
        let rank = |column: &Column| match column.kind {
            Kind::Grid { .. } => costs.grid,
            Kind::Search { steps } => costs.search.0 + costs.search.1 * f64::from(steps),
        };
        let numbers: f64 = if self.has_keys() {
            let of_run = |run: &[Column]| costs.run + if run.len() > 1 { costs.key * run.len() as f64 } else { 0.0 };
            let reals = if self.key == Key::Real { costs.real * columns } else { 0.0 };
            self.runs().map(of_run).sum::<f64>() + reals
        } else {
            self.columns.iter().map(rank).sum()
        };
        let sentinels = if self.sentinel.is_some() { costs.sentinel * columns } else { 0.0 };
        let functions: usize = (0..self.objects()).map(|object| self.chunks(object).len()).sum();
        let objects = costs.object * self.objects() as f64;
        costs.call + objects + numbers + sentinels + costs.function * functions as f64
    }
}

/// Trees as a row goes through them.
struct Walk<'p> {
    functions: Vec<Vec<&'p CodeTree>>,
    has_keys: bool,
    vote: Option<i32>,
}

impl<'p> Walk<'p> {
    fn new(program: &'p Program) -> Self {
        Self { functions: program.functions().collect(), has_keys: program.has_keys(), vote: program.vote() }
    }

    /// Instructions of a row's comparisons and leaves.
    fn of_row(&self, ranks: &[u8], costs: &Costs) -> f64 {
        let mut sum = 0.0;
        for trees in &self.functions {
            let mut seen = Seen::default();
            for tree in trees {
                let mut node = &tree.root;
                while let CodeNode::Split(split) = node {
                    let rank = ranks[split.column];
                    sum += if self.has_keys { seen.compare(split.column, split.at, rank, costs) } else { costs.step };
                    node = if rank <= split.at { &split.left } else { &split.right };
                }
                if let (CodeNode::Leaf(values), None) = (node, tree.object) {
                    sum += costs.of_vector(values, self.vote);
                }
            }
        }
        sum
    }

    /// Instructions where every tree takes its longest way, and every comparison that is not another one has to be made.
    fn longest(&self, costs: &Costs) -> f64 {
        let mut sum = 0.0;
        for trees in &self.functions {
            let mut steps = 0.0;
            for tree in trees {
                steps += tree.root.sum(1.0, &|_| 0.0, &f64::max);
                if tree.object.is_none() {
                    sum += tree.root.sum(0.0, &|values| costs.of_vector(values, self.vote), &f64::max);
                }
            }
            sum += if self.has_keys {
                let new = f64::min(steps, different(trees) as f64);
                costs.new * new + costs.beyond * (new - KEPT as f64).max(0.0)
            } else {
                costs.step * steps
            };
        }
        sum
    }
}

impl Costs {
    /// Instructions of a leaf with a value for each object, which is added by its number.
    fn of_vector(&self, values: &[i32], vote: Option<i32>) -> f64 {
        let Some(vote) = vote else { return self.leaf + self.value * values.len() as f64 };
        let given = values.iter().filter(|value| **value != 0).count();
        if given == 1 && values.contains(&vote) { self.vote } else { self.list + self.entry * given.max(1) as f64 }
    }
}

/// Number of different comparisons in trees of a function.
fn different(trees: &[&CodeTree]) -> usize {
    let mut all = HashSet::new();
    trees.iter().for_each(|tree| tree.root.comparisons(&mut all));
    all.len()
}

impl CodeNode {
    /// Adds the comparisons: a column, and the rank at or below which a row goes left.
    fn comparisons(&self, all: &mut HashSet<(usize, u8)>) {
        if let Self::Split(split) = self {
            all.insert((split.column, split.at));
            split.left.comparisons(all);
            split.right.comparisons(all);
        }
    }
}
