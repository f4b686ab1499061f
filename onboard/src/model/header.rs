//! The header, and the sections that it says there are.

use super::check;
use super::{Model, Stated};
use crate::bytes::{ModelError, Wrong, take};
use crate::layouts::Sections;
use palpate_shared::Descriptor;
use palpate_shared::format::{
    CHECKSUM_LENGTH, HEADER_LENGTH, Header, Key, Layout, LeafType, MAGIC, RAW_FEATURES, VERSION, checksum,
};

/// Checks that bytes are a whole model of a version that is read, as it was written.
// Otherwise its error would be moved, and a call that moves memory takes more flash than all of this.
#[inline(always)]
pub(crate) fn whole(bytes: &[u8]) -> Result<(), ModelError> {
    let found = bytes.len();
    if bytes.iter().zip(MAGIC).any(|(&byte, magic)| byte != magic) {
        return Err(ModelError::NotAModel);
    }
    let Some((header, _)) = Header::split(bytes) else {
        let expected = u32::try_from(HEADER_LENGTH).unwrap_or_default();
        return Err(ModelError::Length { expected, found });
    };
    if header.version() != VERSION {
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
    if stated == computed { Ok(()) } else { Err(ModelError::Checksum { stated, computed }) }
}

/// Finds the sections of a whole model, and checks them.
pub(super) fn read(bytes: &[u8]) -> Result<Model<'_>, Wrong> {
    let header = Header::of(bytes);
    let mut rest = bytes.get(HEADER_LENGTH..).unwrap_or_default();
    let axis_count = header.axes();
    let mut parts = [&[][..]; 7];
    for (part, length) in parts.iter_mut().zip(header.lengths()) {
        let offset = bytes.len() - rest.len();
        *part = take(&mut rest, length).ok_or(Wrong::Section(offset))?;
    }
    if rest.len() != CHECKSUM_LENGTH {
        return Err(Wrong::Section(bytes.len() - rest.len()));
    }
    let [_, optional, margins, ranked, groups, nodes, leaves] = parts;
    let layout = Layout::from_code(header.layout()).ok_or(Wrong::Field(6))?;
    let leaf = LeafType::from_code(header.leaf()).ok_or(Wrong::Field(7))?;
    let descriptor = descriptor(&header).map_err(Wrong::Field)?;
    let sections = Sections { bytes, margins, ranked, groups, nodes, leaves, axis_count, layout, leaf };
    let mut stated = Stated::new(descriptor);
    check::check(&sections, optional, &mut stated)?;
    Ok(Model::of(sections, stated))
}

/// The header's descriptor, `None` for rows of features; the offset of the fault in the header.
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
