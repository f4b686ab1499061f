//! Problems with training on touches.

use crate::error::Variant;
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;

/// Problems with training on touches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TrainProblem {
    /// One object cannot be distinguished from anything.
    #[error("there is only one object to train on")]
    OneObject,
    /// There are more objects than a model can hold.
    #[error("there are {objects} objects to train on, more than the 256 that a model can distinguish")]
    TooManyObjects {
        /// Objects.
        objects: usize,
    },
    /// An object has no touches.
    #[error("{object} has no touches to train on")]
    NoTouches {
        /// The object.
        object: String,
    },
    /// A background does not go with a data set.
    #[error("the background does not match the data set: {detail}")]
    Background {
        /// The reason.
        detail: &'static str,
    },
    /// An object has no touch of those that were asked for.
    #[error("no touch of {object} is evidence: {}", none_of(*counted))]
    NothingCounts {
        /// Its name.
        object: String,
        /// Touches that were to be evidence.
        counted: Counted,
    },
    /// The descriptor needs the probe's pose.
    #[error("the descriptor {} needs the probe's pose, which no touch has", descriptor.name())]
    NoPose {
        /// The descriptor.
        descriptor: Descriptor,
    },
    /// The trainer refused what it was given, or failed.
    #[error("the trainer {trainer} refused the touches: {detail}")]
    Trainer {
        /// Its name.
        trainer: &'static str,
        /// Its message.
        detail: String,
    },
}

impl Variant for TrainProblem {
    fn fix(&self) -> String {
        match self {
            Self::OneObject => "Capture at least two.",
            Self::TooManyObjects { .. } => "Leave some objects out of the data set.",
            Self::NoTouches { .. } => "Capture it again.",
            Self::Background { .. } => "Capture the background as the data set: `palpate capture background`.",
            Self::NothingCounts { .. } => "Capture more approaches, or train on touches with any contact.",
            Self::NoPose { .. } => "Capture the touches with their pose, or use the descriptor curvature.",
            Self::Trainer { .. } => "Report this as a bug, with the data.",
        }
        .into()
    }
}

fn none_of(counted: Counted) -> &'static str {
    match counted {
        Counted::Full => "none has three contacts",
        Counted::Contacts => "none has a contact",
        Counted::All => "none has what the descriptor needs",
    }
}
