//! The file formats of touches.

use crate::error::{Result, TouchesProblem};
use palpate_shared::Touch;
use std::path::Path;

/// Format of touches on the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// One line per touch.
    #[default]
    Text,
    /// One row per touch, in columns, compressed.
    Parquet,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 2] = [Self::Text, Self::Parquet];

    /// The format's name, as `dataset.json` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Parquet => "parquet",
        }
    }

    /// Extension of the files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Text => "txt",
            Self::Parquet => "parquet",
        }
    }

    /// True if this build can read and write the format.
    pub(crate) fn is_built_in(self) -> bool {
        self != Self::Parquet || cfg!(feature = "parquet")
    }

    /// Reads a file of this format.
    pub(super) fn read(self, path: &Path) -> Result<Vec<Touch>> {
        match self {
            Self::Text => super::text::read(path),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::read(path),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(crate::Error::at(crate::error::Place::file(path), TouchesProblem::NoParquet)),
        }
    }
}

impl std::str::FromStr for Format {
    type Err = TouchesProblem;

    fn from_str(name: &str) -> Result<Self, TouchesProblem> {
        Self::ALL
            .into_iter()
            .find(|format| format.name() == name)
            .ok_or_else(|| TouchesProblem::UnknownFormat { name: name.into() })
    }
}
