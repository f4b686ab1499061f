//! The parts of XGBoost's JSON model schema that are used.

use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// XGBoost's value for "no such node" in a one-output tree's `parents`.
pub(super) const NO_PARENT: i64 = i32::MAX as i64;
/// XGBoost's split condition of a node that has none, in a multi-output tree: the smallest subnormal.
pub(super) const NO_CONDITION: f32 = f32::from_bits(1);

#[derive(Serialize, Deserialize)]
pub(super) struct Document {
    pub(super) learner: Learner,
    pub(super) version: [u32; 3],
}

#[derive(Serialize, Deserialize)]
pub(super) struct Learner {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, String>,
    #[serde(default)]
    pub(super) feature_names: Vec<String>,
    #[serde(default)]
    pub(super) feature_types: Vec<String>,
    pub(super) gradient_booster: GradientBooster,
    pub(super) learner_model_param: LearnerParameters,
    pub(super) objective: Objective,
}

#[derive(Serialize, Deserialize)]
pub(super) struct GradientBooster {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<Forest>,
    pub(super) name: String,
    /// The booster that holds the trees, for dart up to 3.2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) gbtree: Option<Box<GradientBooster>>,
    /// Weights of dart up to 3.3; later versions have them in the model.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_floats")]
    pub(super) weight_drop: Option<Vec<f32>>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Forest {
    /// The names of categories, since 3.1: a form of its own is no reason to refuse a model.
    #[serde(default, skip_serializing)]
    pub(super) cats: serde_json::Value,
    pub(super) gbtree_model_param: ForestParameters,
    #[serde(default)]
    pub(super) iteration_indptr: Vec<u64>,
    pub(super) tree_info: Vec<u64>,
    pub(super) trees: Vec<TreeColumns>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_floats")]
    pub(super) weight_drop: Option<Vec<f32>>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct ForestParameters {
    #[serde(default)]
    pub(super) num_parallel_tree: String,
    pub(super) num_trees: String,
}

#[derive(Serialize, Deserialize)]
pub(super) struct LearnerParameters {
    pub(super) base_score: String,
    #[serde(default)]
    pub(super) boost_from_average: String,
    #[serde(default)]
    pub(super) num_class: String,
    pub(super) num_feature: String,
    #[serde(default)]
    pub(super) num_target: String,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Objective {
    pub(super) name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) softmax_multiclass_param: Option<SoftmaxParameters>,
    #[serde(default, skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub(super) reg_loss_param: Option<LossParameters>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct SoftmaxParameters {
    pub(super) num_class: String,
}

/// Loss parameters of binary models and regressions.
#[derive(Serialize)]
pub(super) struct LossParameters {
    pub(super) scale_pos_weight: String,
}

/// A tree as XGBoost stores it: one array per property, indexed by node.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct TreeColumns {
    #[serde(deserialize_with = "floats")]
    pub(super) base_weights: Vec<f32>,
    #[serde(default)]
    pub(super) categories: Vec<i64>,
    #[serde(default)]
    pub(super) categories_nodes: Vec<i64>,
    #[serde(default)]
    pub(super) categories_segments: Vec<i64>,
    #[serde(default)]
    pub(super) categories_sizes: Vec<i64>,
    pub(super) default_left: Vec<Flag>,
    pub(super) id: u64,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_floats")]
    pub(super) leaf_weights: Option<Vec<f32>>,
    pub(super) left_children: Vec<i64>,
    #[serde(default, skip_deserializing)]
    pub(super) loss_changes: Vec<f32>,
    #[serde(default, skip_deserializing)]
    pub(super) parents: Vec<i64>,
    pub(super) right_children: Vec<i64>,
    #[serde(deserialize_with = "floats")]
    pub(super) split_conditions: Vec<f32>,
    pub(super) split_indices: Vec<u64>,
    #[serde(default)]
    pub(super) split_type: Vec<u8>,
    #[serde(default, skip_deserializing)]
    pub(super) sum_hessian: Vec<f32>,
    pub(super) tree_param: TreeParameters,
}

#[derive(Default, Serialize, Deserialize)]
pub(super) struct TreeParameters {
    pub(super) num_deleted: String,
    pub(super) num_feature: String,
    pub(super) num_nodes: String,
    pub(super) size_leaf_vector: String,
}

/// Numbers; those that JSON cannot write are null.
fn floats<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f32>, D::Error> {
    let numbers = Vec::<Option<f32>>::deserialize(deserializer)?;
    Ok(numbers.into_iter().map(|number| number.unwrap_or(f32::NAN)).collect())
}

fn optional_floats<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<f32>>, D::Error> {
    floats(deserializer).map(Some)
}

/// A truth value: a number since XGBoost 1.6, `true` or `false` before.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Flag {
    Number(u8),
    Word(bool),
}

impl Flag {
    pub(super) fn is_set(self) -> bool {
        match self {
            Self::Number(number) => number != 0,
            Self::Word(word) => word,
        }
    }
}
