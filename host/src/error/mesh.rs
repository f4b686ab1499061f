//! What can be wrong with meshes and where they come from.

/// What can be wrong with meshes and where they come from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshProblem {}

impl MeshProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
