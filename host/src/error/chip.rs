//! What can be wrong with chips, real and emulated, and the line to them.

/// What can be wrong with chips, real and emulated, and the line to them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChipProblem {}

impl ChipProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
