//! What can be wrong with data sets and files of touches.

/// What can be wrong with data sets and files of touches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TouchesProblem {}

impl TouchesProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
