//! Writes a data set, whole or not at all.

use super::checksum::CRC;
use super::{Entry, Listing, PoolFile};
use crate::error::{Error, Result};
use crate::output::Folder;
use crc::{Digest, Table};
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A data set that is written: the files of one object after those of the other, in a directory that appears when all are there.
pub(crate) struct Writer {
    folder: Folder,
    listing: Listing,
}

/// The files of an object that are written.
pub(crate) struct ObjectFiles<'w> {
    pub(super) entry: &'w mut Entry,
    files: Vec<OpenFile>,
}

/// The file of a pool.
struct OpenFile {
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

    /// Makes the files of an object, by its number in the listing.
    ///
    /// # Errors
    /// When they cannot be made.
    pub(crate) fn object(&mut self, object: usize) -> Result<ObjectFiles<'_>> {
        let entry = &mut self.listing.objects[object];
        let directory = self.folder.path();
        let open = |pool: &PoolFile| {
            let path = entry.path(directory, pool);
            let file = make(&path).map_err(|error| not_written(&path, error))?;
            Ok(OpenFile { path, file, digest: CRC.digest() })
        };
        let files = entry.pools.iter().map(open).collect::<Result<_>>()?;
        Ok(ObjectFiles { entry, files })
    }

    /// Puts the directory in its place, with its listing if that is known to be true. Of a directory that is there, the files
    /// `replaced` are removed, and others stay.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn finish(self, is_listed: bool, replaced: &[PathBuf]) -> Result<()> {
        if is_listed {
            self.listing.write(self.folder.path())?;
        }
        self.folder.finish(replaced)
    }
}

impl ObjectFiles<'_> {
    /// Appends the lines of touches to the file of a pool, by its number in the entry.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(crate) fn write(&mut self, pool: usize, lines: &str, touches: u64) -> Result<()> {
        let OpenFile { path, file, digest } = &mut self.files[pool];
        file.write_all(lines.as_bytes()).map_err(|error| not_written(path, error))?;
        digest.update(lines.as_bytes());
        self.entry.pools[pool].touches += touches;
        Ok(())
    }

    /// Ends the files, and says how many approaches the touches took. Pools without touches are not listed.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(crate) fn close(self, approaches: u64) -> Result<()> {
        self.entry.approaches = approaches;
        for (pool, OpenFile { path, file, digest }) in self.entry.pools.iter_mut().zip(self.files) {
            let ended = if pool.touches > 0 { file.sync_all() } else { std::fs::remove_file(&path) };
            ended.map_err(|error| not_written(&path, error))?;
            pool.crc32 = Some(digest.finalize());
        }
        self.entry.pools.retain(|pool| pool.touches > 0);
        Ok(())
    }
}

/// Makes a file that is not there, and the directory that it is in.
pub(super) fn make(path: &Path) -> std::io::Result<File> {
    path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
    File::create_new(path)
}

fn not_written(path: &Path, error: std::io::Error) -> Error {
    Error::io(path, "write the touches", error)
}
