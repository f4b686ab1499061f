//! Problems with captures.

use crate::error::Problem;
use std::io::ErrorKind;

/// Problems with captures.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureProblem {
    /// An object's mesh makes no scene.
    #[error("{name}: {detail}")]
    Object {
        /// The object.
        name: String,
        /// Description of the fault.
        detail: String,
        /// Remedy, as a sentence.
        fix: String,
    },
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
    /// Another capture has locked the directory.
    #[error("another capture is writing into this directory")]
    Busy,
    /// The directory holds a data set of objects that the capture would not write.
    #[error("holds {touches} touches of {}, which this capture would not write", list(objects))]
    HoldsOtherObjects {
        /// The objects.
        objects: Vec<String>,
        /// Number of touches of them.
        touches: u64,
    },
    /// The directory holds a data set of the same objects that was made in another way.
    #[error("holds touches of {} that were made with other settings: {differences}", list(objects))]
    HoldsOtherSettings {
        /// The objects.
        objects: Vec<String>,
        /// The settings that differ, with both values.
        differences: String,
    },
    /// The directory holds files of touches that no listing names.
    #[error("holds {}, which no capture has listed, and which this one would replace or never use", list(files))]
    HoldsFiles {
        /// The files' names.
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
    /// The directory holds an unfinished capture.
    #[error("holds an unfinished capture of {}, with {touches} touches so far", list(objects))]
    HoldsUnfinished {
        /// Its objects.
        objects: Vec<String>,
        /// Number of touches.
        touches: u64,
    },
    /// Objects to add are there already.
    #[error("already holds touches of {}", list(objects))]
    AlreadyThere {
        /// The objects.
        objects: Vec<String>,
    },
    /// Objects cannot be added to a data set that was made in another way.
    #[error("cannot add to these touches: other settings: {differences}")]
    AddsOtherSettings {
        /// The settings that differ, with both values.
        differences: String,
    },
    /// The capture to resume was started by another version.
    #[error("cannot resume: started by version {found}, this is {}", env!("CARGO_PKG_VERSION"))]
    ResumesOtherVersion {
        /// Version that captured it.
        found: String,
    },
    /// The capture to resume was started with other settings.
    #[error("cannot resume: other settings: {differences}")]
    ResumesOtherSettings {
        /// The settings that differ, with both values.
        differences: String,
    },
    /// The capture to resume was started with other objects.
    #[error("cannot resume: other objects: it was started with {}", list(objects))]
    ResumesOtherObjects {
        /// Its objects.
        objects: Vec<String>,
    },
    /// A part lost checkpointed touches.
    #[error("shorter than the {bytes} bytes that dataset.json states")]
    Shorter {
        /// Stated size in bytes.
        bytes: u64,
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

impl Problem for CaptureProblem {
    fn fix(&self) -> String {
        match self {
            Self::Object { fix, .. } => return fix.clone(),
            Self::Untouchable { is_true_size: false, .. } => {
                "Give a larger radius, a smaller spacing or a greater length, keep every approach, also those that miss, or \
                 leave the object out."
            }
            Self::Untouchable { is_true_size: true, .. } => {
                "If that is not the size, state another unit of the mesh. Otherwise give a larger radius or a smaller spacing, \
                 keep every approach, also those that miss, or leave the object out."
            }
            Self::NoTrueSize { .. } => "State the unit of the mesh: mm, cm, m or in.",
            Self::Busy => "Wait until it is done, or give another directory.",
            Self::HoldsOtherObjects { .. } => "Give another directory, add to these touches, or replace them.",
            Self::HoldsOtherSettings { .. } => "Give another directory, or replace these touches.",
            Self::HoldsRecorded { .. } => "Give another directory: recorded and simulated touches are not mixed.",
            Self::HoldsFiles { .. } => "Give another directory, or move the files away.",
            Self::HoldsUnfinished { .. } => "Resume that capture, replace it, or give another directory.",
            Self::AlreadyThere { .. } => "Leave them out, or give another directory.",
            Self::AddsOtherSettings { .. } => {
                "Capture with the settings and meshes of these touches, or give another directory."
            }
            Self::ResumesOtherVersion { .. } | Self::ResumesOtherSettings { .. } | Self::ResumesOtherObjects { .. } => {
                "Repeat the arguments and restore the meshes of the first capture, or give another directory."
            }
            Self::Shorter { .. } => "Capture again from the beginning, replacing these touches.",
            Self::NotWritten { kind: ErrorKind::StorageFull | ErrorKind::QuotaExceeded, .. } => {
                "Free some space, then resume the capture: everything up to the last checkpoint is safe."
            }
            Self::NotWritten { .. } => {
                "Check the disk, then resume the capture: everything up to the last checkpoint is safe."
            }
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
