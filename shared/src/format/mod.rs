//! The bytes of a compiled model; `FORMAT.md` in this crate specifies every one of them.
//!
//! ```text
//! header │ text │ optional sections │ base margins │ priors │ axes │ thresholds │ groups │ splits │ leaves │ CRC-32
//! ```

#[macro_use]
mod codes;
mod evidence;
mod header;
mod key;
mod leaves;
mod outputs;
mod plan;
mod prediction;
mod promise;
mod records;
mod sequences;
mod strangers;
mod trained;

pub use crate::checksum::checksum;
pub use codes::{Counted, Key, Layout, LeafType, Length, MAPS_LAYOUT, Per, RAW_FEATURES};
pub use evidence::{RowEvidence, Shifts, Weights};
pub use header::{HEADER_LENGTH, Header, HeaderBuilder, MAGIC, VERSION};
pub use key::f32_key;
pub use leaves::SharedLeaves;
pub use outputs::Outputs;
pub use plan::Plan;
pub use prediction::{Link, OutputScale, Prediction, Sentinel};
pub use promise::{OddsByObject, Promise, PromisedNoise, Temperature};
pub use records::{Axis, Columns, Group};
pub use sequences::{Fault, Guard, Limits, Position};
pub use strangers::{MisfitTerms, MisfitTest, ObjectMisfit, Strangers};
pub use trained::{
    Feature, Fingerprints, MUST_UNDERSTAND, PatternShares, SECTION_HEADER_LENGTH, Section, Tag, TrainedNoise,
    TrainedProbe, TrainedTouches, take_feature, take_section,
};

/// Bytes of the checksum at the end.
pub const CHECKSUM_LENGTH: usize = 4;

/// Margins stay within ± this many units, by the export's choice of unit and the validation of a model.
pub const MARGIN_LIMIT: i32 = 1 << 30;

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    /// The bytes that something writes in parts.
    pub(super) fn written(write: impl FnOnce(&mut &mut dyn FnMut(&[u8]))) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut put: &mut dyn FnMut(&[u8]) = &mut |part| bytes.extend_from_slice(part);
        write(&mut put);
        bytes
    }

    /// Nothing is read from bytes with any of these in them, each at its place, though it is from the bytes as they are.
    pub(super) fn assert_refused(bytes: &[u8], wrong: &[(usize, &[u8])], is_read: impl Fn(&[u8]) -> bool) {
        assert!(is_read(bytes));
        for (place, wrong) in wrong {
            let mut bytes = bytes.to_vec();
            bytes[*place..place + wrong.len()].copy_from_slice(wrong);
            assert!(!is_read(&bytes), "byte {place}: {wrong:?}");
        }
    }
}
