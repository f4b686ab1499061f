//! Problems with captures.

use crate::error::Variant;
use std::io::ErrorKind;

/// Problems with captures.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureProblem {
    /// The true size of an object is needed and not known.
    #[error("{name}: the true size is unknown, because the mesh states no unit")]
    NoTrueSize {
        /// The object.
        name: String,
    },
    /// Objects cannot be touched with all fingers.
    #[error(
        "{}: none of {approaches} approaches touched with all three fingers, {span} from the first to the third, of radius \
         {radius}",
        objects.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    )]
    Untouchable {
        /// The objects.
        objects: Vec<Untouched>,
        /// Number of approaches to each that were tried.
        approaches: u64,
        /// Distance of the outer fingers, with its unit.
        span: String,
        /// Radius of the fingers, with its unit.
        radius: String,
        /// True if the objects have their true size.
        is_true_size: bool,
    },
    /// The directory holds something else than this capture's touches.
    #[error("holds {}, which this capture would not write", list(files))]
    HoldsOthers {
        /// The names of the files.
        files: Vec<String>,
    },
    /// The directory holds recorded touches, which no capture could make again.
    #[error("holds {touches} recorded touches of {}", list(objects))]
    HoldsRecorded {
        /// The objects.
        objects: Vec<String>,
        /// Number of touches of them.
        touches: u64,
    },
    /// Touches could not be written.
    #[error("cannot write the touches: {message}")]
    NotWritten {
        /// The kind of the operating system's error.
        kind: ErrorKind,
        /// The operating system's message.
        message: String,
    },
    /// The operating system refused a thread.
    #[error("the system started only {started} of {asked} threads ({message})")]
    Threads {
        /// Number of threads asked for.
        asked: usize,
        /// Number of threads started.
        started: usize,
        /// The operating system's message.
        message: String,
    },
    /// A worker ended without a result.
    #[error("a worker stopped")]
    WorkerStopped,
}

impl Variant for CaptureProblem {
    fn fix(&self) -> String {
        match self {
            Self::Untouchable { is_true_size: false, .. } => {
                "Give a larger radius, a smaller spacing or a greater length, keep every approach, also those that miss, or \
                 leave the object out."
            }
            Self::Untouchable { is_true_size: true, .. } => {
                "If that is not the size, state another unit of the mesh. Otherwise give a larger radius or a smaller spacing, \
                 keep every approach, also those that miss, or leave the object out."
            }
            Self::NoTrueSize { .. } => "State the unit of the mesh: mm, cm, m or in.",
            Self::HoldsRecorded { .. } => "Give another directory: recorded and simulated touches are not mixed.",
            Self::HoldsOthers { .. } => "Give another directory, move these away, or replace the touches that are there.",
            Self::NotWritten { kind: ErrorKind::StorageFull | ErrorKind::QuotaExceeded, .. } => {
                "Free some space, then repeat the capture."
            }
            Self::NotWritten { .. } => "Check the disk, then repeat the capture.",
            Self::Threads { .. } => "Use fewer threads.",
            Self::WorkerStopped => "Report this as a bug.",
        }
        .into()
    }
}

/// An object that cannot be touched with all fingers.
#[derive(Clone, Debug, PartialEq)]
pub struct Untouched {
    /// Its name.
    pub name: String,
    /// The sides of its bounding box, with their unit.
    pub size: String,
}

impl std::fmt::Display for Untouched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.name, self.size)
    }
}

/// Names, the first ten of them.
fn list(names: &[String]) -> String {
    let shown = names[..names.len().min(10)].join(", ");
    if names.len() > 10 { format!("{shown} and {} more", names.len() - 10) } else { shown }
}
