//! What can be wrong with scenes, probes and casts.

/// What can be wrong with scenes, probes and casts.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeProblem {}

impl ProbeProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
