//! A model's bytes, checked once, then read in place.

use crate::built_in;
use crate::bytes::{at, take};
use crate::error::ModelError;
use crate::validate;
use palpate_shared::Descriptor;
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH, Header, Key, Layout, LeafType, MAGIC, VERSION, checksum};

/// A compiled model, read in place from bytes that stay where they are (flash, at any alignment).
///
/// `FORMAT.md` of `palpate-shared` describes the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) base: &'a [u8],
    pub(crate) axes: &'a [u8],
    pub(crate) cuts: &'a [u8],
    pub(crate) groups: &'a [u8],
    pub(crate) nodes: &'a [u8],
    pub(crate) leaves: &'a [u8],
    pub(crate) objects: u16,
    pub(crate) layout: Layout,
    pub(crate) leaf: LeafType,
    pub(crate) descriptor: Option<Descriptor>,
}

impl<'a> Model<'a> {
    /// Opens a model, checking everything that reading it later relies on: after this nothing can fail.
    ///
    /// Cost: about 50 instructions a byte, nearly all of them for the checksum; call it once and keep the result.
    ///
    /// # Errors
    /// [`ModelError`], for bytes that are truncated, too many, of another version, changed, or meaningless.
    #[inline(never)]
    pub fn new(bytes: &'a [u8]) -> Result<Self, ModelError> {
        let mut model = Self::read(bytes);
        if let Ok(opened) = &model
            && let Err(error) = validate::model(opened)
        {
            model = Err(error);
        }
        model
    }

    /// Finds the sections.
    #[inline(never)]
    fn read(bytes: &'a [u8]) -> Result<Self, ModelError> {
        let found = bytes.len();
        if bytes.iter().zip(MAGIC).any(|(&byte, magic)| byte != magic) {
            return Err(ModelError::NotAModel);
        }
        let Some((header, mut rest)) = Header::split(bytes) else {
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
        let base = section(4 * usize::from(objects))?;
        section(4 * usize::from(objects))?;
        let axes = section(4 * usize::from(header.axes()))?;
        let cuts = section(length(header.cuts_length()))?;
        let groups = section(8 * usize::from(header.groups()))?;
        let nodes = section(length(header.nodes_length()))?;
        let leaves = section(length(header.leaves_length()))?;
        let layout = Layout::from_code(header.layout()).ok_or(ModelError::Field { offset: 6 })?;
        let leaf = LeafType::from_code(header.leaf()).ok_or(ModelError::Field { offset: 7 })?;
        let descriptor = validate::descriptor(&header).map_err(|offset| ModelError::Field { offset })?;
        if rest.len() != CHECKSUM_LENGTH {
            return Err(ModelError::Section { offset: found - rest.len() });
        }
        Ok(Self { bytes, base, axes, cuts, groups, nodes, leaves, objects, layout, leaf, descriptor })
    }

    /// The header.
    pub fn header(&self) -> Header<'a> {
        // A model is only made from bytes that have a header.
        Header::split(self.bytes).map_or(Header::EMPTY, |(header, _)| header)
    }

    /// All of the model's bytes.
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// How many objects the model knows: 1 to 256.
    pub fn object_count(&self) -> usize {
        usize::from(self.objects)
    }

    /// How many features a row has: 1 to 256.
    pub fn feature_count(&self) -> usize {
        usize::from(self.header().last_feature()) + 1
    }

    /// Which features a touch is turned into; `None` for a model over rows of features.
    pub const fn descriptor(&self) -> Option<Descriptor> {
        self.descriptor
    }

    /// How the trees are laid out.
    pub const fn layout(&self) -> Layout {
        self.layout
    }

    /// What leaves are stored as.
    pub const fn leaf_type(&self) -> LeafType {
        self.leaf
    }

    /// Whether margins are added in f32; never without the feature `f32-leaves`, so that no code for it is linked.
    pub(crate) const fn is_float(&self) -> bool {
        built_in::leaf(LeafType::F32) && matches!(self.leaf, LeafType::F32)
    }

    /// What features are compared as.
    pub fn key(&self) -> Key {
        Key::from_code(self.header().key()).unwrap_or(Key::Whole)
    }

    /// Nats in one unit of a margin.
    pub fn unit(&self) -> f32 {
        self.header().unit()
    }

    /// The farthest that a margin can be from the full model's, in nats.
    pub fn margin_error(&self) -> f32 {
        self.header().margin_error()
    }

    /// The checksum, which names the model: two models with the same are the same.
    pub fn checksum(&self) -> u32 {
        self.bytes.last_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    /// The version of the program that exported the model.
    pub fn tool_version(&self) -> &'a str {
        self.text(0)
    }

    /// The name of an object; empty for one that the model does not know.
    pub fn object_name(&self, object: usize) -> &'a str {
        self.text(object.saturating_add(1))
    }

    /// The evidence for an object before any touch, in units of a margin.
    pub fn prior(&self, object: usize) -> i32 {
        self.priors().get(object).map_or(0, |prior| i32::from_le_bytes(*prior))
    }

    /// Where a section starts.
    pub(crate) fn offset(&self, section: &[u8]) -> usize {
        section.as_ptr().addr().saturating_sub(self.bytes.as_ptr().addr())
    }

    /// The evidence for each object before any touch.
    pub(crate) fn priors(&self) -> &'a [[u8; 4]] {
        let start = HEADER_LENGTH + self.text_length() + self.base.len();
        self.bytes.get(start..start + self.base.len()).unwrap_or_default().as_chunks().0
    }

    fn text_length(&self) -> usize {
        usize::try_from(self.header().text_length()).unwrap_or_default()
    }

    fn text(&self, index: usize) -> &'a str {
        let mut text = self.bytes.get(HEADER_LENGTH..).unwrap_or_default();
        text = text.get(..self.text_length()).unwrap_or_default();
        for _ in 0..index {
            next_text(&mut text);
        }
        core::str::from_utf8(next_text(&mut text)).unwrap_or_default()
    }
}

/// The next string: a byte for its length, then its UTF-8.
fn next_text<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let length = usize::from(at(text, 0));
    take(text, 1).and_then(|_| take(text, length)).unwrap_or_default()
}
