//! Models with optional sections.

use palpate_shared::format::{
    HEADER_LENGTH, Header, PatternShares, Section, Tag, TrainedNoise, TrainedProbe, TrainedTouches, checksum,
};

/// Statements of a model about its training.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trained {
    /// The probe.
    pub probe: Option<TrainedProbe>,
    /// The touches.
    pub touches: Option<TrainedTouches>,
    /// The noise.
    pub noise: Option<TrainedNoise>,
    /// The shares of the contact patterns.
    pub shares: Option<PatternShares>,
}

impl Trained {
    /// The bytes of all sections, in order.
    fn sections(&self) -> Vec<u8> {
        let mut sections = Vec::new();
        let mut put = |tag, must_understand, content: &[u8]| {
            write_section(tag, must_understand, content, &mut |bytes| sections.extend_from_slice(bytes));
        };
        if let Some(probe) = self.probe {
            put(Tag::Probe, false, &probe.to_bytes()[..probe.length()]);
        }
        if let Some(touches) = self.touches {
            put(Tag::Touches, true, &touches.to_bytes());
        }
        if let Some(noise) = self.noise {
            put(Tag::Noise, false, &noise.to_bytes());
        }
        if let Some(shares) = self.shares {
            put(Tag::PatternShares, false, &shares.to_bytes());
        }
        sections
    }
}

/// Hands the bytes of a section to `put`.
pub fn write_section(tag: Tag, must_understand: bool, content: &[u8], put: &mut impl FnMut(&[u8])) {
    Section { tag: tag.code(), must_understand, content }.write(put);
}

/// The model with these optional sections instead of those that it has.
///
/// # Panics
/// If the bytes are no model.
pub fn with_sections(model: &[u8], sections: &[u8]) -> Vec<u8> {
    let (header, _) = Header::split(model).expect("a model has a header");
    let start = HEADER_LENGTH + header.text_length() as usize;
    let rest = &model[start + header.optional_length() as usize..model.len() - 4];
    let mut bytes = [&model[..start], sections, rest].concat();
    let length = u32::try_from(bytes.len() + 4).expect("a small model");
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    bytes[92..96].copy_from_slice(&(sections.len() as u32).to_le_bytes());
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// The model, with statements about its training.
///
/// # Panics
/// Like [`with_sections`].
pub fn trained(model: &[u8], trained: &Trained) -> Vec<u8> {
    let mut sections = trained.sections();
    // What the leaves' meaning depends on stays.
    let opened = palpate_onboard::Model::new(model).expect("a model");
    let own = opened.optional_sections().filter(|section| section.tag == Tag::SharedLeaves.code());
    own.for_each(|section| section.write(&mut |bytes| sections.extend_from_slice(bytes)));
    with_sections(model, &sections)
}
