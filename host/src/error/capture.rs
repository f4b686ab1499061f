//! What can be wrong with captures.

/// What can be wrong with captures.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureProblem {}

impl CaptureProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
