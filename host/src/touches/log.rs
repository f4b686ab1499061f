//! Touches out of a robot's log, which is an MCAP file: `docs/reference/mcap.md` says what belongs in it.

use super::logged::{Channels, Message};
use super::{Longest, ObjectTouches, Source, Warning, mcap, text};
use crate::error::{Error, Place, Result, TouchesProblem};
use palpate_shared::Touch;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The first byte of an MCAP file. No text in UTF-8 begins with it.
const FIRST: u8 = 0x89;
/// More touches than this are refused: a probe that touches every second takes four months for them.
const MOST: usize = 10_000_000;
/// Largest size of all names of objects, in bytes.
const NAMES: usize = 16 << 20;

/// The touches of a log, in the order of their log times.
#[derive(Clone, Debug, Default)]
pub struct Log {
    path: PathBuf,
    touches: Vec<Logged>,
    objects: Vec<String>,
    channels: Channels,
}

/// A touch in a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Logged {
    /// Time of logging, in nanoseconds on the log's clock.
    pub time: u64,
    /// The touch.
    pub touch: Touch,
    /// Offset in the file: the byte at which its message, or the chunk with it, begins.
    pub offset: u64,
    /// The object's number among the log's.
    object: Option<u32>,
}

/// True if a file, or a stream, is a log, by how it begins.
pub fn begins_log(bytes: &[u8]) -> bool {
    bytes.first() == Some(&FIRST)
}

/// True if the file at `path` is a log, by its first byte; false for a file that cannot be read.
pub fn is_log(path: &Path) -> bool {
    begins(path, begins_log)
}

/// True if the file at `path` is a bag of ROS that is not in MCAP; false for a file that cannot be read.
pub(super) fn is_bag(path: &Path) -> bool {
    begins(path, begins_bag)
}

/// True if the first bytes of a file say so.
fn begins(path: &Path, says: impl Fn(&[u8]) -> bool) -> bool {
    let mut first = Vec::new();
    path.is_file() && File::open(path).and_then(|file| file.take(16).read_to_end(&mut first)).is_ok() && says(&first)
}

/// True if a file that begins like this is a bag of ROS that is not in MCAP.
pub(super) fn begins_bag(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#ROSBAG V") || bytes.starts_with(b"SQLite format 3\0")
}

/// The touches of a file: of a log, whichever objects they are of, or of lines of text.
///
/// # Errors
/// Errors of [`Log::read`] and [`text::read`].
pub fn read_touches(path: &Path) -> Result<Vec<Touch>> {
    match is_log(path) {
        true => Ok(Log::read(path)?.touches.iter().map(|logged| logged.touch).collect()),
        false => text::read(path),
    }
}

impl Log {
    /// Extension of logs.
    pub const EXTENSION: &'static str = "mcap";

    /// Reads a log.
    ///
    /// Memory: 72 bytes for each touch, up to ten million of them, and that of the largest chunk, at most 256 MiB.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged or ends early, has no channel of touches, no touch, or a message on such a
    /// channel that is none; when some touches have a position and others have none.
    pub fn read(path: &Path) -> Result<Self> {
        Self::of(File::open(path).map_err(|error| Error::io(path, "read the touches", error))?, path)
    }

    /// Reads a log from anywhere; errors name `path`.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read).
    pub fn of(bytes: impl Read, path: &Path) -> Result<Self> {
        let (mut touches, mut objects, mut numbers, mut size) = (Vec::new(), Vec::new(), HashMap::new(), 0);
        let mut alike = text::Alike::default();
        let channels = mcap::read(bytes, path, |Message { time, offset, touch, object }| {
            let wrong = |problem| Err(Error::variant_at(Place::byte(path, offset), problem));
            if let Err(problem) = alike.admit(touch) {
                return wrong(problem);
            }
            if touches.len() == MOST {
                return wrong(TouchesProblem::TooMany { most: MOST });
            }
            let object = match object {
                None => None,
                Some(name) => Some(match numbers.get(&name) {
                    Some(&number) => number,
                    None => {
                        size += name.len();
                        if size > NAMES {
                            let (what, bytes, most) = ("names of objects".into(), size as u64, NAMES as u64);
                            return wrong(TouchesProblem::TooLarge { what, bytes, most });
                        }
                        let number = objects.len() as u32;
                        objects.push(name.clone());
                        numbers.insert(name, number);
                        number
                    }
                }),
            };
            touches.push(Logged { time, touch, offset, object });
            Ok(())
        })?;
        if touches.is_empty() {
            return Err(Error::variant_at(Place::file(path), TouchesProblem::NoTouches));
        }
        let checked = Longest::default().check_all(touches.iter().map(|logged| (logged.offset, &logged.touch)));
        checked.map_err(|(offset, problem)| Error::variant_at(Place::byte(path, offset), problem))?;
        // Messages of one time stay in the order of the file.
        touches.sort_by_key(|logged| logged.time);
        Ok(Self { path: path.into(), touches, objects, channels })
    }

    /// The touches, in the order of their times.
    pub fn touches(&self) -> &[Logged] {
        &self.touches
    }

    /// The object of a touch of this log, where its message names one.
    pub fn object(&self, logged: &Logged) -> Option<&str> {
        self.objects.get(logged.object? as usize).map(String::as_str)
    }

    /// The channels that the log has.
    pub fn channels(&self) -> &Channels {
        &self.channels
    }

    /// Warning about skipped channels.
    pub fn skipped(&self) -> Option<Warning> {
        let channels = &self.channels.others;
        (!channels.is_empty()).then(|| Warning::SkippedChannels { path: self.path.clone(), channels: channels.clone() })
    }

    /// The touches by object, sorted by name; all are of the object `otherwise` if no message names one.
    ///
    /// # Errors
    /// [`TouchesProblem::NamelessTouch`] if some name an object and others do not.
    pub fn by_object(&self, otherwise: &str) -> Result<Vec<ObjectTouches>> {
        self.all_or_none_named()?;
        let mut objects: BTreeMap<&str, Vec<Touch>> = BTreeMap::new();
        for logged in &self.touches {
            objects.entry(self.object(logged).unwrap_or(otherwise)).or_default().push(logged.touch);
        }
        let source = || Source::Log(self.path.clone());
        Ok(objects.into_iter().map(|(name, touches)| ObjectTouches::new(name, touches, source())).collect())
    }

    /// The touches of one object: those that name it, or all if none names any; and how many others there are. Of a placement,
    /// called `object/placement`, those that name the object if none names the placement.
    ///
    /// # Errors
    /// [`TouchesProblem::NamelessTouch`] as [`by_object`](Self::by_object), and [`TouchesProblem::NotInLog`] if there is
    /// none.
    pub fn of_object(&self, object: &str) -> Result<(Vec<Touch>, usize)> {
        self.all_or_none_named()?;
        let whole = object.split_once('/').map(|(whole, _)| whole);
        let named = match whole {
            Some(whole) if !self.objects.iter().any(|name| name == object) => whole,
            _ => object,
        };
        let is_it = |logged: &&Logged| self.object(logged).is_none_or(|name| name == named);
        let touches: Vec<Touch> = self.touches.iter().filter(is_it).map(|logged| logged.touch).collect();
        if touches.is_empty() {
            let problem = TouchesProblem::NotInLog { object: object.into(), objects: self.objects.join(", ") };
            return Err(Error::variant_at(Place::file(&self.path), problem));
        }
        let others = self.touches.len() - touches.len();
        Ok((touches, others))
    }

    fn all_or_none_named(&self) -> Result<()> {
        match self.touches.iter().find(|logged| logged.object.is_none()) {
            Some(nameless) if !self.objects.is_empty() => {
                Err(Error::variant_at(Place::byte(&self.path, nameless.offset), TouchesProblem::NamelessTouch))
            }
            _ => Ok(()),
        }
    }
}
