//! From one of XGBoost's trees to nodes, everything checked.

use super::schema::TreeColumns;
use crate::ensemble::nodes::reachable;
use crate::ensemble::{Node, Output, Tree};
use crate::error::TreeProblem;

/// Facts of a document about all of its trees.
pub(super) struct Shape {
    /// The features' names.
    pub(super) features: Vec<String>,
    /// Outputs: groups of trees, or values of a leaf that has several.
    pub(super) groups: usize,
    /// The object of the first group: 1 for a binary model, whose trees are for the second class.
    pub(super) first: usize,
    /// True if a threshold may be infinite.
    pub(super) infinite: bool,
}

/// A column must have one entry for each node; XGBoost leaves some columns out, which read as empty.
fn whole(column: &'static str, found: usize, wanted: usize) -> Result<(), TreeProblem> {
    if found == wanted { Ok(()) } else { Err(TreeProblem::Column { column, found, wanted }) }
}

pub(super) fn tree(columns: &TreeColumns, group: u64, shape: &Shape) -> Result<Tree, TreeProblem> {
    let objects = shape.groups;
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
    if let Some(node) = columns.split_type.iter().position(|&kind| kind != 0) {
        let feature = columns.split_indices.get(node).and_then(|&index| usize::try_from(index).ok());
        let name = feature.and_then(|feature| shape.features.get(feature));
        return Err(TreeProblem::Categorical { feature: name.cloned().unwrap_or_default() });
    }
    let values = number("size_leaf_vector", &columns.tree_param.size_leaf_vector)?.max(1);
    let output = match usize::try_from(group) {
        _ if values == objects && objects > 1 => Output::Each,
        Ok(object) if values == 1 && object < objects => Output::One(object + shape.first),
        _ if values == 1 => return Err(TreeProblem::Object { object: group, objects }),
        _ => return Err(TreeProblem::LeafWidth { values, objects }),
    };
    let read = |position: usize| node(columns, position, output, shape);
    let nodes = reachable(nodes, read)?;
    Ok(Tree { nodes, output })
}

/// Node `position` as the file has it, its values and its feature checked, its children checked for range only.
fn node(columns: &TreeColumns, position: usize, output: Output, shape: &Shape) -> Result<Node, TreeProblem> {
    let (features, objects) = (shape.features.len(), shape.groups);
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
    if threshold.is_nan() || !(shape.infinite || threshold.is_finite()) {
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
