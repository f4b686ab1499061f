//! The whole program of a chip that recognizes touches from a host.

use super::session::{RecordsTooShort, Station};
use super::storage::Storage;
use core::fmt;
use embedded_io::{Read, Write};
use palpate_shared::link::DeviceEnd;

/// Reason why a chip's program has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ServeError<E> {
    /// The transport's own error.
    Transport(E),
    /// Records are too short: nothing could be stored.
    Records(RecordsTooShort),
}

impl<E: fmt::Display> fmt::Display for ServeError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Transport(error) => error.fmt(f),
            Self::Records(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for ServeError<E> {}

impl<E> From<RecordsTooShort> for ServeError<E> {
    fn from(error: RecordsTooShort) -> Self {
        Self::Records(error)
    }
}

/// Serves a host at the other end of `transport`, with room for models of `N` objects, until the transport fails.
///
/// Continues from the newest record in `storage`; a loaded model is used again if it is still intact. `built_in` is a model
/// in flash, in use until another is loaded; it may be empty.
///
/// Stack: a few buffers for frames and records more than [`Recognizer::push`](crate::Recognizer::push); the README of the
/// firmware states it.
///
/// `boot` should be another number after each start: see [`DeviceEnd::new`]. Records count starts by themselves, so a
/// chip that has them may give 0.
///
/// # Errors
/// The transport's own; a transport that ends (reads nothing) returns `Ok`. [`ServeError::Records`] at once if the
/// storage keeps records and they are too short for models of `N` objects.
pub fn serve<const N: usize, S: Storage, T: Read + Write>(
    built_in: &[u8],
    storage: S,
    boot: u32,
    transport: &mut T,
) -> Result<(), ServeError<T::Error>> {
    let (mut station, progress, starts) = Station::<N, S>::open(built_in, storage)?;
    // Each start writes a record at its first command, so the counter is another one after each that mattered.
    let mut end = DeviceEnd::new(progress, boot.wrapping_add(starts));
    let mut written = Ok(());
    end.start(|frame| {
        if written.is_ok() {
            written = transport.write_all(frame);
        }
    });
    written.map_err(ServeError::Transport)?;
    loop {
        transport.flush().map_err(ServeError::Transport)?;
        let mut buffer = [0; 32];
        let count = transport.read(&mut buffer).map_err(ServeError::Transport)?;
        if count == 0 {
            return Ok(());
        }
        // Byte by byte, so that nothing is done once the transport has failed.
        for byte in buffer.get(..count).unwrap_or_default() {
            let mut result = Ok(());
            let send = |frame: &[u8]| result = transport.write_all(frame);
            end.receive(core::slice::from_ref(byte), &mut station, send);
            result.map_err(ServeError::Transport)?;
        }
    }
}
