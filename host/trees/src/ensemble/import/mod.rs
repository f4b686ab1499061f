//! Ensembles that other libraries trained, distinguished by the content of their files.
//!
//! | library | file | exactness of margins |
//! |---|---|---|
//! | XGBoost 1.6 and later | JSON or UBJSON of `save_model` | every bit |
//! | LightGBM 3 and later | text of `save_model` | within 1e-5: the library adds f64, and this f32 |
//! | CatBoost 1 | JSON of `save_model(…, format="json")` | the same |
//! | scikit-learn and others | ONNX: `TreeEnsembleClassifier`, `TreeEnsembleRegressor`, `TreeEnsemble` | the same |
//!
//! [`Parts`] are trees that another program holds in memory, such as scikit-learn's in Python.
//!
//! All of them become an [`Ensemble`] over rows of f32 features, with the features' names and the classes' where the file
//! has them. Comparisons are exact: `x <= t` is `x < c` with the next f32 c, for a t of any precision; the file's own t stays
//! in `Imported::thresholds`, for rows of whole numbers that f32 does not hold. How far
//! margins can be from the library's own is computed from the leaves and stated in
//! `Imported::rounding`. Splits by sets of categories become splits by thresholds. What cannot be
//! taken over exactly is rejected by name, such as linear leaves and statistics of the target.

mod catboost;
mod city;
pub(super) mod draft;
pub(super) mod draft_node;
mod lightgbm;
mod onnx;
pub(super) mod options;
mod parts;
pub(super) mod set;
#[cfg(test)]
mod set_tests;
pub(super) mod spelled_out;
mod ubjson;
mod votes;

pub use options::Options;
pub use parts::{PartTree, Parts};

use super::faults::damaged;
use super::{Ensemble, xgboost};
use crate::error::{Error, Place, Result, problem};
use options::MISSING_UNKNOWN;
pub(crate) use options::asks;
use std::path::Path;

impl Ensemble {
    /// Reads an ensemble over rows of features from a file of XGBoost, LightGBM, CatBoost or an ONNX file: see
    /// [`import`](self). The content determines the kind. XGBoost's JSON with the attribute `palpate_descriptor` is over
    /// features that the model computes; [`Options::schemas`] has those that can be read.
    ///
    /// # Errors
    /// If the file cannot be read, is of no such kind, or has something in it that no compiled model can do:
    /// an unknown descriptor, or another number of features than it has; fewer than two objects
    /// (over rows none) or more than 256, a name that is repeated, empty, too long or has control characters, or another
    /// number of classes; columns of unequal length; a child, feature or object out of range; a node that is reached
    /// twice (a cycle); a leaf that is not finite; categorical splits, or no trees at all. The error names the file, the
    /// tree and the node.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        Self::load_with(path, &Options::default())
    }

    /// Reads an ensemble as [`load`](Self::load) does, with facts that the file does not state.
    ///
    /// # Errors
    /// Errors of [`load`](Self::load); if there are other names than outputs; for a missing value of an ensemble that is
    /// not over rows.
    pub fn load_with(path: impl AsRef<Path>, options: &Options<'_>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the ensemble", source))?;
        read(path, &bytes, options)
    }
}

/// Reads an ensemble from a file's bytes; `path` is for errors only.
///
/// Memory: some 50 bytes for each byte of the file at most.
///
/// # Errors
/// Errors of [`Ensemble::load_with`], except for reading the file.
pub fn read(path: &Path, bytes: &[u8], options: &Options<'_>) -> Result<Ensemble> {
    let mut ensemble = read_as_it_is(path, bytes, options).map_err(|error| error.in_file(path))?;
    if options.missing.is_some()
        && let Some(imported) = ensemble.origin.imported.as_mut()
    {
        imported.notes.retain(|note| note != MISSING_UNKNOWN);
    }
    if let Some(missing) = options.missing.filter(|missing| !missing.is_nan()) {
        let Some(imported) = ensemble.origin.imported.as_mut() else {
            let of = ensemble.schema().map_or("other features", |schema| schema.of);
            return Err(problem!("it is over {of}, where no number stands for a missing contact")
                .fix("Leave the missing value out.")
                .at(Place::file(path)));
        };
        imported.sentinel = Some([missing; 2]);
    }
    Ok(ensemble)
}

fn read_as_it_is(path: &Path, bytes: &[u8], options: &Options<'_>) -> Result<Ensemble> {
    let names = options.names;
    // The mark that Windows puts before a text.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match kind(bytes)? {
        Kind::Json => match json_kind(bytes) {
            JsonKind::CatBoost => catboost::read(bytes, names),
            JsonKind::LightGbmDump => Err(problem!("it is what LightGBM's dump_model wrote, which rounds numbers")
                .fix("Save the model with `booster.save_model(\"model.txt\")`.")),
            JsonKind::XgBoostDump => Err(problem!(
                "it is a list, as XGBoost's dump_model writes it, which lacks the starting values of the margins"
            )
            .fix("Save the model with `booster.save_model(\"model.json\")`.")),
            JsonKind::XgBoost => xgboost::from_json(path, bytes, options),
        },
        Kind::Ubjson => match ubjson::read(bytes) {
            Ok(value) => xgboost::from_ubjson(&value, options),
            Err(at) => Err(damaged("XGBoost UBJSON", "not UBJSON from here on").at(Place::byte(path, at))),
        },
        Kind::LightGbm => lightgbm::read(path, bytes, names),
        Kind::Onnx => onnx::read(bytes, names),
    }
}

enum Kind {
    Json,
    Ubjson,
    LightGbm,
    Onnx,
}

/// Returns the kind of a file, by its first bytes.
fn kind(bytes: &[u8]) -> Result<Kind> {
    let text = bytes.trim_ascii_start();
    let starts = |prefix: &[u8]| bytes.starts_with(prefix);
    let refused = |what: &str, fix: &str| Err(Error::new(what).fix(fix));
    match bytes {
        // `{` and the length of the first key, in one of UBJSON's integers; or `{$` and `{#`, of typed objects.
        [b'{', b'i' | b'U' | b'I' | b'u' | b'l' | b'm' | b'L' | b'$' | b'#', ..] => Ok(Kind::Ubjson),
        _ if text.starts_with(b"{") || text.starts_with(b"[") => Ok(Kind::Json),
        _ if text.starts_with(b"tree\n") || text.starts_with(b"tree\r\n") => Ok(Kind::LightGbm),
        _ if starts(b"PLPT") => refused(
            "it is a compiled model already",
            "Give the ensemble that it was exported from; as source code it is written by palpate export MODEL -o MODEL \
                 --emit c.",
        ),
        _ if starts(b"CBM1") => refused(
            "it is CatBoost's binary format",
            "Save the model with `model.save_model(\"model.json\", format=\"json\")`.",
        ),
        _ if starts(b"binf") || starts(b"CONFIG-offset:") => {
            refused("it is XGBoost's old binary format", "Save the model with `booster.save_model(\"model.json\")`.")
        }
        [0x80, 2..=5, ..] => refused(
            "it is a Python pickle, which only Python can open",
            "Convert a scikit-learn model with `skl2onnx.to_onnx(model, X[:1])`, and save the bytes of its \
             SerializeToString(); a model of another library with its own save_model. skl2onnx drops where missing values go: \
             with such rows, and for HistGradientBoosting, which it cannot convert, use palpate.compile of the Python package.",
        ),
        [0x1f, 0x8b, ..] | [b'P', b'K', 3, 4, ..] | [0x28, 0xb5, 0x2f, 0xfd, ..] => {
            refused("it is compressed", "Unpack it first.")
        }
        _ if onnx::is_onnx(bytes) => Ok(Kind::Onnx),
        [] => refused("it is empty", KINDS),
        _ => refused("it is not an ensemble in a readable format", KINDS),
    }
}

/// Advice on the kinds of files that can be read.
const KINDS: &str = "Give what `palpate train` wrote, XGBoost's JSON or UBJSON, LightGBM's text, CatBoost's JSON, or an \
                     ONNX file of trees.";

enum JsonKind {
    XgBoost,
    XgBoostDump,
    CatBoost,
    LightGbmDump,
}

/// Whose JSON a text is; XGBoost's where nothing says otherwise, or where it has a learner: no further is read.
fn json_kind(bytes: &[u8]) -> JsonKind {
    #[derive(Default, serde::Deserialize)]
    struct Keys {
        #[serde(rename = "learner", default, deserialize_with = "stop")]
        _learner: (),
        oblivious_trees: Option<serde::de::IgnoredAny>,
        features_info: Option<serde::de::IgnoredAny>,
        tree_info: Option<serde::de::IgnoredAny>,
    }
    fn stop<'de, D: serde::Deserializer<'de>>(_: D) -> Result<(), D::Error> {
        Err(serde::de::Error::custom("XGBoost's"))
    }
    if bytes.trim_ascii_start().starts_with(b"[") {
        return JsonKind::XgBoostDump;
    }
    match serde_json::from_slice(bytes).unwrap_or_default() {
        Keys { oblivious_trees: Some(_), .. } | Keys { features_info: Some(_), .. } => JsonKind::CatBoost,
        Keys { tree_info: Some(_), .. } => JsonKind::LightGbmDump,
        _ => JsonKind::XgBoost,
    }
}
