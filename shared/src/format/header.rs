//! The fixed part at the start of a model: fields at fixed places.

use super::records::{Axis, Group};

/// Length of the header, in bytes.
pub const HEADER_LENGTH: usize = 96;
/// The first four bytes of every model.
pub const MAGIC: [u8; 4] = *b"PLPT";
/// The version of the format that this crate reads.
pub const VERSION: u16 = 3;

/// The header's bytes, at any address; every field is read from its place when asked for.
///
/// Cost: a few instructions for each field. Cannot fail: every bit pattern has a value; whether it makes sense is checked
/// when a model is opened.
#[derive(Clone, Copy, Debug)]
pub struct Header<'a>(&'a [u8]);

/// A header under construction.
#[derive(Clone, Debug)]
pub struct HeaderBuilder([u8; HEADER_LENGTH]);

/// A number in a header.
trait Field {
    /// The one at `offset`.
    fn read(bytes: &[u8], offset: usize) -> Self;
}

impl Field for u32 {
    /// One function for all fields: inlined, each would put its number together from four bytes.
    #[inline(never)]
    fn read(bytes: &[u8], offset: usize) -> Self {
        bytes.get(offset..).and_then(<[u8]>::first_chunk).map_or(0, |bytes| Self::from_le_bytes(*bytes))
    }
}

impl Field for u8 {
    fn read(bytes: &[u8], offset: usize) -> Self {
        bytes.get(offset).copied().unwrap_or_default()
    }
}

impl Field for u16 {
    fn read(bytes: &[u8], offset: usize) -> Self {
        let [a, b, ..] = u32::read(bytes, offset).to_le_bytes();
        Self::from_le_bytes([a, b])
    }
}

impl Field for u64 {
    fn read(bytes: &[u8], offset: usize) -> Self {
        Self::from(u32::read(bytes, offset)) | Self::from(u32::read(bytes, offset + 4)) << 32
    }
}

impl Field for f32 {
    fn read(bytes: &[u8], offset: usize) -> Self {
        Self::from_bits(u32::read(bytes, offset))
    }
}

macro_rules! fields {
    ($($(#[$meta:meta])* $name:ident, $set:ident: $type:ty = $offset:literal;)*) => {
        impl Header<'_> {
            $($(#[$meta])* pub fn $name(&self) -> $type {
                <$type>::read(self.0, $offset)
            })*
        }
        impl HeaderBuilder {
            $($(#[$meta])* pub fn $set(mut self, value: $type) -> Self {
                if let Some(slot) = self.0.get_mut($offset..).and_then(<[u8]>::first_chunk_mut) {
                    *slot = value.to_le_bytes();
                }
                self
            })*
        }
        #[cfg(test)]
        const FIELDS: &[(usize, usize)] = &[$(($offset, size_of::<$type>())),*];
    };
}

fields! {
    /// The first four bytes as a number; [`MAGIC`] in every model.
    magic, with_magic: u32 = 0;
    /// The format's version.
    version, with_version: u16 = 4;
    /// The code of the [`Layout`](super::Layout).
    layout, with_layout: u8 = 6;
    /// The code of the [`LeafType`](super::LeafType).
    leaf, with_leaf: u8 = 7;
    /// Bytes of the whole model, checksum included.
    length, with_length: u32 = 8;
    /// The descriptor's code, or [`RAW_FEATURES`](super::RAW_FEATURES).
    descriptor, with_descriptor: u8 = 12;
    /// The code of the [`Key`](super::Key) that features are compared as.
    key, with_key: u8 = 13;
    /// Number of objects, less one.
    last_object, with_last_object: u8 = 14;
    /// Number of features, less one.
    last_feature, with_last_feature: u8 = 15;
    /// Number of axes: sorted lists of thresholds.
    axes, with_axes: u16 = 16;
    /// Number of groups of trees.
    groups, with_groups: u16 = 18;
    /// Number of trees of the ensemble.
    trees, with_trees: u32 = 20;
    /// Number of splits of the ensemble.
    splits, with_splits: u32 = 24;
    /// Number of leaves of the ensemble.
    leaves, with_leaves: u32 = 28;
    /// Nats in one unit of a margin.
    unit, with_unit: f32 = 32;
    /// Bits (log2 e nats) in one unit: this times 2^-`unit_shift`, in Q32.
    unit_bits, with_unit_bits: u32 = 36;
    /// See [`unit_bits`](Header::unit_bits).
    unit_shift, with_unit_shift: u8 = 40;
    /// The farthest a margin can be from the full model's, in nats.
    margin_error, with_margin_error: f32 = 44;
    /// The default stopping threshold: error rate / (1 − error rate) in Q56.
    odds, with_odds: u64 = 48;
    /// The default limit of touches.
    max_touches, with_max_touches: u32 = 56;
    /// The distance between fingers that the model was trained for, in lengths of the scene (object = 10).
    spacing, with_spacing: f32 = 60;
    /// The probe's speed that the model was trained for, in lengths of the scene per second.
    speed, with_speed: f32 = 64;
    /// Bytes of the text section.
    text_length, with_text_length: u32 = 68;
    /// The hash of the ensemble that the model was compiled from.
    ensemble, with_ensemble: u64 = 72;
    /// Bytes of the thresholds.
    cuts_length, with_cuts_length: u32 = 80;
    /// Bytes of the splits.
    nodes_length, with_nodes_length: u32 = 84;
    /// Bytes of the leaves.
    leaves_length, with_leaves_length: u32 = 88;
    /// Bytes of the optional sections.
    optional_length, with_optional_length: u32 = 92;
}

impl<'a> Header<'a> {
    /// The header at the start of a model; fields that are not there are 0.
    pub const fn of(model: &'a [u8]) -> Self {
        Self(model)
    }

    /// Bytes of each part between the header and the checksum, in their order: text, optional sections, base margins with
    /// priors, axes with their thresholds, groups, splits, leaves.
    ///
    /// Cost: a few instructions for each part. Cannot fail.
    #[inline]
    pub fn lengths(&self) -> [usize; 7] {
        let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
        [
            length(self.text_length()),
            length(self.optional_length()),
            8 * (usize::from(self.last_object()) + 1),
            length(self.cuts_length()).saturating_add(Axis::LENGTH * usize::from(self.axes())),
            Group::LENGTH * usize::from(self.groups()),
            length(self.nodes_length()),
            length(self.leaves_length()),
        ]
    }

    /// The header at the start of a model and the bytes after it, or `None` if there are too few bytes.
    pub fn split(bytes: &'a [u8]) -> Option<(Self, &'a [u8])> {
        bytes.split_at_checked(HEADER_LENGTH).map(|(header, rest)| (Self(header), rest))
    }
}

impl Default for HeaderBuilder {
    fn default() -> Self {
        Self([0; HEADER_LENGTH]).with_magic(u32::from_le_bytes(MAGIC)).with_version(VERSION)
    }
}

/// A header to be changed.
impl From<Header<'_>> for HeaderBuilder {
    fn from(header: Header<'_>) -> Self {
        let mut bytes = [0; HEADER_LENGTH];
        bytes.iter_mut().zip(header.0).for_each(|(to, from)| *to = *from);
        Self(bytes)
    }
}

impl HeaderBuilder {
    /// The header's bytes.
    pub const fn bytes(&self) -> &[u8; HEADER_LENGTH] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_aligned_to_their_size_and_do_not_overlap() {
        let mut end = 0;
        for &(offset, size) in FIELDS {
            assert!(offset >= end && offset % size == 0, "field at {offset}");
            end = offset + size;
        }
        assert!(end <= HEADER_LENGTH);
    }

    #[test]
    fn a_field_written_is_read_back_and_leaves_the_others_alone() {
        let built = HeaderBuilder::default().with_odds(u64::MAX - 1).with_last_object(9).with_unit(0.25);
        let (header, rest) = Header::split(built.bytes()).unwrap();
        assert!(rest.is_empty());
        assert_eq!((header.odds(), header.last_object(), header.unit()), (u64::MAX - 1, 9, 0.25));
        assert_eq!((header.magic().to_le_bytes(), header.version(), header.max_touches()), (MAGIC, VERSION, 0));
    }
}
