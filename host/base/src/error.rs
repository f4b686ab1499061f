//! Errors, with the place and a remedy.

use std::any::Any;
use std::fmt;
use std::path::{Path, PathBuf};

/// The result of everything fallible on the host's side.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Place of a fault.
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

/// Something that is wrong with what was given. Each room has an enum of its own, with a variant for whatever a caller may
/// act on. Its `Display` says what is wrong, without a full stop.
pub trait Problem: std::error::Error + Any + Send + Sync {
    /// Remedy, as a sentence.
    fn fix(&self) -> String;

    /// The exit code of a program that ends with it: 1 for bad input, 2 for bad arguments.
    fn exit_code(&self) -> u8 {
        1
    }
}

/// A setting is out of its range: a mistake of the caller, not of the data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {value}")]
pub struct Setting {
    /// The setting's name: the field in its `Settings`.
    pub name: &'static str,
    /// Value that was given.
    pub value: String,
    /// Values allowed: "1 to 10000".
    pub allowed: String,
}

impl Problem for Setting {
    fn fix(&self) -> String {
        format!("Use {}.", self.allowed)
    }

    fn exit_code(&self) -> u8 {
        2
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
        /// Action that failed, as an infinitive: "read the mesh".
        action: &'static str,
        /// The operating system's message.
        source: std::io::Error,
        /// Remedy, as a sentence.
        fix: String,
    },
    /// Something is wrong with what was given.
    #[error("{place}{problem}. {}", problem.fix())]
    At {
        /// Its place.
        place: Place,
        /// The problem.
        problem: Box<dyn Problem>,
    },
    /// The caller cancelled the work through its [`Progress`](crate::progress::Progress).
    #[error("cancelled")]
    Cancelled,
    /// Standard output was closed by its reader (`palpate … | head`): not an error for the user.
    #[error("standard output was closed")]
    Closed,
}

/// A problem that no path names.
impl<P: Problem> From<P> for Error {
    fn from(problem: P) -> Self {
        Self::at(Place::Nowhere, problem)
    }
}

impl Error {
    /// Something is wrong at a place.
    pub fn at(place: Place, problem: impl Problem) -> Self {
        Self::At { place, problem: Box::new(problem) }
    }

    /// The setting `name` is `value`, which is not among what is `allowed` ("1 to 10000").
    pub fn setting(name: &'static str, value: impl fmt::Display, allowed: impl Into<String>) -> Self {
        Setting { name, value: value.to_string(), allowed: allowed.into() }.into()
    }

    /// The problem, if it is of this kind: `error.problem::<Setting>()`.
    pub fn problem<P: Problem>(&self) -> Option<&P> {
        match self {
            Self::At { problem, .. } => (problem.as_ref() as &dyn Any).downcast_ref(),
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
            ErrorKind::NotADirectory | ErrorKind::AlreadyExists => "Give a directory, not a file",
            ErrorKind::InvalidData => "Check that it is the right kind of file",
            _ => "Check the file and the disk it is on",
        };
        Self::Io { path: path.as_ref().into(), action, source, fix: format!("{fix}.") }
    }

    /// Says which file wrong data came from; other errors stay as they are.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        match self {
            Self::At { place: Place::Nowhere, problem } => Self::At { place: Place::file(path), problem },
            other => other,
        }
    }

    /// The program's exit code: 1 for bad input, 2 for bad arguments, 0 when the reader of stdout went away.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::At { problem, .. } => problem.exit_code(),
            Self::Closed => 0,
            _ => 1,
        }
    }
}
