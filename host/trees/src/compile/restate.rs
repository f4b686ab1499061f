//! A compiled model with other statements: its thresholds, its priors, its optional sections. No margin changes.

use crate::error::{CompileProblem, Result};
use palpate_onboard::Model;
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH, HeaderBuilder, Section, Tag, checksum};

/// Statements that replace those of a model; by default nothing changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restated {
    /// The threshold in the header: error rate / (1 − error rate) in Q56.
    pub odds: Option<u64>,
    /// The limit of touches.
    pub max_touches: Option<u32>,
    /// The evidence for each object before any touch, in units.
    pub priors: Option<Vec<i32>>,
    /// Sections to write instead of those with their tags: whether they have to be understood, and their content. `None`
    /// removes a section.
    pub sections: Vec<RestatedSection>,
}

/// A section to write or, where there is none, to leave out: its tag, whether it has to be understood, and its content.
pub type RestatedSection = (Tag, Option<(bool, Vec<u8>)>);

/// The bytes of `model` with what is restated. Other sections stay as they are, also those that nobody knows.
///
/// # Errors
/// [`CompileProblem::TooLarge`] for more than 4 GB; [`CompileProblem::Model`] if the result is no model, such as with a
/// section whose content makes no sense.
pub fn restate(model: &Model<'_>, restated: &Restated) -> Result<Vec<u8>> {
    let (bytes, header) = (model.bytes(), model.header());
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    let text_end = HEADER_LENGTH + length(header.text_length());
    let sections_end = text_end + length(header.optional_length());
    let sections = sections(model, &restated.sections);
    let count = |length: usize| u32::try_from(length).map_err(|_| CompileProblem::TooLarge);
    let mut all = [&bytes[..text_end], &sections, &bytes[sections_end..]].concat();
    let header = HeaderBuilder::from(header)
        .with_length(count(all.len())?)
        .with_sections(count(sections.len())?)
        .with_odds(restated.odds.unwrap_or(header.odds()))
        .with_max_touches(restated.max_touches.unwrap_or(header.max_touches()));
    all[..HEADER_LENGTH].copy_from_slice(header.bytes());
    if let Some(priors) = &restated.priors {
        let start = text_end + sections.len() + 4 * model.object_count();
        let slots = all[start..start + 4 * model.object_count()].as_chunks_mut::<4>().0;
        slots.iter_mut().zip(priors).for_each(|(slot, prior)| *slot = prior.to_le_bytes());
    }
    let body = all.len() - CHECKSUM_LENGTH;
    let sum = checksum(&all[..body]);
    all[body..].copy_from_slice(&sum.to_le_bytes());
    super::open(&all)?;
    Ok(all)
}

/// The optional sections, in the order of their tags.
fn sections(model: &Model<'_>, restated: &[RestatedSection]) -> Vec<u8> {
    let is_restated = |tag: u16| restated.iter().any(|(other, _)| other.code() == tag);
    let kept = model.optional_sections().filter(|section| !is_restated(section.tag));
    let new = restated.iter().filter_map(|(tag, section)| {
        let (must_understand, content) = section.as_ref()?;
        Some(Section { tag: tag.code(), must_understand: *must_understand, content })
    });
    let mut all: Vec<Section<'_>> = kept.chain(new).collect();
    all.sort_by_key(|section| section.tag);
    let mut bytes = Vec::new();
    all.iter().for_each(|section| section.write(&mut |part| bytes.extend_from_slice(part)));
    bytes
}
