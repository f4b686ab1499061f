//! A compiled model with other statements: its thresholds, its priors, its optional sections. No margin changes.

use super::container::{Container, OwnedSection};
use crate::error::Result;
use palpate_onboard::Model;
use palpate_shared::format::{Header, Tag};

/// Statements that replace those of a model; by default nothing changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restated {
    /// The threshold in the header: error rate / (1 − error rate) in Q56.
    pub odds: Option<u64>,
    /// Steps after which recognizers give up.
    pub max_touches: Option<u32>,
    /// The evidence for each object before the first step, in units.
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
/// For more than 4 GB; if the result is no model, such as with a section whose content makes no sense.
pub fn restate(model: &Model<'_>, restated: &Restated) -> Result<Vec<u8>> {
    let bytes = restated_file(model.bytes(), restated)?;
    super::open(&bytes)?;
    Ok(bytes)
}

/// The bytes of a model that was opened, of trees or of maps, with what is restated; whether the result is a model is not
/// checked.
///
/// # Errors
/// For more than 4 GB.
pub fn restated_file(bytes: &[u8], restated: &Restated) -> Result<Vec<u8>> {
    let mut container = Container::of(bytes);
    for (tag, section) in &restated.sections {
        container.sections.retain(|other| other.tag != tag.code());
        let section = section.as_ref();
        let new = section.map(|(must_understand, content)| OwnedSection::new(*tag, *must_understand, content.clone()));
        container.sections.extend(new);
    }
    let header = Header::of(bytes);
    container.header = container
        .header
        .with_odds(restated.odds.unwrap_or(header.odds()))
        .with_max_touches(restated.max_touches.unwrap_or(header.max_touches()));
    if let Some(priors) = &restated.priors {
        // After as many starting values of the margins.
        let priors_start = 4 * (usize::from(header.last_object()) + 1);
        let slots = container.content[priors_start..2 * priors_start].as_chunks_mut::<4>().0;
        slots.iter_mut().zip(priors).for_each(|(slot, prior)| *slot = prior.to_le_bytes());
    }
    container.bytes()
}
