//! Check of a data set, line by line, and its summary.
//!
//! [`Dataset::read`](super::Dataset::read) stops at the first fault; a check reads on, and also looks for what reads well
//! and would train badly: files appended to themselves, an object under two names, times in other units than seconds.

mod summary;

pub use summary::{ObjectSummary, Quantiles, Summary};

use super::files::{logs, name_of};
use super::finding::Sink;
use super::read::{Content, Found, read};
use super::{Finding, Listing, Longest, Origin};
use crate::error::{Error, Kind, Place, Result};
use palpate_shared::Touch;
use std::collections::HashMap;
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
        let Content { objects, listing } = read(directory, &mut findings)?;
        if let Some(listing) = &listing {
            findings.unlisted(directory, listing)?;
        }
        if let [one] = &objects[..] {
            // Files without a listing may be lines that a robot printed. Objects are recorded one after the other, and one is
            // enough to teach or to compare.
            let is_recorded = listing.as_ref().is_none_or(Listing::is_recorded);
            findings.note(
                directory,
                &format!("only {} {}", one.touches.name, if is_recorded { "has been recorded" } else { "is here" }),
                "That is enough to evaluate a model, and to train one other objects are needed in the same directory.",
            );
        }
        let origin = listing.as_ref().map(|listing| &listing.origin);
        objects.iter().for_each(|object| findings.object(object, origin));
        findings.together(directory, &objects);
        Ok(Self { findings: findings.0, summary: Summary::of(&objects, listing) })
    }
}

impl Found {
    /// The file that is to be named, with the object where a log is not called like it.
    fn place(&self) -> PathBuf {
        let name = &self.touches.name;
        if self.is_logged && name_of(&self.file) != *name { self.file.join(name) } else { self.file.clone() }
    }
}

struct Findings(Vec<Finding>);

/// Goes on after a fault, unless something cannot be read.
impl Sink for Findings {
    fn fault(&mut self, error: Error) -> Result<()> {
        if error.is(&Kind::Io) {
            return Err(error);
        }
        self.0.push(error.into());
        Ok(())
    }

    fn warning(&mut self, finding: Finding) {
        self.0.push(finding);
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

    /// Names files that a listing does not.
    fn unlisted(&mut self, directory: &Path, listing: &Listing) -> Result<()> {
        for path in logs(directory)? {
            let what = format!("a log, which is not read beside {}", Listing::FILE);
            self.note(&path, &what, "Record its touches with `palpate data record`, or move it away.");
        }
        // Objects with several files have a directory.
        let inner = listing.objects.iter().map(|entry| directory.join(&entry.name)).filter(|path| path.is_dir());
        for directory_of_files in std::iter::once(directory.to_owned()).chain(inner) {
            for (_, path) in super::files(&directory_of_files)? {
                if listing.paths(directory).all(|listed| listed != path) {
                    let what = format!("not listed in {}, so it is not read", Listing::FILE);
                    self.note(&path, &what, "Capture all objects together, or remove the file.");
                }
            }
        }
        Ok(())
    }

    /// Finds problems with all touches of an object together.
    fn object(&mut self, object: &Found, origin: Option<&Origin>) {
        let (path, touches) = (&object.place(), object.touches.touches());
        let count = touches.len();
        let of = |number: usize| format!("{number} of {count} touches");
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
    fn together(&mut self, directory: &Path, objects: &[Found]) {
        let touches = || objects.iter().flat_map(|object| object.touches.touches());
        let posed = touches().filter(|touch| touch.pose().is_some()).count();
        let all = touches().count();
        if posed > 0 && posed < all {
            let what = format!("{posed} of {all} touches have a pose and the others have none");
            self.wrong(directory, what, "Give all of them one, or none.");
        }
        for (index, object) in objects.iter().enumerate() {
            let own = object.touches.touches();
            let is_same = |other: &&Found| own.len() >= ENOUGH && other.touches.touches() == own;
            if let Some(other) = objects[..index].iter().find(is_same) {
                let what = format!("{} and {} hold the same touches", other.touches.name, object.touches.name);
                self.wrong(&object.place(), what, "Remove one of the objects, or capture it again.");
            }
        }
        let counts = objects.iter().map(|object| object.touches.len());
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

#[cfg(test)]
mod tests;
