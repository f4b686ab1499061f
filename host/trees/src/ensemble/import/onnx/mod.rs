//! ONNX files of one tree ensemble: what `skl2onnx` and `onnxmltools` write for scikit-learn, XGBoost and LightGBM, and the
//! operator `TreeEnsemble` of `ai.onnx.ml` 5.
//!
//! <https://onnx.ai/onnx/operators/#ai-onnx-ml>. Identity, Cast, Reshape and ZipMap may stand around the ensemble, since they
//! change no margin; margins are those before its `post_transform`.

mod classic;
mod five;
mod wire;

use super::draft::{Draft, DraftTree, Targeted};
use super::draft_node::DraftNode;
use crate::ensemble::{Ensemble, MAX_OBJECTS, Threshold, check::object_count, columns::check_count};
use crate::error::{Error, Result, problem};
use std::fmt::Display;
use wire::{Attribute, Graph, Node};

/// Operations around an ensemble that change no margin.
const HARMLESS: [&str; 5] = ["Identity", "Cast", "Reshape", "ZipMap", "Flatten"];

/// True if bytes may be an ONNX file: an `ir_version`, and then a field that a model has.
pub(super) fn is_onnx(bytes: &[u8]) -> bool {
    matches!(bytes, [0x08, 1..=40, 0x12 | 0x1a | 0x22 | 0x28 | 0x32 | 0x3a | 0x42, ..])
}

fn damaged(what: impl Display) -> Error {
    crate::ensemble::faults::damaged("ONNX", what)
}

/// Reads an ONNX file.
pub(super) fn read(bytes: &[u8], names: Option<&[String]>) -> Result<Ensemble> {
    let model = wire::model(bytes).ok_or_else(|| damaged("it ends early, or was changed"))?;
    let is_ensemble = |node: &&Node<'_>| node.operation.starts_with("TreeEnsemble");
    let mut ensembles = model.graph.nodes.iter().filter(is_ensemble);
    let Some(node) = ensembles.next() else {
        return Err(problem!("it is an ONNX file without a tree ensemble").fix("Give an ONNX file of trees."));
    };
    let others = ensembles.count();
    if others > 0 {
        return Err(problem!(
            "it has {} tree ensembles, whose outputs are combined by other operators: weights, votes, probabilities",
            others + 1
        )
        .fix(
            "In place of AdaBoost, Bagging, Voting, Stacking, OneVsRest or a calibrated classifier, train and give a \
             forest or boosted trees. A single model that onnxmltools split has to be converted without `split`.",
        ));
    }
    let harmless = |node: &&Node<'_>| !is_ensemble(node) && !HARMLESS.contains(&node.operation);
    if let Some(node) = model.graph.nodes.iter().find(harmless) {
        return Err(problem!("beside the trees it computes with {}", node.operation)
            .fix("Convert the trees alone, and compute the steps before and after them yourself."));
    }
    let columns = columns(&model.graph, node)?;
    // CatBoost states its sources and its compiler there as well.
    let producer = model.producer.lines().next().unwrap_or_default().trim_end();
    let producer = if producer.is_empty() { String::new() } else { format!(" ({producer})") };
    let mut draft = Draft { kind: format!("ONNX {}{producer}", node.operation), ..Draft::default() };
    draft.f32_sums = true;
    let features = match node.operation {
        "TreeEnsemble" => five::read(node, &mut draft)?,
        "TreeEnsembleClassifier" | "TreeEnsembleRegressor" => classic::read(node, &mut draft)?,
        other => {
            return Err(problem!("its operator {other} is unknown").fix("Convert it with opset 5 or older."));
        }
    };
    let count = columns.unwrap_or(features);
    if count < features {
        return Err(damaged(format!("it splits on feature {}, but there are {count}", features - 1)));
    }
    check_count(count)?;
    draft.features = vec![String::new(); count];
    // Thresholds are doubles where the rows are.
    let is_double = |node: &DraftNode| match node {
        DraftNode::Split { threshold, .. } => f64::from(threshold.value as f32) != threshold.value,
        DraftNode::Set { .. } | DraftNode::Leaf(_) => false,
    };
    draft.compares_f64 = draft.trees.iter().flat_map(|tree| &tree.nodes).any(is_double);
    draft.finish(names)
}

/// The columns of the graph's input that leads to the ensemble, if they are stated.
fn columns(graph: &Graph<'_>, ensemble: &Node<'_>) -> Result<Option<usize>> {
    let mut name = ensemble.inputs.first().copied().unwrap_or_default();
    for _ in 0..=graph.nodes.len() {
        if let Some((_, columns)) = graph.inputs.iter().find(|(input, _)| *input == name) {
            return Ok(*columns);
        }
        let Some(before) = graph.nodes.iter().find(|node| node.outputs.contains(&name)) else { break };
        name = before.inputs.first().copied().unwrap_or_default();
    }
    Err(damaged("nothing leads from an input to the trees"))
}

/// A comparison: the threshold of `x < threshold`, whether it is the false branch that is left then, and where a missing
/// value goes.
struct Comparison {
    threshold: Threshold,
    swapped: bool,
    missing_left: bool,
}

impl Comparison {
    /// The split of a feature by it, with the nodes where the comparison of the file holds and where it does not.
    fn split(self, feature: usize, [holds, fails]: [usize; 2]) -> Targeted {
        let Self { threshold, swapped, missing_left } = self;
        let (left, right) = if swapped { (fails, holds) } else { (holds, fails) };
        Targeted::Split { feature, threshold, missing_left, left, right }
    }
}

/// `mode` as one of the names of modes, without `BRANCH_`.
fn comparison(mode: &str, value: f64, missing_is_true: bool) -> Result<Comparison> {
    if value.is_nan() {
        return Err(damaged("a threshold is not a number"));
    }
    let (threshold, swapped) = match mode {
        "LEQ" => (Threshold::at_or_below(value), false),
        "LT" => (Threshold::below(value), false),
        "GTE" => (Threshold::below(value), true),
        "GT" => (Threshold::at_or_below(value), true),
        _ => {
            return Err(problem!("it splits on categories (BRANCH_{mode})")
                .fix("Encode categories as numbers before training, one column of 0 and 1 for each (one-hot)."));
        }
    };
    // A comparison with NaN is false, unless it is stated to be true.
    Ok(Comparison { threshold, swapped, missing_left: missing_is_true != swapped })
}

/// An attribute's list of exactly `wanted` entries.
fn list<'n, T>(
    node: &'n Node<'_>,
    name: &str,
    wanted: Option<usize>,
    of: impl Fn(&'n Attribute<'n>) -> &'n [T],
) -> Result<&'n [T]> {
    let list = node.attributes.get(name).map_or(&[][..], of);
    match wanted {
        Some(wanted) if list.len() != wanted => {
            Err(damaged(format!("{name} has {} entries instead of {wanted}", list.len())))
        }
        _ => Ok(list),
    }
}

fn index(number: i64, what: &str) -> Result<usize> {
    usize::try_from(number).map_err(|_| damaged(format!("{what} is {number}")))
}

/// Number of outputs stated by a file.
fn outputs(count: i64) -> Result<usize> {
    let count = index(count, "n_targets")?;
    if (1..=MAX_OBJECTS).contains(&count) { Ok(count) } else { Err(object_count(count)) }
}

/// Divisor of the leaves' values.
fn divisor(aggregate: &str, trees: usize) -> Result<f64> {
    match aggregate {
        "SUM" => Ok(1.0),
        "AVERAGE" => Ok(trees.max(1) as f64),
        _ => Err(problem!("it takes the {aggregate} of its trees, not their sum")
            .fix("Give an ensemble whose trees are added or averaged.")),
    }
}

/// Adds a tree from `root` on: `read` gives each node, with its children's numbers; each may be reached once.
fn add_tree(
    draft: &mut Draft,
    root: usize,
    seen: &mut [bool],
    mut read: impl FnMut(usize) -> Result<Targeted>,
) -> Result<()> {
    let tree = draft.trees.len();
    let mut nodes = vec![Targeted::Leaf(Vec::new())];
    let mut waiting = vec![(root, 0)];
    while let Some((number, to)) = waiting.pop() {
        let reached = seen.get_mut(number).ok_or_else(|| damaged(format!("tree {tree}: there is no node {number}")))?;
        if std::mem::replace(reached, true) {
            return Err(damaged(format!("tree {tree}: node {number} is reached twice")));
        }
        let mut node = read(number)?;
        if let Targeted::Split { left, right, .. } = &mut node {
            let first = nodes.len();
            nodes.extend([Targeted::Leaf(Vec::new()), Targeted::Leaf(Vec::new())]);
            waiting.extend([(*right, first + 1), (*left, first)]);
            (*left, *right) = (first, first + 1);
        }
        nodes[to] = node;
    }
    draft.trees.push(DraftTree::of_targets(nodes, draft.base.len()));
    Ok(())
}
