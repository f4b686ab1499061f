//! One error: what is wrong, where, and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

pub use crate::problem;

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

/// Kinds of problems that a caller may act on: Python picks an exception by them, and a program its exit code. Texts are for
/// people alone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Something is wrong with what was given, and nothing that a caller could do about it differs from the rest.
    #[default]
    Input,
    /// A setting is out of its range: a mistake of the caller, not of the data.
    Setting {
        /// The setting's name: the field in its `Settings`.
        name: &'static str,
        /// Value that was given.
        value: String,
        /// Values allowed: "1 to 10000".
        allowed: String,
    },
    /// The operating system refused to read or write.
    Io,
    /// Two sources give objects of one name.
    SameName {
        /// Source of the first: a file, or `builtin`.
        first: PathBuf,
        /// Source of the second.
        second: PathBuf,
    },
    /// Some of several files cannot be read, and the others can.
    Unread,
    /// The caller cancelled the work through its [`Progress`](crate::progress::Progress).
    Cancelled,
    /// Standard output was closed by its reader (`palpate … | head`): not an error for the user.
    Closed,
    /// A place that is written to holds something else.
    Exists,
    /// The line to a chip broke, nobody is there, or the chip is silent or was reset: it may come back.
    Lost,
    /// Margins of a library do not belong to the rows or the outputs of the model that is compared with them.
    Margins,
    /// A hand does not come straight down.
    NotDown,
    /// A promise is not kept: too many are wrong at every threshold that was tested.
    NotKept,
    /// Nothing is recorded of something that a promise is for.
    NotRecorded,
    /// Predictions of a library do not belong to the rows or the outputs of the model that is compared with them.
    Predictions,
    /// There is too little data for what was asked.
    TooFew,
    /// Objects cannot be touched with all fingers.
    Untouchable {
        /// Their names.
        objects: Vec<String>,
        /// True if they have their true size.
        is_true_size: bool,
    },
}

/// A problem as a value: where it is, what is wrong, what to do. It is made where it arises:
///
/// ```
/// use palpate_base::error::Place;
/// use palpate_base::problem;
///
/// let error = problem!("{} fields where a touch has 3", 5).fix("Give three times.").at(Place::line("bowl.txt", 7));
/// assert_eq!(error.to_string(), "bowl.txt:7: 5 fields where a touch has 3. Give three times.");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Error(Box<Parts>);

#[derive(Clone, Debug, Default, PartialEq)]
struct Parts {
    kind: Kind,
    place: Place,
    what: String,
    fix: String,
}

/// An [`Error`] of kind [`Kind::Input`] that says what is wrong, in the words of [`format!`], without a full stop.
#[macro_export]
macro_rules! problem {
    ($($what:tt)*) => { $crate::error::Error::new(format!($($what)*)) };
}

impl std::error::Error for Error {}

/// The place, what is wrong, and the remedy.
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Parts { place, what, fix, .. } = &*self.0;
        write!(f, "{place}{what}{}{fix}", if fix.is_empty() { "" } else { ". " })
    }
}

impl Error {
    /// Something is wrong with what was given.
    pub fn new(what: impl Into<String>) -> Self {
        Self(Box::new(Parts { what: what.into(), ..Parts::default() }))
    }

    /// The setting `name` is `value`, which is not among what is `allowed` ("1 to 10000").
    pub fn setting(name: &'static str, value: impl fmt::Display, allowed: impl Into<String>) -> Self {
        let (value, allowed) = (value.to_string(), allowed.into());
        problem!("{name} is {value}").fix(format!("Use {allowed}.")).as_kind(Kind::Setting { name, value, allowed })
    }

    /// The operating system refused `action` (an infinitive) on `path`; the fix follows from the kind of refusal.
    pub fn io(path: impl AsRef<Path>, action: &str, source: std::io::Error) -> Self {
        use std::io::ErrorKind;
        let fix = match source.kind() {
            ErrorKind::NotFound => "Check the path.",
            ErrorKind::PermissionDenied => "Check the permissions, or choose another place.",
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "Free some space, then run the command again.",
            ErrorKind::IsADirectory => "Give a file, not a directory.",
            ErrorKind::NotADirectory | ErrorKind::AlreadyExists => "Give a directory, not a file.",
            ErrorKind::InvalidData => "Check that it is the right kind of file.",
            _ => "Check the file and the disk it is on.",
        };
        Self::new(format!("cannot {action}: {source}")).fix(fix).as_kind(Kind::Io).at(Place::file(path))
    }

    /// The caller cancelled the work.
    pub fn cancelled() -> Self {
        Self::new("cancelled").as_kind(Kind::Cancelled)
    }

    /// The reader of standard output went away.
    pub(crate) fn closed() -> Self {
        Self::new("standard output was closed").as_kind(Kind::Closed)
    }

    /// Adds the remedy, a sentence.
    #[must_use]
    pub fn fix(mut self, fix: impl Into<String>) -> Self {
        self.0.fix = fix.into();
        self
    }

    /// Sets the place.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.0.place = place;
        self
    }

    /// Sets the kind.
    #[must_use]
    pub fn as_kind(mut self, kind: Kind) -> Self {
        self.0.kind = kind;
        self
    }

    /// Puts `part` before the description: "row 3: ".
    #[must_use]
    pub fn within(mut self, part: impl fmt::Display) -> Self {
        self.0.what.insert_str(0, &part.to_string());
        self
    }

    /// Says which file wrong data came from; a problem that has a place stays as it is.
    #[must_use]
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        match self.place() {
            Place::Nowhere if self.exit_code() > 0 && !self.is(&Kind::Cancelled) => self.at(Place::file(path)),
            _ => self,
        }
    }

    /// The kind, for a caller that acts on it.
    pub fn kind(&self) -> &Kind {
        &self.0.kind
    }

    /// True for a problem of this kind.
    pub fn is(&self, kind: &Kind) -> bool {
        self.0.kind == *kind
    }

    /// The place.
    pub fn place(&self) -> &Place {
        &self.0.place
    }

    /// The description, without place and remedy.
    pub fn what(&self) -> &str {
        &self.0.what
    }

    /// The remedy, as a sentence.
    pub fn remedy(&self) -> &str {
        &self.0.fix
    }

    /// The program's exit code: 1 for bad input, 2 for bad arguments, 0 when the reader of stdout went away.
    pub fn exit_code(&self) -> u8 {
        match self.kind() {
            Kind::Setting { .. } => 2,
            Kind::Closed => 0,
            _ => 1,
        }
    }
}
