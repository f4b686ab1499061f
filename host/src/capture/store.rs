//! A data set on its way to the disk.
//!
//! Touches of an object are appended to `<object>.part`, which becomes `<object>.txt` when it is complete, or is
//! complete. Twice a second the part is flushed to the disk, then the listing is written, which
//! says how much of it counts: bytes behind that, left by an interruption, are cut off when the capture is resumed.
//!
//! Touches are only deleted after a listing that says `"complete": false` was written: at no moment does a complete
//! listing name files that are gone.

use super::Settings;
use super::admission::{Admission, admit, own_files, part};
use crate::error::{CaptureProblem, Error, Place, Result};
use crate::output;
use crate::touches::{Entry, Listing, checksum};
use std::fs::File;
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between checkpoints of the data on the disk.
const CHECKPOINT: Duration = Duration::from_millis(500);

pub(super) struct Store {
    directory: PathBuf,
    listing: Listing,
    /// Indices in the listing of this capture's objects; the listing may have others.
    positions: Vec<usize>,
    samples: u64,
    /// The object that is being written.
    open: Option<(usize, File)>,
    checkpointed: Instant,
    /// Held as long as the store lives: the operating system takes it back even from a process that is killed.
    _lock: File,
}

impl Store {
    /// Opens the directory for a capture of objects with these names, alone.
    pub(super) fn open(directory: &Path, settings: &Settings, objects: &[Entry]) -> Result<Self> {
        std::fs::create_dir_all(directory).map_err(|error| Error::io(directory, "make the directory", error))?;
        let busy = || Error::at(Place::file(directory), CaptureProblem::Busy);
        let lock = output::lock(directory)?.ok_or_else(busy)?;
        let Admission { replaced, listing } = admit(directory, settings, objects)?;
        output::remove_leftovers(directory)?;
        if let Some(replaced) = replaced {
            Listing { complete: false, ..replaced.clone() }.write(directory)?;
            replaced.objects.iter().try_for_each(|entry| remove_touches(directory, &entry.name))?;
        }
        listing.write(directory)?;
        let samples = settings.origin.samples();
        let samples = samples.end - samples.start;
        // Touches that were made in different ways are never mixed.
        for entry in &listing.objects {
            if entry.touches == 0 {
                remove_touches(directory, &entry.name)?;
            } else if entry.touches < samples {
                remove(&entry.file(directory))?;
            }
        }
        let position = |object: &Entry| listing.objects.iter().position(|entry| entry.name == object.name);
        Ok(Self {
            directory: directory.into(),
            positions: objects.iter().filter_map(position).collect(),
            listing,
            samples,
            open: None,
            checkpointed: Instant::now(),
            _lock: lock,
        })
    }

    /// Entry of an object.
    pub(super) fn entry(&self, object: usize) -> &Entry {
        &self.listing.objects[self.positions[object]]
    }

    fn entry_mut(&mut self, object: usize) -> &mut Entry {
        &mut self.listing.objects[self.positions[object]]
    }

    /// Appends touches of an object.
    pub(super) fn append(&mut self, object: usize, text: &[u8], touches: u64, approaches: u64) -> Result<()> {
        let path = self.part(object);
        let file = self.part_file(object)?;
        file.write_all(text).map_err(|error| stopped(&path, &error))?;
        let entry = self.entry_mut(object);
        entry.touches += touches;
        entry.approaches += approaches;
        entry.bytes += text.len() as u64;
        if self.checkpointed.elapsed() >= CHECKPOINT { self.checkpoint() } else { Ok(()) }
    }

    /// Gives the object's file its name, once all its touches are there, and takes its checksum. An interruption between
    /// any two of these steps is repaired when the capture is resumed.
    pub(super) fn complete(&mut self, object: usize) -> Result<()> {
        let (part, done) = (self.part(object), self.entry(object).file(&self.directory));
        debug_assert_eq!(self.entry(object).touches, self.samples);
        if !done.exists() {
            self.part_file(object)?;
            self.checkpoint()?;
            self.open = None;
            std::fs::rename(&part, &done).map_err(|error| stopped(&part, &error))?;
        }
        if self.entry(object).crc32.is_none() {
            let bytes = std::fs::metadata(&done).map_err(|error| Error::io(&done, "read the touches", error))?.len();
            let crc32 = checksum(&done)?;
            let entry = self.entry_mut(object);
            (entry.bytes, entry.crc32) = (bytes, Some(crc32));
            remove(&part)?;
        }
        Ok(())
    }

    /// Says that the data set is complete.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.listing.complete = true;
        self.write_listing()
    }

    fn write_listing(&self) -> Result<()> {
        self.listing.write(&self.directory).map_err(|error| match error {
            Error::Io { path, source, .. } => stopped(&path, &source),
            other => other,
        })
    }

    fn checkpoint(&mut self) -> Result<()> {
        if let Some((object, file)) = &self.open {
            file.sync_data().map_err(|error| stopped(&self.part(*object), &error))?;
        }
        self.checkpointed = Instant::now();
        self.write_listing()
    }

    /// The object's part, cut to the listed length when it is opened.
    fn part_file(&mut self, object: usize) -> Result<&mut File> {
        let path = self.part(object);
        let io = |error| stopped(&path, &error);
        if self.open.as_ref().is_none_or(|(open, _)| *open != object) {
            let bytes = self.entry(object).bytes;
            let options = File::options().write(true).create(true).truncate(false).clone();
            let mut file = options.open(&path).map_err(io)?;
            if file.metadata().map_err(io)?.len() < bytes {
                return Err(Error::at(Place::file(&path), CaptureProblem::Shorter { bytes }));
            }
            file.set_len(bytes).map_err(io)?;
            file.seek(SeekFrom::End(0)).map_err(io)?;
            self.open = Some((object, file));
        }
        match &mut self.open {
            Some((_, file)) => Ok(file),
            None => unreachable!("opened above"),
        }
    }

    fn part(&self, object: usize) -> PathBuf {
        part(&self.directory, &self.entry(object).name)
    }
}

fn remove_touches(directory: &Path, name: &str) -> Result<()> {
    own_files(directory, name).try_for_each(|path| remove(&path))
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io(path, "remove the old touches", error)),
        _ => Ok(()),
    }
}

/// A capture that could not write, and can be resumed.
fn stopped(path: &Path, error: &std::io::Error) -> Error {
    let problem = CaptureProblem::NotWritten { kind: error.kind(), message: error.to_string() };
    Error::at(Place::file(path), problem)
}
