//! `TreeEnsembleClassifier` and `TreeEnsembleRegressor`: lists of nodes that name their tree and themselves.

use super::wire::Node;
use super::{Draft, Targeted, add_tree, comparison, damaged, divisor, index, list, outputs};
use crate::ensemble::Probability;
use crate::ensemble::import::options::one_class;
use crate::error::Result;
use palpate_shared::format::Link;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Reads the trees into `draft`; returns the number of features that they use, counted to the last.
pub(super) fn read(node: &Node<'_>, draft: &mut Draft) -> Result<usize> {
    let integers = |name: &str, wanted: Option<usize>| list(node, name, wanted, |attribute| &attribute.integers);
    let ids = integers("nodes_nodeids", None)?;
    let count = ids.len();
    let trees = integers("nodes_treeids", Some(count))?;
    let features = integers("nodes_featureids", Some(count))?;
    let trues = integers("nodes_truenodeids", Some(count))?;
    let falses = integers("nodes_falsenodeids", Some(count))?;
    let tracks = integers("nodes_missing_value_tracks_true", None)?;
    let modes = list(node, "nodes_modes", Some(count), |attribute| &attribute.texts)?;
    let values = numbers(node, "nodes_values", Some(count))?;
    if !tracks.is_empty() && tracks.len() != count {
        return Err(damaged(format!("nodes_missing_value_tracks_true has {} entries for {count} nodes", tracks.len())));
    }
    let places: HashMap<(i64, i64), usize> = trees.iter().copied().zip(ids.iter().copied()).zip(0..).collect();
    if places.len() != count {
        return Err(damaged("two nodes of a tree have the same number"));
    }
    let mut weights = Weights::read(node, draft)?;
    // The root of a tree is the node without a parent.
    let mut roots: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    let is_leaf = |position: usize| modes[position] == "LEAF";
    let splits = (0..count).filter(|&position| !is_leaf(position));
    let children: BTreeSet<(i64, i64)> =
        splits.flat_map(|at| [(trees[at], trues[at]), (trees[at], falses[at])]).collect();
    let mut order = Vec::new();
    for position in 0..count {
        let roots = roots.entry(trees[position]).or_insert_with(|| {
            order.push(trees[position]);
            Vec::new()
        });
        if !children.contains(&(trees[position], ids[position])) {
            roots.push(position);
        }
    }
    let divisor = divisor(text(node, "aggregate_function").unwrap_or("SUM"), order.len())?;
    weights.divide(divisor);
    weights.complete(draft, order.len());
    let mut most = 0;
    let mut seen = vec![false; count];
    for tree in order {
        let [root] = roots[&tree][..] else {
            return Err(damaged(format!("tree {tree} has {} roots", roots[&tree].len())));
        };
        add_tree(draft, root, &mut seen, |at| {
            if is_leaf(at) {
                return Ok(Targeted::Leaf(weights.leaf(trees[at], ids[at])));
            }
            let child = |id: i64| {
                let place = places.get(&(tree, id)).copied();
                place.ok_or_else(|| damaged(format!("tree {tree}: there is no node {id}")))
            };
            let mode = modes[at].strip_prefix("BRANCH_").unwrap_or(modes[at]);
            let missing_is_true = tracks.get(at).is_some_and(|&flag| flag != 0);
            let comparison = comparison(mode, values[at], missing_is_true)?;
            let branches = [child(trues[at])?, child(falses[at])?];
            let feature = index(features[at], "a feature's number")?;
            most = most.max(feature.saturating_add(1));
            Ok(comparison.split(feature, branches))
        })?;
    }
    Ok(most)
}

/// Leaves' values by tree and node, for the outputs of the draft.
struct Weights {
    of: HashMap<(i64, i64), Vec<(usize, f64)>>,
    /// True if leaves hold shares of votes for the second of two classes.
    votes: bool,
    /// Sum of a tree's votes for both classes, if leaves are to have those for the first one too.
    all: Option<f64>,
}

impl Weights {
    /// Reads leaves' values, what margins start from, and the names of classes.
    fn read(node: &Node<'_>, draft: &mut Draft) -> Result<Self> {
        let is_classifier = node.operation == "TreeEnsembleClassifier";
        let prefix = if is_classifier { "class" } else { "target" };
        let integers = |name: &str, wanted| list(node, &format!("{prefix}_{name}"), wanted, |a| &a.integers);
        let targets = integers("ids", None)?;
        let count = targets.len();
        let (trees, nodes) = (integers("treeids", Some(count))?, integers("nodeids", Some(count))?);
        let values = numbers(node, &format!("{prefix}_weights"), Some(count))?;
        let base = numbers(node, "base_values", None)?;
        let transform = text(node, "post_transform").unwrap_or("NONE");
        let map: Map = if is_classifier {
            classes(node, draft, targets, values, base, transform)?
        } else {
            let wanted =
                outputs(node.attributes.get("n_targets").and_then(|attribute| attribute.integer).unwrap_or(1))?;
            draft.prediction.targets = wanted > 1;
            draft.base = match base {
                [] => vec![0.0; wanted],
                each if each.len() == wanted => each.to_vec(),
                _ => {
                    let targets = if wanted == 1 { "1 target".into() } else { format!("{wanted} targets") };
                    return Err(damaged(format!("base_values has {} numbers for {targets}", base.len())));
                }
            };
            match transform {
                "NONE" => {}
                "LOGISTIC" => draft.prediction.link = Link::Logistic,
                other => draft.notes.push(format!("The file's post_transform is {other}: values are those before it.")),
            }
            Map::Same
        };
        let outputs = draft.base.len();
        let mut of: HashMap<(i64, i64), Vec<(usize, f64)>> = HashMap::new();
        for (((&tree, &node), &target), &value) in trees.iter().zip(nodes).zip(targets).zip(values) {
            let slot = of.entry((tree, node)).or_default();
            match map {
                Map::Same => {
                    let target = index(target, "a target's number")?;
                    if target >= outputs {
                        return Err(damaged(format!("a leaf is for output {target} of {outputs}")));
                    }
                    slot.push((target, value));
                }
                Map::Second | Map::Votes => slot.push((1, value)),
            }
        }
        Ok(Self { of, votes: matches!(map, Map::Votes), all: None })
    }

    /// Gives leaves the votes for the first class as well. If a tree's votes can be identified, margins are shares of all trees'
    /// votes from 0 on; otherwise those of the first class start from 1.
    fn complete(&mut self, draft: &mut Draft, trees: usize) {
        if !self.votes {
            return;
        }
        let all = 1.0 / trees.max(1) as f64;
        let shares = || self.of.values().map(|values| values.iter().map(|(_, value)| value).sum::<f64>());
        if draft.base.iter().all(|&base| base == 0.0) && shares().all(|share| share <= all * (1.0 + 1e-6)) {
            self.all = Some(all);
        } else {
            draft.base[0] = 1.0 - draft.base[1];
        }
    }

    /// Values that a leaf adds to each output that it names.
    fn leaf(&mut self, tree: i64, node: i64) -> Vec<(usize, f64)> {
        let mut values = self.of.remove(&(tree, node)).unwrap_or_default();
        if self.votes {
            let second: f64 = values.iter().map(|(_, value)| value).sum();
            let first = self.all.map_or(-second, |all| (all - second).max(0.0));
            values = vec![(0, first), (1, second)];
        }
        values
    }

    fn divide(&mut self, divisor: f64) {
        self.of.values_mut().flatten().for_each(|(_, value)| *value /= divisor);
    }
}

/// Assignment of a leaf's value to an output.
#[derive(Clone, Copy)]
enum Map {
    /// The one that it names.
    Same,
    /// Log-odds of the second of two classes, for which the file has one number.
    Second,
    /// Share of votes for the second of two classes.
    Votes,
}

fn classes(
    node: &Node<'_>,
    draft: &mut Draft,
    targets: &[i64],
    weights: &[f64],
    base: &[f64],
    transform: &str,
) -> Result<Map> {
    let texts = list(node, "classlabels_strings", None, |attribute| &attribute.texts)?;
    let numbers = list(node, "classlabels_int64s", None, |attribute| &attribute.integers)?;
    let texts = texts.iter().map(ToString::to_string);
    draft.names = texts.chain(numbers.iter().map(ToString::to_string)).collect();
    let classes = outputs(draft.names.len() as i64)?;
    if classes == 1 {
        return Err(one_class());
    }
    let named: BTreeSet<i64> = targets.iter().copied().collect();
    let is_votes = transform == "NONE" && weights.iter().all(|&weight| weight >= 0.0);
    draft.probability = match transform {
        _ if is_votes => Probability::Shares,
        "LOGISTIC" if named.len() > 1 => Probability::Logistic,
        "SOFTMAX" | "LOGISTIC" => Probability::Softmax,
        _ => Probability::Unknown,
    };
    if classes == 2 && named.len() == 1 {
        let base = match base {
            [] => 0.0,
            [base] => *base,
            _ => return Err(damaged("base_values has two numbers, but leaves are for one class")),
        };
        draft.base = vec![0.0, base];
        return Ok(if is_votes { Map::Votes } else { Map::Second });
    }
    draft.base = match base {
        [] => vec![0.0; classes],
        [one] => vec![*one; classes],
        each if each.len() == classes => each.to_vec(),
        _ => return Err(damaged(format!("base_values has {} numbers for {classes} classes", base.len()))),
    };
    Ok(Map::Same)
}

/// f32 numbers, or those of the attribute's double of this name.
fn numbers<'n>(node: &'n Node<'_>, name: &str, wanted: Option<usize>) -> Result<&'n [f64]> {
    let double = format!("{name}_as_tensor");
    let name = if node.attributes.contains_key(double.as_str()) { &double } else { name };
    list(node, name, wanted, |attribute| &attribute.numbers)
}

fn text<'n>(node: &'n Node<'_>, name: &str) -> Option<&'n str> {
    node.attributes.get(name).and_then(|attribute| attribute.text)
}
