//! Touches out of a robot's log, which is an MCAP file: `docs/reference/mcap.md` says what belongs in it.

use super::alike::Alike;
use super::files::{LOG, is_log};
use super::finding::Finding;
use super::logged::{Channels, Message, too_large};
use super::{Longest, ObjectTouches, Source, mcap, text};
use crate::error::{Error, Place, Result, problem};
use palpate_shared::Touch;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

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
    pub const EXTENSION: &'static str = LOG;

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
        let mut alike = Alike::default();
        let channels = mcap::read(bytes, path, |Message { time, offset, touch, object }| {
            let at = |error: Error| error.at(Place::byte(path, offset));
            alike.admit(&touch).map_err(at)?;
            if touches.len() == MOST {
                return Err(at(problem!("more than {MOST} touches")
                    .fix("Divide the log: mcap filter LOG -o PART.mcap --start TIME --end TIME.")));
            }
            let object = match object {
                None => None,
                Some(name) => Some(match numbers.get(&name) {
                    Some(&number) => number,
                    None => {
                        size += name.len();
                        if size > NAMES {
                            return Err(at(too_large("names of objects", size as u64, NAMES as u64)));
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
            return Err(text::no_touches().at(Place::file(path)));
        }
        let checked = Longest::default().check_all(touches.iter().map(|logged| (logged.offset, &logged.touch)));
        checked.map_err(|(offset, error)| error.at(Place::byte(path, offset)))?;
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

    /// Names some of the skipped channels, and counts them.
    pub fn skipped(&self) -> Option<Finding> {
        const SHOWN: usize = 8;
        let channels = &self.channels.others;
        let shown = channels.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
        let count = match channels.len() {
            0 => return None,
            1 => "1 other channel".to_owned(),
            count => format!("{count} other channels"),
        };
        let more = if channels.len() > SHOWN { ", …" } else { "" };
        Some(Finding::remark(&self.path, format_args!("skipped {count}: {shown}{more}")))
    }

    /// The touches by object, sorted by name; all are of the object `otherwise` if no message names one.
    ///
    /// # Errors
    /// When some name an object and others do not.
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
    /// Errors of [`by_object`](Self::by_object), and when there is none.
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
            return Err(problem!("no touch of {object} in this log, only of {}", self.objects.join(", "))
                .fix("Give one of these names, or the log of the other object.")
                .at(Place::file(&self.path)));
        }
        let others = self.touches.len() - touches.len();
        Ok((touches, others))
    }

    fn all_or_none_named(&self) -> Result<()> {
        match self.touches.iter().find(|logged| logged.object.is_none()) {
            Some(nameless) if !self.objects.is_empty() => {
                Err(problem!("this touch names no object, and others of the log do")
                    .fix("Name the object in every message, or in none.")
                    .at(Place::byte(&self.path, nameless.offset)))
            }
            _ => Ok(()),
        }
    }
}
