//! The file of a model around its content: header, text, optional sections, checksum. The content here is trees.

use crate::error::{Error, Result, problem};
use palpate_onboard::Model;
use palpate_shared::format::{
    CHECKSUM_LENGTH, Group, HEADER_LENGTH, Header, HeaderBuilder, Section, Tag, checksum, take_section,
};

/// An optional section of a model's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnedSection {
    /// Its tag.
    pub tag: u16,
    /// True if a reader that does not know the tag must refuse the model.
    pub must_understand: bool,
    /// Its content.
    pub content: Vec<u8>,
}

impl OwnedSection {
    /// A section with one of the format's tags.
    pub fn new(tag: Tag, must_understand: bool, content: impl Into<Vec<u8>>) -> Self {
        Self { tag: tag.code(), must_understand, content: content.into() }
    }
}

/// Parts of a model's file.
pub(super) struct Container {
    /// Lengths of the other parts are filled in when it is written.
    pub(super) header: HeaderBuilder,
    /// Texts, with zeros up to a multiple of four.
    pub(super) text: Vec<u8>,
    /// In any order.
    pub(super) sections: Vec<OwnedSection>,
    /// Everything between sections and checksum.
    pub(super) content: Vec<u8>,
}

impl Container {
    /// The parts of a model that was opened, including sections that nobody knows.
    pub(super) fn of(bytes: &[u8]) -> Self {
        let header = Header::of(bytes);
        let [text, optional, ..] = header.lengths();
        let (text, rest) = bytes[HEADER_LENGTH..bytes.len() - CHECKSUM_LENGTH].split_at(text);
        let (mut optional, content) = rest.split_at(optional);
        let owned = |Section { tag, must_understand, content }: Section<'_>| OwnedSection {
            tag,
            must_understand,
            content: content.into(),
        };
        Self {
            header: HeaderBuilder::from(header),
            text: text.into(),
            sections: std::iter::from_fn(|| take_section(&mut optional)).map(owned).collect(),
            content: content.into(),
        }
    }

    /// The file's bytes.
    ///
    /// # Errors
    /// For more than 4 GB.
    pub(super) fn bytes(mut self) -> Result<Vec<u8>> {
        self.sections.sort_by_key(|section| section.tag);
        let sections = bytes_of(&self.sections);
        let length = HEADER_LENGTH + self.text.len() + sections.len() + self.content.len() + CHECKSUM_LENGTH;
        let header = self
            .header
            .with_length(count(length)?)
            .with_text_length(count(self.text.len())?)
            .with_optional_length(count(sections.len())?);
        let mut bytes = [&header.bytes()[..], &self.text, &sections, &self.content].concat();
        bytes.extend(checksum(&bytes).to_le_bytes());
        Ok(bytes)
    }
}

/// The parts of a model of trees in the order of [`Header::lengths`].
pub(super) fn parts<'m>(model: &Model<'m>) -> [&'m [u8]; 7] {
    let mut rest = &model.bytes()[HEADER_LENGTH..];
    model.header().lengths().map(|length| {
        let (part, after) = rest.split_at(length);
        rest = after;
        part
    })
}

/// The groups of a model, and the bytes of its splits: an open model gives margins, not trees.
pub(super) fn groups_and_splits<'m>(model: &Model<'m>) -> (Vec<Group>, &'m [u8]) {
    let [.., groups, splits, _] = parts(model);
    (groups.as_chunks().0.iter().filter_map(|group| Group::from_bytes(*group)).collect(), splits)
}

/// The file of a model whose content is no trees, such as maps: margins and priors are 0.
///
/// # Errors
/// For more than 4 GB.
pub fn file(header: HeaderBuilder, text: Vec<u8>, sections: Vec<OwnedSection>, content: Vec<u8>) -> Result<Vec<u8>> {
    Container { header, text, sections, content }.bytes()
}

/// Bytes of sections, in their order.
pub(super) fn bytes_of<'s>(sections: impl IntoIterator<Item = &'s OwnedSection>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for OwnedSection { tag, must_understand, content } in sections {
        let section = Section { tag: *tag, must_understand: *must_understand, content };
        section.write(&mut |part| bytes.extend_from_slice(part));
    }
    bytes
}

/// A length in the header.
pub(super) fn count(number: usize) -> Result<u32> {
    u32::try_from(number).map_err(|_| too_large())
}

/// Advice on ensembles that are too large.
pub(super) const FEWER_SPLITS: &str = "Train fewer trees, or trees with fewer splits.";

/// Error of a model with more of something than its field can count.
pub(super) fn too_large() -> Error {
    problem!("the ensemble is too large for the model format").fix(FEWER_SPLITS)
}
