//! What can be wrong with scenes, probes and casts.

/// What can be wrong with scenes, probes and casts.
///
/// What is wrong with a scene's mesh is a [`MeshProblem`](super::MeshProblem), what is wrong with a probe's measures a
/// [`Problem::Setting`](super::Problem::Setting).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeProblem {
    /// A line of a file of casts has too few or too many fields.
    #[error("{fields} fields where a cast has 7, or 8 with a time")]
    CastFields {
        /// How many fields the line has.
        fields: usize,
    },
    /// A coordinate of a cast is not a finite number.
    #[error("{text:?} is not a finite number")]
    CastCoordinate {
        /// What stands there instead.
        text: String,
    },
    /// The known time of a cast is neither a number that is at least 0 nor `miss`.
    #[error("{text:?} is neither a time nor `miss`")]
    CastTime {
        /// What stands there instead.
        text: String,
    },
}

impl ProbeProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match self {
            Self::CastFields { .. } | Self::CastCoordinate { .. } | Self::CastTime { .. } => {
                "Give set,ox,oy,oz,dx,dy,dz and, if known, t.".into()
            }
        }
    }
}
