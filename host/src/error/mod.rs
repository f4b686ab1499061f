//! Errors, with the place and a remedy.

mod calibrate;
mod capture;
mod chip;
mod compile;
mod ensemble;
mod evaluate;
mod mesh;
mod page;
mod probe;
mod report;
mod rows;
mod teach;
mod touches;
mod tune;

pub use calibrate::{CalibrateProblem, Supplied};
pub use capture::CaptureProblem;
pub use chip::ChipProblem;
pub use compile::CompileProblem;
pub use ensemble::{EnsembleProblem, NameProblem, TreeProblem};
pub use evaluate::EvaluateProblem;
pub use mesh::MeshProblem;
pub use page::PageProblem;
pub use probe::ProbeProblem;
pub use report::ReportProblem;
pub use rows::RowsProblem;
pub use teach::TeachProblem;
pub use touches::TouchesProblem;
pub use tune::TuneProblem;

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

/// Problem: one variant for each room of the library. Its `Display` says what is wrong, without a full stop;
/// [`fix`](Self::fix) says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A setting is out of its range: a mistake of the caller, not of the data.
    #[error("{name} is {value}")]
    Setting {
        /// The setting's name: the field in its `Settings`.
        name: &'static str,
        /// Value that was given.
        value: String,
        /// Values allowed: "1 to 10000".
        allowed: String,
    },
    /// With meshes and where they come from.
    #[error(transparent)]
    Mesh(#[from] MeshProblem),
    /// With scenes, probes and casts.
    #[error(transparent)]
    Probe(#[from] ProbeProblem),
    /// With data sets and files of touches.
    #[error(transparent)]
    Touches(#[from] TouchesProblem),
    /// With captures.
    #[error(transparent)]
    Capture(#[from] CaptureProblem),
    /// With ensembles, their files and their training.
    #[error(transparent)]
    Ensemble(#[from] EnsembleProblem),
    /// With compiling, and compiled models.
    #[error(transparent)]
    Compile(#[from] CompileProblem),
    /// With evaluating.
    #[error(transparent)]
    Evaluate(#[from] EvaluateProblem),
    /// With calibrating.
    #[error(transparent)]
    Calibrate(#[from] CalibrateProblem),
    /// With rows of features, and models over them.
    #[error(transparent)]
    Rows(#[from] RowsProblem),
    /// With teaching objects from recorded touches.
    #[error(transparent)]
    Teach(#[from] TeachProblem),
    /// With searching for a model.
    #[error(transparent)]
    Tune(#[from] TuneProblem),
    /// With chips, real and emulated, and the line to them.
    #[error(transparent)]
    Chip(#[from] ChipProblem),
    /// With drawing.
    #[error(transparent)]
    Page(#[from] PageProblem),
    /// With the report and the main job.
    #[error(transparent)]
    Report(#[from] ReportProblem),
}

impl Problem {
    /// Remedy, as a sentence.
    pub fn fix(&self) -> String {
        match self {
            Self::Setting { allowed, .. } => format!("Use {allowed}."),
            Self::Mesh(problem) => problem.fix(),
            Self::Probe(problem) => problem.fix(),
            Self::Touches(problem) => problem.fix(),
            Self::Capture(problem) => problem.fix(),
            Self::Ensemble(problem) => problem.fix(),
            Self::Compile(problem) => problem.fix(),
            Self::Evaluate(problem) => problem.fix(),
            Self::Calibrate(problem) => problem.fix(),
            Self::Rows(problem) => problem.fix(),
            Self::Teach(problem) => problem.fix(),
            Self::Tune(problem) => problem.fix(),
            Self::Chip(problem) => problem.fix(),
            Self::Page(problem) => problem.fix(),
            Self::Report(problem) => problem.fix(),
        }
    }
}

/// An error: where it is, what is wrong, what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
        /// Where.
        place: Place,
        /// The problem.
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
problems!(
    Problem,
    MeshProblem,
    ProbeProblem,
    TouchesProblem,
    CaptureProblem,
    EnsembleProblem,
    CompileProblem,
    EvaluateProblem,
    CalibrateProblem,
    RowsProblem,
    TeachProblem,
    TuneProblem,
    ChipProblem,
    PageProblem,
    ReportProblem
);

impl Error {
    /// Something is wrong at a place.
    pub fn at(place: Place, problem: impl Into<Problem>) -> Self {
        Self::At { place, problem: problem.into() }
    }

    /// The setting `name` is `value`, which is not among what is `allowed` ("1 to 10000").
    pub fn setting(name: &'static str, value: impl fmt::Display, allowed: impl Into<String>) -> Self {
        Problem::Setting { name, value: value.to_string(), allowed: allowed.into() }.into()
    }

    /// The problem, if the library found it in what it was given.
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
