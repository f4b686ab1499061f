//! Bytes to and from a chip.

use super::qemu::{self, Qemu};
use crate::error::{Error, Kind, Place, Result, problem};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

/// Bytes to and from a chip.
pub struct Transport {
    name: String,
    received: Receiver<std::io::Result<Vec<u8>>>,
    writer: Box<dyn Write + Send>,
    emulator: Option<Qemu>,
}

impl Transport {
    /// A transport of a reader, on which a thread waits, and a writer; `name` is for errors. Where bytes come one by one,
    /// `gather` is how long they may pile up before they are read.
    pub(crate) fn new(
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
        Self { name, received, writer: Box::new(writer), emulator: None }
    }

    pub(super) fn with_emulator(mut self, emulator: Qemu) -> Self {
        self.emulator = Some(emulator);
        self
    }

    /// Name of the transport in messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Resets the emulated chip, like a power cut of a chip with battery-backed RAM.
    ///
    /// # Errors
    /// When this is no emulator, or it does not listen.
    pub fn reset_chip(&mut self) -> Result<()> {
        match &self.emulator {
            Some(emulator) => emulator.reset(),
            None => Err(qemu::no_reset().at(Place::file(&self.name))),
        }
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// When the other end is gone.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.writer.write_all(bytes).and_then(|()| self.writer.flush());
        written.map_err(|source| self.lost(&source))
    }

    /// Waits for bytes, at most for `wait`. No bytes mean that none came.
    ///
    /// # Errors
    /// When the other end is gone.
    pub(crate) fn receive(&mut self, wait: Duration) -> Result<Vec<u8>> {
        match self.received.recv_timeout(wait) {
            Ok(Ok(bytes)) => Ok(bytes),
            Ok(Err(source)) => Err(self.lost(&source)),
            Err(RecvTimeoutError::Timeout) => Ok(Vec::new()),
            Err(RecvTimeoutError::Disconnected) => Err(self.lost(&ErrorKind::UnexpectedEof.into())),
        }
    }

    /// The error for a line that broke.
    fn lost(&mut self, source: &std::io::Error) -> Error {
        let problem = match &mut self.emulator {
            Some(emulator) => problem!("the emulator ended{}", qemu::after_colon(&emulator.end()))
                .fix("Check that the firmware image is an ELF file for the emulated machine."),
            None => {
                let reason = match source.kind() {
                    ErrorKind::UnexpectedEof => "the other end closed it".into(),
                    _ => source.to_string(),
                };
                problem!("the connection to the chip was lost: {reason}").as_kind(Kind::Lost).fix(
                    "Check the cable and the chip's power, or the program at the other end of a TCP connection; then \
                     start again.",
                )
            }
        };
        problem.at(Place::file(&self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device that is no longer there.
    struct Unplugged;

    impl Unplugged {
        fn error() -> std::io::Error {
            std::io::Error::other("Input/output error (os error 5)")
        }
    }

    impl Read for Unplugged {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(Self::error())
        }
    }

    impl Write for Unplugged {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(Self::error())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Err(Self::error())
        }
    }

    #[test]
    fn an_unplugged_cable_says_what_happened_and_what_to_do() {
        let mut transport = Transport::new("/dev/ttyACM0".into(), Unplugged, Unplugged, Duration::ZERO);
        let errors = [transport.receive(Duration::from_secs(60)).unwrap_err(), transport.send(b"hello").unwrap_err()];
        for error in errors {
            let text = error.to_string();
            assert!(
                text.starts_with("/dev/ttyACM0: the connection to the chip was lost: Input/output error"),
                "{text}"
            );
            assert!(text.contains("Check the cable and the chip's power") && !text.contains("disk"), "{text}");
            assert_eq!(error.exit_code(), 1);
        }
    }

    #[test]
    fn a_connection_that_the_other_end_closed_says_so() {
        let mut transport =
            Transport::new("tcp://localhost:1".into(), std::io::empty(), std::io::sink(), Duration::ZERO);
        let error = transport.receive(Duration::from_secs(60)).unwrap_err().to_string();
        let start = "tcp://localhost:1: the connection to the chip was lost: the other end closed it. Check";
        assert!(error.starts_with(start), "{error}");
    }

    #[test]
    fn only_the_emulator_can_be_reset() {
        let mut transport = Transport::new("/dev/ttyACM0".into(), Unplugged, Unplugged, Duration::ZERO);
        let error = transport.reset_chip().unwrap_err().to_string();
        assert!(error.starts_with("/dev/ttyACM0: the chip cannot be reset from here"), "{error}");
    }
}
