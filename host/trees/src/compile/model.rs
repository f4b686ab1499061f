//! Compiled models, opened.

use super::container::parts;
use crate::error::{Error, Place, Result, problem};
use palpate_onboard::{Model, ModelError};
use palpate_shared::format::{Axis, Header, Layout, MAGIC, MAPS_LAYOUT};
use std::path::{Path, PathBuf};

/// A compiled model that was checked: its bytes, and the file that they came from.
///
/// ```no_run
/// # fn main() -> palpate_trees::Result<()> {
/// let compiled = palpate_trees::compile::CompiledModel::read("model.palpate")?;
/// println!("{} bytes, knows {}", compiled.bytes().len(), compiled.names().join(", "));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompiledModel {
    path: Option<PathBuf>,
    bytes: Vec<u8>,
}

impl CompiledModel {
    /// Reads and checks a model.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io) when the file cannot be read; with the byte where it goes wrong, a file that is not a
    /// model of this version, whole and unchanged.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the model", source))?;
        Self::from_file(path, bytes)
    }

    /// Checks a model that was read from `path`.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read).
    pub fn from_file(path: &Path, bytes: Vec<u8>) -> Result<Self> {
        match Model::new(&bytes) {
            Ok(_) => Ok(Self { path: Some(path.into()), bytes }),
            Err(_) if bytes.starts_with(&MAGIC) && Header::of(&bytes).layout() == MAPS_LAYOUT => {
                Err(problem!("a model of maps, not of trees")
                    .fix(
                        "`palpate inspect`, `palpate link` and the commands of `palpate maps` take it; other commands take models of trees.",
                    )
                    .at(Place::file(path)))
            }
            Err(error) => {
                let offset = u64::try_from(error.offset()).unwrap_or(u64::MAX);
                Err(refused(error).at(Place::byte(path, offset)))
            }
        }
    }

    /// Checks a model in memory.
    ///
    /// # Errors
    /// For bytes that are not a model of this version, whole and unchanged.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        open(&bytes)?;
        Ok(Self { path: None, bytes })
    }

    /// The model, to be recognized with. Cannot fail: the bytes were checked. Cost: the check again, about a millisecond
    /// for 100 KB.
    pub fn model(&self) -> Model<'_> {
        Model::new(&self.bytes).unwrap_or_else(|_| unreachable!("the bytes were checked and do not change"))
    }

    /// The file that the model came from, if it was one.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The model's bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The model's bytes, kept.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// The names of the objects that the model knows, in its order.
    pub fn names(&self) -> Vec<String> {
        names(&self.model())
    }
}

/// Opens the bytes of a compiled model in place, such as [`Compiled::bytes`](super::Compiled::bytes).
///
/// # Errors
/// For bytes that are not a model of this version, whole and unchanged; none for what
/// [`compile`](super::compile) returned.
pub fn open(bytes: &[u8]) -> Result<Model<'_>> {
    Model::new(bytes).map_err(refused)
}

/// Error of bytes that the chip's code refuses as a model.
fn refused(error: ModelError) -> Error {
    problem!("{error}").fix(match error {
        ModelError::NotAModel => "Give a file that `palpate export` wrote.",
        ModelError::Version(_) => "Export the ensemble again with this version of palpate.",
        ModelError::Length { .. } | ModelError::Checksum { .. } => "Copy the model again, or export it again.",
        ModelError::NeedsCode => {
            "Trees as code can be neither proved nor inspected: export the model without --emit c-code or rust-code for that."
        }
        _ => "Export the model again with `palpate export`.",
    })
}

/// Opens a model of any layout; of the layout code, whose trees are elsewhere, margins are not to be asked for.
pub(super) fn open_any(bytes: &[u8]) -> Result<Model<'_>> {
    match Model::new(bytes) {
        Err(ModelError::NeedsCode) => Model::with_code(bytes, |_, _| {}),
        other => other,
    }
    .map_err(refused)
}

/// The names of the objects that a model knows, in its order.
pub fn names(model: &Model<'_>) -> Vec<String> {
    (0..model.object_count()).map(|object| model.object_name(object).to_owned()).collect()
}

/// The thresholds of all features together, as the chip compares them.
pub fn thresholds(model: &Model<'_>) -> Vec<i32> {
    let [_, _, _, axes, ..] = parts(model);
    let (axes, mut cuts) = axes.split_at(Axis::LENGTH * usize::from(model.header().axes()));
    if model.layout() == Layout::Wide {
        return cuts.as_chunks().0.iter().map(|cut| i32::from_le_bytes(*cut)).collect();
    }
    let mut thresholds = Vec::new();
    for axis in axes.as_chunks().0.iter().filter_map(|axis| Axis::from_bytes(*axis)) {
        let Some((own, rest)) = cuts.split_at_checked(axis.cuts_length()) else { break };
        cuts = rest;
        let number = |bytes: &[u8]| {
            // Sign-extended from the highest byte that is stored.
            let sign = if bytes.last().is_some_and(|byte| byte & 0x80 != 0) { 0xff } else { 0 };
            i32::from_le_bytes(std::array::from_fn(|index| bytes.get(index).copied().unwrap_or(sign)))
        };
        thresholds.extend(own.chunks(usize::from(axis.width)).map(number));
    }
    thresholds
}

/// The farthest that an output's margin can be from the library's own.
pub(crate) fn bound_of(model: &Model<'_>, output: usize) -> f64 {
    let scale = model.output_scale(output).map_or(model.prediction().scale, |own| own.scale);
    f64::from(model.margin_error()) * f64::from(scale)
}
