//! What can be wrong with drawing.

/// What can be wrong with drawing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PageProblem {}

impl PageProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
