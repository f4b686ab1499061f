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
    /// A recorded object has no mesh.
    #[error("{name} was recorded, and is none of the objects: {}", known.join(", "))]
    NotRecorded {
        /// The recorded object.
        name: String,
        /// The objects that there are.
        known: Vec<String>,
    },
    /// There are too few recorded touches to fit a probe to.
    #[error("only {touches} recorded touches with two or three contacts, of at least {least} that a fit takes")]
    FewRecorded {
        /// How many there are.
        touches: usize,
        /// How many it takes.
        least: usize,
    },
    /// Recordings look wrong.
    #[error("recordings look wrong:\n  {}\nNothing was written", suspects.join("\n  "))]
    Suspects {
        /// What looks wrong, each a sentence or two.
        suspects: Vec<String>,
    },
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
            Self::NotRecorded { .. } => {
                "Give its mesh as well, under the recording's name, or leave the recording out."
            }
            Self::FewRecorded { .. } => {
                "Record a few hundred approaches to objects whose meshes you have; 60 presses on a plate help too."
            }
            Self::Suspects { .. } => "Record again, or leave the recording out.",
            Self::NothingCompiles => "Report this as a bug, with the data.",
        }
        .into()
    }
}
