//! Ensembles as files: XGBoost's JSON model schema.
//!
//! What is written opens in XGBoost 2 and later (one-output ensembles in 1.x too) and predicts the same margins there,
//! bit for bit. XGBoost's two layouts of a leaf that holds one value for each object stand side by side: `base_weights`
//! indexed by node (2.x to 3.1) and `leaf_weights` indexed by leaf, with the leaf's number in `right_children` (later).
//! The descriptor and the objects' names are attributes of the learner, `palpate_descriptor` and `palpate_objects` (a
//! JSON array of strings).
//!
//! What is read is checked whole before any of it is used: see [`Ensemble::load`].

use super::{Ensemble, Node, Output, Tree};
use crate::error::{Error, Result};
use crate::output;
use palpate_shared::Descriptor;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;

/// The most objects that a compiled model can tell apart.
const MAX_OBJECTS: usize = 256;
/// XGBoost's value for "no such node" in a one-output tree's `parents`.
const NO_PARENT: i64 = i32::MAX as i64;
/// XGBoost's split condition of a node that has none, in a multi-output tree: the smallest subnormal.
const NO_CONDITION: f32 = f32::from_bits(1);

impl Ensemble {
    /// Reads an ensemble in XGBoost's JSON model schema, written by [`Ensemble::save`], by XGBoost or by another
    /// trainer, with a `multi:softprob` or `multi:softmax` objective and the attributes `palpate_descriptor` and
    /// `palpate_objects`.
    ///
    /// # Errors
    /// If the file cannot be read, or is not such a model: not JSON; an unknown descriptor, or another number of
    /// features than it has; fewer than two objects, a repeated or empty name, or another number of classes; columns of
    /// unequal length; a child, feature or object out of range; a node that is reached twice (a cycle); a number that
    /// is not finite; categorical splits, dropped trees (DART), or no trees at all. The error names the file, the tree
    /// and the node.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the ensemble", source))?;
        let document: Document = serde_json::from_slice(&bytes).map_err(|error| not_json(path, &bytes, &error))?;
        document.into_ensemble().map_err(|problem| Error::file(path, problem.what, problem.fix))
    }

    /// What XGBoost itself has just trained on `descriptor`'s features of `objects`.
    #[cfg(feature = "xgboost")]
    pub(crate) fn from_xgboost(json: &[u8], descriptor: Descriptor, objects: Vec<String>) -> Result<Self> {
        let path = Path::new("XGBoost's model");
        let mut document: Document = serde_json::from_slice(json).map_err(|error| not_json(path, json, &error))?;
        document.learner.attributes = palpate_attributes(descriptor, &objects);
        document.into_ensemble().map_err(|problem| Error::file(path, problem.what, problem.fix))
    }

    /// Writes the ensemble in XGBoost's JSON model schema, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Io`] naming `path`.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let document = Document::of(self);
        output::write_whole(path.as_ref(), |out| {
            serde_json::to_writer(&mut *out, &document)?;
            out.write_all(b"\n")
        })
    }
}

/// What is wrong with a document, and what to do; the file's name is added by [`Ensemble::load`].
struct Problem {
    what: String,
    fix: String,
}

/// A broken file: trees that contradict themselves.
fn broken(what: impl Into<String>) -> Problem {
    Problem { what: what.into(), fix: "The file is damaged or was changed by hand; train or export it again.".into() }
}

/// A sound file of a kind that is not supported.
fn unsupported(what: impl Into<String>, fix: impl Into<String>) -> Problem {
    Problem { what: what.into(), fix: fix.into() }
}

fn not_json(path: &Path, bytes: &[u8], error: &serde_json::Error) -> Error {
    let looks_binary = bytes.iter().take(64).any(|&byte| byte == 0) || bytes.starts_with(b"{L");
    if looks_binary {
        let fix = "Save it as JSON: `booster.save_model(\"ensemble.json\")`; compiled models go where a .palpate is asked for.";
        return Error::file(path, "not an ensemble in XGBoost's JSON format but a binary file", fix);
    }
    let what = format!("not an ensemble in XGBoost's JSON format: {error}");
    let fix = "Give a file that `palpate train` or XGBoost's `save_model(\"….json\")` wrote.";
    match u64::try_from(error.line()) {
        Ok(line) if line > 0 => Error::line(path, line, what, fix),
        _ => Error::file(path, what, fix),
    }
}

#[derive(Serialize, Deserialize)]
struct Document {
    learner: Learner,
    version: [u32; 3],
}

#[derive(Serialize, Deserialize)]
struct Learner {
    #[serde(default)]
    attributes: BTreeMap<String, String>,
    #[serde(default)]
    feature_names: Vec<String>,
    #[serde(default)]
    feature_types: Vec<String>,
    gradient_booster: GradientBooster,
    learner_model_param: LearnerParameters,
    objective: Objective,
}

#[derive(Serialize, Deserialize)]
struct GradientBooster {
    model: Forest,
    name: String,
}

#[derive(Serialize, Deserialize)]
struct Forest {
    gbtree_model_param: ForestParameters,
    #[serde(default)]
    iteration_indptr: Vec<u64>,
    tree_info: Vec<u64>,
    trees: Vec<TreeColumns>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weight_drop: Option<Vec<f32>>,
}

#[derive(Serialize, Deserialize)]
struct ForestParameters {
    num_parallel_tree: String,
    num_trees: String,
}

#[derive(Serialize, Deserialize)]
struct LearnerParameters {
    base_score: String,
    #[serde(default)]
    boost_from_average: String,
    num_class: String,
    num_feature: String,
    #[serde(default)]
    num_target: String,
}

#[derive(Serialize, Deserialize)]
struct Objective {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    softmax_multiclass_param: Option<SoftmaxParameters>,
}

#[derive(Serialize, Deserialize)]
struct SoftmaxParameters {
    num_class: String,
}

/// A tree as XGBoost stores it: one array a property, indexed by node.
#[derive(Default, Serialize, Deserialize)]
struct TreeColumns {
    base_weights: Vec<f32>,
    #[serde(default)]
    categories: Vec<i64>,
    #[serde(default)]
    categories_nodes: Vec<i64>,
    #[serde(default)]
    categories_segments: Vec<i64>,
    #[serde(default)]
    categories_sizes: Vec<i64>,
    default_left: Vec<Flag>,
    id: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    leaf_weights: Option<Vec<f32>>,
    left_children: Vec<i64>,
    #[serde(default)]
    loss_changes: Vec<f32>,
    #[serde(default)]
    parents: Vec<i64>,
    right_children: Vec<i64>,
    split_conditions: Vec<f32>,
    split_indices: Vec<u64>,
    #[serde(default)]
    split_type: Vec<u8>,
    #[serde(default)]
    sum_hessian: Vec<f32>,
    tree_param: TreeParameters,
}

#[derive(Default, Serialize, Deserialize)]
struct TreeParameters {
    num_deleted: String,
    num_feature: String,
    num_nodes: String,
    size_leaf_vector: String,
}

/// A truth value: a number since XGBoost 1.6, `true` or `false` before.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
enum Flag {
    Number(u8),
    Word(bool),
}

impl Flag {
    fn is_set(self) -> bool {
        match self {
            Self::Number(number) => number != 0,
            Self::Word(word) => word,
        }
    }
}

impl Document {
    fn of(ensemble: &Ensemble) -> Self {
        let objects = ensemble.objects.len();
        let features = ensemble.descriptor.feature_count();
        let trees = &ensemble.trees;
        let num_class = objects.to_string();
        Self {
            learner: Learner {
                attributes: palpate_attributes(ensemble.descriptor, &ensemble.objects),
                feature_names: Vec::new(),
                feature_types: Vec::new(),
                gradient_booster: GradientBooster {
                    model: Forest {
                        gbtree_model_param: ForestParameters {
                            num_parallel_tree: "1".into(),
                            num_trees: trees.len().to_string(),
                        },
                        iteration_indptr: rounds(ensemble),
                        tree_info: trees.iter().map(|tree| group(tree.output)).collect(),
                        trees: trees.iter().zip(0..).map(|(tree, id)| columns(tree, id, features, objects)).collect(),
                        weight_drop: None,
                    },
                    name: "gbtree".into(),
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

    fn into_ensemble(self) -> Result<Ensemble, Problem> {
        let Learner { attributes, gradient_booster, learner_model_param, objective, .. } = self.learner;
        if !matches!(objective.name.as_str(), "multi:softprob" | "multi:softmax") {
            let fix = "Train with the objective multi:softprob.";
            return Err(unsupported(format!("its objective is {}, not multi:softprob", objective.name), fix));
        }
        if gradient_booster.name != "gbtree" || gradient_booster.model.weight_drop.is_some() {
            let what = format!("its booster is {}, not plain gbtree", gradient_booster.name);
            return Err(unsupported(what, "Train with booster=gbtree."));
        }
        let descriptor = descriptor(&attributes)?;
        let objects = object_names(&attributes)?;
        let classes = count("num_class", &learner_model_param.num_class)?;
        if classes != objects.len() {
            let what = format!("it has {classes} classes, but palpate_objects names {} objects", objects.len());
            return Err(unsupported(what, "Name every class once, in the order of the labels."));
        }
        let features = count("num_feature", &learner_model_param.num_feature)?;
        if features != descriptor.feature_count() {
            let what = format!(
                "it has {features} features, but its descriptor {} has {} ({})",
                descriptor.name(),
                descriptor.feature_count(),
                descriptor.feature_names().join(", ")
            );
            return Err(unsupported(what, "Train it on that descriptor's features, or name the right descriptor."));
        }
        let base_margins = base_margins(&learner_model_param.base_score, classes)?;
        let Forest { tree_info, trees, .. } = gradient_booster.model;
        if trees.is_empty() {
            return Err(broken("it has no trees"));
        }
        if tree_info.len() != trees.len() {
            return Err(broken(format!("tree_info has {} entries for {} trees", tree_info.len(), trees.len())));
        }
        let trees = trees
            .iter()
            .zip(tree_info)
            .zip(0..)
            .map(|((columns, group), id)| {
                tree(columns, group, features, classes)
                    .map_err(|problem| Problem { what: format!("tree {id}: {}", problem.what), fix: problem.fix })
            })
            .collect::<Result<_, _>>()?;
        Ok(Ensemble { descriptor, objects, base_margins, trees })
    }
}

fn palpate_attributes(descriptor: Descriptor, objects: &[String]) -> BTreeMap<String, String> {
    let names = serde_json::Value::from(objects.to_vec()).to_string();
    BTreeMap::from([("palpate_descriptor".into(), descriptor.name().into()), ("palpate_objects".into(), names)])
}

/// Where each boosting round's trees begin and end: one tree for each object in order, or one tree for all.
fn rounds(ensemble: &Ensemble) -> Vec<u64> {
    let in_order = |(index, tree): (usize, &Tree)| tree.output == Output::One(index % ensemble.objects.len());
    let a_round = if ensemble.trees.iter().enumerate().all(in_order) { ensemble.objects.len() } else { 1 };
    (0..=ensemble.trees.len()).step_by(a_round).filter_map(|tree| u64::try_from(tree).ok()).collect()
}

fn group(output: Output) -> u64 {
    match output {
        Output::One(object) => u64::try_from(object).unwrap_or(u64::MAX),
        Output::Each => 0,
    }
}

/// One number where all margins start alike (every version reads that), else a list.
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

fn attribute<'a>(attributes: &'a BTreeMap<String, String>, name: &str, example: &str) -> Result<&'a str, Problem> {
    attributes.get(name).map(String::as_str).ok_or_else(|| {
        let fix = format!("Before saving it in Python, set it: `booster.set_attr({name}={example})`.");
        unsupported(format!("it has no attribute {name}"), fix)
    })
}

fn descriptor(attributes: &BTreeMap<String, String>) -> Result<Descriptor, Problem> {
    let name = attribute(attributes, "palpate_descriptor", "\"curvature\"")?;
    Descriptor::from_name(name).ok_or_else(|| {
        let known = Descriptor::ALL.map(Descriptor::name).join(", ");
        unsupported(format!("its descriptor {name:?} is unknown"), format!("Use one of {known}."))
    })
}

fn object_names(attributes: &BTreeMap<String, String>) -> Result<Vec<String>, Problem> {
    let text = attribute(attributes, "palpate_objects", "'[\"bowl\", \"fork\"]'")?;
    let fix = "Give a JSON array of 2 to 256 different names, in the order of the labels.";
    let names: Vec<String> = serde_json::from_str(text)
        .map_err(|error| unsupported(format!("palpate_objects is not a JSON array of names: {error}"), fix))?;
    if !(2..=MAX_OBJECTS).contains(&names.len()) {
        return Err(unsupported(format!("palpate_objects names {} objects", names.len()), fix));
    }
    let mut seen = HashSet::new();
    match names.iter().find(|name| name.is_empty() || name.chars().any(char::is_control) || !seen.insert(*name)) {
        Some(name) => Err(unsupported(format!("palpate_objects has the name {name:?} twice, or it is no name"), fix)),
        None => Ok(names),
    }
}

fn count(name: &str, text: &str) -> Result<usize, Problem> {
    text.parse().map_err(|_| broken(format!("{name} is {text:?}, not a count")))
}

fn base_margins(text: &str, objects: usize) -> Result<Vec<f32>, Problem> {
    let list = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let parsed: Result<Vec<f32>, _> = list.unwrap_or(text).split(',').map(|number| number.trim().parse()).collect();
    match parsed {
        Ok(margins) if margins.iter().any(|margin| !margin.is_finite()) => {
            Err(broken(format!("its base_score {text} is not finite")))
        }
        Ok(margins) if margins.len() == 1 => Ok(vec![margins[0]; objects]),
        Ok(margins) if margins.len() == objects => Ok(margins),
        _ => Err(broken(format!("its base_score {text:?} is neither a number nor {objects} numbers"))),
    }
}

/// A column must have one entry a node; XGBoost leaves some out, which reads as empty.
fn whole(name: &str, found: usize, wanted: usize) -> Result<(), Problem> {
    if found == wanted { Ok(()) } else { Err(broken(format!("{name} has {found} entries instead of {wanted}"))) }
}

fn tree(columns: &TreeColumns, group: u64, features: usize, objects: usize) -> Result<Tree, Problem> {
    let nodes = columns.left_children.len();
    let stated = count("num_nodes", &columns.tree_param.num_nodes)?;
    whole("left_children", nodes, stated)?;
    whole("right_children", columns.right_children.len(), nodes)?;
    whole("split_indices", columns.split_indices.len(), nodes)?;
    whole("split_conditions", columns.split_conditions.len(), nodes)?;
    whole("default_left", columns.default_left.len(), nodes)?;
    if nodes == 0 {
        return Err(broken("it has no nodes"));
    }
    if columns.split_type.iter().any(|&kind| kind != 0) || !columns.categories.is_empty() {
        let fix = "Train on numbers: every feature of a touch is one.";
        return Err(unsupported("it has categorical splits, which no descriptor needs", fix));
    }
    let width = count("size_leaf_vector", &columns.tree_param.size_leaf_vector)?.max(1);
    let output = match usize::try_from(group) {
        _ if width == objects => Output::Each,
        Ok(object) if width == 1 && object < objects => Output::One(object),
        _ if width == 1 => return Err(broken(format!("it is for object {group} of {objects}"))),
        _ => return Err(broken(format!("its leaves hold {width} values for {objects} objects"))),
    };
    let read = |position: usize| node(columns, position, output, features, objects);
    let nodes = reachable(nodes, read)?;
    Ok(Tree { nodes, output })
}

/// Node `position` as the file has it, its values and its feature checked, its children checked for range only.
fn node(
    columns: &TreeColumns,
    position: usize,
    output: Output,
    features: usize,
    objects: usize,
) -> Result<Node, Problem> {
    let left = columns.left_children[position];
    if left == -1 {
        return leaf(columns, position, output, objects).map(Node::Leaf);
    }
    let count = columns.left_children.len();
    let child = |side: &str, index: i64| {
        let in_range = usize::try_from(index).ok().filter(|&child| child < count);
        in_range.ok_or_else(|| broken(format!("node {position}: its {side} child {index} is not one of {count} nodes")))
    };
    let feature = columns.split_indices[position];
    let threshold = columns.split_conditions[position];
    if !threshold.is_finite() {
        return Err(broken(format!("node {position}: its threshold {threshold} is not finite")));
    }
    Ok(Node::Split {
        feature: usize::try_from(feature).ok().filter(|&index| index < features).ok_or_else(|| {
            broken(format!("node {position}: it splits on feature {feature}, but there are {features}"))
        })?,
        threshold,
        missing_left: columns.default_left[position].is_set(),
        left: child("left", left)?,
        right: child("right", columns.right_children[position])?,
    })
}

fn leaf(columns: &TreeColumns, position: usize, output: Output, objects: usize) -> Result<Vec<f32>, Problem> {
    let values = match (output, &columns.leaf_weights) {
        (Output::One(_), _) => vec![columns.split_conditions[position]],
        (Output::Each, None) => {
            let start = position * objects;
            let values = columns.base_weights.get(start..start + objects);
            let missing = || broken(format!("node {position}: base_weights has no {objects} values for this leaf"));
            values.ok_or_else(missing)?.to_vec()
        }
        (Output::Each, Some(weights)) => {
            let number = columns.right_children[position];
            let start = usize::try_from(number).ok().and_then(|number| number.checked_mul(objects));
            let values = start.and_then(|start| weights.get(start..start.checked_add(objects)?));
            let missing = || broken(format!("node {position}: leaf_weights has no {objects} values for leaf {number}"));
            values.ok_or_else(missing)?.to_vec()
        }
    };
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(broken(format!("node {position}: its leaf value {value} is not finite"))),
        None => Ok(values),
    }
}

/// The nodes that the root leads to, in the file's order and numbered anew: XGBoost leaves pruned nodes behind. Each may
/// be reached once only, which rules out cycles.
fn reachable(count: usize, read: impl Fn(usize) -> Result<Node, Problem>) -> Result<Vec<Node>, Problem> {
    let mut found: Vec<Option<Node>> = vec![None; count];
    let mut waiting = vec![0];
    while let Some(position) = waiting.pop() {
        if found[position].is_some() {
            return Err(broken(format!("node {position} is reached twice: the tree has a cycle or a shared branch")));
        }
        let node = read(position)?;
        if let Node::Split { left, right, .. } = node {
            waiting.extend([right, left]);
        }
        found[position] = Some(node);
    }
    let mut numbers = Vec::with_capacity(count);
    let mut next = 0;
    for node in &found {
        numbers.push(next);
        next += usize::from(node.is_some());
    }
    Ok(found
        .into_iter()
        .flatten()
        .map(|node| match node {
            Node::Split { feature, threshold, missing_left, left, right } => {
                Node::Split { feature, threshold, missing_left, left: numbers[left], right: numbers[right] }
            }
            leaf @ Node::Leaf(_) => leaf,
        })
        .collect())
}

#[cfg(all(test, feature = "train"))]
mod tests;
