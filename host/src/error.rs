//! What can go wrong, said so that the user knows where and what to do next.

use std::path::{Path, PathBuf};

/// The result of everything fallible in this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error: where it is, what is wrong, what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// A line of a text file is wrong.
    #[error("{}:{line}: {what}. {fix}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: u64,
        /// What is wrong, without a full stop.
        what: String,
        /// What to do, as a sentence.
        fix: String,
    },
    /// A byte of a binary file is wrong.
    #[error("{}: byte {offset}: {what}. {fix}", path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// The offset, counted from 0.
        offset: u64,
        /// What is wrong, without a full stop.
        what: String,
        /// What to do, as a sentence.
        fix: String,
    },
    /// A file or directory as a whole is wrong.
    #[error("{}: {what}. {fix}", path.display())]
    File {
        /// The file or directory.
        path: PathBuf,
        /// What is wrong, without a full stop.
        what: String,
        /// What to do, as a sentence.
        fix: String,
    },
    /// The data is wrong, wherever it came from.
    #[error("{what}. {fix}")]
    Data {
        /// What is wrong, without a full stop.
        what: String,
        /// What to do, as a sentence.
        fix: String,
    },
    /// An argument is wrong: exit code 2 instead of 1.
    #[error("{what}. {fix}")]
    Argument {
        /// What is wrong, without a full stop.
        what: String,
        /// What to do, as a sentence.
        fix: String,
    },
    /// Standard output was closed by its reader (`palpate … | head`): not an error for the user.
    #[error("standard output was closed")]
    Closed,
}

impl Error {
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

    /// Line `line` (from 1) of `path` is wrong.
    pub fn line(path: impl AsRef<Path>, line: u64, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Line { path: path.as_ref().into(), line, what: what.into(), fix: fix.into() }
    }

    /// Byte `offset` (from 0) of `path` is wrong.
    pub fn byte(path: impl AsRef<Path>, offset: u64, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Byte { path: path.as_ref().into(), offset, what: what.into(), fix: fix.into() }
    }

    /// The file or directory `path` is wrong as a whole.
    pub fn file(path: impl AsRef<Path>, what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::File { path: path.as_ref().into(), what: what.into(), fix: fix.into() }
    }

    /// Data that has no file is wrong.
    pub fn data(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Data { what: what.into(), fix: fix.into() }
    }

    /// An argument is wrong.
    pub fn argument(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Argument { what: what.into(), fix: fix.into() }
    }

    /// Says which file wrong data came from; other errors stay as they are.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        match self {
            Self::Data { what, fix } => Self::file(path, what, fix),
            other => other,
        }
    }

    /// The program's exit code: 1 for bad input, 2 for bad arguments, 0 when the reader of stdout went away.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Argument { .. } => 2,
            Self::Closed => 0,
            _ => 1,
        }
    }
}
