//! CatBoost's JSON: `save_model("model.json", format="json")`, symmetric trees (`oblivious_trees`) and others (`trees`).
//!
//! A value goes right if it is above the border, in f32, and a category if it is the one of the split (one-hot).

use super::city;
use super::draft::{Draft, DraftTree};
use super::draft_node::DraftNode;
use super::options::CATEGORIES;
use super::set::Set;
use crate::ensemble::faults::{self, no_trees};
use crate::ensemble::{Ensemble, Output, Probability, Threshold};
use crate::error::{Error, Result, problem};
use palpate_shared::format::Link;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

/// CatBoost's own limit.
const MAX_DEPTH: usize = 16;

#[derive(Deserialize)]
struct Document {
    features_info: FeaturesInfo,
    #[serde(default)]
    model_info: ModelInfo,
    #[serde(default)]
    oblivious_trees: Vec<Oblivious>,
    #[serde(default)]
    trees: Vec<Branch>,
    #[serde(default)]
    scale_and_bias: Option<(f64, Bias)>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Bias {
    One(f64),
    Each(Vec<f64>),
}

#[derive(Deserialize)]
struct FeaturesInfo {
    #[serde(default)]
    float_features: Vec<FloatFeature>,
    #[serde(default)]
    categorical_features: Vec<OtherFeature>,
    #[serde(default)]
    text_features: Vec<OtherFeature>,
    #[serde(default)]
    embedding_features: Vec<OtherFeature>,
}

#[derive(Deserialize)]
struct FloatFeature {
    #[serde(default)]
    feature_id: String,
    flat_feature_index: usize,
    #[serde(default)]
    nan_value_treatment: String,
}

#[derive(Deserialize)]
struct OtherFeature {
    #[serde(default)]
    feature_id: String,
    #[serde(default)]
    flat_feature_index: usize,
}

#[derive(Default, Deserialize)]
struct ModelInfo {
    #[serde(default)]
    catboost_version_info: String,
    #[serde(default)]
    class_params: Value,
    #[serde(default)]
    params: Value,
    /// The probability from which on the second class is predicted, as a text.
    #[serde(default)]
    binclass_probability_threshold: Value,
}

#[derive(Deserialize)]
struct Oblivious {
    leaf_values: Vec<f64>,
    #[serde(default)]
    splits: Option<Vec<Split>>,
}

#[derive(Deserialize)]
struct Branch {
    split: Option<Split>,
    left: Option<Box<Branch>>,
    right: Option<Box<Branch>>,
    value: Option<OneOrEach>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrEach {
    One(f64),
    Each(Vec<f64>),
}

#[derive(Deserialize)]
struct Split {
    #[serde(default)]
    border: f64,
    float_feature_index: Option<usize>,
    cat_feature_index: Option<usize>,
    /// The hash of a category.
    value: Option<i32>,
    #[serde(default)]
    split_type: String,
}

impl Split {
    /// The hash of the category that it asks for, if it is of categories.
    fn hash(&self) -> Option<u32> {
        self.value.filter(|_| self.split_type == ONE_HOT).map(i32::cast_unsigned)
    }
}

const ONE_HOT: &str = "OneHotFeature";

/// A split of a tree: by a border, or by whether a value is of these numbers.
enum Test {
    Border(Threshold, bool),
    Numbers(Vec<i32>),
}

impl Test {
    /// The split of a feature.
    fn node(&self, feature: usize, [left, right]: [usize; 2]) -> DraftNode {
        match self {
            &Self::Border(threshold, missing_left) => {
                DraftNode::Split { feature, threshold, missing_left, left, right }
            }
            Self::Numbers(numbers) => DraftNode::Set {
                feature,
                set: Set::of_numbers(numbers.clone()),
                missing_inside: false,
                inside: right,
                outside: left,
            },
        }
    }
}

fn damaged(what: impl Display) -> Error {
    faults::damaged("CatBoost JSON", what)
}

/// Reads CatBoost's JSON.
pub(super) fn read(bytes: &[u8], names: Option<&[String]>) -> Result<Ensemble> {
    let document: Document = serde_json::from_slice(bytes).map_err(damaged)?;
    let info = &document.features_info;
    let others = [&info.categorical_features, &info.text_features, &info.embedding_features];
    let others = others.into_iter().flatten();
    let of_floats = info.float_features.iter().map(|feature| (feature.flat_feature_index, &feature.feature_id));
    let all: Vec<(usize, &String)> =
        of_floats.chain(others.map(|feature| (feature.flat_feature_index, &feature.feature_id))).collect();
    let mut features = vec![String::new(); all.len()];
    for (index, name) in &all {
        let slot = features.get_mut(*index);
        let slot = slot.ok_or_else(|| damaged(format!("feature {index} of {}", all.len())))?;
        // A name that is only the feature's number does not count.
        *slot = if **name == index.to_string() { String::new() } else { name.to_string() };
    }
    let (scale, bias) = match document.scale_and_bias {
        None => (1.0, vec![0.0]),
        Some((scale, Bias::One(bias))) => (scale, vec![bias]),
        Some((scale, Bias::Each(bias))) => (scale, bias),
    };
    let loss = document.model_info.params.pointer("/loss_function/type").and_then(Value::as_str).unwrap_or_default();
    let classes = class_names(&document.model_info.class_params);
    let values = values_per_leaf(&document.oblivious_trees, &document.trees)?;
    let is_multiclass = matches!(loss, "MultiClass" | "MultiClassOneVsAll") || (loss.is_empty() && classes.len() > 2);
    let are_targets = values > 1 && !is_multiclass;
    if are_targets && !loss.starts_with("MultiRMSE") {
        return Err(problem!(
            "it has {values} outputs that are neither classes nor targets of a regression (its loss is {loss})"
        )
        .fix("Train a model for each."));
    }
    let is_binary = values == 1 && (classes.len() == 2 || matches!(loss, "Logloss" | "CrossEntropy"));
    let first = usize::from(is_binary);
    let outputs = values + first;
    let version = document.model_info.catboost_version_info.lines().find_map(|line| line.split("release ").nth(1));
    let version = version.and_then(|text| text.split(". ").next()).map(|v| format!(" {v}")).unwrap_or_default();
    let mut draft = Draft { features, kind: format!("CatBoost{version} JSON"), ..Draft::default() };
    if classes.len() == outputs {
        draft.names = classes;
    }
    if loss == "MultiClassOneVsAll" {
        draft.probability = Probability::Logistic;
        draft.notes.push("Posteriors are those of softmax, the model's of one class against all others.".into());
    }
    check_threshold(&document.model_info.binclass_probability_threshold)?;
    // As its `predict` says by default: LogLinQuantile's values are margins there.
    if matches!(loss, "Poisson" | "Tweedie") {
        draft.prediction.link = Link::Exponential;
    }
    draft.prediction.targets = are_targets;
    draft.base = vec![0.0; outputs];
    if bias.len() != values && bias.len() != 1 {
        return Err(damaged(format!("scale_and_bias has {} numbers for {values} outputs", bias.len())));
    }
    for value in 0..values {
        draft.base[first + value] = if bias.len() == 1 { bias[0] } else { bias[value] };
    }
    let mut hashes = BTreeSet::new();
    document
        .oblivious_trees
        .iter()
        .for_each(|tree| hashes.extend(tree.splits.iter().flatten().filter_map(Split::hash)));
    document.trees.iter().for_each(|tree| tree.hashes(&mut hashes));
    if !hashes.is_empty() {
        draft.notes.push(CATEGORIES.into());
    }
    let reader = Reader { info, values, scale, numbers: city::numbers(&hashes) };
    let output = if values > 1 { Output::Each } else { Output::One(first) };
    for (number, tree) in document.oblivious_trees.iter().enumerate() {
        let nodes = reader.oblivious(tree, number)?;
        draft.trees.push(DraftTree { nodes, output });
    }
    for (number, tree) in document.trees.iter().enumerate() {
        let nodes = reader.branches(tree, number)?;
        draft.trees.push(DraftTree { nodes, output });
    }
    draft.finish(names)
}

/// Returns an error for another threshold than one half: a model's class is that with the largest margin.
fn check_threshold(stated: &Value) -> Result<()> {
    let text = stated.as_str().map_or_else(|| stated.to_string(), String::from);
    if stated.is_null() || text.parse() == Ok(0.5) {
        return Ok(());
    }
    Err(problem!(
        "it has the probability threshold {text} for its second class, and a model here gives the class with the greatest \
         margin"
    )
    .fix("Call `set_probability_threshold(0.5)` before saving it, and compare posteriors yourself."))
}

fn class_names(params: &Value) -> Vec<String> {
    let text = |name: &Value| name.as_str().map_or_else(|| name.to_string(), String::from);
    params.get("class_names").and_then(Value::as_array).into_iter().flatten().map(text).collect()
}

fn values_per_leaf(oblivious: &[Oblivious], trees: &[Branch]) -> Result<usize> {
    if let Some(tree) = oblivious.first() {
        let depth = tree.splits.as_ref().map_or(0, Vec::len);
        let leaves = (depth <= MAX_DEPTH).then(|| 1_usize << depth);
        let values = leaves.filter(|leaves| tree.leaf_values.len().is_multiple_of(*leaves));
        let values = values.map(|leaves| tree.leaf_values.len() / leaves).filter(|&values| values > 0);
        return values.ok_or_else(|| damaged("tree 0: leaf_values has another length than its splits ask for"));
    }
    let Some(mut branch) = trees.first() else { return Err(no_trees()) };
    loop {
        match (&branch.value, &branch.left) {
            (Some(OneOrEach::One(_)), _) => return Ok(1),
            (Some(OneOrEach::Each(values)), _) if !values.is_empty() => return Ok(values.len()),
            (None, Some(left)) => branch = left,
            _ => return Err(damaged("tree 0: a leaf has no value")),
        }
    }
}

impl Branch {
    fn hashes(&self, seen: &mut BTreeSet<u32>) {
        let mut waiting = vec![self];
        while let Some(branch) = waiting.pop() {
            seen.extend(branch.split.as_ref().and_then(Split::hash));
            waiting.extend([&branch.left, &branch.right].into_iter().flatten().map(|child| &**child));
        }
    }
}

struct Reader<'a> {
    info: &'a FeaturesInfo,
    values: usize,
    scale: f64,
    /// Whole numbers by the hashes of categories.
    numbers: BTreeMap<u32, Vec<i32>>,
}

impl Reader<'_> {
    /// A split's feature in a row, and its test.
    fn split(&self, split: &Split, tree: usize) -> Result<(usize, Test)> {
        if let Some(hash) = split.hash() {
            return self.one_hot(split, hash, tree);
        }
        let index = split.float_feature_index.filter(|_| matches!(split.split_type.as_str(), "FloatFeature" | ""));
        let Some(index) = index else {
            let others = &self.info.categorical_features;
            let names: Vec<&str> = others.iter().map(|feature| feature.feature_id.as_str()).collect();
            return Err(match split.split_type.as_str() {
                "OnlineCtr" => problem!(
                    "tree {tree} splits on statistics of the target by category ({})",
                    names.join(", ")
                )
                .fix(
                    "Train with one_hot_max_size at least as large as the number of categories of a feature (at most \
                         255), and max_ctr_complexity=1.",
                ),
                other => problem!("tree {tree} has splits of another kind ({other})")
                    .fix("Train on numbers, or on categories with one_hot_max_size."),
            });
        };
        let feature = self.info.float_features.get(index);
        let feature = feature.ok_or_else(|| damaged(format!("tree {tree}: it has no feature {index}")))?;
        // A comparison with NaN is false; or missing values count as above all borders.
        let missing_left = feature.nan_value_treatment != "AsTrue";
        let threshold = Threshold::at_or_below(f64::from(split.border as f32));
        Ok((feature.flat_feature_index, Test::Border(threshold, missing_left)))
    }

    /// A split that asks for one category.
    fn one_hot(&self, split: &Split, hash: u32, tree: usize) -> Result<(usize, Test)> {
        let feature = split.cat_feature_index.and_then(|index| self.info.categorical_features.get(index));
        let feature = feature.ok_or_else(|| damaged(format!("tree {tree}: its categorical feature does not exist")))?;
        let numbers = self.numbers.get(&hash).ok_or_else(|| {
            problem!(
                "tree {tree} asks for a category of feature {} ({:?}) that is no whole number within {} of 0",
                feature.flat_feature_index,
                feature.feature_id,
                city::MOST
            )
            .fix("Number the categories before training, from 0 on: a chip has no words.")
        })?;
        Ok((feature.flat_feature_index, Test::Numbers(numbers.clone())))
    }

    fn leaf(&self, values: &[f64]) -> DraftNode {
        DraftNode::Leaf(values.iter().map(|value| value * self.scale).collect())
    }

    /// A tree whose levels have one split each: the first decides the lowest bit of the leaf's number.
    fn oblivious(&self, tree: &Oblivious, number: usize) -> Result<Vec<DraftNode>> {
        let splits = tree.splits.as_deref().unwrap_or_default();
        let depth = splits.len();
        if depth > MAX_DEPTH || tree.leaf_values.len() != self.values << depth {
            let found = tree.leaf_values.len();
            return Err(damaged(format!("tree {number}: leaf_values has {found} entries for {depth} splits")));
        }
        let splits: Vec<_> = splits.iter().map(|split| self.split(split, number)).collect::<Result<_>>()?;
        let mut nodes = Vec::with_capacity((2 << depth) - 1);
        // Level by level: node i of a level has the children 2 i and 2 i + 1 of the next.
        for (level, (feature, test)) in splits.iter().enumerate() {
            let next = (2 << level) - 1;
            for index in 0..1 << level {
                let left = next + 2 * index;
                nodes.push(test.node(*feature, [left, left + 1]));
            }
        }
        for position in 0..1_usize << depth {
            // The first split is the highest bit of the position, and the lowest of the leaf's number.
            let number = (0..depth).fold(0, |leaf, level| leaf | (position >> (depth - 1 - level) & 1) << level);
            nodes.push(self.leaf(&tree.leaf_values[number * self.values..(number + 1) * self.values]));
        }
        Ok(nodes)
    }

    fn branches(&self, root: &Branch, number: usize) -> Result<Vec<DraftNode>> {
        let mut nodes = vec![DraftNode::Leaf(Vec::new())];
        let mut waiting = vec![(root, 0)];
        while let Some((branch, to)) = waiting.pop() {
            nodes[to] = match branch {
                Branch { split: Some(split), left: Some(left), right: Some(right), .. } => {
                    let (feature, test) = self.split(split, number)?;
                    let first = nodes.len();
                    nodes.extend([DraftNode::Leaf(Vec::new()), DraftNode::Leaf(Vec::new())]);
                    waiting.extend([(&**right, first + 1), (&**left, first)]);
                    test.node(feature, [first, first + 1])
                }
                Branch { value: Some(OneOrEach::One(value)), .. } => self.leaf(&[*value]),
                Branch { value: Some(OneOrEach::Each(values)), .. } => self.leaf(values),
                _ => return Err(damaged(format!("tree {number}: a node is neither a split nor a leaf"))),
            };
        }
        Ok(nodes)
    }
}
