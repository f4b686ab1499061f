//! The bytes of a compiled model; `FORMAT.md` in this crate specifies every one of them.
//!
//! ```text
//! header │ text │ optional sections │ base margins │ priors │ axes │ thresholds │ groups │ splits │ leaves │ CRC-32
//! ```

#[macro_use]
mod codes;
mod early;
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
mod signature;
mod strangers;
mod trained;

pub use crate::checksum::checksum;
pub use codes::{Counted, Held, Key, Layout, LeafType, Length, MAPS_LAYOUT, Per, RAW_FEATURES};
pub use early::EarlyExit;
pub use evidence::{RowEvidence, Shifts, Weights};
pub use header::{HEADER_LENGTH, Header, HeaderBuilder, MAGIC, VERSION};
pub use key::f32_key;
pub use leaves::SharedLeaves;
pub use outputs::Outputs;
pub use plan::Plan;
pub use prediction::{Link, Prediction, Sentinel};
pub use promise::{OddsByObject, Promise, PromisedNoise, Temperature};
pub use records::{Axis, Columns, Group};
pub use sequences::{Events, Fault, Guard, Limits, Position};
pub use signature::{SIGNATURE_LENGTH, SignedModel};
pub use strangers::{MisfitTerms, MisfitTest, ObjectMisfit, Strangers};
pub use trained::{
    Feature, MUST_UNDERSTAND, PatternShares, SECTION_HEADER_LENGTH, Section, Tag, Trained, TrainedCapture,
    TrainedNoise, TrainedProbe, TrainedTouches, take_feature, take_section, write_section,
};

/// Bytes of the checksum at the end.
pub const CHECKSUM_LENGTH: usize = 4;

/// Margins stay within ± this many units, by the export's choice of unit and the validation of a model.
pub const MARGIN_LIMIT: i32 = 1 << 30;

/// The largest depth of trees in [`Layout::Complete`].
pub const MAX_COMPLETE_DEPTH: u8 = 8;
