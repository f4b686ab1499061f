//! The sections of a model, found but not yet checked.

use palpate_shared::format::{Axis, Header, Layout, LeafType};

/// Sections of a model. A layout has checked the ones that it reads.
///
/// Short enough for a model to be copied in a few instructions; a call to copy it would bring in a routine that most programs
/// have no other use for. So neighbors that are rarely used apart are one slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sections<'a> {
    /// All of the model's bytes.
    pub(crate) bytes: &'a [u8],
    /// Base margins, then priors, four bytes of each for each object.
    pub(crate) margins: &'a [u8],
    /// Axes, then thresholds; see [`Sections::axes`].
    pub(crate) ranked: &'a [u8],
    pub(crate) groups: &'a [u8],
    pub(crate) nodes: &'a [u8],
    pub(crate) leaves: &'a [u8],
    /// Number of axes.
    pub(crate) axis_count: u16,
    pub(crate) layout: Layout,
    pub(crate) leaf: LeafType,
}

/// Sections as offsets, without the bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    /// Start of each part, in the order of the fields of [`Sections`], and the end of the last one.
    starts: [usize; 6],
    length: usize,
    axis_count: u16,
    layout: Layout,
    leaf: LeafType,
}

impl<'a> Sections<'a> {
    /// The offsets of the sections.
    pub(crate) fn places(&self) -> Places {
        let at = |section| self.offset(section);
        let end = at(self.leaves) + self.leaves.len();
        let [a, b, c, d, e] = [self.margins, self.ranked, self.groups, self.nodes, self.leaves].map(at);
        let &Self { axis_count, layout, leaf, .. } = self;
        Places { starts: [a, b, c, d, e, end], length: self.bytes.len(), axis_count, layout, leaf }
    }

    /// The sections at these places of `bytes`, which must be as long as they were.
    pub(crate) fn at(bytes: &'a [u8], places: &Places) -> Option<Self> {
        if bytes.len() != places.length {
            return None;
        }
        let &Places { starts: [a, b, c, d, e, end], axis_count, layout, leaf, .. } = places;
        Some(Self {
            bytes,
            margins: bytes.get(a..b)?,
            ranked: bytes.get(b..c)?,
            groups: bytes.get(c..d)?,
            nodes: bytes.get(d..e)?,
            leaves: bytes.get(e..end)?,
            axis_count,
            layout,
            leaf,
        })
    }

    /// The header.
    pub(crate) const fn header(&self) -> Header<'a> {
        Header::of(self.bytes)
    }

    /// Number of objects: 1 to 256.
    #[inline(always)]
    pub(crate) const fn objects(&self) -> usize {
        self.margins.len() / 8
    }

    /// Base margins and priors.
    #[inline(always)]
    pub(crate) fn base_and_priors(&self) -> (&'a [u8], &'a [u8]) {
        self.margins.split_at_checked(self.margins.len() / 2).unwrap_or_default()
    }

    /// Axes and thresholds.
    #[inline(always)]
    pub(crate) fn axes_and_cuts(&self) -> (&'a [[u8; Axis::LENGTH]], &'a [u8]) {
        let (axes, cuts) =
            self.ranked.split_at_checked(Axis::LENGTH * usize::from(self.axis_count)).unwrap_or_default();
        (axes.as_chunks().0, cuts)
    }

    /// The offset in the model at which a section, or the rest of one, starts.
    pub(crate) fn offset(&self, section: &[u8]) -> usize {
        section.as_ptr().addr().saturating_sub(self.bytes.as_ptr().addr())
    }
}
