//! What can go wrong, said so that the user knows where and what to do next.

mod compile;
mod ensemble;
mod rows;

pub use compile::CompileProblem;
pub use ensemble::{EnsembleProblem, NameProblem, TreeProblem};
pub use rows::RowsProblem;

use std::fmt;
use std::path::{Path, PathBuf};

/// The result of everything fallible in this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Where something is wrong.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// In memory: nothing that a path names.
    #[default]
    Nowhere,
    /// In a file or directory as a whole.
    File(PathBuf),
    /// In a line of a text file, counted from 1.
    Line(PathBuf, u64),
    /// At a byte of a binary file, counted from 0.
    Byte(PathBuf, u64),
}

impl Place {
    /// In the file or directory `path` as a whole.
    pub fn file(path: impl AsRef<Path>) -> Self {
        Self::File(path.as_ref().into())
    }

    /// In line `line` (from 1) of `path`.
    pub fn line(path: impl AsRef<Path>, line: u64) -> Self {
        Self::Line(path.as_ref().into(), line)
    }

    /// At byte `offset` (from 0) of `path`.
    pub fn byte(path: impl AsRef<Path>, offset: u64) -> Self {
        Self::Byte(path.as_ref().into(), offset)
    }
}

/// The prefix of a message: `path: `, `path:line: `, `path: byte n: `, or nothing.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nowhere => Ok(()),
            Self::File(path) => write!(f, "{}: ", path.display()),
            Self::Line(path, line) => write!(f, "{}:{line}: ", path.display()),
            Self::Byte(path, offset) => write!(f, "{}: byte {offset}: ", path.display()),
        }
    }
}

/// What is wrong: one kind for each room of the crate. Its `Display` says what is wrong, without a full stop;
/// [`fix`](Self::fix) says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A setting is out of its range: a mistake of the caller, not of the data.
    #[error("{name} is {value}")]
    Setting {
        /// The setting's name: the field in its `Settings`.
        name: &'static str,
        /// What it was set to.
        value: String,
        /// What it may be: "1 to 10000".
        allowed: String,
    },
    /// With ensembles, their files and their training.
    #[error(transparent)]
    Ensemble(#[from] EnsembleProblem),
    /// With compiling, and compiled models.
    #[error(transparent)]
    Compile(#[from] CompileProblem),
    /// With rows of features, and models over them.
    #[error(transparent)]
    Rows(#[from] RowsProblem),
}

impl Problem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match self {
            Self::Setting { allowed, .. } => format!("Use {allowed}."),
            Self::Ensemble(problem) => problem.fix(),
            Self::Compile(problem) => problem.fix(),
            Self::Rows(problem) => problem.fix(),
        }
    }
}

/// An error: where it is, what is wrong, what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read or write a file.
    #[error("{}: cannot {action}: {source}. {fix}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What was tried, as an infinitive: "read the mesh".
        action: &'static str,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do, as a sentence.
        fix: String,
    },
    /// Something is wrong with what was given.
    #[error("{place}{problem}. {}", problem.fix())]
    At {
        /// Where.
        place: Place,
        /// What.
        problem: Problem,
    },
    /// The caller cancelled the work through its [`Progress`](crate::progress::Progress).
    #[error("cancelled")]
    Cancelled,
    /// Standard output was closed by its reader (`palpate … | head`): not an error for the user.
    #[error("standard output was closed")]
    Closed,
}

/// Problems that no path names.
macro_rules! problems {
    ($($problem:ty),*) => {
        $(impl From<$problem> for Error {
            fn from(problem: $problem) -> Self {
                Self::at(Place::Nowhere, problem)
            }
        })*
    };
}
problems!(Problem, EnsembleProblem, CompileProblem, RowsProblem);

impl Error {
    /// Something is wrong at a place.
    pub fn at(place: Place, problem: impl Into<Problem>) -> Self {
        Self::At { place, problem: problem.into() }
    }

    /// The setting `name` is `value`, which is not among what is `allowed` ("1 to 10000").
    pub fn setting(name: &'static str, value: impl fmt::Display, allowed: impl Into<String>) -> Self {
        Problem::Setting { name, value: value.to_string(), allowed: allowed.into() }.into()
    }

    /// What is wrong, where the library found it in what it was given.
    pub fn problem(&self) -> Option<&Problem> {
        match self {
            Self::At { problem, .. } => Some(problem),
            _ => None,
        }
    }

    /// The operating system refused `action` (an infinitive) on `path`; the fix follows from the kind of refusal.
    pub fn io(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        use std::io::ErrorKind;
        let fix = match source.kind() {
            ErrorKind::NotFound => "Check the path",
            ErrorKind::PermissionDenied => "Check the permissions, or choose another place",
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "Free some space, then run the command again",
            ErrorKind::IsADirectory => "Give a file, not a directory",
            ErrorKind::NotADirectory => "Give a directory, not a file",
            ErrorKind::InvalidData => "Check that it is the right kind of file",
            _ => "Check the file and the disk it is on",
        };
        Self::Io { path: path.as_ref().into(), action, source, fix: format!("{fix}.") }
    }

    /// Says which file wrong data came from; other errors stay as they are.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        match self {
            Self::At { place: Place::Nowhere, problem } => Self::at(Place::file(path), problem),
            other => other,
        }
    }

    /// The program's exit code: 1 for bad input, 2 for bad arguments, 0 when the reader of stdout went away.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::At { problem: Problem::Setting { .. }, .. } => 2,
            Self::Closed => 0,
            _ => 1,
        }
    }
}
