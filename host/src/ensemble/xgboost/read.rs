//! From XGBoost's schema to an ensemble, everything checked.

use super::schema::{Document, Forest, Learner, TreeColumns};
use crate::ensemble::check::check_names;
use crate::ensemble::{Ensemble, Node, Origin, Output, Tree};
use crate::error::{EnsembleProblem, TreeProblem};
use palpate_shared::Descriptor;
use std::collections::BTreeMap;

type Attributes = BTreeMap<String, String>;

impl Document {
    /// The ensemble in the document.
    pub(super) fn into_ensemble(self) -> Result<Ensemble, EnsembleProblem> {
        let Learner { attributes, gradient_booster, learner_model_param, objective, .. } = self.learner;
        if !matches!(objective.name.as_str(), "multi:softprob" | "multi:softmax") {
            return Err(EnsembleProblem::Objective { found: objective.name });
        }
        if gradient_booster.name != "gbtree" || gradient_booster.model.weight_drop.is_some() {
            return Err(EnsembleProblem::Booster { found: gradient_booster.name });
        }
        let descriptor = descriptor(&attributes)?;
        let objects = object_names(&attributes)?;
        let classes = count("num_class", &learner_model_param.num_class)?;
        if classes != objects.len() {
            return Err(EnsembleProblem::Classes { classes, objects: objects.len() });
        }
        let features = count("num_feature", &learner_model_param.num_feature)?;
        if features != descriptor.feature_count() {
            return Err(EnsembleProblem::Features { found: features, descriptor });
        }
        let base_margins = base_margins(&learner_model_param.base_score, classes)?;
        let Forest { tree_info, trees, .. } = gradient_booster.model;
        if trees.is_empty() {
            return Err(EnsembleProblem::NoTrees);
        }
        if tree_info.len() != trees.len() {
            return Err(EnsembleProblem::TreeInfo { found: tree_info.len(), trees: trees.len() });
        }
        let read = |((number, columns), group): ((usize, &TreeColumns), u64)| {
            tree(columns, group, features, classes).map_err(|problem| EnsembleProblem::Tree { tree: number, problem })
        };
        let trees = trees.iter().enumerate().zip(tree_info).map(read).collect::<Result<_, _>>()?;
        Ok(Ensemble { descriptor, objects, base_margins, trees, origin: origin(&attributes)? })
    }
}

fn attribute<'a>(
    attributes: &'a Attributes,
    name: &'static str,
    example: &'static str,
) -> Result<&'a str, EnsembleProblem> {
    attributes.get(name).map(String::as_str).ok_or(EnsembleProblem::NoAttribute { name, example })
}

fn descriptor(attributes: &Attributes) -> Result<Descriptor, EnsembleProblem> {
    let name = attribute(attributes, "palpate_descriptor", "\"curvature\"")?;
    Descriptor::from_name(name).ok_or_else(|| EnsembleProblem::UnknownDescriptor { found: name.into() })
}

fn object_names(attributes: &Attributes) -> Result<Vec<String>, EnsembleProblem> {
    let name = "palpate_objects";
    let text = attribute(attributes, name, "'[\"bowl\", \"fork\"]'")?;
    let names: Vec<String> = parsed(name, "a JSON array of names", text)?;
    check_names(&names)?;
    Ok(names)
}

/// What the optional attributes say about the training touches.
fn origin(attributes: &Attributes) -> Result<Origin, EnsembleProblem> {
    let probe = attributes.get("palpate_probe").map(|text| {
        let expected = "a JSON object of radius, spacing, speed, tilt and length";
        parsed("palpate_probe", expected, text)
    });
    let trained = attributes.get("palpate_trained").map(|text| {
        let expected = "a JSON object of counted, patterns, needs_pose and largest_spread";
        parsed("palpate_trained", expected, text)
    });
    let touches = attributes.get("palpate_touches").map(|text| {
        let (name, expected) = ("palpate_touches", "a JSON object of hexadecimal numbers");
        let touches: BTreeMap<String, String> = parsed(name, expected, text)?;
        let number = |(object, text): (String, String)| match u64::from_str_radix(&text, 16) {
            Ok(number) => Ok((object, number)),
            Err(error) => Err(EnsembleProblem::Attribute { name, expected, detail: error.to_string() }),
        };
        touches.into_iter().map(number).collect()
    });
    let noise = attributes.get("palpate_noise").map(|text| {
        let expected = "a JSON object of what was added to the touches in training";
        parsed("palpate_noise", expected, text)
    });
    let background = attributes.get("palpate_background").map(|text| {
        let expected = "true where the last object is a background, else false";
        parsed("palpate_background", expected, text)
    });
    Ok(Origin {
        background: background.transpose()?.unwrap_or_default(),
        probe: probe.transpose()?,
        trained: trained.transpose()?,
        noise: noise.transpose()?,
        touches: touches.transpose()?.unwrap_or_default(),
    })
}

fn parsed<'t, T: serde::Deserialize<'t>>(
    name: &'static str,
    expected: &'static str,
    text: &'t str,
) -> Result<T, EnsembleProblem> {
    serde_json::from_str(text).map_err(|error| EnsembleProblem::Attribute { name, expected, detail: error.to_string() })
}

fn count(name: &'static str, text: &str) -> Result<usize, EnsembleProblem> {
    text.parse().map_err(|_| EnsembleProblem::Count { name, text: text.into() })
}

fn base_margins(text: &str, objects: usize) -> Result<Vec<f32>, EnsembleProblem> {
    let list = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let parsed: Result<Vec<f32>, _> = list.unwrap_or(text).split(',').map(|number| number.trim().parse()).collect();
    match parsed {
        Ok(margins) if margins.iter().any(|margin| !margin.is_finite()) => {}
        Ok(margins) if margins.len() == 1 => return Ok(vec![margins[0]; objects]),
        Ok(margins) if margins.len() == objects => return Ok(margins),
        _ => {}
    }
    Err(EnsembleProblem::BaseScore { text: text.into(), objects })
}

/// A column must have one entry for each node; XGBoost leaves some columns out, which read as empty.
fn whole(column: &'static str, found: usize, wanted: usize) -> Result<(), TreeProblem> {
    if found == wanted { Ok(()) } else { Err(TreeProblem::Column { column, found, wanted }) }
}

fn tree(columns: &TreeColumns, group: u64, features: usize, objects: usize) -> Result<Tree, TreeProblem> {
    let number = |name, text: &str| text.parse().map_err(|_| TreeProblem::Count { name, text: text.into() });
    let nodes = columns.left_children.len();
    let stated = number("num_nodes", &columns.tree_param.num_nodes)?;
    whole("left_children", nodes, stated)?;
    whole("right_children", columns.right_children.len(), nodes)?;
    whole("split_indices", columns.split_indices.len(), nodes)?;
    whole("split_conditions", columns.split_conditions.len(), nodes)?;
    whole("default_left", columns.default_left.len(), nodes)?;
    if nodes == 0 {
        return Err(TreeProblem::NoNodes);
    }
    if columns.split_type.iter().any(|&kind| kind != 0) || !columns.categories.is_empty() {
        return Err(TreeProblem::Categorical);
    }
    let values = number("size_leaf_vector", &columns.tree_param.size_leaf_vector)?.max(1);
    let output = match usize::try_from(group) {
        _ if values == objects => Output::Each,
        Ok(object) if values == 1 && object < objects => Output::One(object),
        _ if values == 1 => return Err(TreeProblem::Object { object: group, objects }),
        _ => return Err(TreeProblem::LeafWidth { values, objects }),
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
) -> Result<Node, TreeProblem> {
    let left = columns.left_children[position];
    if left == -1 {
        return leaf(columns, position, output, objects).map(Node::Leaf);
    }
    let nodes = columns.left_children.len();
    let child = |side: &'static str, child: i64| {
        let in_range = usize::try_from(child).ok().filter(|&child| child < nodes);
        in_range.ok_or(TreeProblem::Child { node: position, side, child, nodes })
    };
    let feature = columns.split_indices[position];
    let threshold = columns.split_conditions[position];
    if !threshold.is_finite() {
        return Err(TreeProblem::Threshold { node: position, threshold });
    }
    Ok(Node::Split {
        feature: usize::try_from(feature).ok().filter(|&index| index < features).ok_or(TreeProblem::Feature {
            node: position,
            feature,
            features,
        })?,
        threshold,
        missing_left: columns.default_left[position].is_set(),
        left: child("left", left)?,
        right: child("right", columns.right_children[position])?,
    })
}

fn leaf(columns: &TreeColumns, position: usize, output: Output, objects: usize) -> Result<Vec<f32>, TreeProblem> {
    let no_values = |column| TreeProblem::NoValues { node: position, column, values: objects };
    let values = match (output, &columns.leaf_weights) {
        (Output::One(_), _) => vec![columns.split_conditions[position]],
        (Output::Each, None) => {
            let start = position * objects;
            let values = columns.base_weights.get(start..start + objects);
            values.ok_or(no_values("base_weights"))?.to_vec()
        }
        (Output::Each, Some(weights)) => {
            let number = columns.right_children[position];
            let start = usize::try_from(number).ok().and_then(|number| number.checked_mul(objects));
            let values = start.and_then(|start| weights.get(start..start.checked_add(objects)?));
            values.ok_or(no_values("leaf_weights"))?.to_vec()
        }
    };
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(TreeProblem::LeafValue { node: position, value }),
        None => Ok(values),
    }
}

/// The nodes that the root leads to, in the file's order and numbered again: XGBoost leaves pruned nodes behind. Each
/// may be reached once only, which rules out cycles.
fn reachable(count: usize, read: impl Fn(usize) -> Result<Node, TreeProblem>) -> Result<Vec<Node>, TreeProblem> {
    let mut found: Vec<Option<Node>> = vec![None; count];
    let mut waiting = vec![0];
    while let Some(position) = waiting.pop() {
        if found[position].is_some() {
            return Err(TreeProblem::ReachedTwice { node: position });
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
    let renumbered = |node| match node {
        Node::Split { feature, threshold, missing_left, left, right } => {
            Node::Split { feature, threshold, missing_left, left: numbers[left], right: numbers[right] }
        }
        leaf @ Node::Leaf(_) => leaf,
    };
    Ok(found.into_iter().flatten().map(renumbered).collect())
}
