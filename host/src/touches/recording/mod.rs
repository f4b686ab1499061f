//! Touches of a real probe on their way to the disk.
//!
//! Each recording is a file. Each touch is a line appended to it and flushed to the disk before the next one is waited for, so
//! that any end of a recording (a pulled cable, Ctrl-C, a power cut) costs at most the touch that is being written. The
//! listing follows twice a second and at the end; until then a file may hold more than is listed. Readers count what the
//! file holds, up to the last whole line.

#[cfg(test)]
mod tests;

use super::alike::other_position;
use super::checksum::CRC;
use super::files::{check_name, files};
use super::finding::Strict;
use super::read::read_listed;
use super::recorded::Recorded;
use super::text::lines;
use super::writer::make;
use super::{Entry, Finding, Listing, Origin, PoolFile};
use crate::error::{Error, Place, Result, problem};
use crate::output;
use crc::{Digest, Table};
use palpate_shared::Touch;
use palpate_shared::format::Length;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two writes of the listing while touches come.
const CHECKPOINT: Duration = Duration::from_millis(500);

/// A data set to which touches of an object are added.
pub struct Recording {
    directory: PathBuf,
    object: String,
    listing: Listing,
    recorded: Recorded,
    /// Its file, once it has a touch.
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

/// The file of a recording, and its entry in the listing.
struct Open {
    path: PathBuf,
    /// Positions of the object, and of the file among those of the object.
    place: [usize; 2],
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
    /// are without it; when `object` cannot be a file's name; when a file of the object has lost touches.
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
        let lock = output::lock(directory)?.ok_or_else(busy)?;
        output::remove_leftovers(directory)?;
        let listing = match Listing::read(directory)? {
            Some(listing) => admit(listing, origin).map_err(here)?,
            None => {
                let names = |(_, path): &(_, PathBuf)| path.file_name().map(|name| name.display().to_string());
                let files: Vec<String> = files(directory)?.iter().filter_map(names).collect();
                if !files.is_empty() {
                    return Err(unlisted(&files.join(", "), directory));
                }
                let usual = || Origin::recorded(super::Origin::default().probe, Length::Tenth, false);
                Listing::new(&origin.cloned().unwrap_or_else(usual), [])
            }
        };
        // Before the first touch, which would be lost.
        let first = Entry { name: object.into(), ..Entry::default() };
        next_file(directory, listing.objects.iter().find(|entry| entry.name == object).unwrap_or(&first))?;
        let recorded = Recorded {
            placement: placement.map(str::to_owned),
            began: humantime::format_rfc3339_seconds(began).to_string(),
            source: source.into(),
            ..Recorded::default()
        };
        let mut recording = Self {
            directory: directory.into(),
            object: object.into(),
            listing,
            recorded,
            open: None,
            before: 0,
            added: 0,
            warnings: Vec::new(),
            checkpointed: Instant::now(),
            _lock: lock,
        };
        recording.before = recording.count_earlier()?;
        Ok(recording)
    }

    /// Number of touches that earlier recordings of the object hold, which are then listed.
    fn count_earlier(&mut self) -> Result<u64> {
        let Some(entry) = self.listing.objects.iter_mut().find(|entry| entry.name == self.object) else { return Ok(0) };
        let (directory, longest, mut sink) = (&self.directory, self.listing.origin.longest(), Strict::default());
        let mut count = |pool: &PoolFile| {
            let touches = read_listed(entry, pool, &entry.path(directory, pool), &longest, &mut sink)?;
            Ok(touches.len() as u64)
        };
        let counts = entry.pools.iter().map(&mut count).collect::<Result<Vec<u64>>>()?;
        for (pool, touches) in entry.pools.iter_mut().zip(&counts) {
            // An interrupted recording holds more than it had listed.
            if pool.touches != *touches {
                (pool.touches, pool.crc32) = (*touches, None);
            }
        }
        self.warnings = sink.0;
        Ok(counts.iter().sum())
    }

    /// The object's name.
    pub fn object(&self) -> &str {
        &self.object
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
        self.before + self.added
    }

    /// Says which program made the touches that follow, and with which model, by its checksum. Returns what made the newest
    /// touches of the data set, if that is something else.
    ///
    /// # Errors
    /// When the listing cannot be written.
    pub(crate) fn made_by(&mut self, firmware: Option<String>, model: Option<u32>) -> Result<Option<String>> {
        let all = self.listing.objects.iter().flat_map(|entry| &entry.pools).filter_map(|pool| pool.recorded.as_ref());
        let newest = all.max_by_key(|recorded| &recorded.began).and_then(|recorded| recorded.firmware.clone());
        let other = newest.filter(|other| firmware.as_ref().is_some_and(|own| own != other));
        let is_same = self.recorded.firmware == firmware && self.recorded.model == model;
        if !is_same && self.open.is_some() {
            // Another program since the cable was out: a recording of its own.
            self.checkpoint()?;
            self.open = None;
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
        let crc32 = Some(CRC.checksum(lines(touches, true).as_bytes()));
        let count = touches.len() as u64;
        let mut pools =
            self.listing.objects.iter().filter(|entry| entry.name == self.object).flat_map(|entry| &entry.pools);
        if let Some(same) = pools.find(|pool| pool.crc32 == crc32 && pool.touches == count) {
            let began = same.recorded.as_ref().map_or("", |recorded| &recorded.began);
            return Err(problem!("the same {count} touches of {} were recorded before, on {began}", self.object)
                .fix("Give other lines."));
        }
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
        let open = match &mut self.open {
            Some(open) => open,
            None => self.open.insert(Open::new(&self.directory, &mut self.listing, &self.object, &self.recorded)?),
        };
        // In one piece, so that hardly anything can come in between.
        let lines = lines(touches, true);
        let written = open.file.write_all(lines.as_bytes()).and_then(|()| open.file.sync_data());
        written.map_err(|error| Error::io(&open.path, "write the touches", error))?;
        open.digest.update(lines.as_bytes());
        let [object, pool] = open.place;
        let entry = &mut self.listing.objects[object];
        entry.pools[pool].touches += touches.len() as u64;
        entry.approaches = entry.touches();
        self.added += touches.len() as u64;
        Ok(())
    }

    /// Writes the listing as it is now. Without a touch there is nothing to list.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn checkpoint(&mut self) -> Result<()> {
        self.checkpointed = Instant::now();
        let Some(Open { place: [object, pool], digest, .. }) = &self.open else { return Ok(()) };
        self.listing.objects[*object].pools[*pool].crc32 = Some(digest.clone().finalize());
        self.listing.write(&self.directory)
    }
}

impl Open {
    /// Lists a recording and makes its file, before its first touch: a file that is not listed would not be read.
    fn new(directory: &Path, listing: &mut Listing, object: &str, recorded: &Recorded) -> Result<Self> {
        let objects = &mut listing.objects;
        let number = objects.iter().position(|entry| entry.name == object).unwrap_or_else(|| {
            let place = objects.partition_point(|entry| entry.name.as_str() < object);
            objects.insert(place, Entry { name: object.into(), ..Entry::default() });
            place
        });
        let entry = &mut objects[number];
        let place = [number, entry.pools.len()];
        let (pool, path) = next_file(directory, entry)?;
        entry.pools.push(PoolFile { recorded: Some(recorded.clone()), ..pool });
        listing.write(directory)?;
        let file = make(&path).map_err(|error| Error::io(&path, "write the touches", error))?;
        Ok(Self { path, place, file, digest: CRC.digest() })
    }
}

/// The file of the next recording of an object, and its path, at which there must be nothing: what is there would be taken for its
/// touches.
fn next_file(directory: &Path, entry: &Entry) -> Result<(PoolFile, PathBuf)> {
    let number = |pool: &PoolFile| pool.file.as_ref().map_or(1, |file| file.parse::<u64>().unwrap_or(0));
    let file = entry.pools.iter().map(number).max().map(|last| (last + 1).to_string());
    let pool = PoolFile { file, ..PoolFile::default() };
    let path = entry.path(directory, &pool);
    match path.exists() {
        true => Err(unlisted(&path.strip_prefix(directory).unwrap_or(&path).display().to_string(), directory)),
        false => Ok((pool, path)),
    }
}

/// The problem of files that a listing does not name.
fn unlisted(files: &str, directory: &Path) -> Error {
    problem!("holds {files}, which dataset.json does not list")
        .fix("Give another directory, or move the files away.")
        .at(Place::file(directory))
}

/// A recorded listing to add to.
fn admit(listing: Listing, origin: Option<&Origin>) -> Result<Listing> {
    if !listing.is_recorded() {
        let touches: u64 = listing.objects.iter().map(Entry::touches).sum();
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
