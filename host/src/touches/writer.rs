//! Writes a data set, whole or not at all.

use super::checksum::CRC;
use super::{Entry, Listing};
use crate::error::{Error, Result};
use crate::output::Folder;
use crc::{Digest, Table};
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A data set that is written: one file after the other, in a directory that appears when all are there.
pub(crate) struct Writer {
    folder: Folder,
    listing: Listing,
}

/// The file of an object that is written.
pub(crate) struct ObjectFile<'w> {
    pub(super) entry: &'w mut Entry,
    path: PathBuf,
    file: File,
    digest: Digest<'static, u32, Table<16>>,
}

impl Writer {
    /// Begins a directory of the objects that are listed, none of which has a touch so far.
    ///
    /// # Errors
    /// Errors of [`Folder::begin`].
    pub(crate) fn begin(directory: &Path, listing: Listing) -> Result<Self> {
        Ok(Self { folder: Folder::begin(directory)?, listing })
    }

    /// Makes the file of an object, by its number in the listing.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn file(&mut self, object: usize) -> Result<ObjectFile<'_>> {
        let entry = &mut self.listing.objects[object];
        let path = entry.file(self.folder.path());
        let file = File::create(&path).map_err(|error| not_written(&path, error))?;
        Ok(ObjectFile { entry, path, file, digest: CRC.digest() })
    }

    /// Puts the directory in its place, with its listing if that is known to be true. Of a directory that is there, the files
    /// `replaced` are removed, and others stay.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn finish(self, is_listed: bool, replaced: &[String]) -> Result<()> {
        if is_listed {
            self.listing.write(self.folder.path())?;
        }
        self.folder.finish(replaced)
    }
}

impl ObjectFile<'_> {
    /// Appends the lines of touches, and says how many approaches they took.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(crate) fn write(&mut self, lines: &str, touches: u64, approaches: u64) -> Result<()> {
        self.file.write_all(lines.as_bytes()).map_err(|error| not_written(&self.path, error))?;
        self.digest.update(lines.as_bytes());
        self.entry.touches += touches;
        self.entry.approaches += approaches;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn close(self) -> Result<()> {
        self.file.sync_all().map_err(|error| not_written(&self.path, error))?;
        self.entry.crc32 = Some(self.digest.finalize());
        Ok(())
    }
}

fn not_written(path: &Path, error: std::io::Error) -> Error {
    Error::io(path, "write the touches", error)
}
