//! What can be wrong with compiling, and compiled models.

/// What can be wrong with compiling, and compiled models.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileProblem {}

impl CompileProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
