//! Problems with the report and the main job.

use palpate::error::Variant;

/// Problems with the report and the main job.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReportProblem {
    /// There is nothing to compare an object with.
    #[error("there is only one object, and nothing to distinguish it from")]
    OneObject,
    /// The directory holds results that this call did not make.
    #[error("the directory holds results of another run: {found}")]
    OtherResults {
        /// Evidence of it: a file's name, or what its summary states.
        found: String,
    },
    /// Densities are estimated over exactly two features.
    #[error("the descriptor {descriptor} has {features} features, not two")]
    NotTwoFeatures {
        /// The descriptor's name.
        descriptor: String,
        /// Number of features of the model.
        features: usize,
    },
    /// A model that was just compiled does not open.
    #[error("a model that was just compiled does not open: {reason}")]
    Compiled {
        /// The reader's message.
        reason: String,
    },
    /// A model knows more objects than the recognizer has room for.
    #[error("a model of {objects} objects")]
    TooManyObjects {
        /// Number of objects.
        objects: usize,
    },
    /// A result cannot be written as JSON.
    #[error("cannot write the {what} as JSON: {reason}")]
    Json {
        /// Data that were to be written.
        what: &'static str,
        /// The JSON library's message.
        reason: String,
    },
}

impl Variant for ReportProblem {
    fn fix(&self) -> String {
        match self {
            Self::OneObject => "Give at least two objects.",
            Self::OtherResults { .. } => "Choose another directory, or force the replacement.",
            Self::NotTwoFeatures { .. } => "Estimate densities for the descriptor curvature only.",
            Self::TooManyObjects { .. } => "Use at most 256 objects.",
            Self::Compiled { .. } | Self::Json { .. } => "Report this as a bug.",
        }
        .into()
    }
}
