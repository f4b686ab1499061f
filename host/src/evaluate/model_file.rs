//! A model on disk: compiled, or still an ensemble.

use crate::compile::CompiledModel;
use crate::ensemble::{self, Ensemble, TouchOrigin, compiled_trained_on, import::Options};
use crate::error::{Error, Result};
use crate::evaluate::Candidate;
use crate::touches::Dataset;
use palpate_shared::format::MAGIC;
use std::path::Path;

/// A model read from a file, of either kind.
#[derive(Clone, Debug)]
pub enum ModelFile {
    /// The full model, from a file of any kind that [`ensemble::load`] reads.
    Full(Box<Ensemble>),
    /// The bytes that the chip reads, checked.
    Compiled(CompiledModel),
}

impl ModelFile {
    /// Reads a model; its first bytes say whether it is a compiled one.
    ///
    /// # Errors
    /// Errors of [`ensemble::load`] and [`CompiledModel::read`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::io(path, "read the model", source))?;
        if bytes.starts_with(&MAGIC) {
            return Ok(Self::Compiled(CompiledModel::from_file(path, bytes)?));
        }
        Ok(Self::Full(Box::new(ensemble::read(path, &bytes, &Options::default())?)))
    }

    /// The names of its outputs, in order.
    pub fn names(&self) -> Vec<String> {
        match self {
            Self::Full(ensemble) => ensemble.objects.clone(),
            Self::Compiled(compiled) => compiled.names(),
        }
    }

    /// The objects whose touches in `dataset` the model was trained on, if it states them.
    pub fn trained_on<'d>(&self, dataset: &'d Dataset) -> Vec<&'d str> {
        match self {
            Self::Full(ensemble) => {
                TouchOrigin::of(&ensemble.origin).map_or_else(|_| Vec::new(), |origin| origin.trained_on(dataset))
            }
            Self::Compiled(compiled) => compiled_trained_on(compiled, dataset),
        }
    }

    /// Calls `evaluate` with the model, ready to be evaluated.
    ///
    /// # Errors
    /// Errors of `evaluate`.
    pub fn with<T>(&self, evaluate: impl FnOnce(Candidate<'_>) -> Result<T>) -> Result<T> {
        match self {
            Self::Full(ensemble) => evaluate(Candidate::Full(ensemble)),
            Self::Compiled(compiled) => evaluate(Candidate::Compiled(&compiled.model())),
        }
    }
}

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::compile::{self, compile};
    use crate::ensemble::train::{Settings, train};
    use crate::tests::synthetic;

    #[test]
    fn both_kinds_are_distinguished_and_anything_else_is_refused_by_name() {
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
