//! Touches of a real probe on their way to the disk.
//!
//! Each touch is a line appended to `<object>.txt` and flushed to the disk before the next one is waited for, so that
//! any end of a recording (a pulled cable, Ctrl-C, a power cut) costs at most the touch that is being written. The
//! listing follows twice a second and at the end; until then a file may hold more than is listed. Readers count what the
//! file holds, up to the last whole line, and the next recording cuts off what is behind it.

#[cfg(test)]
mod tests;

use super::alike::other_position;
use super::checksum::CRC;
use super::files::{check_name, files, whole_lines};
use super::finding::Strict;
use super::read::read_listed;
use super::recorded::Recorded;
use super::{Entry, Finding, Listing, Origin, write_touch};
use crate::error::{Error, Place, Result, problem};
use crate::output;
use crc::{Digest, Table};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two writes of the listing while touches come.
const CHECKPOINT: Duration = Duration::from_millis(500);

/// A data set to which touches of an object are added.
pub struct Recording {
    directory: PathBuf,
    path: PathBuf,
    listing: Listing,
    /// Statement of this recording about itself; among the listed ones once it has a touch.
    recorded: Recorded,
    open: Option<Open>,
    /// Touches of the object that earlier recordings added.
    before: u64,
    /// Touches that were added since it was opened.
    added: u64,
    warnings: Vec<Finding>,
    checkpointed: Instant,
    /// Held as long as the recording lives.
    _lock: File,
}

/// The object's file.
struct Open {
    file: File,
    digest: Digest<'static, u32, Table<16>>,
}

impl Recording {
    /// Opens the directory, which is created if it is missing, for touches of `object`, or of one of its placements, called
    /// `object/placement`. Nothing is written before the first touch.
    ///
    /// `origin` says how the touches are made ([`Origin::recorded`]); none: as those in the directory, or by the published
    /// probe. `source` is where they come from, and `began` the time.
    ///
    /// # Errors
    /// When the directory cannot be read, another program is writing into it, or it holds simulated touches, files that
    /// no listing names, or touches that were recorded with another probe, at another scale, or with the pose where these
    /// are without it; when `object` cannot be a file's name; when the object's file has lost touches.
    pub fn open(
        directory: &Path,
        object: &str,
        origin: Option<&Origin>,
        source: &str,
        began: SystemTime,
    ) -> Result<Self> {
        let (object, placement) = match object.split_once('/') {
            Some((object, placement)) => (object, Some(placement)),
            None => (object, None),
        };
        std::iter::once(object).chain(placement).try_for_each(check_name)?;
        std::fs::create_dir_all(directory).map_err(|error| Error::io(directory, "make the directory", error))?;
        let here = |error: Error| error.at(Place::file(directory));
        let busy = || {
            here(
                problem!("another program is writing into this directory")
                    .fix("Wait until it is done, or give another directory."),
            )
        };
        let unlisted = |files: &str| {
            here(
                problem!("holds {files}, which dataset.json does not list")
                    .fix("Give another directory, or move the files away."),
            )
        };
        let lock = output::lock(directory)?.ok_or_else(busy)?;
        output::remove_leftovers(directory)?;
        let listing = match Listing::read(directory)? {
            Some(listing) => admit(listing, origin).map_err(here)?,
            None => {
                let names = |(_, path): &(_, PathBuf)| path.file_name().map(|name| name.display().to_string());
                let files: Vec<String> = files(directory)?.iter().filter_map(names).collect();
                if !files.is_empty() {
                    return Err(unlisted(&files.join(", ")));
                }
                let usual = || Origin::recorded(super::Origin::default().probe, Length::Tenth, false);
                Listing::new(&origin.cloned().unwrap_or_else(usual), [])
            }
        };
        let path = Entry { name: object.into(), ..Entry::default() }.file(directory);
        let is_listed = listing.objects.iter().any(|entry| entry.name == object);
        if !is_listed && path.metadata().is_ok_and(|there| there.len() > 0) {
            return Err(unlisted(&path.file_name().unwrap_or_default().display().to_string()));
        }
        let recorded = Recorded {
            object: object.into(),
            placement: placement.map(str::to_owned),
            began: humantime::format_rfc3339_seconds(began).to_string(),
            source: source.into(),
            ..Recorded::default()
        };
        let mut recording = Self {
            directory: directory.into(),
            path,
            listing,
            recorded,
            open: None,
            before: 0,
            added: 0,
            warnings: Vec::new(),
            checkpointed: Instant::now(),
            _lock: lock,
        };
        recording.before = recording.take_up()?;
        Ok(recording)
    }

    /// Brings what is listed of the object in line with its file, and returns how many touches there are.
    fn take_up(&mut self) -> Result<u64> {
        let object = &self.recorded.object;
        let Some(entry) = self.listing.objects.iter_mut().find(|entry| entry.name == *object) else { return Ok(0) };
        let longest = self.listing.origin.longest();
        let mut sink = Strict::default();
        let touches = read_listed(entry, &self.path, true, &longest, &mut sink)?.0.len() as u64;
        self.warnings = sink.0;
        // What an interrupted recording had not listed is its own.
        let more = touches - entry.touches;
        if let Some(last) = self.listing.recorded.iter_mut().rev().find(|recorded| recorded.object == *object) {
            last.touches += more;
        }
        entry.touches = touches;
        entry.approaches = touches;
        Ok(touches)
    }

    /// The object's name.
    pub fn object(&self) -> &str {
        &self.recorded.object
    }

    /// The placement of the touches that are added, where one is stated.
    pub fn placement(&self) -> Option<&str> {
        self.recorded.placement.as_deref()
    }

    /// Warnings about the touches that the object had before.
    pub fn warnings(&self) -> &[Finding] {
        &self.warnings
    }

    /// Number of touches added since this was opened.
    pub fn touches(&self) -> u64 {
        self.added
    }

    /// Number of touches of the object there are now.
    pub fn all_touches(&self) -> u64 {
        self.before + self.recorded.touches
    }

    /// Says which program made the touches that follow, and with which model, by its checksum. Returns what made the newest
    /// touches of the data set, if that is something else.
    ///
    /// # Errors
    /// When the listing cannot be written.
    pub(crate) fn made_by(&mut self, firmware: Option<String>, model: Option<u32>) -> Result<Option<String>> {
        let newest = self.listing.recorded.iter().rev().find_map(|recorded| recorded.firmware.clone());
        let other = newest.filter(|other| firmware.as_ref().is_some_and(|own| own != other));
        let is_same = self.recorded.firmware == firmware && self.recorded.model == model;
        if !is_same && self.recorded.touches > 0 {
            // Another program since the cable was out: a recording of its own.
            self.checkpoint()?;
            self.before += self.recorded.touches;
            self.recorded.touches = 0;
        }
        (self.recorded.firmware, self.recorded.model) = (firmware, model);
        Ok(other)
    }

    /// True if the touch lacks the pose that the touches of this data set are recorded with.
    pub(crate) fn lacks_pose(&self, touch: &Touch) -> bool {
        self.listing.origin.pose && touch.pose().is_none()
    }

    /// Refuses a touch without the position that the touches of this data set are recorded with, or with one that they lack.
    fn check_position(&self, touch: &Touch) -> Result<()> {
        let has_position = touch.position().is_some();
        match has_position == self.listing.origin.position {
            true => Ok(()),
            false => Err(other_position(has_position, "the touches recorded here")),
        }
    }

    /// Adds a touch. When this returns, the touch is on the disk.
    ///
    /// # Errors
    /// When it lacks its pose or its position, or has a position where the others have none; when a contact is later than
    /// the stroke that the data set states; when the file cannot be written.
    pub fn add(&mut self, touch: &Touch) -> Result<()> {
        self.append(std::slice::from_ref(touch))?;
        if self.checkpointed.elapsed() >= CHECKPOINT { self.checkpoint() } else { Ok(()) }
    }

    /// Adds the touches of a file: all or, if one of them is wrong, none.
    ///
    /// # Errors
    /// Errors of [`add`](Self::add), and when the same touches of the object were recorded before.
    pub fn add_all(&mut self, touches: &[Touch]) -> Result<()> {
        let crc32 = CRC.checksum(lines(touches).as_bytes());
        let is_same = |other: &&Recorded| {
            (&other.object, other.crc32, other.touches) == (&self.recorded.object, Some(crc32), touches.len() as u64)
        };
        if let Some(Recorded { object, touches, began, .. }) = self.listing.recorded.iter().find(is_same).cloned() {
            return Err(problem!("the same {touches} touches of {object} were recorded before, on {began}")
                .fix("Give other lines."));
        }
        self.recorded.crc32 = Some(crc32);
        self.append(touches)?;
        self.checkpoint()
    }

    fn append(&mut self, touches: &[Touch]) -> Result<()> {
        if touches.iter().any(|touch| self.lacks_pose(touch)) {
            return Err(problem!("no pose, but this data set is recorded with one")
                .fix("Give direction and alignment after the times, or record without the pose."));
        }
        touches.iter().try_for_each(|touch| self.check_position(touch))?;
        let probe = &self.listing.origin.probe;
        let latest = probe.latest();
        let is_late = |touch: &&Touch| latest.is_some_and(|latest| f64::from(touch.spread()) > latest);
        if let Some((touch, stroke)) = touches.iter().find(is_late).zip(probe.stroke) {
            let seconds = |micros: f64| format!("{:.3} s", micros / 1e6);
            let [window, latest] =
                [probe.window().map(f64::from), latest].map(|micros| seconds(micros.unwrap_or_default()));
            let contact = seconds(touch.spread().into());
            return Err(problem!(
                "a contact {contact} after the first, and this data set is recorded with a stroke of {stroke} ({window}), which \
                 explains contacts up to {latest}"
            )
            .fix("Give the probe file the stroke that the hand has, and record into another directory."));
        }
        let lines = lines(touches);
        if self.recorded.touches == 0 {
            self.list()?;
        }
        let path = &self.path;
        let io = |error| Error::io(path, "write the touches", error);
        let open = match &mut self.open {
            Some(open) => open,
            None => self.open.insert(Open::new(path)?),
        };
        // In one piece, so that hardly anything can come in between.
        open.file.write_all(lines.as_bytes()).and_then(|()| open.file.sync_data()).map_err(io)?;
        open.digest.update(lines.as_bytes());
        self.recorded.touches += touches.len() as u64;
        self.added += touches.len() as u64;
        Ok(())
    }

    /// Lists this recording, before its first touch: a file that is not listed would not be read.
    fn list(&mut self) -> Result<()> {
        let object = &self.recorded.object;
        if !self.listing.objects.iter().any(|entry| entry.name == *object) {
            self.listing.objects.push(Entry { name: object.clone(), ..Entry::default() });
            self.listing.objects.sort_by(|a, b| a.name.cmp(&b.name));
        }
        self.listing.recorded.push(self.recorded.clone());
        self.listing.write(&self.directory)
    }

    /// Writes the listing as it is now. Without a touch there is nothing to list.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn checkpoint(&mut self) -> Result<()> {
        self.checkpointed = Instant::now();
        let (Some(open), Some(last)) = (&self.open, self.listing.recorded.last_mut()) else { return Ok(()) };
        if self.recorded.touches > 0 {
            last.clone_from(&self.recorded);
        }
        let all = self.before + self.recorded.touches;
        if let Some(entry) = self.listing.objects.iter_mut().find(|entry| entry.name == self.recorded.object) {
            (entry.touches, entry.approaches) = (all, all);
            entry.crc32 = Some(open.digest.clone().finalize());
        }
        self.listing.write(&self.directory)
    }
}

impl Open {
    /// Opens an object's file behind its last whole line; what follows that is cut off.
    fn new(path: &Path) -> Result<Self> {
        let io = |error| Error::io(path, "write the touches", error);
        let mut file = File::options().write(true).create(true).truncate(false).open(path).map_err(io)?;
        let mut there = std::fs::read(path).map_err(io)?;
        there.truncate(whole_lines(&there).len());
        file.set_len(there.len() as u64).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        let mut digest = CRC.digest();
        digest.update(&there);
        Ok(Self { file, digest })
    }
}

/// A recorded listing to add to.
fn admit(listing: Listing, origin: Option<&Origin>) -> Result<Listing> {
    if !listing.is_recorded() {
        let touches: u64 = listing.objects.iter().map(|entry| entry.touches).sum();
        return Err(problem!("holds {touches} simulated touches of {}", listing.names().join(", "))
            .fix("Give another directory: recorded and simulated touches are not mixed."));
    }
    let differences = origin.map_or_else(Vec::new, |origin| differences(&listing.origin, origin));
    match differences.is_empty() {
        true => Ok(listing),
        false => Err(problem!("cannot add to these recorded touches: {}", differences.join(", "))
            .fix("Record as these touches were, or into another directory.")),
    }
}

/// Differences between the ways in which touches were and are recorded.
fn differences(there: &Origin, here: &Origin) -> Vec<String> {
    let numbers = |origin: &Origin| {
        let probe = origin.probe;
        [("radius", probe.radius), ("spacing", probe.spacing), ("speed", probe.speed), ("tilt", probe.tilt)]
    };
    let mut differences = Vec::new();
    if there.unit != here.unit {
        differences.push(format!("unit is {} there and {} here", there.unit.name(), here.unit.name()));
    }
    let hand = |origin: &Origin| [("stroke", origin.probe.stroke), ("travel", origin.probe.travel)];
    let said = |length: Option<f64>| length.map_or("none".into(), |length| length.to_string());
    let pairs = hand(there).into_iter().zip(hand(here)).filter(|(there, here)| there != here);
    differences.extend(
        pairs.map(|((name, there), (_, here))| format!("{name} is {} there and {} here", said(there), said(here))),
    );
    let pairs = numbers(there).into_iter().zip(numbers(here)).filter(|(there, here)| there != here);
    differences.extend(pairs.map(|((name, there), (_, here))| format!("{name} is {there} there and {here} here")));
    for (what, there, here) in [("pose", there.pose, here.pose), ("position", there.position, here.position)] {
        let said = |is_there| if is_there { "with" } else { "without" };
        if there != here {
            differences.push(format!("{} the {what} there and {} it here", said(there), said(here)));
        }
    }
    differences
}

/// The lines of touches; with the poses of those that have one.
fn lines(touches: &[Touch]) -> String {
    let mut lines = String::new();
    touches.iter().for_each(|touch| write_touch(&mut lines, touch, true));
    lines
}
