//! Reasons why bytes are not a model.

use core::fmt;
use palpate_shared::format::{VERSION, take_section};

/// Reason why bytes are not a model; [`ModelError::offset`] is the place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModelError {
    /// There are fewer bytes than the model has, or more.
    Length {
        /// Number of bytes the model should have.
        expected: u32,
        /// Number of bytes there are.
        found: usize,
    },
    /// The bytes do not start as a model does.
    NotAModel,
    /// The model is of another version of the format.
    Version(u16),
    /// The bytes were changed since the export.
    Checksum {
        /// The checksum that the model states.
        stated: u32,
        /// The checksum of the bytes.
        computed: u32,
    },
    /// A field of the header has an invalid value.
    Field {
        /// Its offset in the model.
        offset: usize,
    },
    /// A section does not have the length stated in the header.
    Section {
        /// Its offset in the model.
        offset: usize,
    },
    /// The model has an optional section that a reader has to understand, and this crate does not.
    NotUnderstood {
        /// The section's tag.
        tag: u16,
        /// Its offset in the model.
        offset: usize,
    },
    /// Margins could grow beyond [`MARGIN_LIMIT`](palpate_shared::format::MARGIN_LIMIT).
    MarginRange,
    /// This crate was built without the feature that reads such a model.
    NotBuiltIn {
        /// The offset of the missing part: 6 for the layout, 7 for the type of leaf.
        offset: usize,
    },
    /// The model's trees are code, which it has to be opened with.
    NeedsCode,
}

/// Fault in a model whose bytes are as they were written, with its offset: an error that fits two registers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wrong {
    Field(usize),
    Section(usize),
    /// At a section whose tag stands there.
    NotUnderstood(usize),
    MarginRange,
    NotBuiltIn(usize),
}

impl Wrong {
    /// The error as a caller that opens a model sees it.
    pub(crate) fn in_model(self, model: &[u8]) -> ModelError {
        match self {
            Self::Field(offset) => ModelError::Field { offset },
            Self::Section(offset) => ModelError::Section { offset },
            Self::NotUnderstood(offset) => {
                let tag = take_section(&mut model.get(offset..).unwrap_or_default()).map_or(0, |section| section.tag);
                ModelError::NotUnderstood { tag, offset }
            }
            Self::MarginRange => ModelError::MarginRange,
            Self::NotBuiltIn(offset) => ModelError::NotBuiltIn { offset },
        }
    }
}

impl ModelError {
    /// The byte at which the model went wrong, counted from 0.
    pub fn offset(&self) -> usize {
        match *self {
            Self::Length { expected, found } => usize::try_from(expected).unwrap_or(found).min(found),
            Self::NotAModel => 0,
            Self::Version(_) => 4,
            Self::NeedsCode => 6,
            Self::Checksum { .. } | Self::MarginRange => 8,
            Self::Field { offset }
            | Self::Section { offset }
            | Self::NotUnderstood { offset, .. }
            | Self::NotBuiltIn { offset } => offset,
        }
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected, found } if usize::try_from(*expected).is_ok_and(|e| e > *found) => {
                write!(f, "the model is truncated: {found} bytes of {expected}")
            }
            Self::Length { expected, found } => write!(f, "the model has {expected} bytes, but there are {found}"),
            Self::NotAModel => f.write_str("this is not a Palpate model"),
            Self::Version(version) => {
                write!(f, "the model is of format version {version}, and this program reads version {VERSION}")
            }
            Self::Checksum { stated, computed } => {
                write!(f, "the checksum is {computed:08x} where the model states {stated:08x}: its bytes were changed")
            }
            Self::Field { .. } => f.write_str("a field of the model has an invalid value"),
            Self::Section { .. } => f.write_str("a section of the model does not have the length stated in the header"),
            Self::NotUnderstood { tag, .. } => {
                write!(f, "the model relies on section {tag}, which this program does not know: it needs a newer one")
            }
            Self::MarginRange => f.write_str("the model's margins could overflow"),
            Self::NeedsCode => {
                f.write_str("the model's trees are code, beside it, for a chip's program to be built with")
            }
            Self::NotBuiltIn { offset } => {
                let what = if *offset == 6 { "layout" } else { "type of leaf" };
                write!(f, "this program was built without palpate-onboard's feature for the model's {what}")
            }
        }
    }
}

impl core::error::Error for ModelError {}
