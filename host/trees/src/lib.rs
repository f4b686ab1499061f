//! Tree ensembles that other programs trained, compiled to the bytes that a microcontroller reads, and verified.
//!
//! ```text
//! file of a trainer ──► ensemble ──► compiled model ──► verified on rows
//! ```
//!
//! | module | what it does | start with |
//! |---|---|---|
//! | [`ensemble`] | boosted trees in f32; files of XGBoost, LightGBM, CatBoost and ONNX | [`ensemble::Ensemble::load`] |
//! | [`rows`] | rows of features | [`rows::Rows`] |
//! | [`compile`] | an ensemble to the bytes that a chip reads | [`compile::compile`](fn@compile::compile) |
//! | [`verify`] | margins, predictions and scores over rows; a model compared with its ensemble | [`verify::verify`](fn@verify::verify) |
//! | [`prove`] | a model means what its ensemble means, for every row: proofs | [`prove::prove`](fn@prove::prove) |
//! | [`train`] | grows boosted trees on rows of classes | [`train::train`] |
//! | [`error`] | errors, with the place and a remedy | |
//! | [`output`], [`progress`] | files that appear whole or not at all; progress of long calls | |
//! | [`wording`] | numbers as people read them | [`wording::decimal`] |
//!
//! The crate `palpate` builds on this one. The crates [`onboard`] and [`shared`] run on
//! the chip.

pub mod compile;
pub mod ensemble;
pub mod prove;
pub mod rows;
pub mod train;
pub mod verify;

pub use error::{Error, Result};
pub use palpate_base::{error, output, progress, wording};
pub use palpate_onboard as onboard;
pub use palpate_shared as shared;
