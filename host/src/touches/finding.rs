//! Something that is wrong with a data set, or may be, and those who are told of it.

use crate::error::{Error, Place, Result};
use std::fmt;
use std::path::Path;

/// Something that is wrong with a data set, or may be.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct Finding {
    /// True if training would be wrong, or fail; otherwise it may be meant.
    pub is_wrong: bool,
    /// Place and problem, as a line without a full stop: `data/fork.txt:3: the time -1 is negative`.
    pub what: String,
    /// Remedy, as a sentence; empty where nothing needs to be done.
    pub fix: String,
}

/// Place and problem.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}

impl From<Error> for Finding {
    fn from(error: Error) -> Self {
        Self { is_wrong: true, what: format!("{}{}", error.place(), error.what()), fix: error.remedy().into() }
    }
}

impl Finding {
    /// Something that looks wrong, but may be meant.
    pub(super) fn warning(path: &Path, what: impl fmt::Display, fix: &str) -> Self {
        Self { is_wrong: false, what: format!("{}{what}", Place::file(path)), fix: fix.into() }
    }

    /// Something that needs to be known, about which nothing needs to be done.
    pub(super) fn remark(path: &Path, what: impl fmt::Display) -> Self {
        Self::warning(path, what, "")
    }
}

/// Takes what a reader of touches finds.
pub(super) trait Sink {
    /// Takes a fault. The reading ends with an error that is returned, and goes on otherwise.
    fn fault(&mut self, error: Error) -> Result<()>;

    /// Takes something that may be meant.
    fn warning(&mut self, finding: Finding);
}

/// Ends the reading at the first fault, and keeps the warnings.
#[derive(Default)]
pub(super) struct Strict(pub(super) Vec<Finding>);

impl Sink for Strict {
    fn fault(&mut self, error: Error) -> Result<()> {
        Err(error)
    }

    fn warning(&mut self, finding: Finding) {
        self.0.push(finding);
    }
}
