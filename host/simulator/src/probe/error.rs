//! Problems with scenes and probes.

use crate::error::Variant;

/// Problems with scenes and probes.
///
/// A fault of a scene's mesh is a [`MeshProblem`](crate::mesh::MeshProblem), a probe's measure out of range a
/// [`Kind::Setting`](crate::error::Kind::Setting).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeProblem {
    /// Two sides state different probes.
    #[error("{first} and {second} state different probes: {differences}")]
    Differs {
        /// One side, such as "the model".
        first: String,
        /// The other.
        second: String,
        /// The differences: "radius 0.15 and 0.3".
        differences: String,
    },
    /// Recorded touches were made with another stroke than a model or a file states.
    #[error(
        "{first} has {stroke}, and in {second} {}",
        match is_later {
            true => format!("contacts come up to {latest} after the first"),
            false => format!("no contact is later than {latest} after the first, though many come just before"),
        }
    )]
    OtherStroke {
        /// The side that states the stroke, such as "the model".
        first: String,
        /// The touches.
        second: String,
        /// The stated stroke, as a length and as a time.
        stroke: String,
        /// The latest contact.
        latest: String,
        /// True if contacts are later than the stroke; else they end before.
        is_later: bool,
    },
    /// Fingers that bend aside were to be added to touches that are captured already.
    #[error("grazing is added to touches while they are captured: a data set does not hold the angles of contacts")]
    OnlyCaptured,
    /// A probe file is not TOML, or not a probe.
    #[error("not a usable probe file: {message}")]
    BadFile {
        /// Description of the fault.
        message: String,
    },
    /// A text is no duration, angle or share.
    #[error("{text:?} is not a quantity with its unit")]
    BadQuantity {
        /// The text.
        text: String,
        /// Text to write, with an example.
        example: &'static str,
    },
}

impl Variant for ProbeProblem {
    fn fix(&self) -> String {
        match self {
            Self::Differs { .. } => "Use both with the same probe: with another, times have another meaning.".into(),
            Self::OtherStroke { .. } => {
                "Train for the stroke of the hand that made the touches: state it as stroke in probe.toml, or let `palpate probe \
                 fit` estimate it, from these touches too."
                    .into()
            }
            Self::OnlyCaptured => "Capture with `palpate capture --probe FILE`, or leave grazing out of the file.".into(),
            Self::BadFile { .. } => {
                "Give unit (\"unit\" or \"mm\"), radius, spacing, speed, and optionally tilt, stroke, travel, timer and [real].".into()
            }
            Self::BadQuantity { example, .. } => format!("Give {example}."),
        }
    }
}
