//! From one of XGBoost's trees to nodes, everything checked.

use super::schema::TreeColumns;
use crate::ensemble::faults::{self, DAMAGED};
use crate::ensemble::import::draft::DraftTree;
use crate::ensemble::import::draft_node::DraftNode;
use crate::ensemble::import::set::Set;
use crate::ensemble::import::spelled_out::spelled_out;
use crate::ensemble::nodes::reachable;
use crate::ensemble::{Node, Output, Threshold, Tree, check_leaf};
use crate::error::{Error, Result, problem};
use std::collections::BTreeMap;

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
    /// True if categories that a set has no bit for go where missing ones go.
    pub(super) unknown_as_missing: bool,
}

/// A column must have one entry for each node; XGBoost leaves some columns out, which read as empty.
fn whole(column: &str, found: usize, wanted: usize) -> Result<()> {
    if found == wanted { Ok(()) } else { Err(faults::column(column, found, wanted)) }
}

/// XGBoost takes no categories from here on, nor negative ones: they go left, or up to 1.6 as missing ones.
const OUT_OF_RANGE: u32 = 1 << 24;

/// Reads the tree with this number.
pub(super) fn tree(columns: &TreeColumns, (number, group): (usize, u64), shape: &Shape) -> Result<Tree> {
    let wrong = |error: Error| error.within(format_args!("tree {number}: "));
    let tree = plain(columns, group, shape).map_err(wrong)?;
    if !has_sets(columns) {
        return Ok(tree);
    }
    let sets = sets(columns, shape).map_err(wrong)?;
    let output = tree.output;
    let read = |position: usize| -> Result<DraftNode> {
        // What no other node leads to was not checked, and is not reached.
        Ok(match node(columns, position, output, shape) {
            Ok(Node::Split { .. }) if is_set(columns, position) && !sets.contains_key(&position) => {
                DraftNode::Leaf(Vec::new())
            }
            Ok(Node::Split { feature, threshold, missing_left, left, right }) => match sets.get(&position) {
                // What is in the set goes right.
                Some(set) => {
                    let last = set.iter().max().copied().unwrap_or(0);
                    let set = Set::of_categories(set.iter().copied(), false)?;
                    // Up to there a set has bits, in words of 32.
                    let end = (last / 32 + 1) * 32;
                    let set = if shape.unknown_as_missing && !missing_left { set.and_beyond(end.into()) } else { set };
                    DraftNode::Set { feature, set, missing_inside: !missing_left, inside: right, outside: left }
                }
                None => {
                    let threshold = Threshold::below(threshold.into());
                    DraftNode::Split { feature, threshold, missing_left, left, right }
                }
            },
            Ok(Node::Leaf(values)) => DraftNode::Leaf(values.into_iter().map(f64::from).collect()),
            Err(_) => DraftNode::Leaf(Vec::new()),
        })
    };
    let nodes = (0..columns.left_children.len()).map(read).collect::<Result<_, _>>()?;
    let name = |feature: usize| shape.features.get(feature).cloned().unwrap_or_default();
    let nodes = spelled_out(nodes, number, name)?;
    Ok(DraftTree { nodes, output }.finish().0)
}

/// True if a tree has splits by categories.
pub(super) fn has_sets(columns: &TreeColumns) -> bool {
    columns.split_type.iter().any(|&kind| kind != 0)
}

fn is_set(columns: &TreeColumns, position: usize) -> bool {
    columns.split_type.get(position).is_some_and(|&kind| kind != 0)
}

/// The categories of each node that splits by them.
fn sets(columns: &TreeColumns, shape: &Shape) -> Result<BTreeMap<usize, Vec<u32>>> {
    let splits = columns.split_type.iter().enumerate().filter(|(_, kind)| **kind != 0);
    let mut sets: BTreeMap<usize, Option<Vec<u32>>> = splits.map(|(node, _)| (node, None)).collect();
    if !shape.infinite {
        let node = sets.keys().next().copied().unwrap_or_default();
        let feature = columns.split_indices.get(node).and_then(|&index| usize::try_from(index).ok());
        let name = feature.and_then(|feature| shape.features.get(feature)).map_or("", String::as_str);
        return Err(problem!("it splits on categories of the feature {name}")
            .fix("Encode categories as numbers before training, one column of 0 and 1 for each (one-hot)."));
    }
    let wanted = columns.categories_nodes.len();
    whole("categories_segments", columns.categories_segments.len(), wanted)?;
    whole("categories_sizes", columns.categories_sizes.len(), wanted)?;
    let bounds = columns.categories_segments.iter().zip(&columns.categories_sizes);
    for (&node, (&first, &size)) in columns.categories_nodes.iter().zip(bounds) {
        let place = usize::try_from(node).ok().and_then(|node| sets.get_mut(&node));
        let range = usize::try_from(first).ok().zip(usize::try_from(size).ok());
        let own = range.and_then(|(first, size)| columns.categories.get(first..first.checked_add(size)?));
        // A category that XGBoost never finds is in no set.
        let own = own.map(|own| own.iter().filter_map(|&category| u32::try_from(category).ok()));
        let own = own.map(|own| own.filter(|category| *category < OUT_OF_RANGE).collect());
        let (Some(place), Some(own)) = (place, own) else {
            return Err(faults::column("categories", columns.categories.len(), wanted));
        };
        *place = Some(own);
    }
    // Nodes that were pruned may have lost theirs.
    Ok(sets.into_iter().filter_map(|(node, set)| Some((node, set?))).collect())
}

/// The tree, without what sets of categories say.
fn plain(columns: &TreeColumns, group: u64, shape: &Shape) -> Result<Tree> {
    let objects = shape.groups;
    let number = |name, text: &str| text.parse().map_err(|_| faults::count(name, text));
    let nodes = columns.left_children.len();
    let stated = number("num_nodes", &columns.tree_param.num_nodes)?;
    whole("left_children", nodes, stated)?;
    whole("right_children", columns.right_children.len(), nodes)?;
    whole("split_indices", columns.split_indices.len(), nodes)?;
    whole("split_conditions", columns.split_conditions.len(), nodes)?;
    whole("default_left", columns.default_left.len(), nodes)?;
    if nodes == 0 {
        return Err(faults::no_nodes());
    }
    let values = number("size_leaf_vector", &columns.tree_param.size_leaf_vector)?.max(1);
    let output = match usize::try_from(group) {
        _ if values == objects && objects > 1 => Output::Each,
        Ok(object) if values == 1 && object < objects => Output::One(object + shape.first),
        _ if values == 1 => return Err(faults::object(group, objects)),
        _ => return Err(problem!("its leaves hold {values} values for {objects} objects").fix(DAMAGED)),
    };
    let read = |position: usize| node(columns, position, output, shape);
    let nodes = reachable(nodes, read)?;
    Ok(Tree { nodes, output })
}

/// Node `position` as the file has it, its values and its feature checked, its children checked for range only.
fn node(columns: &TreeColumns, position: usize, output: Output, shape: &Shape) -> Result<Node> {
    let (features, objects) = (shape.features.len(), shape.groups);
    let left = columns.left_children[position];
    if left == -1 {
        return leaf(columns, position, output, objects).map(Node::Leaf);
    }
    let nodes = columns.left_children.len();
    let child = |side: &str, child: i64| {
        let in_range = usize::try_from(child).ok().filter(|&child| child < nodes);
        in_range.ok_or_else(|| faults::child(position, side, child, nodes))
    };
    let feature = columns.split_indices[position];
    let threshold = if is_set(columns, position) { 0.0 } else { columns.split_conditions[position] };
    if threshold.is_nan() || !(shape.infinite || threshold.is_finite()) {
        return Err(faults::threshold(position, threshold));
    }
    let index = usize::try_from(feature).ok().filter(|&index| index < features);
    Ok(Node::Split {
        feature: index.ok_or_else(|| faults::feature(position, feature, features))?,
        threshold,
        missing_left: columns.default_left[position].is_set(),
        left: child("left", left)?,
        right: child("right", columns.right_children[position])?,
    })
}

fn leaf(columns: &TreeColumns, position: usize, output: Output, objects: usize) -> Result<Vec<f32>> {
    let no_values = |column| problem!("node {position}: {column} has no {objects} values for this leaf").fix(DAMAGED);
    let values = match (output, &columns.leaf_weights) {
        (Output::One(_), _) => vec![columns.split_conditions[position]],
        (Output::Each, None) => {
            let start = position * objects;
            let values = columns.base_weights.get(start..start + objects);
            values.ok_or_else(|| no_values("base_weights"))?.to_vec()
        }
        (Output::Each, Some(weights)) => {
            let number = columns.right_children[position];
            let start = usize::try_from(number).ok().and_then(|number| number.checked_mul(objects));
            let values = start.and_then(|start| weights.get(start..start.checked_add(objects)?));
            values.ok_or_else(|| no_values("leaf_weights"))?.to_vec()
        }
    };
    check_leaf(position, &values, values.len())?;
    Ok(values)
}
