//! The optional sections: checked once, then found by their tags.

use super::{
    HAS_OUTPUTS, HAS_ROW_EVIDENCE, HAS_SENTINEL, HAS_SEQUENCES, HAS_SHARED_LEAVES, HAS_STRANGERS, HAS_WEIGHTS, MARKS,
    Stated,
};
use crate::bytes::Wrong;
use crate::layouts::{Sections, built_in};
use palpate_shared::format::{
    Guard, OddsByObject, Outputs, Plan, Position, Prediction, RowEvidence, Section, Sentinel, SharedLeaves, Strangers,
    Tag, TrainedNoise, TrainedProbe, TrainedTouches, Weights, take_section,
};

/// The content of the section with this tag; empty if there is none; no section that is read is empty.
pub(super) fn find(mut sections: &[u8], tag: Tag) -> &[u8] {
    while let Some(Section { tag: found, content, .. }) = take_section(&mut sections) {
        if found == tag.code() {
            return content;
        }
    }
    &[]
}

/// Checks that sections fill their part of the model, in the order of their tags, that what recognition depends on makes
/// sense (probe and noise are checked when asked for), and that none is there that has to be understood and is not. Sets what they state.
pub(super) fn check(model: &Sections<'_>, mut rest: &[u8], stated: &mut Stated) -> Result<(), Wrong> {
    let mut last = 0;
    while !rest.is_empty() {
        let offset = model.offset(rest);
        let Section { tag, must_understand, content } = take_section(&mut rest).ok_or(Wrong::Section(offset))?;
        let valid = match tag {
            _ if tag <= last => false,
            _ if tag == Tag::Probe.code() => content.len() >= TrainedProbe::LENGTH,
            _ if tag == Tag::Touches.code() => {
                TrainedTouches::from_bytes(content).map(|touches| stated.set_touches(touches)).is_some()
            }
            _ if tag == Tag::ThresholdsByObject.code() => {
                stated.by_object |= u32::try_from(model.offset(content)).unwrap_or_default() & !MARKS;
                content.len() >= OddsByObject::LENGTH * model.objects()
            }
            _ if tag == Tag::Noise.code() => content.len() >= TrainedNoise::LENGTH,
            _ if tag == Tag::Plan.code() => Plan::from_bytes(content, model.objects()).is_some(),
            // A chip without the feature does not understand it.
            _ if cfg!(feature = "strangers") && tag == Tag::Strangers.code() => {
                stated.by_object |= HAS_STRANGERS;
                Strangers::from_bytes(content, model.objects()).is_some()
            }
            _ if built_in::SHARED_LEAVES && tag == Tag::SharedLeaves.code() => {
                stated.by_object |= HAS_SHARED_LEAVES;
                SharedLeaves::from_bytes(content).is_some()
            }
            _ if tag == Tag::Prediction.code() => Prediction::from_bytes(content, model.objects()).is_some(),
            _ if cfg!(feature = "sentinel") && tag == Tag::Sentinel.code() => {
                stated.by_object |= HAS_SENTINEL;
                Sentinel::from_bytes(content).is_some()
            }
            _ if cfg!(feature = "row-evidence") && tag == Tag::Weights.code() => {
                stated.by_object |= HAS_WEIGHTS;
                Weights::from_bytes(content).is_some()
            }
            // Touches have margins that are log-probabilities.
            _ if cfg!(feature = "row-evidence") && tag == Tag::RowEvidence.code() => {
                stated.by_object |= HAS_ROW_EVIDENCE;
                RowEvidence::from_bytes(content).is_some() && stated.descriptor.is_none()
            }
            _ if cfg!(feature = "outputs") && tag == Tag::Outputs.code() => {
                stated.by_object |= HAS_OUTPUTS;
                Outputs::from_bytes(content, model.objects()).is_some()
            }
            _ if cfg!(feature = "sequences") && (tag == Tag::Position.code() || tag == Tag::Guard.code()) => {
                stated.by_object |= HAS_SEQUENCES;
                let features = usize::from(model.header().last_feature()) + 1;
                let is_read = match tag == Tag::Position.code() {
                    true => Position::from_bytes(content, features).is_some(),
                    false => Guard::from_bytes(content, features).is_some(),
                };
                is_read && stated.descriptor.is_none()
            }
            _ if must_understand => return Err(Wrong::NotUnderstood(offset)),
            _ => true,
        };
        if !valid {
            return Err(Wrong::Field(offset));
        }
        last = tag;
    }
    Ok(())
}
