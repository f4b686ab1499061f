//! What can be wrong with ensembles, their files and their training.

/// What can be wrong with ensembles, their files and their training.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleProblem {}

impl EnsembleProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
