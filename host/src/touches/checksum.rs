//! Checksums of files of touches.

use crate::error::{Error, Result};
use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use std::io::Read;
use std::path::Path;

pub(crate) static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// The checksum of a file, as listings state it.
pub(crate) fn checksum(path: &Path) -> Result<u32> {
    let io = |error| Error::io(path, "read the touches", error);
    let mut file = Checked::new(std::fs::File::open(path).map_err(io)?);
    std::io::copy(&mut file, &mut std::io::sink()).map_err(io)?;
    Ok(file.checksum())
}

/// A reader that takes the checksum of all that passes through it.
pub(super) struct Checked<R> {
    inner: R,
    digest: Digest<'static, u32, Table<16>>,
}

impl<R> Checked<R> {
    pub(super) fn new(inner: R) -> Self {
        Self { inner, digest: CRC.digest() }
    }

    /// The checksum of the bytes read so far.
    pub(super) fn checksum(self) -> u32 {
        self.digest.finalize()
    }
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.digest.update(&buffer[..count]);
        Ok(count)
    }
}
