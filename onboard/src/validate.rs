//! What is checked when a model is opened, so that no later step can fail.

use crate::built_in;
use crate::bytes::take;
use crate::error::ModelError;
use crate::model::Model;
use palpate_shared::Descriptor;
use palpate_shared::format::{
    Axis, Group, Header, Key, Layout, LeafType, MARGIN_LIMIT, MAX_COMPLETE_DEPTH, RAW_FEATURES,
};

/// The largest shift of a group.
const MAX_SHIFT: u8 = 24;

/// The header's descriptor, `None` for rows of features; the place of what is wrong in the header.
pub(crate) fn descriptor(header: &Header<'_>) -> Result<Option<Descriptor>, usize> {
    if header.descriptor() == RAW_FEATURES {
        return Ok(None);
    }
    let descriptor = Descriptor::from_code(header.descriptor()).ok_or(12_usize)?;
    if usize::from(header.last_feature()) + 1 != descriptor.feature_count() {
        return Err(15);
    }
    if header.key() != Key::Whole.code() {
        return Err(13);
    }
    Ok(Some(descriptor))
}

/// Everything else: the numbers of the header, the axes, the groups, and the lengths of splits and leaves.
#[inline(never)]
pub(crate) fn model(model: &Model<'_>) -> Result<(), ModelError> {
    let header = &model.header();
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
    let built_in = built_in::layout(model.layout);
    if !built_in || !built_in::leaf(model.leaf) {
        return Err(ModelError::NotBuiltIn { offset: if built_in { 7 } else { 6 } });
    }
    axes(model, header)?;
    let section =
        |ok: bool, part: &[u8]| if ok { Ok(()) } else { Err(ModelError::Section { offset: model.offset(part) }) };
    let values = usize::from(model.objects);
    let mut nodes = model.nodes;
    let mut leaves = model.leaves;
    if built_in::layout(Layout::Grid) && model.layout == Layout::Grid {
        let cells = grid_cells(model).ok_or(ModelError::Section { offset: model.offset(model.axes) })?;
        section(take(&mut leaves, cells * values * model.leaf.size()).is_some(), model.leaves)?;
        section(model.groups.is_empty(), model.groups)?;
    }
    // The largest leaf, as a power of two.
    let leaf_bits = match model.leaf {
        LeafType::I8 => 7,
        LeafType::I16 => 15,
        LeafType::F32 => 0,
    };
    let limit = MARGIN_LIMIT.unsigned_abs();
    let (mut range, mut largest_base) = (1_u32 << 20, 0);
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
        if model.leaf != LeafType::F32 {
            // Shifted at most by 15 + MAX_SHIFT; a right shift of the limit cannot overflow as one of the trees could.
            if group.trees > (limit >> leaf_bits) >> shift {
                return Err(ModelError::MarginRange);
            }
            range = range.saturating_add(group.trees << ((leaf_bits + shift) & 31));
        }
        let leaf = model.leaf.size() * if group.object.is_none() { values } else { 1 };
        let fits = match model.layout {
            Layout::Complete
                if built_in::layout(Layout::Complete) && (1..=MAX_COMPLETE_DEPTH).contains(&group.depth) =>
            {
                complete_group(&group, &mut nodes, &mut leaves, leaf)
            }
            Layout::Compact if built_in::layout(Layout::Compact) && group.depth == 0 => {
                preorder_group(&group, &mut nodes, &mut leaves, leaf, 3)
            }
            Layout::Wide if built_in::layout(Layout::Wide) && group.depth == 0 => {
                preorder_group(&group, &mut nodes, &mut leaves, leaf, 6)
            }
            _ => return Err(wrong),
        };
        section(fits.is_some(), model.nodes)?;
    }
    section(nodes.is_empty(), nodes)?;
    section(leaves.is_empty(), leaves)?;
    if model.leaf != LeafType::F32 {
        for &base in model.base.as_chunks().0 {
            largest_base = largest_base.max(i32::from_le_bytes(base).unsigned_abs());
        }
    }
    if range.saturating_add(largest_base) > limit { Err(ModelError::MarginRange) } else { Ok(()) }
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
    let trees = usize::try_from(group.trees).ok()?;
    // Two bytes a slot; compared like this nothing can overflow.
    if trees > nodes.len() >> 1 >> (group.depth & 15) {
        return None;
    }
    let slots = trees << (group.depth & 15);
    take(nodes, 2 * slots)?;
    take(leaves, slots.checked_mul(leaf)?)?;
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
