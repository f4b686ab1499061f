//! The full model: boosted trees in f32 as the trainer left them.
//!
//! [`train::train`] makes an [`Ensemble`] from a [`Dataset`](crate::touches::Dataset), and [`load`] reads one. Ensembles and
//! their files are those of `palpate_trees`; what touches state of themselves is a [`TouchOrigin`] in their attributes.

mod origin;
mod schema;
#[cfg(feature = "train")]
pub mod train;
mod trained;

pub use origin::{StatedProbe, TouchOrigin, compiled_trained_on};
pub(crate) use origin::{object_of, stroke_of};
pub use palpate_trees::ensemble::*;
pub(crate) use schema::SCHEMAS;
pub use schema::{OverTouches, feature_row, inputs};
pub use trained::Trained;

use crate::error::Result;
use import::Options;
use std::path::Path;

/// Reads an ensemble, over touches or over rows, and checks its statements about touches.
///
/// # Errors
/// Errors of [`Ensemble::load`], and for statements that this crate did not write.
pub fn load(path: impl AsRef<Path>) -> Result<Ensemble> {
    load_with(path, &Options::default())
}

/// Reads an ensemble as [`load`] does, with facts that the file does not state.
///
/// # Errors
/// Errors of [`Ensemble::load_with`] and of [`load`].
pub fn load_with(path: impl AsRef<Path>, options: &Options<'_>) -> Result<Ensemble> {
    let path = path.as_ref();
    checked(path, Ensemble::load_with(path, &Options { schemas: SCHEMAS, ..*options })?)
}

/// Reads an ensemble from a file's bytes as [`load_with`] does; `path` is for errors only.
///
/// # Errors
/// Errors of [`load_with`], except for reading the file.
pub fn read(path: &Path, bytes: &[u8], options: &Options<'_>) -> Result<Ensemble> {
    checked(path, import::read(path, bytes, &Options { schemas: SCHEMAS, ..*options })?)
}

/// An ensemble that was read from `path`, if what it states of its touches can be read.
fn checked(path: &Path, ensemble: Ensemble) -> Result<Ensemble> {
    TouchOrigin::of(&ensemble.origin).map_err(|error| error.in_file(path))?;
    Ok(ensemble)
}
