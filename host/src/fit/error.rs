//! Problems with fitting a probe to recordings.

use crate::error::Variant;

/// Problems with fitting a probe to recordings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitProblem {
    /// A recorded object has no mesh.
    #[error("{name} was recorded, but is not among the objects: {}", known.join(", "))]
    NotRecorded {
        /// The recorded object.
        name: String,
        /// The known objects.
        known: Vec<String>,
    },
    /// There are too few recorded touches to fit a probe to.
    #[error("only {touches} recorded touches with two or three contacts, and a fit needs at least {least}")]
    FewRecorded {
        /// Number of touches.
        touches: usize,
        /// Number of touches needed.
        least: usize,
    },
    /// The recordings show another stroke than the probe states.
    #[error("the probe states a stroke of {stated}, and in the recordings {found}")]
    OtherStroke {
        /// The stroke that is stated, as a length and as a time.
        stated: String,
        /// Description of what was recorded.
        found: String,
    },
}

impl Variant for FitProblem {
    fn fix(&self) -> String {
        match self {
            Self::NotRecorded { .. } => {
                "Give its mesh as well, under the recording's name, or leave the recording out."
            }
            Self::FewRecorded { .. } => {
                "Record a few hundred approaches to objects whose meshes you have; 60 presses on a plate help too."
            }
            Self::OtherStroke { .. } => {
                "Give the stroke that the touches were recorded with, or none: it is then estimated from the recordings."
            }
        }
        .into()
    }
}
