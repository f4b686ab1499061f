//! Groups, splits and leaves of a compiled model: an open model gives margins, not trees.

use palpate_onboard::Model;
use palpate_shared::format::{Axis, Group, HEADER_LENGTH, Layout};

/// The groups of a model, and the bytes of its splits, in the order of sections that FORMAT.md gives.
pub(super) fn groups_and_splits<'m>(model: &Model<'m>) -> (Vec<Group>, &'m [u8]) {
    let (bytes, header) = (model.bytes(), model.header());
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    let groups = HEADER_LENGTH
        + length(header.text_length())
        + length(header.optional_length())
        + 8 * model.object_count()
        + Axis::LENGTH * usize::from(header.axes())
        + length(header.cuts_length());
    let splits = groups + Group::LENGTH * usize::from(header.groups());
    let records = bytes.get(groups..splits).unwrap_or_default().as_chunks().0;
    let found = records.iter().filter_map(|record| Group::from_bytes(*record)).collect();
    (found, bytes.get(splits..splits + length(header.nodes_length())).unwrap_or_default())
}

/// Numbers of trees after which a walk for a class alone may end.
pub(crate) fn ends_of_walks(model: &Model<'_>) -> Vec<usize> {
    let groups = groups_and_splits(model).0;
    let trees = |groups: &[Group]| groups.iter().map(|group| group.trees as usize).sum();
    let exits = model.early_exits().map(|exit| groups.len().min(exit.groups.into()));
    exits.map(|end| trees(&groups[..end])).collect()
}

/// The groups of a model, and how many leaves each of their trees has, in the model's order. Tables have no groups.
pub(crate) fn leaves_of_trees(model: &Model<'_>) -> Vec<(Group, Vec<usize>)> {
    let (groups, mut rest) = groups_and_splits(model);
    let size = if model.layout() == Layout::Wide { 6 } else { 3 };
    let mut leaves = |group: &Group| {
        if model.layout() == Layout::Complete {
            return 1 << group.depth;
        }
        // There is one tree for each that a group states: that was checked when the model was opened.
        let (count, after) =
            rest.split_first_chunk().map_or((0, rest), |(count, after)| (u16::from_le_bytes(*count), after));
        rest = after.get(usize::from(count) * size..).unwrap_or_default();
        usize::from(count) + 1
    };
    groups.into_iter().map(|group| (group, (0..group.trees).map(|_| leaves(&group)).collect())).collect()
}
