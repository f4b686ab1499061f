//! Reads a data set: a directory with a listing or without one, or a log.

use super::alike::{Alike, other_position};
use super::checksum::CRC;
use super::files::{PARQUET, files, is_log, logs, name_of, of_extension, whole_lines};
use super::finding::{Finding, Sink};
use super::{Entry, Listing, Log, Longest, ObjectTouches, PoolFile, Source, text};
use crate::error::{Error, Place, Result, problem};
use palpate_shared::Touch;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Contents of a data set, as far as they can be read.
pub(super) struct Content {
    /// The objects that have touches, sorted by name.
    pub(super) objects: Vec<Found>,
    /// The listing, if there is one.
    pub(super) listing: Option<Listing>,
}

/// Touches of an object, and the file that has them, or the first of several.
pub(super) struct Found {
    pub(super) touches: ObjectTouches,
    pub(super) file: PathBuf,
    /// True if the file is a log.
    pub(super) is_logged: bool,
}

/// Reads what is in a directory, or in a log. The sink says whether the reading goes on after a fault.
///
/// # Errors
/// Errors of the sink, and when a directory or file cannot be read.
pub(super) fn read(directory: &Path, sink: &mut dyn Sink) -> Result<Content> {
    if is_log(directory) {
        let objects = with_logs(BTreeMap::new(), &[directory.into()], directory, sink)?;
        return Ok(Content { objects, listing: None });
    }
    let listing = match Listing::read(directory) {
        Err(error) if directory.is_file() => return Err(error),
        Err(error) => {
            sink.fault(error)?;
            None
        }
        Ok(listing) => listing,
    };
    let objects = match &listing {
        Some(listing) => listed(directory, listing, sink)?,
        None => unlisted(directory, sink)?,
    };
    if objects.is_empty() {
        let none =
            problem!("no touches here (no .txt or .mcap file)").fix("Fill it with: palpate capture builtin -o DIR.");
        sink.fault(none.at(Place::file(directory)))?;
    }
    Ok(Content { objects, listing })
}

/// The objects that a listing names. Those whose recording was interrupted before its first touch are left out.
fn listed(directory: &Path, listing: &Listing, sink: &mut dyn Sink) -> Result<Vec<Found>> {
    let mut objects = Vec::with_capacity(listing.objects.len());
    for entry in &listing.objects {
        let mut parts = Vec::with_capacity(entry.pools.len());
        for (number, pool) in entry.pools.iter().enumerate() {
            let file = entry.path(directory, pool);
            let touches = read_listed(entry, pool, &file, &listing.origin.longest(), sink)?;
            if let Some(first) = touches.first() {
                let has_position = first.position().is_some();
                if has_position != listing.origin.position {
                    let other = other_position(has_position, "the touches that dataset.json states");
                    sink.fault(other.at(Place::file(&file)))?;
                }
            }
            parts.push((pool.source(number), pool.robot, touches));
        }
        let file = entry.pools.first().map_or_else(PathBuf::new, |pool| entry.path(directory, pool));
        let touches = ObjectTouches::of_parts(&entry.name, parts).of_origin(&listing.origin);
        if !touches.is_empty() {
            objects.push(Found { touches, file, is_logged: false });
        }
    }
    objects.sort_by(|a, b| a.touches.name.cmp(&b.touches.name));
    Ok(objects)
}

/// The touches of a listed file. That of a recording may hold more than listed; what follows its last whole line is not read.
pub(super) fn read_listed(
    entry: &Entry,
    pool: &PoolFile,
    path: &Path,
    longest: &Longest,
    sink: &mut dyn Sink,
) -> Result<Vec<Touch>> {
    const RESTORE: &str = "Restore the file or capture the objects again, or remove dataset.json if this is meant.";
    let at = |error: Error| error.fix(RESTORE).at(Place::file(path));
    let may_grow = pool.recorded.is_some();
    let bytes = match std::fs::read(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            if !may_grow || pool.touches > 0 {
                sink.fault(at(problem!("missing, although dataset.json lists the object {}", entry.name)))?;
            }
            return Ok(Vec::new());
        }
        read => read.map_err(|error| Error::io(path, "read the touches", error))?,
    };
    let lines = if may_grow { whole_lines(&bytes) } else { &bytes };
    let (touches, is_right) = text::read_lines(lines, path, longest, sink)?;
    if lines.len() < bytes.len() {
        let what = "its last line is not whole and was not read: a recording was interrupted";
        sink.warning(Finding::warning(path, what, "Record the touch again if it matters."));
    }
    let (stated, found) = (pool.touches, touches.len() as u64);
    if is_right && found == 0 && !may_grow {
        sink.fault(text::no_touches().at(Place::file(path)))?;
    } else if is_right && found != stated && !(may_grow && found > stated) {
        sink.fault(at(problem!("{found} touches where dataset.json states {stated}")))?;
    } else if found == stated && pool.crc32.is_some_and(|stated| stated != CRC.checksum(lines)) {
        let what = format_args!("changed since its capture: its checksum is not the one in {}", Listing::FILE);
        sink.warning(Finding::warning(path, what, "Capture it again if that is not meant."));
    }
    Ok(touches)
}

/// Every object that has a file.
fn unlisted(directory: &Path, sink: &mut dyn Sink) -> Result<Vec<Found>> {
    if let Some(table) = of_extension(directory, PARQUET)?.first() {
        sink.fault(parquet(table))?;
    }
    let mut logs = logs(directory)?;
    let mut objects = BTreeMap::new();
    for (name, file) in files(directory)? {
        if is_log(&file) {
            logs.push(file);
            continue;
        }
        let touches = ObjectTouches::new(&name, text::read_file(&file, sink)?, Source::Object);
        if !touches.is_empty() {
            objects.insert(name, Found { touches, file, is_logged: false });
        }
    }
    logs.sort();
    with_logs(objects, &logs, directory, sink)
}

/// Adds the contents of logs to objects, one log after the other. Some touches with a position among others are a fault.
fn with_logs(
    mut objects: BTreeMap<String, Found>,
    logs: &[PathBuf],
    directory: &Path,
    sink: &mut dyn Sink,
) -> Result<Vec<Found>> {
    for file in logs {
        let read = Log::read(file).and_then(|log| Ok((log.by_object(&name_of(file))?, log.skipped())));
        let (logged, skipped) = match read {
            Ok(read) => read,
            Err(error) => {
                sink.fault(error)?;
                continue;
            }
        };
        skipped.into_iter().for_each(|skipped| sink.warning(skipped));
        for touches in logged {
            let name = touches.name.clone();
            match objects.get_mut(&name) {
                Some(found) if found.is_logged => found.touches.append(&touches),
                Some(found) => {
                    let [one, other] = [found.file.display(), file.display()];
                    let two = problem!("two files of the object {name}: {one} and {other}").fix("Remove one of them.");
                    sink.fault(two.at(Place::file(directory)))?;
                }
                None => _ = objects.insert(name, Found { touches, file: file.clone(), is_logged: true }),
            }
        }
    }
    let mut alike = Alike::default();
    for Found { touches, file, .. } in objects.values() {
        if let Err(error) = touches.touches().iter().try_for_each(|touch| alike.admit(touch)) {
            sink.fault(error.at(Place::file(file)))?;
        }
    }
    Ok(objects.into_values().collect())
}

/// The problem of a table that no program reads.
pub(super) fn parquet(path: &Path) -> Error {
    problem!("Parquet is not read")
        .fix(format!("Instead, {}.", crate::gone::instead(".parquet").unwrap_or_default()))
        .at(Place::file(path))
}
