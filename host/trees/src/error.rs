//! Errors, with the place and a remedy: those of `palpate-base`, and the problems of this crate's rooms.

pub use crate::compile::CompileProblem;
pub use crate::ensemble::{EnsembleProblem, NameProblem, TreeProblem};
pub use crate::prove::ProofProblem;
pub use crate::rows::RowsProblem;
pub use palpate_base::error::*;
