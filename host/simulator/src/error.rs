//! Errors, with the place and a remedy: those of `palpate-base`, and the problems of this crate's rooms.

pub use crate::mesh::MeshProblem;
pub use crate::probe::ProbeProblem;
pub use palpate_base::error::*;
