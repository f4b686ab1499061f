//! The files of a data set.

use super::Format;
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The objects' names and files in a directory, sorted by name, regardless of any listing.
pub(crate) fn files(directory: &Path) -> Result<Vec<(String, PathBuf, Format)>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let is_in = |format: &Format| path.extension().is_some_and(|extension| extension == format.extension());
        if let Some(format) = Format::ALL.into_iter().find(is_in)
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            files.push((name.to_owned(), path, format));
        }
    }
    files.sort();
    Ok(files)
}
