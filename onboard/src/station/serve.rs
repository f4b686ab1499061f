//! The whole program of a chip that recognizes touches from a host.

use super::Memory;
use super::record::{Records, Source};
use super::session::Station;
use crate::Model;
use core::fmt;
use embedded_io::{Read, Write};
use palpate_shared::link::{DeviceEnd, Event, Progress};

/// Why a chip's program has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ServeError<E> {
    /// The transport's own error.
    Transport(E),
    /// The places for records are too short: nothing could be stored.
    Records {
        /// Bytes that each needs: [`Memory::record_length`].
        needed: usize,
        /// Bytes that one has.
        found: usize,
    },
}

impl<E: fmt::Display> fmt::Display for ServeError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Transport(error) => error.fmt(f),
            Self::Records { needed, found } => {
                write!(f, "a place for records has {found} bytes and needs {needed}: see Memory::record_length")
            }
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for ServeError<E> {}

/// Serves a host at the other end of `transport`, with room for models of `N` objects, until the transport fails.
///
/// Continues from the newest record in `memory`; a loaded model is used again if it is still intact.
///
/// Stack: about 3 KB more than [`Recognizer::push`](crate::Recognizer::push).
///
/// `boot` should be another number after each start: see [`DeviceEnd::new`]. Records count starts by themselves, so a
/// chip that has them may give 0.
///
/// # Errors
/// The transport's own; a transport that ends (reads nothing) returns `Ok`. [`ServeError::Records`] at once if there are
/// places for records and they are too short for models of `N` objects.
pub fn serve<const N: usize, T: Read + Write>(
    memory: Memory<'_>,
    boot: u32,
    transport: &mut T,
) -> Result<(), ServeError<T::Error>> {
    let Memory { built_in, mut models, records } = memory;
    let needed = Memory::record_length(N);
    for record in &records {
        let found = record.len();
        if found < needed && !records.iter().all(|record| record.is_empty()) {
            return Err(ServeError::Records { needed, found });
        }
    }
    let mut records = Records::new(records);
    // A record of a model that is not there any more is not of this program: neither its evidence nor its progress.
    let known = records.newest().filter(|record| {
        let [first, second] = &models;
        let bytes = match record.source {
            Source::BuiltIn => built_in,
            Source::First(length) => prefix(first, length),
            Source::Second(length) => prefix(second, length),
        };
        Model::new(bytes).map_or(0, |model| model.checksum()) == record.model
    });
    let (mut source, progress) = match known {
        Some(record) => (record.source, record.progress),
        None => (Source::BuiltIn, Progress::NONE),
    };
    // Each start writes a record at its first command, so the counter is another one after each that mattered.
    let boot = boot.wrapping_add(records.newest().map_or(0, |record| record.counter));
    let mut end = DeviceEnd::new(progress, boot);
    let mut written = Ok(());
    end.tell(Event::Started, |frame| written = transport.write_all(frame));
    written.map_err(ServeError::Transport)?;
    let (mut buffer, mut read, mut done) = ([0; 32], 0, 0);
    loop {
        let [first, second] = &mut models;
        let (bytes, staging, next): (&[u8], &mut [u8], Source) = match source {
            Source::BuiltIn => (built_in, first, Source::First(0)),
            Source::First(length) => (prefix(first, length), second, Source::Second(0)),
            Source::Second(length) => (prefix(second, length), first, Source::First(0)),
        };
        let model = Model::new(bytes).ok();
        let mut station = Station::<N>::with_memory(model.as_ref(), staging, (source, next), Some(&mut records));
        source = loop {
            if let Some(source) = station.switched() {
                break source;
            }
            if done == read {
                transport.flush().map_err(ServeError::Transport)?;
                (read, done) = (transport.read(&mut buffer).map_err(ServeError::Transport)?, 0);
                if read == 0 {
                    return Ok(());
                }
            }
            // Byte by byte, because what comes after a switch is for the next model.
            let byte = buffer.get(done).copied().unwrap_or_default();
            done += 1;
            let mut result = Ok(());
            end.receive(&[byte], &mut station, |frame| result = transport.write_all(frame));
            result.map_err(ServeError::Transport)?;
        };
    }
}

fn prefix(bytes: &[u8], length: u32) -> &[u8] {
    usize::try_from(length).ok().and_then(|length| bytes.get(..length)).unwrap_or_default()
}
