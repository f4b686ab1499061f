//! Equal leaves once: what stands for a leaf is its number in a table.

use super::container::groups_and_splits;
use super::parts::Parts;
use palpate_onboard::Model;
use palpate_shared::format::{Group, LeafType, SECTION_HEADER_LENGTH, SharedLeaves};
use std::collections::HashMap;

/// The most leaves that two bytes number.
const MOST: usize = 1 << 16;

/// Bytes of a leaf, if they are as many in each of these groups.
fn leaf_length(groups: &[Group], leaf: LeafType, objects: usize) -> Option<usize> {
    let length = |group: &Group| leaf.size() * if group.object.is_some() { 1 } else { objects };
    let first = length(groups.first()?);
    groups.iter().all(|group| length(group) == first).then_some(first)
}

/// Parts with each leaf stored once, if they are smaller then.
pub(super) fn share(mut parts: Parts, leaf: LeafType) -> Parts {
    let Some(length) = leaf_length(&parts.groups, leaf, parts.base.len()) else { return parts };
    let leaves = || parts.leaves.chunks_exact(length);
    // The commonest first: then what is loaded most is close together.
    let mut places: HashMap<&[u8], (usize, usize)> = HashMap::new();
    for (index, values) in leaves().enumerate() {
        places.entry(values).or_insert((0, index)).0 += 1;
    }
    let mut order: Vec<(&[u8], (usize, usize))> = places.into_iter().collect();
    order.sort_unstable_by_key(|&(_, (count, index))| (std::cmp::Reverse(count), index));
    let is_wide = order.len() > 1 << 8;
    let numbers: HashMap<&[u8], usize> =
        order.iter().enumerate().map(|(number, &(values, _))| (values, number)).collect();
    let mut table = SharedLeaves::header(is_wide).to_vec();
    order.iter().for_each(|(values, _)| table.extend_from_slice(values));
    let mut short = Vec::new();
    for values in leaves() {
        let [low, high, ..] = numbers[values].to_le_bytes();
        short.push(low);
        if is_wide {
            short.push(high);
        }
    }
    let section = SECTION_HEADER_LENGTH + table.len().next_multiple_of(4);
    if order.len() <= MOST && section + short.len() < parts.leaves.len() {
        (parts.leaves, parts.shared) = (short, Some(table));
    }
    parts
}

/// Number of leaves in a model's table; `None` if its leaves are where they belong. Where some have one value and some
/// one for each object, how many values.
pub fn different_leaves(model: &Model<'_>) -> Option<usize> {
    let values = model.shared_leaves()?.values().len() / model.leaf_type().size();
    let has_one_for_each = groups_and_splits(model).0.iter().all(|group| group.object.is_none());
    Some(if has_one_for_each { values / model.object_count() } else { values })
}
