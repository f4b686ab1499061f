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

/// The same as offsets, without the bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    /// Where each part starts, in the order of the fields of [`Sections`], and where the last one ends.
    starts: [usize; 8],
    length: usize,
    objects: u16,
    layout: Layout,
    leaf: LeafType,
}

impl<'a> Sections<'a> {
    /// The offsets of the sections.
    pub(crate) fn places(&self) -> Places {
        let at = |section| self.offset(section);
        let end = at(self.leaves) + self.leaves.len();
        let starts = [self.optional, self.base, self.axes, self.cuts, self.groups, self.nodes, self.leaves].map(at);
        let [a, b, c, d, e, f, g] = starts;
        let (length, objects) = (self.bytes.len(), self.objects);
        Places { starts: [a, b, c, d, e, f, g, end], length, objects, layout: self.layout, leaf: self.leaf }
    }

    /// The sections at these places of `bytes`, of which there have to be as many as there were.
    pub(crate) fn at(bytes: &'a [u8], places: &Places) -> Option<Self> {
        if bytes.len() != places.length {
            return None;
        }
        let &Places { starts: [a, b, c, d, e, f, g, end], objects, layout, leaf, .. } = places;
        // The priors stand between base and axes, and are as long as the base.
        Some(Self {
            bytes,
            optional: bytes.get(a..b)?,
            base: bytes.get(b..b + (c - b) / 2)?,
            axes: bytes.get(c..d)?,
            cuts: bytes.get(d..e)?,
            groups: bytes.get(e..f)?,
            nodes: bytes.get(f..g)?,
            leaves: bytes.get(g..end)?,
            objects,
            layout,
            leaf,
        })
    }

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
