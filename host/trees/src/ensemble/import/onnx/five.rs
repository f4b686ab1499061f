//! `TreeEnsemble` of `ai.onnx.ml` 5: splits and leaves in lists of their own, by position.

use super::wire::Node;
use super::{Draft, Targeted, add_tree, comparison, damaged, divisor, index, list, outputs};
use crate::ensemble::Probability;
use crate::error::Result;
use palpate_shared::format::Link;

/// The modes' names, by their codes.
const MODES: [&str; 7] = ["LEQ", "LT", "GTE", "GT", "EQ", "NEQ", "MEMBER"];
/// The names of what may be done to the sums, by their codes.
const TRANSFORMS: [&str; 5] = ["NONE", "SOFTMAX", "LOGISTIC", "SOFTMAX_ZERO", "PROBIT"];
/// The aggregate functions' names, by their codes.
const AGGREGATES: [&str; 4] = ["AVERAGE", "SUM", "MIN", "MAX"];

/// Reads the trees into `draft`; returns the number of features that they use, counted to the last.
pub(super) fn read(node: &Node<'_>, draft: &mut Draft) -> Result<usize> {
    let integer = |name: &str| node.attributes.get(name).and_then(|attribute| attribute.integer);
    let integers = |name: &str, wanted: Option<usize>| list(node, name, wanted, |attribute| &attribute.integers);
    let numbers = |name: &str, wanted: Option<usize>| list(node, name, wanted, |attribute| &attribute.numbers);
    let features = integers("nodes_featureids", None)?;
    let count = features.len();
    let values = numbers("nodes_splits", Some(count))?;
    let modes = integers("nodes_modes", Some(count))?;
    let (trues, falses) = (integers("nodes_truenodeids", Some(count))?, integers("nodes_falsenodeids", Some(count))?);
    let (true_leaves, false_leaves) =
        (integers("nodes_trueleafs", Some(count))?, integers("nodes_falseleafs", Some(count))?);
    let tracks = integers("nodes_missing_value_tracks_true", None)?;
    if !tracks.is_empty() && tracks.len() != count {
        return Err(damaged(format!("nodes_missing_value_tracks_true has {} entries for {count} nodes", tracks.len())));
    }
    let targets = integers("leaf_targetids", None)?;
    let weights = numbers("leaf_weights", Some(targets.len()))?;
    let roots = integers("tree_roots", None)?;
    let wanted = outputs(integer("n_targets").unwrap_or(1))?;
    draft.base = vec![0.0; wanted];
    if wanted > 1 {
        draft.notes.push("The file does not say what its outputs are: they are taken for classes.".into());
        draft.probability = Probability::Unknown;
    }
    // Of one output a value; of classes margins are those before it.
    match integer("post_transform").and_then(|code| usize::try_from(code).ok()).unwrap_or(0) {
        0 => {}
        2 if wanted == 1 => draft.prediction.link = Link::Logistic,
        code => {
            let name = TRANSFORMS.get(code).copied().unwrap_or("unknown");
            draft.notes.push(format!("The file's post_transform is {name}: margins are those before it."));
        }
    }
    let aggregate = usize::try_from(integer("aggregate_function").unwrap_or(1)).ok();
    let aggregate = aggregate.and_then(|code| AGGREGATES.get(code)).copied().unwrap_or("unknown function");
    let divisor = divisor(aggregate, roots.len())?;
    let mut most = 0;
    // Splits first, then a leaf for each side of each split: a leaf may be that of several sides.
    let mut seen = vec![false; 3 * count];
    for &root in roots {
        add_tree(draft, index(root, "a tree's root")?, &mut seen, |at| {
            if let Some(side) = at.checked_sub(count) {
                let leaf = index(if side % 2 == 0 { trues[side / 2] } else { falses[side / 2] }, "a leaf's number")?;
                let (Some(&target), Some(&weight)) = (targets.get(leaf), weights.get(leaf)) else {
                    return Err(damaged(format!("there is no leaf {leaf}")));
                };
                let target = index(target, "a target's number")?;
                if target >= wanted {
                    return Err(damaged(format!("a leaf is for output {target} of {wanted}")));
                }
                return Ok(Targeted::Leaf(vec![(target, weight / divisor)]));
            }
            let child = |is_leaf: i64, number: i64, side: usize| {
                if is_leaf != 0 {
                    return Ok(count + 2 * at + side);
                }
                let number = index(number, "a node's number")?;
                if number < count { Ok(number) } else { Err(damaged(format!("there is no node {number}"))) }
            };
            let mode = usize::try_from(modes[at]).ok().and_then(|code| MODES.get(code)).copied().unwrap_or("unknown");
            let missing_is_true = tracks.get(at).is_some_and(|&flag| flag != 0);
            let comparison = comparison(mode, values[at], missing_is_true)?;
            let branches = [child(true_leaves[at], trues[at], 0)?, child(false_leaves[at], falses[at], 1)?];
            let feature = index(features[at], "a feature's number")?;
            most = most.max(feature.saturating_add(1));
            Ok(comparison.split(feature, branches))
        })?;
    }
    Ok(most)
}
