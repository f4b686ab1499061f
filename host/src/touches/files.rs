//! The files of a data set.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The extension of a file of touches.
pub(crate) const EXTENSION: &str = "txt";

/// The objects' names and files in a directory, sorted by name, regardless of any listing.
pub(crate) fn files(directory: &Path) -> Result<Vec<(String, PathBuf)>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|extension| extension == EXTENSION)
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            files.push((name.to_owned(), path));
        }
    }
    files.sort();
    Ok(files)
}
