//! Checks made when a model is opened, so that no later step can fail.

use super::{HAS_SHARED_LEAVES, Stated, optional};
use crate::bytes::Wrong;
use crate::layouts::{Sections, built_in, preorder, ranks};
use palpate_shared::format::{Group, Header, Key, Layout, LeafType, MARGIN_LIMIT, SharedLeaves, Tag};

/// The largest shift of a group.
const MAX_SHIFT: u8 = 24;

/// Checks the numbers of the header, the axes, the groups, and the lengths of splits and leaves. Sets what the optional
/// sections state.
#[inline(never)]
pub(super) fn check(model: &Sections<'_>, optional: &[u8], stated: &mut Stated) -> Result<(), Wrong> {
    let header = &model.header();
    if Key::from_code(header.key()).is_none() {
        return Err(Wrong::Field(13));
    }
    if let Some(offset) = wrong_number(header) {
        return Err(Wrong::Field(offset));
    }
    let built_in = built_in::layout(model.layout);
    // For code, the type of leaves states only their rounding.
    let is_code = built_in::layout(Layout::Code) && model.layout == Layout::Code;
    if is_code && model.leaf == LeafType::F32 {
        return Err(Wrong::Field(7));
    }
    if !built_in || !(is_code || built_in::leaf(model.leaf)) {
        return Err(Wrong::NotBuiltIn(if built_in { 7 } else { 6 }));
    }
    optional::check(model, optional, stated)?;
    ranks::check(model, header.last_feature())?;
    let section = |ok: bool, part: &[u8]| if ok { Ok(()) } else { Err(Wrong::Section(model.offset(part))) };
    let values = model.objects();
    let mut shared = None;
    if built_in::SHARED_LEAVES && stated.by_object & HAS_SHARED_LEAVES != 0 {
        shared = SharedLeaves::from_bytes(optional::find(optional, Tag::SharedLeaves));
    }
    let mut nodes = model.nodes;
    let mut leaves = model.leaves;
    if is_code {
        section(model.ranked.is_empty(), model.ranked)?;
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
    for bytes in model.groups.as_chunks().0 {
        let wrong = Wrong::Field(model.offset(bytes));
        let group = Group::from_bytes(*bytes).ok_or(wrong)?;
        let known = group.object.is_none_or(|object| usize::from(object) < values);
        let integer = model.leaf != LeafType::F32 || group.shift == 0;
        if group.shift > shift || !known || !integer {
            return Err(wrong);
        }
        shift = group.shift;
        if model.leaf != LeafType::F32 {
            // Shifted at most by 15 + MAX_SHIFT; a right shift of the limit cannot overflow as one of the trees could.
            if group.trees > (limit >> leaf_bits) >> shift {
                return Err(Wrong::MarginRange);
            }
            range = range.saturating_add(group.trees << ((leaf_bits + shift) & 31));
        }
        let length = model.leaf.size() * if group.object.is_none() { values } else { 1 };
        let leaf = shared.map_or(length, |shared| shared.number_length());
        let before = leaves;
        let fits = match model.layout {
            Layout::Compact if built_in::layout(Layout::Compact) => {
                preorder::check(&group, &mut nodes, &mut leaves, leaf, 3)
            }
            Layout::Wide if built_in::layout(Layout::Wide) => preorder::check(&group, &mut nodes, &mut leaves, leaf, 6),
            _ => return Err(wrong),
        };
        section(fits.is_some(), model.nodes)?;
        if let Some(shared) = shared {
            let own = before.get(..before.len() - leaves.len()).unwrap_or_default();
            if let Some(unknown) = shared.first_unknown(own, length) {
                return Err(Wrong::Field(model.offset(before) + unknown * leaf));
            }
        }
    }
    section(nodes.is_empty(), nodes)?;
    section(leaves.is_empty(), leaves)?;
    if model.leaf != LeafType::F32 {
        for &base in model.base_and_priors().0.as_chunks().0 {
            largest_base = largest_base.max(i32::from_le_bytes(base).unsigned_abs());
        }
    }
    if range.saturating_add(largest_base) > limit { Err(Wrong::MarginRange) } else { Ok(()) }
}

/// The offset of a number of the header that makes no sense: a unit beyond its limits or in other bits than `unit_bits`
/// states, a threshold that a tie would pass, no touch. Without floating point.
fn wrong_number(header: &Header<'_>) -> Option<usize> {
    const LEAST_UNIT: u32 = 0x3380_0000; // 2^-24 nats
    const LARGEST_UNIT: u32 = 0x3f00_0000; // 0.5 nats
    const LOG2_E: u64 = 3_098_164_010; // in Q31
    let unit = header.unit().to_bits();
    if !(LEAST_UNIT..=LARGEST_UNIT).contains(&unit) {
        return Some(32);
    }
    // The unit is mantissa · 2^(exponent − 150) nats, and unit_bits · 2^-(32 + unit_shift) bits.
    let (mantissa, exponent) = (unit & 0x7f_ffff | 0x80_0000, unit >> 23);
    let bits = u64::from(mantissa) * LOG2_E;
    let shift = 149_u32.wrapping_sub(exponent).wrapping_sub(header.unit_shift().into());
    if shift > 63 {
        return Some(40);
    }
    if (bits >> shift).abs_diff(header.unit_bits().into()) > 2 {
        return Some(36);
    }
    if header.odds() >= 1 << 56 {
        return Some(48);
    }
    (header.max_touches() == 0).then_some(56)
}
