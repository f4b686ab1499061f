//! Model files.

use crate::error::{Error, Result};
use palpate_onboard::{Model, ModelError};
use std::path::{Path, PathBuf};

/// A model file that was read and checked.
#[derive(Clone, Debug)]
pub struct CompiledFile {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl CompiledFile {
    /// Reads and checks a model.
    ///
    /// # Errors
    /// When the file cannot be read, and when it is not a model of this version, whole and unchanged (with the byte
    /// at which it goes wrong).
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the model", source))?;
        let file = Self { path: path.into(), bytes };
        file.model()?;
        Ok(file)
    }

    /// The file's bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The model in the file.
    ///
    /// # Errors
    /// None, once [`read`](Self::read) returned.
    pub fn model(&self) -> Result<Model<'_>> {
        Model::new(&self.bytes).map_err(|error| {
            let offset = u64::try_from(error.offset()).unwrap_or(0);
            Error::byte(&self.path, offset, error.to_string(), fix(error))
        })
    }
}

fn fix(error: ModelError) -> &'static str {
    match error {
        ModelError::NotAModel => "Give a file that `palpate export` wrote.",
        ModelError::Version(_) => "Export the ensemble again with this version of palpate.",
        ModelError::Length { .. } | ModelError::Checksum { .. } => "Copy the model again, or export it anew.",
        _ => "Export the model anew with `palpate export`.",
    }
}
