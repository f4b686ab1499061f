//! Rows whose margins come near their bounds, found by changing one feature at a time.

use super::boxes::{Rule, Step, Tree};
use super::format::Plain;
use std::collections::BTreeSet;

/// Values of a feature that are tried, and rows that a search begins with.
const VALUES: usize = 48;
const STARTS: u64 = 2;

/// A feature of a row; `None` where it is missing.
type Key = Option<i64>;

/// For each output, the least and the largest margin that a search found: among the cells, for a table.
pub(super) fn found(plain: &Plain) -> Vec<(f64, f64)> {
    if let Some(cells) = &plain.cells {
        let of = |output: usize| {
            let own = cells.iter().map(|(_, margins)| margins[output]);
            own.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), own| (a.min(own), b.max(own)))
        };
        return (0..plain.names.len()).map(of).collect();
    }
    let values = values(plain);
    (0..plain.names.len())
        .map(|output| {
            let trees: Vec<&Tree> = plain
                .trees
                .iter()
                .map(|tree| &tree.0)
                .filter(|tree| tree.object.is_none_or(|own| own == output))
                .collect();
            let margin =
                |row: &[Key]| plain.base[output] + trees.iter().map(|tree| leaf(tree, output, row)).sum::<f64>();
            let ends = [-1.0, 1.0].map(|sign| sign * largest(&values, &|row| sign * margin(row)));
            (ends[0], ends[1])
        })
        .collect()
}

/// The largest margin that is found, each row being changed as long as that helps.
fn largest(values: &[Vec<Key>], margin: &dyn Fn(&[Key]) -> f64) -> f64 {
    let mut most = f64::NEG_INFINITY;
    for start in 0..STARTS {
        let first = |own: &Vec<Key>| own[(own.len() as u64 * start / STARTS) as usize];
        let mut row: Vec<Key> = values.iter().map(first).collect();
        let mut best = margin(&row);
        for _ in 0..4 {
            let before = best;
            for (feature, own) in values.iter().enumerate() {
                let mut kept = row[feature];
                for &value in own {
                    row[feature] = value;
                    let found = margin(&row);
                    if found > best {
                        (best, kept) = (found, value);
                    }
                }
                row[feature] = kept;
            }
            if best == before {
                break;
            }
        }
        most = most.max(best);
    }
    most
}

/// Values to try of each feature: a missing one, and some between thresholds.
fn values(plain: &Plain) -> Vec<Vec<Key>> {
    let mut cuts: Vec<BTreeSet<i64>> = vec![BTreeSet::new(); plain.features];
    for step in plain.trees.iter().flat_map(|(tree, _)| &tree.nodes) {
        if let Step::Split(Rule { feature, cut, .. }, _) = step
            && let Some(own) = cuts.get_mut(*feature)
        {
            own.insert(*cut);
        }
    }
    let all = plain.keys.all(plain.features);
    let of = |(cuts, all): (BTreeSet<i64>, &super::boxes::Values)| {
        let between = std::iter::once(all.low).chain(cuts.into_iter().filter(|cut| (all.low..=all.high).contains(cut)));
        let between: Vec<i64> = between.collect();
        let some = |index: usize| between[index * between.len() / VALUES.min(between.len())];
        let some = (0..VALUES.min(between.len())).map(some);
        // A key that stands for a missing value does not count.
        let known = |key: &i64| plain.sentinel.is_none_or(|[low, high]| !(low..=high).contains(key));
        some.filter(known).map(Some).chain([None]).collect()
    };
    cuts.into_iter().zip(&all).map(of).collect()
}

/// The value of the leaf that a row reaches.
fn leaf(tree: &Tree, output: usize, row: &[Key]) -> f64 {
    let mut at = 0;
    loop {
        match &tree.nodes[at] {
            Step::Leaf(values) => return values[if tree.object.is_some() { 0 } else { output }],
            Step::Split(rule, children) => {
                let left = match row.get(rule.feature).copied().flatten() {
                    Some(key) => key < rule.cut,
                    None => rule.missing_left,
                };
                at = children[usize::from(!left)];
            }
        }
    }
}
