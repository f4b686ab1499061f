//! Ensembles as files: XGBoost's JSON model schema.
//!
//! What is written opens in XGBoost 2 and later (one-output ensembles in 1.x too) and predicts the same margins there,
//! bit for bit. XGBoost's two layouts of a leaf that holds one value for each object stand side by side: `base_weights`
//! indexed by node (2.x to 3.1) and `leaf_weights` indexed by leaf, with the leaf's number in `right_children` (later).
//!
//! What XGBoost does not know are attributes of the learner, which it keeps:
//!
//! | attribute | value |
//! |---|---|
//! | `palpate_descriptor` | the descriptor's name |
//! | `palpate_objects` | a JSON array of the objects' names, in the order of the labels |
//! | `palpate_probe` | optional: the probe of the training touches, a JSON object of `radius`, `spacing`, `speed`, `tilt` and `length` |
//! | `palpate_noise` | optional: what was added to the training touches ([`Noise`](crate::touches::noise::Noise)), a JSON object |
//! | `palpate_background` | optional: `true` where the last object is a background, which is never named |
//! | `palpate_touches` | optional: fingerprints of the training touches, a JSON object of hexadecimal numbers by object |
//!
//! What is read is checked as a whole before any of it is used: see [`Ensemble::load`].

mod read;
mod schema;
#[cfg(all(test, feature = "train"))]
mod tests;
mod write;

use super::Ensemble;
use crate::error::{EnsembleProblem, Error, Place, Result};
use crate::output;
use schema::Document;
use std::path::Path;

impl Ensemble {
    /// Reads an ensemble in XGBoost's JSON model schema, written by [`Ensemble::save`], by XGBoost or by another
    /// trainer, with a `multi:softprob` or `multi:softmax` objective and the attributes `palpate_descriptor` and
    /// `palpate_objects`.
    ///
    /// # Errors
    /// If the file cannot be read, or is not such a model ([`EnsembleProblem`]): not JSON; an unknown descriptor, or
    /// another number of features than it has; fewer than two objects or more than 256, a name that is repeated, empty,
    /// too long or has control characters, or another number of classes; columns of unequal length; a child, feature or
    /// object out of range; a node that is reached twice (a cycle); a number that is not finite; categorical splits,
    /// dropped trees (DART), or no trees at all. The error names the file, the tree and the node.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the ensemble", source))?;
        let document: Document = serde_json::from_slice(&bytes).map_err(|error| not_json(path, &bytes, &error))?;
        document.into_ensemble().map_err(|problem| Error::at(Place::file(path), problem))
    }

    /// What XGBoost itself has just trained on `descriptor`'s features of `objects`.
    #[cfg(feature = "xgboost")]
    pub(crate) fn from_xgboost(
        json: &[u8],
        descriptor: palpate_shared::Descriptor,
        objects: Vec<String>,
    ) -> Result<Self> {
        let path = Path::new("XGBoost's model");
        let mut document: Document = serde_json::from_slice(json).map_err(|error| not_json(path, json, &error))?;
        document.learner.attributes = write::attributes(descriptor, &objects, &super::Origin::default());
        document.into_ensemble().map_err(|problem| Error::at(Place::file(path), problem))
    }

    /// Writes the ensemble in XGBoost's JSON model schema, whole or not at all. What is written can be
    /// [loaded](Self::load) again.
    ///
    /// # Errors
    /// [`Error::Io`] naming `path`; [`EnsembleProblem`] for an ensemble that [`check`](Self::check) refuses, which none
    /// that was trained or loaded is.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        self.check().map_err(|problem| Error::at(Place::file(path), problem))?;
        let document = Document::new(self);
        output::write_whole(path, |out| {
            serde_json::to_writer(&mut *out, &document)?;
            out.write_all(b"\n")
        })
    }
}

fn not_json(path: &Path, bytes: &[u8], error: &serde_json::Error) -> Error {
    let looks_binary = bytes.iter().take(64).any(|&byte| byte == 0) || bytes.starts_with(b"{L");
    if looks_binary {
        return Error::at(Place::file(path), EnsembleProblem::Binary);
    }
    let place = match u64::try_from(error.line()) {
        Ok(line) if line > 0 => Place::line(path, line),
        _ => Place::file(path),
    };
    Error::at(place, EnsembleProblem::NotJson { detail: error.to_string() })
}
