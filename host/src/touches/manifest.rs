//! `dataset.json`: how the touches of a directory were made, and how far the capture got.

use crate::capture::Settings;
use crate::error::{Error, Result};
use crate::output;
use std::path::{Path, PathBuf};

/// The file's name.
pub const FILE: &str = "dataset.json";

/// What a capture writes beside its touches. The same capture writes the same bytes: no times of day, no durations.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Manifest {
    /// The version of the program that made it.
    pub palpate: String,
    /// Whether every touch is there.
    pub complete: bool,
    /// How the touches were made.
    pub settings: Settings,
    /// The objects, in the order of their capture: sorted by name.
    pub objects: Vec<Entry>,
}

/// What there is of one object.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// The object's name.
    pub name: String,
    /// How many touches are on the disk.
    pub touches: u64,
    /// How many approaches it took to get them.
    pub approaches: u64,
    /// How many bytes of text they take (before conversion to another format).
    pub bytes: u64,
}

impl Manifest {
    /// A manifest of objects of which nothing is captured yet.
    pub fn new(settings: &Settings, names: impl IntoIterator<Item = String>) -> Self {
        Self {
            palpate: env!("CARGO_PKG_VERSION").into(),
            complete: false,
            // Not how, but what.
            settings: Settings { resume: false, threads: None, ..settings.clone() },
            objects: names.into_iter().map(|name| Entry { name, ..Entry::default() }).collect(),
        }
    }

    /// Where the manifest of a directory is.
    pub fn path(directory: &Path) -> PathBuf {
        directory.join(FILE)
    }

    /// The manifest of a directory, if it has one: data sets from elsewhere have none.
    ///
    /// # Errors
    /// When the file cannot be read or is no manifest.
    pub fn read(directory: &Path) -> Result<Option<Self>> {
        let path = Self::path(directory);
        let bytes = match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            read => read.map_err(|error| Error::io(&path, "read the manifest", error))?,
        };
        let wrong = |error: serde_json::Error| {
            Error::line(&path, error.line() as u64, format!("no manifest of a data set ({error})"), FIX)
        };
        serde_json::from_slice(&bytes).map(Some).map_err(wrong)
    }

    /// Writes the manifest, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, directory: &Path) -> Result<()> {
        output::write_json(&Self::path(directory), self)
    }
}

const FIX: &str = "Remove the file if the touches are from elsewhere, else capture them anew.";
