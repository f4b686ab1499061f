//! The header, and the sections that it says there are.

use super::Model;
use crate::bytes::{ModelError, take};
use crate::layouts::Sections;
use palpate_shared::Descriptor;
use palpate_shared::format::{
    CHECKSUM_LENGTH, HEADER_LENGTH, Header, Key, Layout, LeafType, MAGIC, RAW_FEATURES, TrainedTouches, VERSION,
    checksum,
};

/// Finds the sections, for a model that states nothing about its touches.
#[inline(never)]
pub(super) fn read(bytes: &[u8]) -> Result<Model<'_>, ModelError> {
    let found = bytes.len();
    if bytes.iter().zip(MAGIC).any(|(&byte, magic)| byte != magic) {
        return Err(ModelError::NotAModel);
    }
    let Some((header, mut rest)) = Header::split(bytes) else {
        let expected = u32::try_from(HEADER_LENGTH).unwrap_or_default();
        return Err(ModelError::Length { expected, found });
    };
    if header.version() == 0 || header.version() > VERSION {
        return Err(ModelError::Version(header.version()));
    }
    let expected = header.length();
    if usize::try_from(expected).ok() != Some(found) {
        return Err(ModelError::Length { expected, found });
    }
    let Some((body, stated)) = bytes.split_last_chunk::<CHECKSUM_LENGTH>() else {
        return Err(ModelError::Length { expected, found });
    };
    let (stated, computed) = (u32::from_le_bytes(*stated), checksum(body));
    if stated != computed {
        return Err(ModelError::Checksum { stated, computed });
    }
    let objects = u16::from(header.last_object()) + 1;
    let mut section = |length: usize| {
        let offset = found - rest.len();
        take(&mut rest, length).ok_or(ModelError::Section { offset })
    };
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    section(length(header.text_length()))?;
    let optional = section(length(header.optional_length()))?;
    let base = section(4 * usize::from(objects))?;
    section(4 * usize::from(objects))?;
    let axes = section(4 * usize::from(header.axes()))?;
    let cuts = section(length(header.cuts_length()))?;
    let groups = section(8 * usize::from(header.groups()))?;
    let nodes = section(length(header.nodes_length()))?;
    let leaves = section(length(header.leaves_length()))?;
    let layout = Layout::from_code(header.layout()).ok_or(ModelError::Field { offset: 6 })?;
    let leaf = LeafType::from_code(header.leaf()).ok_or(ModelError::Field { offset: 7 })?;
    let descriptor = descriptor(&header).map_err(|offset| ModelError::Field { offset })?;
    if rest.len() != CHECKSUM_LENGTH {
        return Err(ModelError::Section { offset: found - rest.len() });
    }
    let touches = TrainedTouches::full(descriptor.is_some_and(Descriptor::needs_pose));
    let sections = Sections { bytes, optional, base, axes, cuts, groups, nodes, leaves, objects, layout, leaf };
    Ok(Model { sections, descriptor, touches, by_object: 0 })
}

/// The header's descriptor, `None` for rows of features; the place of what is wrong in the header.
fn descriptor(header: &Header<'_>) -> Result<Option<Descriptor>, usize> {
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
