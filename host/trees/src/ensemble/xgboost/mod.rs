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
//! | `palpate_descriptor` | the descriptor's name; absent for an ensemble over rows |
//! | `palpate_objects` | a JSON array of the objects' names, in the order of the labels |
//! | `palpate_background` | optional: `true` where the last object is a background, which is never named |
//! | `palpate_prediction` | optional: what the library that trained an ensemble over rows makes of margins, and which numbers stand for a missing value there, a JSON object |
//! | `palpate_trained` | optional: which touches it was trained on, a JSON object |
//! | `palpate_…` | others are kept as they are: [`Provenance::attributes`](super::Provenance::attributes) |
//!
//! What is read is checked as a whole before any of it is used: see [`Ensemble::load`]. UBJSON holds the same.

mod objective;
mod outputs;
mod read;
mod schema;
mod trees;
mod write;

use super::Ensemble;
use super::import::options::Options;
use crate::error::{EnsembleProblem, Error, Place, Result};
use crate::output;
use schema::Document;
use std::borrow::Cow;
use std::path::Path;

/// Reads XGBoost's JSON.
pub(super) fn from_json(path: &Path, bytes: &[u8], options: &Options<'_>) -> Result<Ensemble> {
    check_booster(&serde_json::from_slice(&without_literals(bytes)).unwrap_or_default())
        .map_err(|problem| Error::at(Place::file(path), problem))?;
    let document: Document =
        serde_json::from_slice(&without_literals(bytes)).map_err(|error| not_json(path, &error))?;
    document.into_ensemble(options, "JSON").map_err(|problem| Error::at(Place::file(path), problem))
}

/// Reads XGBoost's UBJSON, which holds the same as its JSON.
pub(super) fn from_ubjson(path: &Path, value: serde_json::Value, options: &Options<'_>) -> Result<Ensemble> {
    let wrong = |problem| Error::at(Place::file(path), problem);
    check_booster(&serde_json::from_value(value.clone()).unwrap_or_default()).map_err(wrong)?;
    let damaged =
        |error: serde_json::Error| EnsembleProblem::Damaged { kind: "XGBoost UBJSON", what: error.to_string() };
    let document: Document = serde_json::from_value(value).map_err(|error| wrong(damaged(error)))?;
    document.into_ensemble(options, "UBJSON").map_err(wrong)
}

/// The part of a document that is read first: a booster without trees has another schema.
#[derive(Default, serde::Deserialize)]
struct Peek {
    #[serde(default)]
    learner: PeekLearner,
}

#[derive(Default, serde::Deserialize)]
struct PeekLearner {
    #[serde(default)]
    gradient_booster: PeekBooster,
}

#[derive(Default, serde::Deserialize)]
struct PeekBooster {
    #[serde(default)]
    name: String,
}

fn check_booster(peek: &Peek) -> Result<(), EnsembleProblem> {
    let name = &peek.learner.gradient_booster.name;
    if name == "gblinear" { Err(EnsembleProblem::Booster { found: name.clone() }) } else { Ok(()) }
}

/// The text with `null` for the numbers that XGBoost writes and JSON does not have: NaN and the infinities.
fn without_literals(bytes: &[u8]) -> Cow<'_, [u8]> {
    const LITERALS: [&[u8]; 3] = [b"-Infinity", b"Infinity", b"NaN"];
    let mut text: Option<Vec<u8>> = None;
    let mut is_string = false;
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let rest = &bytes[at..];
        let literal = LITERALS.iter().find(|literal| !is_string && rest.starts_with(literal));
        let length = match (byte, literal) {
            (_, Some(literal)) => literal.len(),
            (b'\\', None) if is_string => 2.min(rest.len()),
            _ => 1,
        };
        is_string ^= byte == b'"';
        if literal.is_some() {
            text.get_or_insert_with(|| bytes[..at].to_vec()).extend(b"null");
        } else if let Some(text) = &mut text {
            text.extend(&rest[..length]);
        }
        at += length;
    }
    text.map_or(Cow::Borrowed(bytes), Cow::Owned)
}

impl Ensemble {
    /// Ensemble of a model that XGBoost itself has just trained on `descriptor`'s features of `objects`.
    ///
    /// # Errors
    /// [`EnsembleProblem`] for what [`load`](Self::load) refuses.
    pub fn from_xgboost(json: &[u8], descriptor: palpate_shared::Descriptor, objects: Vec<String>) -> Result<Self> {
        let path = Path::new("XGBoost's model");
        let mut document: Document =
            serde_json::from_slice(&without_literals(json)).map_err(|error| not_json(path, &error))?;
        document.learner.attributes = write::attributes(&descriptor.into(), &objects, &super::Provenance::default());
        document.into_ensemble(&Options::default(), "JSON").map_err(|problem| Error::at(Place::file(path), problem))
    }

    /// Writes the ensemble in XGBoost's JSON model schema, whole or not at all. What is written can be
    /// [loaded](Self::load) again.
    ///
    /// XGBoost predicts the same margins with it, bit for bit, for every input that it takes (it refuses infinite
    /// values). Over rows, one output is a regression, and two of which the first one's margin is 0 are
    /// `binary:logistic`, or `binary:logitraw` where no probability in f32 stands for the base margin.
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

/// The parser's message, with its line.
pub(super) fn not_json(path: &Path, error: &serde_json::Error) -> Error {
    let place = match u64::try_from(error.line()) {
        Ok(line) if line > 0 => Place::line(path, line),
        _ => Place::file(path),
    };
    Error::at(place, EnsembleProblem::NotJson { detail: error.to_string() })
}
