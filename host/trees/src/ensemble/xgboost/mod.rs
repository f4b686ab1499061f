//! Ensembles as files: XGBoost's JSON model schema.
//!
//! A written model opens in XGBoost 2 and later (one-output ensembles in 1.x too) and predicts the same margins there,
//! bit for bit. XGBoost's two layouts of a leaf that holds one value for each object stand side by side: `base_weights`
//! indexed by node (2.x to 3.1) and `leaf_weights` indexed by leaf, with the leaf's number in `right_children` (later).
//!
//! Statements that XGBoost does not know are attributes of the learner, which it keeps:
//!
//! | attribute | value |
//! |---|---|
//! | `palpate_descriptor` | the name of the features' [`Schema`]; absent for an ensemble over rows |
//! | `palpate_objects` | a JSON array of the objects' names, in the order of the labels |
//! | `palpate_background` | optional: `true` where the last object is a background, which is never named |
//! | `palpate_prediction` | optional: what the library that trained an ensemble over rows makes of margins, and which numbers stand for a missing value there, a JSON object |
//! | `palpate_…` | others are kept as they are: [`Provenance::attributes`](super::Provenance::attributes) |
//!
//! A file is checked as a whole before any of it is used: see [`Ensemble::load`]. UBJSON holds the same.

mod objective;
mod outputs;
mod read;
mod schema;
mod trees;
mod write;

use super::faults::damaged;
use super::import::options::Options;
use super::{Ensemble, Schema};
use crate::error::{Error, Place, Result, problem};
use palpate_base::output;
use schema::Document;
use serde::Deserialize;
use std::borrow::Cow;
use std::path::Path;

/// Reads XGBoost's JSON.
pub(super) fn from_json(path: &Path, bytes: &[u8], options: &Options<'_>) -> Result<Ensemble> {
    let text = without_literals(bytes);
    let refused = |error| {
        let peek: Peek = serde_json::from_slice(&text).unwrap_or_default();
        peek.problem().unwrap_or_else(|| not_json(path, &error))
    };
    let document: Document = serde_json::from_slice(&text).map_err(refused)?;
    document.into_ensemble(options, "JSON")
}

/// Reads XGBoost's UBJSON, which holds the same as its JSON.
pub(super) fn from_ubjson(value: &serde_json::Value, options: &Options<'_>) -> Result<Ensemble> {
    let refused = |error: serde_json::Error| {
        let peek = Peek::deserialize(value).unwrap_or_default();
        peek.problem().unwrap_or_else(|| damaged("XGBoost UBJSON", error))
    };
    Document::deserialize(value).map_err(refused)?.into_ensemble(options, "UBJSON")
}

/// The booster of a document of any schema.
#[derive(Default, Deserialize)]
struct Peek {
    #[serde(default)]
    learner: PeekLearner,
}

#[derive(Default, Deserialize)]
struct PeekLearner {
    #[serde(default)]
    gradient_booster: PeekBooster,
}

#[derive(Default, Deserialize)]
struct PeekBooster {
    #[serde(default)]
    name: String,
}

impl Peek {
    /// A booster that has no trees, and so another schema.
    fn problem(self) -> Option<Error> {
        let found = self.learner.gradient_booster.name;
        (found == "gblinear").then(|| without_trees(&found))
    }
}

/// A booster that has no trees.
fn without_trees(booster: &str) -> Error {
    problem!("its booster is {booster}, which has no trees").fix("Train with booster=gbtree or dart.")
}

/// The text with `null` for the numbers that XGBoost writes and JSON does not have: NaN and the infinities.
fn without_literals(bytes: &[u8]) -> Cow<'_, [u8]> {
    const LITERALS: [&[u8]; 3] = [b"-Infinity", b"Infinity", b"NaN"];
    let (mut text, mut copied) = (Vec::new(), 0);
    let mut is_string = false;
    let mut at = 0;
    while let Some(byte) = bytes.get(at) {
        let literal = match byte {
            b'"' => {
                is_string = !is_string;
                None
            }
            b'\\' if is_string => {
                at += 1;
                None
            }
            b'-' | b'I' | b'N' if !is_string => LITERALS.iter().find(|literal| bytes[at..].starts_with(literal)),
            _ => None,
        };
        if let Some(literal) = literal {
            text.extend_from_slice(&bytes[copied..at]);
            text.extend(b"null");
            at += literal.len();
            copied = at;
        } else {
            at += 1;
        }
    }
    if copied == 0 {
        return Cow::Borrowed(bytes);
    }
    text.extend_from_slice(&bytes[copied..]);
    Cow::Owned(text)
}

impl Ensemble {
    /// Ensemble of a model that XGBoost itself has just trained on the features of `schema` of `objects`.
    ///
    /// # Errors
    /// Errors of [`load`](Self::load).
    pub fn from_xgboost(json: &[u8], schema: Schema, objects: Vec<String>) -> Result<Self> {
        let path = Path::new("XGBoost's model");
        let mut document: Document =
            serde_json::from_slice(&without_literals(json)).map_err(|error| not_json(path, &error))?;
        document.learner.attributes = write::attributes(&schema.into(), &objects, &super::Provenance::default());
        let options = Options { schemas: &[schema], ..Options::default() };
        document.into_ensemble(&options, "JSON").map_err(|error| error.in_file(path))
    }

    /// Writes the ensemble in XGBoost's JSON model schema, whole or not at all. What is written can be
    /// [loaded](Self::load) again.
    ///
    /// XGBoost predicts the same margins with it, bit for bit, for every input that it takes (it refuses infinite
    /// values). Over rows, one output is a regression, and two outputs, the first one's margin being 0, are
    /// `binary:logistic`, or `binary:logitraw` where no probability in f32 stands for the base margin.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io) naming `path`; errors of [`check`](Self::check), which accepts
    /// every ensemble that was trained or loaded.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        self.check().map_err(|error| error.in_file(path))?;
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
    problem!("not an ensemble in XGBoost's JSON format: {error}")
        .fix("Give a file that `palpate train` or XGBoost's `save_model(\"….json\")` wrote.")
        .at(place)
}
