//! From an ensemble to XGBoost's schema.

use super::outputs::Outputs;
use super::read::StatedRows;
use super::schema::{
    Document, Flag, Forest, ForestParameters, GradientBooster, Learner, LearnerParameters, NO_CONDITION, NO_PARENT,
    TreeColumns, TreeParameters,
};
use crate::ensemble::{Ensemble, Imported, Inputs, Node, Output, Probability, Provenance, Tree};
use palpate_shared::format::Prediction;
use std::borrow::Cow;
use std::collections::BTreeMap;

impl Document {
    /// The document of an ensemble that [`Ensemble::check`] accepts.
    pub(super) fn new(ensemble: &Ensemble) -> Self {
        let outputs = Outputs::of(ensemble);
        let trees = trees_of_one_kind(ensemble);
        // Rows have all columns there.
        let all = ensemble.origin.imported.as_ref().and_then(|imported| imported.columns.as_ref());
        let features = all.map_or(ensemble.inputs.count(), |all| all.names.len());
        let column = |feature: usize| all.map_or(Some(feature), |all| all.used.get(feature).copied());
        let feature_names = match (&ensemble.inputs, all) {
            (Inputs::Rows(_), Some(all)) if Inputs::has_names(&all.names) => all.names.clone(),
            (Inputs::Rows(names), None) if Inputs::has_names(names) => names.clone(),
            _ => Vec::new(),
        };
        Self {
            learner: Learner {
                attributes: attributes(&ensemble.inputs, &ensemble.objects, &ensemble.origin),
                feature_names,
                feature_types: Vec::new(),
                gradient_booster: GradientBooster {
                    model: Some(Forest {
                        cats: serde_json::Value::Null,
                        gbtree_model_param: ForestParameters {
                            num_parallel_tree: "1".into(),
                            num_trees: trees.len().to_string(),
                        },
                        iteration_indptr: rounds(&trees, &outputs),
                        tree_info: trees.iter().map(|tree| outputs.group(tree.output)).collect(),
                        trees: trees
                            .iter()
                            .zip(0..)
                            .map(|(tree, id)| columns(tree, id, (features, &column), outputs.groups))
                            .collect(),
                        weight_drop: None,
                    }),
                    name: "gbtree".into(),
                    gbtree: None,
                    weight_drop: None,
                },
                learner_model_param: LearnerParameters {
                    base_score: outputs.base_score,
                    boost_from_average: "0".into(),
                    num_class: outputs.num_class,
                    num_feature: features.to_string(),
                    num_target: outputs.num_target,
                },
                objective: outputs.objective,
            },
            // The schema that every reader since knows; newer readers take what 2.1 wrote.
            version: [2, 1, 4],
        }
    }
}

pub(super) fn attributes(inputs: &Inputs, objects: &[String], origin: &Provenance) -> BTreeMap<String, String> {
    let names = serde_json::Value::from(objects.to_vec()).to_string();
    let mut attributes = BTreeMap::from([("palpate_objects".to_owned(), names)]);
    if let Some(schema) = inputs.schema() {
        attributes.insert("palpate_descriptor".into(), schema.name.into());
    }
    if let Some(Imported { prediction, probability, sentinel, .. }) = &origin.imported
        && (*prediction != Prediction::default() || *probability != Probability::default() || sentinel.is_some())
    {
        let stated = StatedRows {
            link: prediction.link.name().into(),
            last_of_ties: prediction.last_of_ties,
            scale: prediction.scale,
            sentinel: sentinel.map(|ends| ends.map(|end| end.to_string())),
            average: prediction.average,
            probability: *probability,
        };
        if let Ok(text) = serde_json::to_string(&stated) {
            attributes.insert("palpate_prediction".into(), text);
        }
    }
    if origin.background {
        attributes.insert("palpate_background".into(), "true".into());
    }
    let others = origin.attributes.iter().map(|(name, text)| (name.clone(), text.clone()));
    attributes.extend(others);
    attributes
}

/// The trees, with a value for each object in every leaf if some tree has that: XGBoost has no models of both kinds. What
/// is added to the other objects then is 0.
fn trees_of_one_kind(ensemble: &Ensemble) -> Cow<'_, [Tree]> {
    let of_each = ensemble.trees.iter().filter(|tree| tree.output == Output::Each).count();
    if of_each == 0 || of_each == ensemble.trees.len() {
        return Cow::Borrowed(&ensemble.trees);
    }
    let widened = |tree: &Tree| {
        let Output::One(object) = tree.output else { return tree.clone() };
        let node = |node: &Node| match node {
            Node::Leaf(values) => {
                let own = |index: usize| if index == object { values[0] } else { 0.0 };
                Node::Leaf((0..ensemble.objects.len()).map(own).collect())
            }
            split => split.clone(),
        };
        Tree { nodes: tree.nodes.iter().map(node).collect(), output: Output::Each }
    };
    ensemble.trees.iter().map(widened).collect()
}

/// Begins and ends of boosting rounds among the trees: one tree for each group in order, or one tree for all.
fn rounds(trees: &[Tree], outputs: &Outputs) -> Vec<u64> {
    let groups = u64::try_from(outputs.groups).unwrap_or(1);
    let in_order =
        |(index, tree): (u64, &Tree)| tree.output != Output::Each && outputs.group(tree.output) == index % groups;
    let is_in_order = (0..).zip(trees).all(in_order) && trees.len().is_multiple_of(outputs.groups);
    let per_round = if is_in_order { outputs.groups } else { 1 };
    (0..=trees.len()).step_by(per_round).filter_map(|tree| u64::try_from(tree).ok()).collect()
}

fn columns(
    tree: &Tree,
    id: u64,
    (features, column): (usize, &dyn Fn(usize) -> Option<usize>),
    objects: usize,
) -> TreeColumns {
    let each = tree.output == Output::Each;
    let width = if each { objects } else { 1 };
    let nodes = tree.nodes.len();
    let index = |node: usize| i64::try_from(node).unwrap_or(i64::MAX);
    let mut columns = TreeColumns {
        id,
        loss_changes: vec![0.0; nodes],
        parents: vec![if each { -1 } else { NO_PARENT }; nodes],
        split_type: vec![0; nodes],
        sum_hessian: vec![0.0; nodes],
        leaf_weights: each.then(Vec::new),
        tree_param: TreeParameters {
            num_deleted: "0".into(),
            num_feature: features.to_string(),
            num_nodes: nodes.to_string(),
            size_leaf_vector: width.to_string(),
        },
        ..TreeColumns::default()
    };
    let mut leaves = 0;
    for (position, node) in tree.nodes.iter().enumerate() {
        match node {
            Node::Split { feature, threshold, missing_left, left, right } => {
                // JSON has no infinity. No finite number is below the least one, so all go right there, and as all are
                // below infinity, right has to be what was left.
                let swap = *threshold == f32::INFINITY;
                let (left, right) = if swap { (right, left) } else { (left, right) };
                let (missing_left, threshold) =
                    (*missing_left != swap, if swap { f32::MIN } else { threshold.max(f32::MIN) });
                for child in [*left, *right] {
                    columns.parents[child] = index(position);
                }
                columns.left_children.push(index(*left));
                columns.right_children.push(index(*right));
                let column = column(*feature).and_then(|column| u64::try_from(column).ok());
                columns.split_indices.push(column.unwrap_or(u64::MAX));
                columns.split_conditions.push(threshold);
                columns.default_left.push(Flag::Number(u8::from(missing_left)));
                columns.base_weights.extend(std::iter::repeat_n(0.0, width));
            }
            Node::Leaf(values) => {
                columns.left_children.push(-1);
                columns.right_children.push(if each { leaves } else { -1 });
                columns.split_indices.push(0);
                columns.split_conditions.push(if each { NO_CONDITION } else { values[0] });
                columns.default_left.push(Flag::Number(0));
                columns.base_weights.extend(values);
                columns.leaf_weights.iter_mut().for_each(|weights| weights.extend(values));
                leaves += 1;
            }
        }
    }
    columns
}
