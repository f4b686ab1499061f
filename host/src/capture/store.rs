//! A data set on its way to the disk.
//!
//! Touches of an object are appended to `<object>.part`, which becomes `<object>.txt` when it is complete, or is
//! converted to `<object>.parquet`. Twice a
//! second the part is flushed to the disk, then the manifest says how much of it counts: whatever an interruption
//! leaves behind that is cut off when the capture is resumed.

use super::Settings;
use crate::error::{Error, Result};
use crate::output;
use crate::touches::Format;
use crate::touches::manifest::{Entry, Manifest};
use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often what is on the disk is accounted for.
const ACCOUNT: Duration = Duration::from_millis(500);

pub(super) struct Store {
    directory: PathBuf,
    manifest: Manifest,
    samples: u64,
    /// The object that is being written.
    open: Option<(usize, File)>,
    accounted: Instant,
    /// Held as long as the store lives: the operating system takes it back even from a process that is killed.
    _lock: File,
}

impl Store {
    /// Opens the directory for a capture, alone.
    pub(super) fn open(directory: &Path, settings: &Settings, names: impl Iterator<Item = String>) -> Result<Self> {
        std::fs::create_dir_all(directory).map_err(|error| Error::io(directory, "make the directory", error))?;
        let lock = lock(directory)?;
        output::remove_leftovers(directory)?;
        let wanted = Manifest::new(settings, names);
        let found = Manifest::read(directory);
        let manifest = if settings.resume {
            found?.map_or(Ok(wanted.clone()), |found| resumed(directory, found, &wanted))?
        } else {
            // What is there is replaced, even if it is no manifest.
            for entry in found.ok().flatten().into_iter().flat_map(|manifest| manifest.objects) {
                remove_touches(directory, &entry.name)?;
            }
            wanted
        };
        // Touches that were made in different ways are never mixed.
        for entry in manifest.objects.iter().filter(|entry| entry.touches == 0) {
            remove_touches(directory, &entry.name)?;
        }
        let samples = settings.samples();
        manifest.write(directory)?;
        Ok(Self {
            directory: directory.into(),
            manifest,
            samples: samples.end - samples.start,
            open: None,
            accounted: Instant::now(),
            _lock: lock,
        })
    }

    /// What there is of an object.
    pub(super) fn entry(&self, object: usize) -> &Entry {
        &self.manifest.objects[object]
    }

    /// Appends touches of an object.
    pub(super) fn append(&mut self, object: usize, text: &[u8], touches: u64, approaches: u64) -> Result<()> {
        let path = self.part(object);
        let file = self.part_file(object)?;
        file.write_all(text).map_err(|error| stopped(&path, error))?;
        let entry = &mut self.manifest.objects[object];
        entry.touches += touches;
        entry.approaches += approaches;
        entry.bytes += text.len() as u64;
        if self.accounted.elapsed() >= ACCOUNT { self.account() } else { Ok(()) }
    }

    /// Gives the object's file its name, once all its touches are there.
    pub(super) fn complete(&mut self, object: usize) -> Result<()> {
        let done = done(&self.directory, &self.entry(object).name, self.manifest.settings.format);
        if self.entry(object).touches < self.samples || done.exists() {
            return Ok(());
        }
        self.part_file(object)?;
        self.account()?;
        self.open = None;
        let part = self.part(object);
        match self.manifest.settings.format {
            Format::Text => std::fs::rename(&part, &done).map_err(|error| stopped(&part, error)),
            Format::Parquet => convert(&part, &done, &self.entry(object).name),
        }
    }

    /// Says that the data set is complete.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.manifest.complete = true;
        self.write_manifest()
    }

    fn write_manifest(&self) -> Result<()> {
        self.manifest.write(&self.directory).map_err(|error| match error {
            Error::Io { path, source, .. } => stopped(&path, source),
            other => other,
        })
    }

    fn account(&mut self) -> Result<()> {
        if let Some((object, file)) = &self.open {
            file.sync_data().map_err(|error| stopped(&self.part(*object), error))?;
        }
        self.accounted = Instant::now();
        self.write_manifest()
    }

    /// The object's part, cut to what the manifest accounts for when it is opened.
    fn part_file(&mut self, object: usize) -> Result<&mut File> {
        let path = self.part(object);
        let io = |error| stopped(&path, error);
        if self.open.as_ref().is_none_or(|(open, _)| *open != object) {
            let bytes = self.entry(object).bytes;
            let options = File::options().write(true).create(true).truncate(false).clone();
            let mut file = options.open(&path).map_err(io)?;
            if file.metadata().map_err(io)?.len() < bytes {
                let what =
                    format!("shorter than the {bytes} bytes that {} accounts for", crate::touches::manifest::FILE);
                return Err(Error::file(&path, what, "Capture without --resume."));
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

fn part(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.part"))
}

fn done(directory: &Path, name: &str, format: Format) -> PathBuf {
    directory.join(format!("{name}.{}", format.extension()))
}

/// Turns a complete part into a Parquet file.
#[cfg(feature = "parquet")]
fn convert(part: &Path, done: &Path, object: &str) -> Result<()> {
    let unfinished = done.with_extension("parquet.part");
    let io = |error| stopped(&unfinished, error);
    let file = File::create(&unfinished).map_err(io)?;
    crate::touches::parquet::write(&unfinished, &file, object, crate::touches::text::lines(part)?)?;
    file.sync_all().map_err(io)?;
    std::fs::rename(&unfinished, done).map_err(io)?;
    std::fs::remove_file(part).map_err(|error| Error::io(part, "remove the converted touches", error))
}

#[cfg(not(feature = "parquet"))]
fn convert(_: &Path, _: &Path, _: &str) -> Result<()> {
    Format::Parquet.check()
}

fn remove_touches(directory: &Path, name: &str) -> Result<()> {
    let done = [Format::Text, Format::Parquet].map(|format| done(directory, name, format));
    for path in done.into_iter().chain([part(directory, name), directory.join(format!("{name}.parquet.part"))]) {
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(Error::io(&path, "remove the old touches", error));
            }
            _ => {}
        }
    }
    Ok(())
}

/// A capture that could not write, and can be resumed.
fn stopped(path: &Path, source: std::io::Error) -> Error {
    let cure = match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "Free some space",
        _ => "Check the disk",
    };
    let fix = format!("{cure}, then repeat the command with --resume: what is accounted for is safe.");
    Error::Io { path: path.into(), action: "write the touches", source, fix }
}

fn lock(directory: &Path) -> Result<File> {
    let path = directory.join(".lock");
    let io = |error| Error::io(&path, "lock the directory", error);
    let file = File::options().write(true).create(true).truncate(false).open(&path).map_err(io)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::file(
            directory,
            "another capture is writing into this directory",
            "Wait until it is done, or give another directory.",
        )),
        Err(TryLockError::Error(error)) => Err(io(error)),
    }
}

/// The manifest to go on from.
fn resumed(directory: &Path, found: Manifest, wanted: &Manifest) -> Result<Manifest> {
    let different = |what: String| {
        Err(Error::file(
            Manifest::path(directory),
            format!("cannot resume: {what}"),
            "Repeat the arguments of the first capture, or give another directory.",
        ))
    };
    if found.palpate != wanted.palpate {
        return different(format!("started by version {}, this is {}", found.palpate, wanted.palpate));
    }
    if found.settings != wanted.settings {
        return different(format!("other settings: it was started with {}", describe(&found)));
    }
    let names = |manifest: &Manifest| manifest.objects.iter().map(|entry| entry.name.clone()).collect::<Vec<_>>();
    if names(&found) != names(wanted) {
        return different(format!("other objects: it was started with {}", names(&found).join(", ")));
    }
    Ok(Manifest { complete: false, ..found })
}

fn describe(manifest: &Manifest) -> String {
    serde_json::to_string(&manifest.settings).unwrap_or_default()
}
