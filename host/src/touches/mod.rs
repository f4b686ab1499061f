//! Touches on disk: a directory with a file for each object.

pub mod folds;
pub mod manifest;
pub mod noise;
#[cfg(feature = "parquet")]
pub mod parquet;
#[cfg(all(test, feature = "train"))]
pub(crate) mod synthetic;
pub mod text;

use crate::error::{Error, Result};
use manifest::Manifest;
use palpate_shared::Touch;
use std::path::{Path, PathBuf};

pub use text::{parse_touch, to_q15, write_touch};

/// The touches of two or more objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The objects, sorted by name.
    pub objects: Vec<ObjectTouches>,
}

/// The touches of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectTouches {
    /// The object's name.
    pub name: String,
    /// Its touches, in the order of the file; at least one.
    pub touches: Vec<Touch>,
}

impl Dataset {
    /// Reads every `<object>.txt` and `<object>.parquet` of a directory.
    ///
    /// # Errors
    /// When the directory cannot be read, holds fewer than two objects or an unfinished capture, when a file holds no
    /// touch, and when a line is wrong (file and line named).
    pub fn read(directory: &Path) -> Result<Self> {
        if Manifest::read(directory)?.is_some_and(|manifest| !manifest.complete) {
            let fix = "Repeat the capture's command with --resume.";
            return Err(Error::file(directory, "the capture of these touches is not complete", fix));
        }
        let objects = files(directory)?
            .into_iter()
            .map(|(name, path, format)| Ok(ObjectTouches { name, touches: format.read(&path)? }))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { objects })
    }

    /// The objects' names, sorted.
    pub fn names(&self) -> Vec<String> {
        self.objects.iter().map(|object| object.name.clone()).collect()
    }

    /// How many touches there are, of all objects together.
    pub fn len(&self) -> usize {
        self.objects.iter().map(|object| object.touches.len()).sum()
    }

    /// Whether there is no touch at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How touches are kept on the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// A line a touch.
    #[default]
    Text,
    /// A row a touch, in columns, compressed.
    Parquet,
}

impl Format {
    /// How the files' names end.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Text => "txt",
            Self::Parquet => "parquet",
        }
    }

    /// Refuses a format that this program was built without.
    ///
    /// # Errors
    /// [`Error::Argument`].
    pub fn check(self) -> Result<()> {
        if self == Self::Parquet && !cfg!(feature = "parquet") {
            let fix = "Build it with: cargo build --release --features parquet.";
            return Err(Error::argument("this program was built without Parquet", fix));
        }
        Ok(())
    }

    fn read(self, path: &Path) -> Result<Vec<Touch>> {
        self.check()?;
        #[cfg(feature = "parquet")]
        if self == Self::Parquet {
            return parquet::read(path);
        }
        text::read(path)
    }
}

/// The objects' names and files, sorted by name.
fn files(directory: &Path) -> Result<Vec<(String, PathBuf, Format)>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let is_in = |format: &Format| path.extension().is_some_and(|extension| extension == format.extension());
        if let Some(format) = [Format::Text, Format::Parquet].into_iter().find(is_in)
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            files.push((name.to_owned(), path, format));
        }
    }
    files.sort();
    if let Some(twice) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let what =
            format!("two files of the object {}: {} and {}", twice[0].0, twice[0].1.display(), twice[1].1.display());
        return Err(Error::file(directory, what, "Remove one of them."));
    }
    match files.as_slice() {
        [] => Err(Error::file(
            directory,
            "no touches here (no .txt file)",
            "Fill it with: palpate capture builtin -o DIR.",
        )),
        [(name, ..)] => Err(Error::file(
            directory,
            format!("only one object here, {name}, and nothing to tell it from"),
            "Capture at least two objects into the directory.",
        )),
        _ => Ok(files),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_sorted_by_name_and_other_files_ignored() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["spoon.txt", "fork.txt", "notes.md", "cup.part"] {
            std::fs::write(directory.path().join(name), "0 0.1 0.2\r\n\n0.000000,0.3,-").unwrap();
        }
        let dataset = Dataset::read(directory.path()).unwrap();
        assert_eq!(dataset.names(), ["fork", "spoon"]);
        assert_eq!(dataset.len(), 4);
    }

    #[test]
    fn a_directory_that_is_missing_empty_or_of_one_object_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let error = |path: &Path| Dataset::read(path).unwrap_err().to_string();
        assert!(error(&directory.path().join("nowhere")).contains("cannot read the data set"));
        assert!(error(directory.path()).contains("no touches here"));
        std::fs::write(directory.path().join("fork.txt"), "0 0 0\n").unwrap();
        assert!(error(directory.path()).contains("only one object here, fork"));
    }

    #[test]
    fn a_wrong_line_is_named_with_its_file() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("cup.txt"), "0 0 0\n").unwrap();
        let path = directory.path().join("fork.txt");
        for (text, place) in
            [(&b"0 0 0\n\n0 0 -1\n"[..], "fork.txt:3: the time -1"), (b"0 0 0\n\xff\n", "fork.txt:2: not text")]
        {
            std::fs::write(&path, text).unwrap();
            let error = Dataset::read(directory.path()).unwrap_err();
            assert!(error.to_string().contains(place), "{error}");
            assert_eq!(error.exit_code(), 1);
        }
        std::fs::write(&path, "\n").unwrap();
        assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("fork.txt: no touches"));
    }
}
