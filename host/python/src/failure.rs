//! Errors of the library as exceptions of `palpate._errors`, with the same text.

use palpate::error::{Error, Kind, Place};
use pyo3::prelude::*;
use std::ffi::CString;
use std::path::PathBuf;

/// Failure of a call.
#[derive(Debug)]
pub(crate) enum Failure {
    /// An error of the library.
    Library(Error),
    /// An exception of Python.
    Python(PyErr),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Library(error)
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Python(error) => error,
            Failure::Library(error) => Python::attach(|py| exception(py, &error).unwrap_or_else(|failed| failed)),
        }
    }
}

/// Warns with a `ModelWarning`.
pub(crate) fn note_of(py: Python<'_>, text: &str) -> PyResult<()> {
    let class = py.import("palpate._errors")?.getattr("ModelWarning")?;
    PyErr::warn(py, &class, &CString::new(text)?, 1)
}

fn exception(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let (path, line): (Option<PathBuf>, Option<u64>) = match error.place() {
        Place::File(path) | Place::Byte(path, _) => (Some(path.clone()), None),
        Place::Line(path, line) => (Some(path.clone()), Some(*line)),
        _ => (None, None),
    };
    let name = match error.kind() {
        Kind::Io => "FileError",
        Kind::Setting { .. } => "SettingError",
        Kind::Cancelled | Kind::Closed => "PalpateError",
        _ => "InputError",
    };
    let class = py.import("palpate._errors")?.getattr(name)?;
    Ok(PyErr::from_value(class.call1((error.to_string(), path, line))?))
}
