//! The optional sections: checked once, then found by their tags.

use super::Model;
use crate::bytes::ModelError;
use palpate_shared::format::{
    OddsByObject, Section, Strangers, Tag, TrainedNoise, TrainedProbe, TrainedTouches, take_section,
};

/// The content of the section with this tag; empty if there is none, which no section that is read is.
pub(super) fn find(mut sections: &[u8], tag: Tag) -> &[u8] {
    while let Some(Section { tag: found, content, .. }) = take_section(&mut sections) {
        if found == tag.code() {
            return content;
        }
    }
    &[]
}

/// Checks that sections fill their part of the model, in the order of their tags, that what recognition depends on makes
/// sense (whoever asks for probe or noise finds out about those), and that none is there
/// that has to be understood and is not. Sets the model's touches, and where its thresholds are, if it states them.
pub(super) fn check(opened: &mut Model<'_>) -> Result<(), ModelError> {
    let model = opened.sections;
    let mut rest = model.optional;
    let mut last = 0;
    while !rest.is_empty() {
        let offset = model.offset(rest);
        let Section { tag, must_understand, content } =
            take_section(&mut rest).ok_or(ModelError::Section { offset })?;
        let valid = match tag {
            _ if tag <= last => false,
            _ if tag == Tag::Probe.code() => content.len() >= TrainedProbe::LENGTH,
            _ if tag == Tag::Touches.code() => {
                TrainedTouches::from_bytes(content).map(|stated| opened.touches = stated).is_some()
            }
            _ if tag == Tag::ThresholdsByObject.code() => {
                opened.by_object = u32::try_from(model.offset(content)).unwrap_or_default();
                content.len() >= OddsByObject::LENGTH * usize::from(model.objects)
            }
            _ if tag == Tag::Noise.code() => content.len() >= TrainedNoise::LENGTH,
            _ if tag == Tag::Strangers.code() => Strangers::from_bytes(content, model.objects.into()).is_some(),
            _ if must_understand => return Err(ModelError::NotUnderstood { tag, offset }),
            _ => true,
        };
        if !valid {
            return Err(ModelError::Field { offset });
        }
        last = tag;
    }
    Ok(())
}
