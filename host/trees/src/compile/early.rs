//! Exact early exit: the class of a row before all trees are walked.
//!
//! Trees that can change a difference between two margins most come first. After some of them stands a bound: the most by
//! which all trees that follow change any such difference, computed from their leaves. Where a margin leads by more than the
//! bound, the sum of all trees leads there too.
//!
//! Rows determine where to look: every place costs a comparison of all margins, and groups of trees of its own.

use super::forest::{Branch, Branches, Forest, each_leaf};
use super::lowered::Lowered;
use super::quantize::Scale;
use crate::ensemble::Output;
use crate::rows::{Encoder, Rows};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Layout, Sentinel};
use std::sync::Arc;

/// Choice of models whose walks may end early.
#[derive(Clone, Debug, PartialEq)]
pub enum EarlyExit {
    /// Only if it takes fewer instructions for these rows, which should not be those of the training: a model knows them too
    /// well.
    IfItPays(Rows),
    /// After an eighth, a quarter and a half of the trees.
    Always,
}

/// Result of the choice.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct EarlyExitFound {
    /// Trees of the model, after merging.
    pub trees: usize,
    /// Numbers of trees after which the walk may end; none where that does not pay.
    pub ends: Vec<usize>,
    /// Trees walked for one of the rows on average, if there were rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walked: Option<f64>,
}

/// Parts of the trees between which the places are chosen.
const PARTS: usize = 32;

/// Order of trees, and the places in it.
pub(super) struct Plan {
    /// Numbers of trees, in the order of the walk.
    pub(super) order: Vec<usize>,
    /// After so many of them the following change a difference by at most so many units.
    pub(super) ends: Vec<(usize, u32)>,
    pub(super) found: EarlyExitFound,
}

/// Instructions of a place where a walk may end: the comparison of the margins, in all and for each.
const PLACE: f64 = 30.0;
const PLACE_OF_OBJECT: f64 = 9.0;

/// Costs of a walk, in instructions.
struct Work<'w> {
    /// Cost of walking trees one after the other.
    trees: &'w dyn Fn(&[usize]) -> f64,
    /// Cost of a place.
    place: f64,
}

/// Trees in the order in which they are walked: those whose leaves differ most first.
pub(super) fn order(forest: &Forest<'_>, scale: &Scale) -> Vec<usize> {
    let changes = changes(forest, scale);
    let mut order: Vec<usize> = (0..forest.trees.len()).collect();
    let widest = |tree: usize| match changes[tree] {
        Change::Each(most) => most,
        Change::One(_, low, high) => high - low,
    };
    order.sort_by_key(|&tree| (std::cmp::Reverse(scale.shifts[tree]), std::cmp::Reverse(widest(tree))));
    order
}

/// For each tree the number of the part of an order that it is in, when these are the numbers of trees after which a part ends.
pub(super) fn parts(order: &[usize], ends: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut parts = vec![0; order.len()];
    for end in ends {
        order.iter().skip(end).for_each(|&tree| parts[tree] += 1);
    }
    parts
}

/// Chooses where walks in a layout may end; `None` for a model without classes.
pub(super) fn plan(
    lowered: &Lowered<'_>,
    layout: Layout,
    wanted: &EarlyExit,
    (scales, sentinel): (Option<&[f32]>, Option<Sentinel>),
) -> Option<Plan> {
    let Lowered { forest, scale, base, .. } = lowered;
    let place = PLACE + PLACE_OF_OBJECT * forest.objects() as f64;
    let work = &Work { trees: &|trees| walk_cost(forest, layout, trees), place };
    let trees = forest.trees.len();
    if forest.objects() < 2 || trees < 2 {
        return None;
    }
    let order = order(forest, scale);
    let bounds = bounds(forest, scale, &order);
    let mut found = EarlyExitFound { trees, ..EarlyExitFound::default() };
    let mut ends: Vec<usize> = match wanted {
        EarlyExit::Always => [8, 4, 2].map(|part| trees / part).into(),
        EarlyExit::IfItPays(_) => (1..PARTS).map(|part| trees * part / PARTS).collect(),
    };
    ends.dedup();
    ends.retain(|&end| end > 0 && end < trees);
    if let EarlyExit::IfItPays(rows) = wanted {
        let encoder = scales.map_or(Encoder::Real, |scales| Encoder::Scaled(scales.into()));
        let keys = |row: &[f64]| -> Vec<i32> {
            let keys = encoder.row(row).into_iter();
            keys.map(|key| sentinel.map_or(key, |sentinel| sentinel.or_missing(key))).collect()
        };
        let rows: Vec<Vec<i32>> = rows.iter().map(keys).collect();
        let walk = Walk { forest, scale, base, order: &order, bounds: &bounds };
        let decided: Vec<Vec<bool>> = rows.iter().map(|row| walk.decided(row, &ends)).collect();
        ends = cheapest(&order, &ends, &decided, work);
        let walked = rows.iter().map(|row| {
            let decided = walk.decided(row, &ends);
            ends.iter().zip(decided).find(|(_, decided)| *decided).map_or(trees, |(&end, _)| end)
        });
        found.walked = Some(walked.sum::<usize>() as f64 / rows.len().max(1) as f64);
    }
    found.ends.clone_from(&ends);
    Some(Plan { ends: ends.into_iter().map(|end| (end, bounds[end])).collect(), order, found })
}

/// Changes of a tree, in units.
enum Change {
    /// The most by which a leaf with a value for each object changes a difference.
    Each(i64),
    /// The object that it adds to, the least value and the largest.
    One(usize, i64, i64),
}

fn changes(forest: &Forest<'_>, scale: &Scale) -> Vec<Change> {
    let change = |(tree, &shift): (&Arc<Branches<'_>>, &u8)| {
        let units = |value: &f32| i64::from(scale.integer(*value, shift)) << shift;
        let (mut low, mut high, mut most) = (i64::MAX, i64::MIN, 0);
        each_leaf(&tree.root, &mut |values| {
            let own = values.iter().map(units);
            let (least, largest) = own.fold((i64::MAX, i64::MIN), |(a, b), value| (a.min(value), b.max(value)));
            (low, high, most) = (low.min(least), high.max(largest), most.max(largest - least));
        });
        match tree.output {
            Output::Each => Change::Each(most),
            Output::One(object) => Change::One(object, low, high),
        }
    };
    forest.trees.iter().zip(&scale.shifts).map(change).collect()
}

/// For each number of trees of an order, the most by which the others change a difference between two margins.
fn bounds(forest: &Forest<'_>, scale: &Scale, order: &[usize]) -> Vec<u32> {
    let changes = changes(forest, scale);
    let mut rest = Rest::new(forest.objects());
    let mut bounds = vec![0; order.len() + 1];
    for (index, &tree) in order.iter().enumerate().rev() {
        match changes[tree] {
            Change::Each(most) => rest.each += most,
            Change::One(object, low, high) => rest.add(object, low, high),
        }
        bounds[index] = rest.bound();
    }
    bounds
}

/// Changes that trees may still make.
pub(crate) struct Rest {
    /// By trees with a value for each object.
    pub(crate) each: i64,
    /// Each object's sum of least values, and of largest.
    ranges: Vec<[i64; 2]>,
}

impl Rest {
    pub(crate) fn new(objects: usize) -> Self {
        Self { each: 0, ranges: vec![[0; 2]; objects] }
    }

    pub(crate) fn add(&mut self, object: usize, low: i64, high: i64) {
        let [least, most] = &mut self.ranges[object];
        (*least, *most) = (*least + low, *most + high);
    }

    /// The most by which the difference between any two objects changes.
    pub(crate) fn bound(&self) -> u32 {
        // Of two objects: the largest rise of one and the deepest fall of another.
        let first_two = |change: &dyn Fn(&[i64; 2]) -> i64| {
            let mut two = [(i64::MIN, 0); 2];
            for (object, range) in self.ranges.iter().enumerate() {
                two[1] = two[1].max((change(range), object));
                two.sort_unstable_by(|a, b| b.cmp(a));
            }
            two
        };
        let (rises, falls) = (first_two(&|[_, high]| *high), first_two(&|[low, _]| -low));
        let pairs = rises.into_iter().flat_map(|rise| falls.map(|fall| (rise, fall)));
        let sums = pairs.filter(|(rise, fall)| rise.1 != fall.1).map(|(rise, fall)| rise.0.saturating_add(fall.0));
        let most = sums.max().unwrap_or(0).max(0);
        u32::try_from(self.each + most).unwrap_or(u32::MAX)
    }
}

/// Trees that rows go through.
struct Walk<'w> {
    forest: &'w Forest<'w>,
    scale: &'w Scale,
    base: &'w [i32],
    order: &'w [usize],
    bounds: &'w [u32],
}

impl Walk<'_> {
    /// For each end, true if a row's class is known there.
    fn decided(&self, row: &[i32], ends: &[usize]) -> Vec<bool> {
        let mut margins: Vec<i64> = self.base.iter().map(|&base| base.into()).collect();
        let mut walked = 0;
        let decided = ends.iter().map(|&end| {
            for &tree in &self.order[walked..end] {
                let (own, shift) = (&self.forest.trees[tree], self.scale.shifts[tree]);
                let first = if let Output::One(object) = own.output { object } else { 0 };
                let leaf = reach(&own.root, row);
                for (margin, &value) in margins[first..].iter_mut().zip(leaf) {
                    *margin += i64::from(self.scale.integer(value, shift)) << shift;
                }
            }
            walked = end;
            let mut sorted = margins.clone();
            sorted.sort_unstable_by_key(|&margin| std::cmp::Reverse(margin));
            sorted[0] - sorted[1] > self.bounds[end].into()
        });
        decided.collect()
    }
}

fn reach<'b>(mut branch: &'b Branch<'b>, row: &[i32]) -> &'b [f32] {
    loop {
        match branch {
            Branch::Leaf(values) => return values,
            Branch::Split(split) => {
                let key = row.get(usize::from(split.feature)).copied().unwrap_or(MISSING_FEATURE);
                let left = if key == MISSING_FEATURE { split.missing_left } else { key < split.cut };
                branch = if left { &split.left } else { &split.right };
            }
        }
    }
}

/// The ends with the fewest instructions for all rows together; a class that is known at an end is known at later ones.
fn cheapest(order: &[usize], ends: &[usize], decided: &[Vec<bool>], work: &Work<'_>) -> Vec<usize> {
    let places: Vec<usize> = std::iter::once(0).chain(ends.iter().copied()).chain([order.len()]).collect();
    let left = |place: usize| match place {
        0 => decided.len(),
        place => decided.iter().filter(|row| !row[place - 1]).count(),
    };
    let left: Vec<f64> = (0..=ends.len()).map(|place| left(place) as f64).collect();
    // For each place, the least cost of getting there, and the place before it.
    let mut best = vec![(0.0, 0)];
    for to in 1..places.len() {
        let last = to + 1 == places.len();
        let cost = |from: usize| {
            let trees = (work.trees)(&order[places[from]..places[to]]);
            best[from].0 + left[from] * (trees + if last { 0.0 } else { work.place })
        };
        let chosen = (0..to).map(|from| (cost(from), from)).min_by(|a, b| a.0.total_cmp(&b.0));
        best.extend(chosen);
    }
    let mut chosen = Vec::new();
    let mut at = best[places.len() - 1].1;
    while at > 0 {
        chosen.push(places[at]);
        at = best[at].1;
    }
    chosen.reverse();
    chosen
}

/// About how many instructions a walk takes through trees of one object or of all; for choosing places, not for statements.
fn walk_cost(forest: &Forest<'_>, layout: Layout, trees: &[usize]) -> f64 {
    // By layout: of a tree, of each of its levels or steps, of a value, and of a group, as `cost.rs` has them.
    let (tree, step, value, group) = match layout {
        Layout::Complete => (14.0, 6.5, 8.0, 150.0),
        Layout::Wide => (80.0, 28.0, 5.0, 60.0),
        // Load, comparison, branch; an object's sums are begun and stored.
        Layout::Code => (3.0, 2.8, 0.5, 22.0),
        Layout::Compact | Layout::Grid | Layout::Patterns => (80.0, 17.0, 5.0, 60.0),
    };
    let mut groups = std::collections::BTreeSet::new();
    let mut sum = 0.0;
    for &tree_number in trees {
        let own = &forest.trees[tree_number];
        let (object, values) = match own.output {
            Output::One(object) => (object, 1),
            Output::Each => (usize::MAX, forest.objects()),
        };
        groups.insert((object, if layout == Layout::Code { 0 } else { own.depth }));
        let steps = if layout == Layout::Complete { own.depth.max(1) as f64 } else { steps(&own.root) };
        sum += tree + step * steps + value * if layout == Layout::Code { 1.0 } else { values as f64 };
    }
    sum + group * groups.len() as f64
}

/// Steps to a leaf, if either side of a split is as likely.
pub(super) fn steps(branch: &Branch<'_>) -> f64 {
    match branch {
        Branch::Leaf(_) => 0.0,
        Branch::Split(split) => 1.0 + (steps(&split.left) + steps(&split.right)) / 2.0,
    }
}
