//! Splits by sets of categories, written as splits by thresholds.
//!
//! A category is a whole number, so that a set is some runs of values; which run a value is in takes a search of a few
//! thresholds. Both subtrees are repeated for each of their runs, without what a run's values make impossible: a compiled
//! model needs nothing new for it, and decides as the library does for every f32.

use super::draft::DraftNode;
use super::unsupported;
use crate::ensemble::Threshold;
use crate::error::EnsembleProblem;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Splits that a tree may have, for each one in the file.
const MAX_GROWTH: usize = 64;
/// The same for a small tree.
const ALWAYS: usize = 1 << 12;
/// The most categories of a set: LightGBM's text can state any number in a few bytes.
const MAX_CATEGORIES: usize = 1 << 16;

/// Values of a feature, in runs.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::ensemble) struct Set {
    /// Where one run ends and the next begins, ascending: every other run is in the set.
    ends: Vec<f64>,
    /// True if the first run is.
    begins: bool,
}

impl Set {
    /// The values that a library truncates to one of these categories. Values that are not above -1 are never one of them;
    /// of those between -1 and 0 `truncates_to_zero` says whether they are category 0.
    pub(in crate::ensemble) fn of_categories(
        categories: impl IntoIterator<Item = u32>,
        truncates_to_zero: bool,
    ) -> Result<Self, EnsembleProblem> {
        let mut categories: Vec<u32> = categories.into_iter().collect();
        categories.sort_unstable();
        categories.dedup();
        if categories.len() > MAX_CATEGORIES {
            return Err(unsupported(
                format!("it splits by a set of {} categories", categories.len()),
                "Train with fewer categories in a set: at most 65,536 are taken.",
            ));
        }
        let mut ends: Vec<f64> = Vec::new();
        for category in categories {
            let first = if category == 0 && truncates_to_zero { BELOW_ZERO } else { f64::from(category) };
            if ends.last() == Some(&first) {
                ends.pop();
            } else {
                ends.push(first);
            }
            ends.push(f64::from(category) + 1.0);
        }
        Ok(Self { ends, begins: false })
    }

    /// The same, and all values below 0 and from `end` on, which is beyond all categories.
    pub(in crate::ensemble) fn and_beyond(mut self, end: f64) -> Self {
        for end in [0.0, end] {
            match self.ends.binary_search_by(|own| own.total_cmp(&end)) {
                Ok(place) => _ = self.ends.remove(place),
                Err(place) => self.ends.insert(place, end),
            }
        }
        self.begins = true;
        self
    }

    /// The values that are these whole numbers exactly.
    pub(in crate::ensemble) fn of_numbers(mut numbers: Vec<i32>) -> Self {
        numbers.sort_unstable();
        numbers.dedup();
        let mut ends: Vec<f64> = Vec::new();
        for number in numbers.into_iter().map(f64::from) {
            if ends.last() == Some(&number) {
                ends.pop();
            } else {
                ends.push(number);
            }
            ends.push(number + 1.0);
        }
        Self { ends, begins: false }
    }

    /// The runs that begin above `from` and end at or below `to`: where they end, and whether the first is in the set.
    fn between(&self, from: f64, to: f64) -> (&[f64], bool) {
        let first = self.ends.partition_point(|end| *end <= from);
        let last = self.ends.partition_point(|end| *end < to);
        (self.ends.get(first..last).unwrap_or_default(), (first % 2 == 1) != self.begins)
    }
}

/// The least f64 above -1, where values begin that are truncated to 0: no f32 is between -1 and it.
const BELOW_ZERO: f64 = -1.0 + f64::EPSILON / 2.0;

/// The threshold between two runs of which the second one begins here.
fn threshold(begin: f64) -> Threshold {
    // The same for every f32; for whole numbers of units, the one that was meant.
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

/// The tree with splits by thresholds alone, nodes from the root on; `name` names a feature.
///
/// # Errors
/// If it would become [`MAX_GROWTH`] times as large. Children that do not exist, or nodes that are reached twice, are errors
/// too.
pub(in crate::ensemble) fn spelled_out(
    nodes: Vec<DraftNode>,
    tree: usize,
    name: impl Fn(usize) -> String,
) -> Result<Vec<DraftNode>, EnsembleProblem> {
    let Some(sets) = nodes.iter().find_map(|node| match node {
        DraftNode::Set { feature, .. } => Some(*feature),
        _ => None,
    }) else {
        return Ok(nodes);
    };
    let most = nodes.len().saturating_mul(MAX_GROWTH).max(ALWAYS);
    let mut out = Writer { nodes: Vec::new(), most };
    let root = out.reserve();
    let mut waiting = vec![(0_usize, root, Reaches::default(), 0_usize)];
    while let Some((from, to, reaches, depth)) = waiting.pop() {
        let node = nodes.get(from).filter(|_| depth <= nodes.len());
        let node =
            node.ok_or_else(|| unsupported(format!("tree {tree} has no node {from}"), "Save the model again."))?;
        match node {
            DraftNode::Leaf(values) => out.put(to, DraftNode::Leaf(values.clone())),
            &DraftNode::Split { feature, threshold, missing_left, left, right } => {
                let children = [left, right].map(|child| {
                    let place = out.reserve();
                    waiting.push((child, place, reaches.clone(), depth + 1));
                    place
                });
                let [left, right] = children;
                out.put(to, DraftNode::Split { feature, threshold, missing_left, left, right });
            }
            DraftNode::Set { feature, set, missing_inside, inside, outside } => {
                let reach = reaches.of(*feature);
                let (ends, is_first_inside) = set.between(reach.from, reach.to);
                let mut runs = Vec::with_capacity(ends.len() + 1);
                let mut begin = reach.from;
                for (index, end) in ends.iter().copied().chain([reach.to]).enumerate() {
                    let is_inside = is_first_inside != (index % 2 == 1);
                    runs.push(Run { from: begin, to: end, is_inside, missing: false });
                    begin = end;
                }
                // Missing values go with the first run that goes where they go; without one, apart.
                let with = runs.iter_mut().find(|run| run.is_inside == *missing_inside);
                let is_apart = match (reach.missing, with) {
                    (false, _) => false,
                    (true, Some(run)) => {
                        run.missing = true;
                        false
                    }
                    (true, None) => true,
                };
                let mut to = to;
                let mut copy = |out: &mut Writer, run: Run, place: usize| {
                    let Run { from, to, missing, is_inside } = run;
                    let child = if is_inside { *inside } else { *outside };
                    waiting.push((child, place, reaches.with(*feature, Reach { from, to, missing }), depth + 1));
                    out.check()
                };
                let too_large = || {
                    unsupported(
                        format!(
                            "tree {tree} splits by sets of categories of {:?} that lie so far apart that it would become \
                             {MAX_GROWTH} times as large",
                            name(sets)
                        ),
                        "Train with fewer categories in a set (XGBoost's and LightGBM's max_cat_threshold), less depth, or \
                         rarer categories put together; number categories that behave alike one after the other.",
                    )
                };
                if is_apart {
                    let [left, right] = [out.reserve(), out.reserve()];
                    let nothing = Threshold::below(f64::NEG_INFINITY);
                    let split =
                        DraftNode::Split { feature: *feature, threshold: nothing, missing_left: true, left, right };
                    out.put(to, split);
                    // No number is below minus infinity.
                    let none = Run { from: reach.from, to: reach.from, is_inside: *missing_inside, missing: true };
                    copy(&mut out, none, left).ok_or_else(too_large)?;
                    to = right;
                }
                // A search among the runs, in halves.
                let mut halves = vec![(0, runs.len(), to)];
                while let Some((first, last, place)) = halves.pop() {
                    let own = &runs[first..last];
                    if let [run] = own {
                        copy(&mut out, *run, place).ok_or_else(too_large)?;
                        continue;
                    }
                    let middle = first + own.len() / 2;
                    let missing_left = runs[first..middle].iter().any(|run| run.missing);
                    let [left, right] = [out.reserve(), out.reserve()];
                    let threshold = threshold(runs[middle].from);
                    out.put(place, DraftNode::Split { feature: *feature, threshold, missing_left, left, right });
                    halves.extend([(middle, last, right), (first, middle, left)]);
                }
            }
        }
        out.check()
            .ok_or_else(|| unsupported(format!("tree {tree} has nodes without end"), "Save the model again."))?;
    }
    Ok(out.nodes)
}

#[derive(Clone, Copy)]
struct Run {
    from: f64,
    to: f64,
    is_inside: bool,
    missing: bool,
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

struct Writer {
    nodes: Vec<DraftNode>,
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

    fn check(&self) -> Option<()> {
        (self.nodes.len() <= self.most).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::import::draft::{Draft, DraftTree};
    use crate::ensemble::{Ensemble, Output};

    fn ensemble(nodes: Vec<DraftNode>) -> Ensemble {
        let trees = vec![DraftTree { nodes, output: Output::One(0) }];
        let features = vec!["kind".into(), "size".into()];
        Draft { features, base: vec![0.0], trees, ..Draft::default() }.finish(None).unwrap()
    }

    fn set(feature: usize, set: &Set, missing_inside: bool, inside: usize, outside: usize) -> DraftNode {
        DraftNode::Set { feature, set: set.clone(), missing_inside, inside, outside }
    }

    fn leaf(value: f64) -> DraftNode {
        DraftNode::Leaf(vec![value])
    }

    #[test]
    fn a_set_holds_the_values_that_truncate_to_its_categories_and_no_other_f32() {
        for truncates in [false, true] {
            let categories = [0_u32, 1, 3, 7, 8, 9, (1 << 24) - 1, 1 << 24, (1 << 24) + 2];
            let own = Set::of_categories(categories, truncates).unwrap();
            for missing in [false, true] {
                let ensemble = ensemble(vec![set(0, &own, missing, 1, 2), leaf(1.0), leaf(2.0)]);
                let mut values = vec![f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0, -0.5, -1.0, -1.5];
                for category in 0..12 {
                    let category = category as f32;
                    values.extend([category, category.next_down(), category.next_up(), category + 0.5]);
                }
                values.extend((-4..6).map(|step| (16_777_216 + step) as f32));
                for x in values {
                    let below = if truncates { -1.0 } else { 0.0_f32.next_down() };
                    let category = f64::from(x).trunc();
                    let is_inside = x > below && categories.iter().any(|own| f64::from(*own) == category);
                    let expected = if is_inside { 1.0 } else { 2.0 };
                    assert_eq!(ensemble.margins_of_features(&[x, 0.0]), [expected], "{x:e}, {truncates}");
                }
                let expected = if missing { 1.0 } else { 2.0 };
                assert_eq!(ensemble.margins_of_features(&[f32::NAN, 0.0]), [expected]);
            }
        }
    }

    #[test]
    fn sets_under_sets_and_thresholds_decide_as_the_tree_of_the_file_for_every_category_and_missing_values() {
        let sets = [
            Set::of_categories([0, 2, 3, 6], false).unwrap(),
            Set::of_categories([1, 2, 5, 6], true).unwrap(),
            Set::of_categories([], false).unwrap(),
            Set::of_numbers(vec![-3, 2, 3, 4]),
            Set::of_categories([0, 3, 7], false).unwrap().and_beyond(8.0),
        ];
        for first in &sets {
            for (second, missing) in sets.iter().flat_map(|set| [0, 1, 2, 3].map(|bits| (set, bits))) {
                let [of_first, of_second] = [missing & 1 != 0, missing & 2 != 0];
                let size = DraftNode::Split {
                    feature: 1,
                    threshold: Threshold::at_or_below(0.5),
                    missing_left: true,
                    left: 3,
                    right: 4,
                };
                let nodes = vec![
                    set(0, first, of_first, 1, 2),
                    size,
                    set(0, second, of_second, 5, 6),
                    set(0, second, of_second, 7, 8),
                    leaf(1.0),
                    leaf(2.0),
                    leaf(3.0),
                    leaf(4.0),
                    leaf(5.0),
                ];
                let ensemble = ensemble(nodes);
                let is_inside = |set: &Set, missing: bool, x: f32| match x.is_nan() {
                    true => missing,
                    false => (set.ends.iter().filter(|end| **end <= f64::from(x)).count() % 2 == 1) != set.begins,
                };
                for kind in (-10..20).map(|half| half as f32 / 2.0).chain([f32::NAN]) {
                    for size in [0.0, 1.0, f32::NAN] {
                        let [a, b] = [is_inside(first, of_first, kind), is_inside(second, of_second, kind)];
                        let expected = match (a, size > 0.5, b) {
                            (true, true, _) => 1.0,
                            (false, _, true) => 2.0,
                            (false, _, false) => 3.0,
                            (true, false, true) => 4.0,
                            (true, false, false) => 5.0,
                        };
                        assert_eq!(ensemble.margins_of_features(&[kind, size]), [expected], "{kind}, {size}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_tree_that_would_grow_without_end_is_refused_by_its_feature() {
        // Sets of every other category, of features of their own so that nothing is known of them.
        let every_other = Set::of_categories((0..200).map(|number| 2 * number), false).unwrap();
        let mut nodes = Vec::new();
        for feature in 0..6 {
            let inside = nodes.len() + 1;
            nodes.push(set(feature, &every_other, false, inside, 6));
        }
        nodes.push(leaf(1.0));
        let error = spelled_out(nodes, 3, |feature| format!("f{feature}")).unwrap_err().to_string();
        assert!(error.contains("tree 3") && error.contains("\"f0\"") && error.contains("64 times"), "{error}");
    }
}
