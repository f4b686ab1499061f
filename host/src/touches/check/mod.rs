//! Check of a data set, line by line, and its summary.
//!
//! [`Dataset::read`](super::Dataset::read) stops at the first error; a check reads on, and also looks for what reads well
//! and would train badly: files appended to themselves, an object under two names, times in other units than seconds.

mod summary;

pub use summary::{ObjectSummary, Quantiles, Summary};

use super::alike::other_position;
use super::checksum::Checked;
use super::dataset::{name_of, no_objects, two_files};
use super::listing::{missing, other_count};
use super::{Entry, Finding, Listing, Log, Longest, Origin, is_log, logs, text};
use crate::error::{Error, Kind, Place, Result};
use palpate_shared::Touch;
use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Results of a check.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Check {
    /// Findings, certain or possible, in the order of the files and their lines.
    pub findings: Vec<Finding>,
    /// Contents of the data set, as far as they can be read.
    pub summary: Summary,
}

/// Largest number of wrong lines of a file that are shown; the others are counted.
const MOST_LINES: usize = 20;
/// Least number of touches for findings about their sum.
const ENOUGH: usize = 20;

impl Check {
    /// Number of findings that make training wrong.
    pub fn wrong(&self) -> usize {
        self.findings.iter().filter(|finding| finding.is_wrong).count()
    }

    /// Checks the data set in a directory, or a log. Memory: that of its touches.
    ///
    /// # Errors
    /// When the directory cannot be read. What is wrong in it is a [`Finding`].
    pub fn of(directory: &Path) -> Result<Self> {
        let mut findings = Findings(Vec::new());
        if is_log(directory) {
            let mut objects = Vec::new();
            logged(directory, &mut objects, &mut findings)?;
            return Ok(match objects.is_empty() {
                true => Self { findings: findings.0, summary: Summary::of(&[], None) },
                false => Self::of_objects(directory, &objects, None, true, findings),
            });
        }
        let listing = match Listing::read(directory) {
            Ok(listing) => listing,
            Err(error) if directory.is_file() || error.is(&Kind::Io) => return Err(error),
            Err(error) => {
                findings.error(error);
                None
            }
        };
        let origin = listing.as_ref().map(|listing| listing.origin.clone());
        // Files without a listing may be lines that a robot printed.
        let is_recorded = listing.as_ref().is_none_or(Listing::is_recorded);
        let objects = match listing {
            Some(listing) => listed(directory, listing, &mut findings)?,
            None => found(directory, &mut findings)?,
        };
        Ok(Self::of_objects(directory, &objects, origin, is_recorded, findings))
    }

    /// Finds problems with objects other than those found when they were read.
    fn of_objects(
        directory: &Path,
        objects: &[Read],
        origin: Option<Origin>,
        is_recorded: bool,
        mut findings: Findings,
    ) -> Self {
        match objects {
            [] => findings.error(no_objects().at(Place::file(directory))),
            // Objects are recorded one after the other, and one is enough to teach or to compare.
            [one] => findings.note(
                directory,
                &format!("only {} {}", one.name, if is_recorded { "has been recorded" } else { "is here" }),
                "That is enough to evaluate a model, and to train one other objects are needed in the same directory.",
            ),
            _ => {}
        }
        objects.iter().for_each(|object| findings.object(object, origin.as_ref()));
        findings.together(directory, objects);
        Self { findings: findings.0, summary: Summary::of(objects, origin) }
    }
}

/// Contents of an object, as far as they could be read.
struct Read {
    name: String,
    path: PathBuf,
    touches: Vec<Touch>,
    approaches: Option<u64>,
    /// True if a log has them.
    is_logged: bool,
}

/// The objects that a listing names.
fn listed(directory: &Path, listing: Listing, findings: &mut Findings) -> Result<Vec<Read>> {
    let (mut objects, longest) = (Vec::new(), listing.origin.longest());
    for Entry { name, touches: stated, approaches, crc32, .. } in listing.objects {
        let path = directory.join(format!("{name}.{}", super::files::EXTENSION));
        if !path.exists() {
            findings.error(missing(&name).at(Place::file(&path)));
            continue;
        }
        let before = findings.0.len();
        let (touches, found) = read(&path, &longest, findings)?;
        if findings.0.len() == before && touches.len() as u64 != stated {
            findings.error(other_count(stated, touches.len() as u64).at(Place::file(&path)));
        } else if crc32.is_some_and(|stated| stated != found) {
            findings.note(&path, "changed since its capture", "Capture it again if that is not meant.");
        }
        objects.push(Read { name, path, touches, approaches: Some(approaches), is_logged: false });
    }
    for path in logs(directory)? {
        let what = format!("a log, which is not read beside {}", Listing::FILE);
        findings.note(&path, &what, "Record its touches with `palpate data record`, or move it away.");
    }
    for (name, path) in super::files(directory)? {
        if !objects.iter().any(|object| object.path == path)
            && !findings.0.iter().any(|finding| finding.is_about(&path))
        {
            let what = format!("the object {name} is not listed in {}, so it is not read", Listing::FILE);
            findings.note(&path, &what, "Capture all objects together, or remove the file.");
        }
    }
    Ok(objects)
}

/// Every object that has a file.
fn found(directory: &Path, findings: &mut Findings) -> Result<Vec<Read>> {
    let mut objects: Vec<Read> = Vec::new();
    let mut logs = logs(directory)?;
    for (name, path) in super::files(directory)? {
        if is_log(&path) {
            logs.push(path);
            continue;
        }
        let (touches, _) = read(&path, &Longest::default(), findings)?;
        objects.push(Read { name, path, touches, approaches: None, is_logged: false });
    }
    logs.sort();
    for path in logs {
        let mut more = Vec::new();
        logged(&path, &mut more, findings)?;
        for object in more {
            match objects.iter_mut().find(|other| other.name == object.name) {
                Some(other) if other.is_logged => other.touches.extend(object.touches),
                Some(other) => {
                    findings.error(two_files(&object.name, &other.path, &object.path).at(Place::file(directory)));
                }
                None => objects.push(object),
            }
        }
    }
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(objects)
}

/// The objects of a log.
fn logged(path: &Path, objects: &mut Vec<Read>, findings: &mut Findings) -> Result<()> {
    let read = Log::read(path).and_then(|log| Ok((log.by_object(&name_of(path))?, log.skipped())));
    let (found, skipped) = match read {
        Err(error) if error.is(&Kind::Io) => return Err(error),
        Err(error) => {
            findings.error(error);
            return Ok(());
        }
        Ok(read) => read,
    };
    findings.0.extend(skipped);
    for object in found {
        let (name, touches) = (object.name.clone(), object.touches().to_vec());
        // Findings name the object beside the log, where the log is not called like it.
        let path = if name == name_of(path) { path.into() } else { path.join(&name) };
        objects.push(Read { name, path, touches, approaches: None, is_logged: true });
    }
    Ok(())
}

/// The touches of a file that can be read, and the file's checksum.
fn read(path: &Path, longest: &Longest, findings: &mut Findings) -> Result<(Vec<Touch>, u32)> {
    let file = File::open(path).map_err(|source| Error::io(path, "read the touches", source))?;
    let mut reader = BufReader::with_capacity(1 << 16, Checked::new(file));
    let (mut touches, mut wrong) = (Vec::new(), 0);
    for touch in text::numbered(&mut reader, path) {
        match touch {
            Ok(touch) => touches.push(touch),
            Err(error) if error.is(&Kind::Io) => return Err(error),
            Err(error) => {
                wrong += 1;
                if wrong <= MOST_LINES {
                    findings.error(error);
                }
            }
        }
    }
    if wrong > MOST_LINES {
        findings.wrong(path, format!("{} more lines are wrong", wrong - MOST_LINES), "Correct them, or capture again.");
    }
    if let Err((line, error)) = longest.check_all(touches.iter().map(|(line, touch)| (*line, touch))) {
        findings.error(error.at(Place::line(path, line)));
    }
    Ok((touches.into_iter().map(|(_, touch)| touch).collect(), reader.into_inner().checksum()))
}

struct Findings(Vec<Finding>);

impl Finding {
    fn is_about(&self, path: &Path) -> bool {
        self.what.starts_with(&Place::file(path).to_string())
    }
}

impl Findings {
    fn wrong(&mut self, path: &Path, what: impl Into<String>, fix: &str) {
        let what = format!("{}{}", Place::file(path), what.into());
        self.0.push(Finding { is_wrong: true, what, fix: fix.into() });
    }

    fn note(&mut self, path: &Path, what: &str, fix: &str) {
        self.0.push(Finding::warning(path, what, fix));
    }

    fn error(&mut self, error: Error) {
        self.0.push(error.into());
    }

    /// Finds problems with all touches of an object together.
    fn object(&mut self, object: &Read, origin: Option<&Origin>) {
        let Read { path, touches, .. } = object;
        let count = touches.len();
        if count == 0 {
            if !self
                .0
                .iter()
                .any(|finding| finding.is_about(path) || finding.what.starts_with(&format!("{}:", path.display())))
            {
                self.error(text::no_touches().at(Place::file(path)));
            }
            return;
        }
        let of = |number: usize| format!("{number} of {count} touches");
        let has_position = touches.iter().any(|touch| touch.position().is_some());
        if origin.is_some_and(|origin| origin.position != has_position) {
            self.error(other_position(has_position, Listing::STATED).at(Place::file(path)));
        }
        let partial = touches.iter().filter(|touch| !touch.is_full()).count();
        if partial > 0 && origin.is_some_and(|origin| !origin.approaches) {
            let what = format!("{} miss a contact, but the data set is said to hold full touches only", of(partial));
            self.wrong(path, what, "Remove those lines, or capture with --approaches N.");
        }
        if touches.iter().all(|touch| touch.times().iter().all(|time| time.micros().is_none())) {
            self.wrong(path, "no touch has a contact", "Check that the probe reaches the object.");
        } else if count >= ENOUGH && touches.iter().all(|touch| touch == &touches[0]) {
            self.wrong(path, "all touches are the same", "Check that the probe moves and its clock runs.");
        } else if count >= ENOUGH && is_repeated(touches) {
            let fix = "Remove the repetition: training touches would also be tested on.";
            self.wrong(path, "it holds every touch at least twice, as if it was appended to itself", fix);
        } else if count < 100 {
            self.note(path, &format!("only {count} touches"), "Capture some thousand of each object.");
        }
        let longest = origin.map_or_else(Longest::default, Origin::longest);
        let is_slip = longest.check_all(touches.iter().map(|touch| ((), touch))).is_ok();
        let too_long = touches.iter().filter(|_| is_slip).filter_map(|touch| longest.check(touch).err());
        if let Some(error) = too_long.clone().next() {
            self.note(path, &format!("{}: {}", of(too_long.count()), error.what()), "Check those lines.");
        }
    }

    /// Finds problems with objects compared with each other.
    fn together(&mut self, directory: &Path, objects: &[Read]) {
        let touches = || objects.iter().flat_map(|object| &object.touches);
        let posed = touches().filter(|touch| touch.pose().is_some()).count();
        let located = touches().filter(|touch| touch.position().is_some()).count();
        let all = touches().count();
        for (count, of) in [(posed, "pose"), (located, "position")].into_iter().filter(|(count, _)| *count > 0) {
            if count < all {
                let what = format!("{count} of {all} touches have a {of} and the others have none");
                self.wrong(directory, what, "Give all of them one, or none.");
            }
        }
        for (index, object) in objects.iter().enumerate() {
            let is_same = |other: &&Read| other.touches.len() >= ENOUGH && other.touches == object.touches;
            if let Some(other) = objects[..index].iter().find(is_same) {
                let what = format!("{} and {} hold the same touches", other.name, object.name);
                self.wrong(&object.path, what, "Remove one of the objects, or capture it again.");
            }
        }
        let counts = objects.iter().map(|object| object.touches.len()).filter(|&count| count > 0);
        if let (Some(least), Some(most)) = (counts.clone().min(), counts.max())
            && most > 10 * least
        {
            let what = format!("one object has {least} touches and another {most}");
            self.note(
                directory,
                &what,
                "Capture as many of each: training weights each touch equally, not each object.",
            );
        }
    }
}

/// True if each touch is there at least twice. Coarse clocks repeat touches too, but not every one.
fn is_repeated(touches: &[Touch]) -> bool {
    let mut counts: HashMap<Key, usize> = HashMap::new();
    touches.iter().for_each(|touch| *counts.entry(key(touch)).or_default() += 1);
    counts.values().all(|&count| count >= 2)
}

type Key = ([Option<u32>; 3], Option<([i16; 3], [i16; 3])>, Option<[i32; 3]>);

/// A touch, to be compared with others.
fn key(touch: &Touch) -> Key {
    let pose = touch.pose().map(|pose| (pose.direction, pose.alignment));
    (touch.times().map(|time| time.micros()), pose, touch.position().map(|position| position.micrometers))
}

/// The time between the first and the last contact, in seconds.
fn last(touch: &Touch) -> f64 {
    f64::from(touch.times().iter().filter_map(|time| time.micros()).max().unwrap_or_default()) / 1e6
}

#[cfg(test)]
mod tests;
