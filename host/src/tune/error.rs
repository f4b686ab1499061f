//! What can be wrong with searching for a model.

use crate::error::Problem;

/// What can be wrong with searching for a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneProblem {
    /// No model of the family is within the limits.
    #[error(
        "no model fits; the smallest has {bytes} bytes, and the fastest takes {instructions} instructions per touch"
    )]
    NothingFits {
        /// Bytes of the smallest model.
        bytes: usize,
        /// Instructions per touch of the fastest model, on the chip that the limit is for.
        instructions: u64,
    },
    /// No model of the family fits any layout.
    #[error("no ensemble of the family could be compiled")]
    NothingCompiles,
    /// There is nothing to distinguish.
    #[error("a probe is searched for {objects} object(s), which leaves nothing to distinguish")]
    FewObjects {
        /// How many objects there are.
        objects: usize,
    },
}

impl Problem for TuneProblem {
    fn fix(&self) -> String {
        match self {
            Self::NothingFits { .. } => "Allow more bytes or more instructions.",
            Self::FewObjects { .. } => "Give two or more objects.",
            Self::NothingCompiles => "Report this as a bug, with the data.",
        }
        .into()
    }
}
