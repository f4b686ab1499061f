//! The sections of a model, found but not yet checked.

use palpate_shared::format::{Header, Layout, LeafType};

/// Where the sections of a model are. What a layout reads from them it has checked before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sections<'a> {
    /// All of the model's bytes.
    pub(crate) bytes: &'a [u8],
    /// The optional sections.
    pub(crate) optional: &'a [u8],
    pub(crate) base: &'a [u8],
    pub(crate) axes: &'a [u8],
    pub(crate) cuts: &'a [u8],
    pub(crate) groups: &'a [u8],
    pub(crate) nodes: &'a [u8],
    pub(crate) leaves: &'a [u8],
    pub(crate) objects: u16,
    pub(crate) layout: Layout,
    pub(crate) leaf: LeafType,
}

impl<'a> Sections<'a> {
    /// The header.
    pub(crate) fn header(&self) -> Header<'a> {
        // Sections are only found in bytes that have a header.
        Header::split(self.bytes).map_or(Header::EMPTY, |(header, _)| header)
    }

    /// The offset in the model at which a section, or what is left of one, starts.
    pub(crate) fn offset(&self, section: &[u8]) -> usize {
        section.as_ptr().addr().saturating_sub(self.bytes.as_ptr().addr())
    }
}
