//! Bytes to and from a chip, over a line that can be made bad on purpose.

use super::{BadLine, Faults};
use crate::error::{Error, Result};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::io::{ErrorKind, Read, Write};
use std::process::Child;
use std::time::{Duration, Instant};

/// Bytes to and from a chip.
pub struct Transport {
    name: String,
    received: Receiver<std::io::Result<Vec<u8>>>,
    writer: Box<dyn Write + Send>,
    bad: Option<(BadLine, BadLine)>,
    emulator: Option<Running>,
}

/// A started emulator, ended when it is dropped.
pub(super) struct Running {
    pub(super) child: Child,
    /// Holds the monitor's socket.
    pub(super) directory: Option<tempfile::TempDir>,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Transport {
    /// A transport of a reader, which a thread of its own waits on, and a writer; `name` is for errors. `gather` is how
    /// long bytes may pile up before they are read, where they come one by one.
    pub fn new(
        name: String,
        mut reader: impl Read + Send + 'static,
        writer: impl Write + Send + 'static,
        gather: Duration,
    ) -> Self {
        let (sender, received) = crossbeam_channel::unbounded();
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            loop {
                if !gather.is_zero() {
                    std::thread::sleep(gather);
                }
                let read = match reader.read(&mut buffer) {
                    Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                    Ok(count) => Ok(buffer.get(..count).unwrap_or_default().to_vec()),
                    Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                    Err(error) => Err(error),
                };
                let ended = read.is_err();
                // The other end hangs up when the transport is dropped.
                if sender.send(read).is_err() || ended {
                    return;
                }
            }
        });
        Self { name, received, writer: Box::new(writer), bad: None, emulator: None }
    }

    pub(super) fn with_emulator(mut self, emulator: Running) -> Self {
        self.emulator = Some(emulator);
        self
    }

    /// The same over a bad line.
    pub fn with_faults(mut self, faults: Faults, seed: u64) -> Self {
        self.bad = Some((BadLine::new(faults, seed), BadLine::new(faults, !seed)));
        self
    }

    /// What the transport is called in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Resets the emulated chip, as a power cut would whose RAM is battery-backed.
    ///
    /// # Errors
    /// When this is no emulator, or it does not listen.
    pub fn reset_chip(&mut self) -> Result<()> {
        let directory = self.emulator.as_ref().and_then(|emulator| emulator.directory.as_ref());
        let Some(directory) = directory else {
            return Err(Error::data(format!("{} has no reset", self.name), "Use the emulator."));
        };
        super::emulator::reset(directory.path())
    }

    /// Sends bytes, at once or, on a bad line, when they are due.
    ///
    /// # Errors
    /// When the other end is gone.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        match &mut self.bad {
            Some((down, _)) => {
                down.push(bytes, Instant::now());
                self.send_due()
            }
            None => self.write(bytes),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.writer.write_all(bytes).and_then(|()| self.writer.flush());
        written.map_err(|source| Error::io(&self.name, "send to the chip", source))
    }

    fn send_due(&mut self) -> Result<()> {
        while let Some(bytes) = self.bad.as_mut().and_then(|(down, _)| down.pop(Instant::now())) {
            self.write(&bytes)?;
        }
        Ok(())
    }

    /// Waits for bytes, at most for `wait`. No bytes mean that none came.
    ///
    /// # Errors
    /// When the other end is gone.
    pub fn receive(&mut self, wait: Duration) -> Result<Vec<u8>> {
        self.send_due()?;
        let wait = if self.bad.is_some() { wait.min(Duration::from_millis(1)) } else { wait };
        let bytes = match self.received.recv_timeout(wait) {
            Ok(Ok(bytes)) => bytes,
            Ok(Err(source)) => return Err(Error::io(&self.name, "hear from the chip", source)),
            Err(RecvTimeoutError::Timeout) => Vec::new(),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::io(&self.name, "hear from the chip", ErrorKind::UnexpectedEof.into()));
            }
        };
        let Some((_, up)) = &mut self.bad else { return Ok(bytes) };
        up.push(&bytes, Instant::now());
        let mut due = Vec::new();
        while let Some(bytes) = up.pop(Instant::now()) {
            due.extend(bytes);
        }
        Ok(due)
    }
}
