//! What is checked when a model is opened, so that no later step can fail.

use crate::bytes::take;
use crate::error::ModelError;
use crate::model::Model;
use palpate_shared::Descriptor;
use palpate_shared::format::{
    Axis, Group, Header, Key, Layout, LeafType, MARGIN_LIMIT, MAX_COMPLETE_DEPTH, RAW_FEATURES,
};

/// The largest shift of a group.
const MAX_SHIFT: u8 = 24;

/// The header's descriptor, `None` for rows of features.
pub(crate) fn descriptor(header: &Header<'_>) -> Result<Option<Descriptor>, ModelError> {
    if header.descriptor() == RAW_FEATURES {
        return Ok(None);
    }
    let descriptor = Descriptor::from_code(header.descriptor()).ok_or(ModelError::Field { offset: 12 })?;
    if usize::from(header.last_feature()) + 1 != descriptor.feature_count() {
        return Err(ModelError::Field { offset: 15 });
    }
    if header.key() != Key::Whole.code() {
        return Err(ModelError::Field { offset: 13 });
    }
    Ok(Some(descriptor))
}

/// Everything else: the numbers of the header, the axes, the groups, and the lengths of splits and leaves.
pub(crate) fn model(model: &Model<'_>, header: &Header<'_>) -> Result<(), ModelError> {
    if Key::from_code(header.key()).is_none() {
        return Err(ModelError::Field { offset: 13 });
    }
    let positive = |bits: u32| bits.wrapping_sub(1) < f32::INFINITY.to_bits() - 1;
    if !positive(header.unit().to_bits()) {
        return Err(ModelError::Field { offset: 32 });
    }
    if header.unit_shift() > 63 {
        return Err(ModelError::Field { offset: 40 });
    }
    if model.leaf == LeafType::F32 && cfg!(not(feature = "f32-leaves")) {
        return Err(ModelError::FloatLeaves);
    }
    axes(model, header)?;
    let section =
        |ok: bool, part: &[u8]| if ok { Ok(()) } else { Err(ModelError::Section { offset: model.offset(part) }) };
    let values = usize::from(model.objects);
    let mut nodes = model.nodes;
    let mut leaves = model.leaves;
    if model.layout == Layout::Grid {
        let cells = grid_cells(model).ok_or(ModelError::Section { offset: model.offset(model.axes) })?;
        section(take(&mut leaves, cells * values * model.leaf.size()).is_some(), model.leaves)?;
        section(model.groups.is_empty(), model.groups)?;
    }
    let largest_leaf: u64 = match model.leaf {
        LeafType::I8 => 1 << 7,
        LeafType::I16 => 1 << 15,
        LeafType::F32 => 0,
    };
    let mut range: u64 = 1 << 20;
    let mut shift = MAX_SHIFT;
    for (index, &bytes) in model.groups.as_chunks().0.iter().enumerate() {
        let wrong = ModelError::Field { offset: model.offset(model.groups) + Group::LENGTH * index };
        let group = Group::from_bytes(bytes).ok_or(wrong)?;
        let known = group.object.is_none_or(|object| u16::from(object) < model.objects);
        let integer = model.leaf != LeafType::F32 || group.shift == 0;
        if group.shift > shift || !known || !integer {
            return Err(wrong);
        }
        shift = group.shift;
        range = range.saturating_add((u64::from(group.trees) * largest_leaf) << group.shift);
        let leaf = model.leaf.size() * if group.object.is_none() { values } else { 1 };
        let fits = match model.layout {
            Layout::Complete if (1..=MAX_COMPLETE_DEPTH).contains(&group.depth) => {
                complete_group(&group, &mut nodes, &mut leaves, leaf)
            }
            Layout::Compact if group.depth == 0 => preorder_group(&group, &mut nodes, &mut leaves, leaf, 3),
            Layout::Wide if group.depth == 0 => preorder_group(&group, &mut nodes, &mut leaves, leaf, 6),
            _ => return Err(wrong),
        };
        section(fits.is_some(), model.nodes)?;
    }
    section(nodes.is_empty(), nodes)?;
    section(leaves.is_empty(), leaves)?;
    if model.leaf != LeafType::F32 {
        for object in 0..values {
            range = range.max(u64::from(model.base(object).unsigned_abs()).saturating_add(range));
        }
    }
    if range > u64::from(MARGIN_LIMIT.unsigned_abs()) { Err(ModelError::MarginRange) } else { Ok(()) }
}

/// Every axis is of a feature that there is, columns can be numbered in a byte, thresholds fill their section.
fn axes(model: &Model<'_>, header: &Header<'_>) -> Result<(), ModelError> {
    let start = model.offset(model.axes);
    let mut columns = 0;
    let mut cuts = model.cuts;
    for (index, &bytes) in model.axes.as_chunks().0.iter().enumerate() {
        let wrong = ModelError::Field { offset: start + Axis::LENGTH * index };
        let axis = Axis::from_bytes(bytes).ok_or(wrong)?;
        columns += axis.columns.count();
        if axis.feature > header.last_feature() || columns > 256 {
            return Err(wrong);
        }
        take(&mut cuts, axis.cuts_length()).ok_or(ModelError::Section { offset: model.offset(model.cuts) })?;
    }
    // Wide splits number thresholds of four bytes throughout; the others have axes.
    let ends = if model.layout == Layout::Wide {
        model.axes.is_empty() && cuts.len().is_multiple_of(4)
    } else {
        cuts.is_empty()
    };
    if ends { Ok(()) } else { Err(ModelError::Section { offset: model.offset(cuts) }) }
}

/// The number of cells of a grid: for each of its two axes, one between any two thresholds, one at either end, and one
/// for a missing value.
fn grid_cells(model: &Model<'_>) -> Option<usize> {
    let (&[first, second], []) = model.axes.as_chunks() else { return None };
    let side = |bytes| Axis::from_bytes(bytes).map(|axis| usize::from(axis.count) + 2);
    Some(side(first)? * side(second)?)
}

fn complete_group(group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], leaf: usize) -> Option<()> {
    let slots = 1_usize << group.depth.min(MAX_COMPLETE_DEPTH);
    let trees = usize::try_from(group.trees).ok()?;
    take(nodes, trees.checked_mul(2 * slots)?)?;
    take(leaves, trees.checked_mul(slots)?.checked_mul(leaf)?)?;
    Some(())
}

fn preorder_group(group: &Group, nodes: &mut &[u8], leaves: &mut &[u8], leaf: usize, node: usize) -> Option<()> {
    for _ in 0..group.trees {
        let (&splits, rest) = nodes.split_first_chunk()?;
        *nodes = rest;
        let splits = usize::from(u16::from_le_bytes(splits));
        take(nodes, splits * node)?;
        take(leaves, (splits + 1) * leaf)?;
    }
    Some(())
}
