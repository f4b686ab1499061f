//! Groups and splits of a compiled model: an open model gives margins, not trees.

use palpate_onboard::Model;
use palpate_shared::format::{Axis, Group, HEADER_LENGTH};

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
