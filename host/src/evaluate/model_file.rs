//! A model on disk: compiled, or still an ensemble.

use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
use crate::evaluate::Candidate;
use palpate_onboard::Model;
use std::path::{Path, PathBuf};

/// A model read from a file, of either kind.
pub enum ModelFile {
    /// XGBoost JSON.
    Full(Ensemble),
    /// The bytes that the chip reads, checked, and where they came from.
    Compiled(PathBuf, Vec<u8>),
}

impl ModelFile {
    /// Reads a model; JSON is an ensemble, anything else must be a compiled model.
    ///
    /// # Errors
    /// If the file cannot be read, or is neither; the file is named, and the byte where a compiled model went wrong.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the model", source))?;
        if bytes.trim_ascii_start().starts_with(b"{") {
            return Ensemble::load(path).map(Self::Full);
        }
        open(path, &bytes)?;
        Ok(Self::Compiled(path.into(), bytes))
    }

    /// Calls `use_it` with the model, ready to be evaluated.
    ///
    /// # Errors
    /// What `use_it` returns.
    pub fn with<T>(&self, use_it: impl FnOnce(Candidate<'_>) -> Result<T>) -> Result<T> {
        match self {
            Self::Full(ensemble) => use_it(Candidate::Full(ensemble)),
            Self::Compiled(path, bytes) => use_it(Candidate::Compiled(&open(path, bytes)?)),
        }
    }
}

fn open<'b>(path: &Path, bytes: &'b [u8]) -> Result<Model<'b>> {
    Model::new(bytes).map_err(|error| {
        let offset = u64::try_from(error.offset()).unwrap_or(u64::MAX);
        Error::byte(path, offset, format!("not a compiled model: {error}"), "Write it anew with: palpate export.")
    })
}

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::compile::{self, compile};
    use crate::ensemble::train::{Settings, train};
    use crate::touches::synthetic;

    #[test]
    fn both_kinds_are_told_apart_and_anything_else_is_refused_by_name() {
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        let settings = Settings { rounds: 3, depth: 3, ..Settings::compact() };
        let ensemble = train(&synthetic::dataset(&[200, 200], 1), &settings, &()).unwrap();
        ensemble.save(path("full")).unwrap();
        let compiled = compile(&ensemble, &compile::Settings::default()).unwrap();
        std::fs::write(path("compiled"), &compiled.bytes).unwrap();
        std::fs::write(path("truncated"), &compiled.bytes[..compiled.bytes.len() - 1]).unwrap();
        std::fs::write(path("empty"), b"").unwrap();
        assert!(matches!(ModelFile::load(path("full")).unwrap(), ModelFile::Full(_)));
        assert!(matches!(ModelFile::load(path("compiled")).unwrap(), ModelFile::Compiled(..)));
        for bad in ["truncated", "empty", "missing"] {
            let error = ModelFile::load(path(bad)).err().unwrap();
            assert!(error.to_string().contains(bad) && error.exit_code() == 1, "{error}");
        }
    }
}
