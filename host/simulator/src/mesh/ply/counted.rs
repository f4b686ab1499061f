//! A reader that knows at which byte and line it is.

use std::cell::Cell;
use std::io::{BufRead, Read, Result};

/// Position up to which a file was read.
#[derive(Debug, Default)]
pub(super) struct Counts {
    /// The byte after the last one that was read, from 0.
    pub(super) byte: Cell<u64>,
    /// The line of the last byte that is not white space, from 1.
    pub(super) line: Cell<u64>,
    /// Ends of lines since that byte.
    ends: Cell<u64>,
}

impl Counts {
    /// Everything before this byte and this line was read.
    pub(super) fn starting_at(byte: u64, line: u64) -> Self {
        Self { byte: Cell::new(byte), line: Cell::new(line), ends: Cell::new(0) }
    }

    fn take(&self, bytes: &[u8]) {
        self.byte.set(self.byte.get() + bytes.len() as u64);
        for byte in bytes {
            if *byte == b'\n' {
                self.ends.set(self.ends.get() + 1);
            } else if !byte.is_ascii_whitespace() {
                self.line.set(self.line.get() + self.ends.replace(0));
            }
        }
    }
}

/// A reader that counts.
pub(super) struct Counted<'a, R> {
    inner: R,
    counts: &'a Counts,
}

impl<'a, R> Counted<'a, R> {
    pub(super) fn new(inner: R, counts: &'a Counts) -> Self {
        Self { inner, counts }
    }
}

impl<R: BufRead> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let read = self.inner.read(buffer)?;
        self.counts.take(buffer.get(..read).unwrap_or_default());
        Ok(read)
    }
}

impl<R: BufRead> BufRead for Counted<'_, R> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        // What is consumed was there when it was looked at, so this does not read.
        if let Ok(bytes) = self.inner.fill_buf() {
            self.counts.take(bytes.get(..amount).unwrap_or_default());
        }
        self.inner.consume(amount);
    }
}
