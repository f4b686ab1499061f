//! Errors, with the place and a remedy: those of `palpate-base`.

pub use palpate_base::error::*;
