//! Splits by sets of categories, written as splits by thresholds.
//!
//! A category is a whole number, so a set consists of runs of values, and a search of a few thresholds tells which run a
//! value is in. Both subtrees are repeated for each of their runs, without what a run's values make impossible. The
//! compiled model needs no split of another kind, and decides as the library does for every f32.

use super::draft_node::DraftNode;
use super::set::{BELOW_ZERO, Set};
use crate::ensemble::Threshold;
use crate::error::{Error, Result, problem};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Splits that a tree may have, for each one in the file.
const MAX_GROWTH: usize = 64;
/// The limit for a small tree.
const ALWAYS: usize = 1 << 12;

/// The tree with splits by thresholds alone, nodes from the root on; `name` names a feature.
///
/// # Errors
/// If it would become [`MAX_GROWTH`] times as large. Children that do not exist, or nodes that are reached twice, are errors
/// too.
pub(in crate::ensemble) fn spelled_out(
    nodes: Vec<DraftNode>,
    tree: usize,
    name: impl Fn(usize) -> String,
) -> Result<Vec<DraftNode>> {
    let of_set = |node: &DraftNode| if let DraftNode::Set { feature, .. } = node { Some(*feature) } else { None };
    let Some(first) = nodes.iter().find_map(of_set) else { return Ok(nodes) };
    let again = |error: Error| error.fix("Save the model again.");
    let mut writer =
        Writer { nodes: Vec::new(), waiting: Vec::new(), most: nodes.len().saturating_mul(MAX_GROWTH).max(ALWAYS) };
    let root = writer.reserve();
    writer.waiting.push(Waiting { from: 0, to: root, reaches: Reaches::default(), depth: 0 });
    while let Some(here) = writer.waiting.pop() {
        let node = nodes.get(here.from).filter(|_| here.depth <= nodes.len());
        match node.ok_or_else(|| again(problem!("tree {tree} has no node {}", here.from)))? {
            DraftNode::Leaf(values) => writer.put(here.to, DraftNode::Leaf(values.clone())),
            &DraftNode::Split { feature, threshold, missing_left, left, right } => {
                let [left, right] = [left, right].map(|child| {
                    let to = writer.reserve();
                    writer.wait(child, to, &here, here.reaches.clone());
                    to
                });
                writer.put(here.to, DraftNode::Split { feature, threshold, missing_left, left, right });
            }
            DraftNode::Set { feature, set, missing_inside, inside, outside } => {
                let reach = here.reaches.of(*feature);
                let runs = Runs::of(set, reach, *missing_inside);
                let is_small = writer.search(&runs, *feature, [*inside, *outside], &here);
                is_small.ok_or_else(|| {
                    problem!(
                        "tree {tree} splits by sets of categories of {:?} that lie so far apart that it would become \
                         {MAX_GROWTH} times as large",
                        name(first)
                    )
                    .fix(
                        "Train with fewer categories in a set (XGBoost's and LightGBM's max_cat_threshold), less depth, or \
                         rarer categories put together; number categories that behave alike one after the other.",
                    )
                })?;
            }
        }
        writer.check().ok_or_else(|| again(problem!("tree {tree} has nodes without end")))?;
    }
    Ok(writer.nodes)
}

/// The threshold between two runs, the second of which begins here. Between -1 and [`BELOW_ZERO`] there is no f32, and
/// at a threshold in whole numbers of units "at or below -1" is what was meant.
fn threshold(begin: f64) -> Threshold {
    if begin == BELOW_ZERO { Threshold::at_or_below(-1.0) } else { Threshold::below(begin) }
}

/// Values of a feature that lead to a node: from the first one to before the last one, and missing ones.
#[derive(Clone, Copy, Debug)]
struct Reach {
    from: f64,
    to: f64,
    missing: bool,
}

impl Reach {
    const ALL: Self = Self { from: f64::NEG_INFINITY, to: f64::INFINITY, missing: true };
}

/// Values that the features of sets may have at a node.
#[derive(Clone, Default)]
struct Reaches(Rc<BTreeMap<usize, Reach>>);

impl Reaches {
    fn of(&self, feature: usize) -> Reach {
        self.0.get(&feature).copied().unwrap_or(Reach::ALL)
    }

    fn with(&self, feature: usize, reach: Reach) -> Self {
        let mut all = (*self.0).clone();
        all.insert(feature, reach);
        Self(Rc::new(all))
    }
}

/// Neighboring values that are all in a set, or all not.
#[derive(Clone, Copy)]
struct Run {
    reach: Reach,
    is_inside: bool,
}

/// The runs that a node's values fall into, ascending.
struct Runs {
    runs: Vec<Run>,
    /// Missing values, where no run goes where they go.
    apart: Option<Run>,
}

impl Runs {
    fn of(set: &Set, reach: Reach, missing_inside: bool) -> Self {
        let (ends, is_first_inside) = set.between(reach.from, reach.to);
        let mut runs = Vec::with_capacity(ends.len() + 1);
        let mut from = reach.from;
        for (index, to) in ends.iter().copied().chain([reach.to]).enumerate() {
            let is_inside = is_first_inside != (index % 2 == 1);
            runs.push(Run { reach: Reach { from, to, missing: false }, is_inside });
            from = to;
        }
        // Missing values go with the first run that goes where they go.
        let mut apart = None;
        if reach.missing {
            match runs.iter_mut().find(|run| run.is_inside == missing_inside) {
                Some(run) => run.reach.missing = true,
                None => apart = Some(Run { reach: Reach { to: reach.from, ..reach }, is_inside: missing_inside }),
            }
        }
        Self { runs, apart }
    }
}

/// A node of the file that is to be written, for the values that lead to it.
struct Waiting {
    from: usize,
    to: usize,
    reaches: Reaches,
    depth: usize,
}

struct Writer {
    nodes: Vec<DraftNode>,
    waiting: Vec<Waiting>,
    most: usize,
}

impl Writer {
    fn reserve(&mut self) -> usize {
        self.nodes.push(DraftNode::Leaf(Vec::new()));
        self.nodes.len() - 1
    }

    fn put(&mut self, at: usize, node: DraftNode) {
        if let Some(place) = self.nodes.get_mut(at) {
            *place = node;
        }
    }

    /// Has a child of `parent` written later.
    fn wait(&mut self, from: usize, to: usize, parent: &Waiting, reaches: Reaches) {
        self.waiting.push(Waiting { from, to, reaches, depth: parent.depth + 1 });
    }

    /// None if the tree has become too large.
    fn check(&self) -> Option<()> {
        (self.nodes.len() <= self.most).then_some(())
    }

    /// Writes a search among runs, in halves, with copies of the subtrees inside and outside of the set below it.
    fn search(&mut self, runs: &Runs, feature: usize, children: [usize; 2], here: &Waiting) -> Option<()> {
        let [inside, outside] = children;
        let copy = |writer: &mut Self, run: &Run, place: usize| {
            let child = if run.is_inside { inside } else { outside };
            writer.wait(child, place, here, here.reaches.with(feature, run.reach));
            writer.check()
        };
        let mut to = here.to;
        if let Some(apart) = &runs.apart {
            let [left, right] = [self.reserve(), self.reserve()];
            // No number is below minus infinity.
            let threshold = Threshold::below(f64::NEG_INFINITY);
            self.put(to, DraftNode::Split { feature, threshold, missing_left: true, left, right });
            copy(self, apart, left)?;
            to = right;
        }
        let mut halves = vec![(runs.runs.as_slice(), to)];
        while let Some((own, place)) = halves.pop() {
            if let [run] = own {
                copy(self, run, place)?;
                continue;
            }
            let (low, high) = own.split_at(own.len() / 2);
            let Some(middle) = high.first() else { continue };
            let missing_left = low.iter().any(|run| run.reach.missing);
            let [left, right] = [self.reserve(), self.reserve()];
            let threshold = threshold(middle.reach.from);
            self.put(place, DraftNode::Split { feature, threshold, missing_left, left, right });
            halves.extend([(high, right), (low, left)]);
        }
        Some(())
    }
}
