//! From an ensemble to XGBoost's schema.

use super::schema::{
    Document, Flag, Forest, ForestParameters, GradientBooster, Learner, LearnerParameters, NO_CONDITION, NO_PARENT,
    Objective, SoftmaxParameters, TreeColumns, TreeParameters,
};
use crate::ensemble::{Ensemble, Node, Origin, Output, Tree};
use palpate_shared::Descriptor;
use std::collections::BTreeMap;

impl Document {
    /// The document of an ensemble that [`Ensemble::check`] accepts.
    pub(super) fn new(ensemble: &Ensemble, descriptor: Descriptor) -> Self {
        let objects = ensemble.objects.len();
        let features = descriptor.feature_count();
        let trees = &ensemble.trees;
        let num_class = objects.to_string();
        Self {
            learner: Learner {
                attributes: attributes(descriptor, &ensemble.objects, &ensemble.origin),
                feature_names: Vec::new(),
                feature_types: Vec::new(),
                gradient_booster: GradientBooster {
                    model: Some(Forest {
                        gbtree_model_param: ForestParameters {
                            num_parallel_tree: "1".into(),
                            num_trees: trees.len().to_string(),
                        },
                        iteration_indptr: rounds(ensemble),
                        tree_info: trees.iter().map(|tree| group(tree.output)).collect(),
                        trees: trees.iter().zip(0..).map(|(tree, id)| columns(tree, id, features, objects)).collect(),
                        weight_drop: None,
                    }),
                    name: "gbtree".into(),
                    gbtree: None,
                    weight_drop: None,
                },
                learner_model_param: LearnerParameters {
                    base_score: base_score(&ensemble.base_margins),
                    boost_from_average: "0".into(),
                    num_class: num_class.clone(),
                    num_feature: features.to_string(),
                    num_target: "1".into(),
                },
                objective: Objective {
                    name: "multi:softprob".into(),
                    softmax_multiclass_param: Some(SoftmaxParameters { num_class }),
                },
            },
            // The schema that every reader since knows; newer readers take what 2.1 wrote.
            version: [2, 1, 4],
        }
    }
}

pub(super) fn attributes(descriptor: Descriptor, objects: &[String], origin: &Origin) -> BTreeMap<String, String> {
    let names = serde_json::Value::from(objects.to_vec()).to_string();
    let mut attributes = BTreeMap::from([
        ("palpate_descriptor".to_owned(), descriptor.name().to_owned()),
        ("palpate_objects".into(), names),
    ]);
    // Numbers and strings are always JSON.
    if let Some(probe) = origin.probe.and_then(|probe| serde_json::to_string(&probe).ok()) {
        attributes.insert("palpate_probe".into(), probe);
    }
    if let Some(trained) = origin.trained.and_then(|trained| serde_json::to_string(&trained).ok()) {
        attributes.insert("palpate_trained".into(), trained);
    }
    if let Some(noise) = origin.noise.and_then(|noise| serde_json::to_string(&noise).ok()) {
        attributes.insert("palpate_noise".into(), noise);
    }
    if origin.background {
        attributes.insert("palpate_background".into(), "true".into());
    }
    if !origin.touches.is_empty() {
        let hexadecimal = origin.touches.iter().map(|(name, fingerprint)| (name, format!("{fingerprint:016x}")));
        if let Ok(touches) = serde_json::to_string(&hexadecimal.collect::<BTreeMap<_, _>>()) {
            attributes.insert("palpate_touches".into(), touches);
        }
    }
    attributes
}

/// Where each boosting round's trees begin and end: one tree for each object in order, or one tree for all.
fn rounds(ensemble: &Ensemble) -> Vec<u64> {
    let in_order = |(index, tree): (usize, &Tree)| tree.output == Output::One(index % ensemble.objects.len());
    let per_round = if ensemble.trees.iter().enumerate().all(in_order) { ensemble.objects.len() } else { 1 };
    (0..=ensemble.trees.len()).step_by(per_round).filter_map(|tree| u64::try_from(tree).ok()).collect()
}

fn group(output: Output) -> u64 {
    match output {
        Output::One(object) => u64::try_from(object).unwrap_or(u64::MAX),
        Output::Each => 0,
    }
}

/// One number where all margins start equal (every version reads that), else a list.
fn base_score(margins: &[f32]) -> String {
    match margins {
        [first, rest @ ..] if rest.iter().all(|margin| margin.to_bits() == first.to_bits()) => format!("{first:E}"),
        _ => format!("[{}]", margins.iter().map(|margin| format!("{margin:E}")).collect::<Vec<_>>().join(",")),
    }
}

fn columns(tree: &Tree, id: u64, features: usize, objects: usize) -> TreeColumns {
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
                for child in [*left, *right] {
                    columns.parents[child] = index(position);
                }
                columns.left_children.push(index(*left));
                columns.right_children.push(index(*right));
                columns.split_indices.push(u64::try_from(*feature).unwrap_or(u64::MAX));
                columns.split_conditions.push(*threshold);
                columns.default_left.push(Flag::Number(u8::from(*missing_left)));
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
