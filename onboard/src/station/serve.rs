//! The whole program of a chip that recognizes touches from a host.

use super::session::Station;
use super::storage::Storage;
use super::table::Locates;
use embedded_io::{Read, Write};
use palpate_shared::link::DeviceEnd;

/// Errors of a transport in a row after which [`serve`] ends: of reads without a byte in between, or of frames to be sent. A
/// UART reports each garbled byte as an error, and has one or two of them whenever a cable is plugged in.
pub const ERRORS_IN_A_ROW: u16 = 1_000;

/// Errors of one direction of a transport, in a row.
struct Failures(u16);

impl Failures {
    /// The result of a call; `None` for an error that is one of few.
    fn pass<T, E>(&mut self, result: Result<T, E>) -> Result<Option<T>, E> {
        match result {
            Ok(done) => {
                self.0 = 0;
                Ok(Some(done))
            }
            Err(error) => {
                self.0 = self.0.saturating_add(1);
                if self.0 < ERRORS_IN_A_ROW { Ok(None) } else { Err(error) }
            }
        }
    }
}

/// Serves a host at the other end of `transport`, with room for models of `N` objects, until the transport ends or has failed
/// [`ERRORS_IN_A_ROW`] times in a row. Fewer errors lose bytes or frames, which the host sends or asks for again.
///
/// Begins with the model that was loaded last into `storage`, if it is still whole. `built_in` is a model in flash, in use until
/// another is loaded; it may be empty. Once the transport works again, call this again with the same storage.
///
/// Stack: a few buffers for frames more than [`Recognizer::push`](crate::Recognizer::push); the README of the
/// firmware states it.
///
/// `boot` has to be another number after each start: see [`DeviceEnd::new`].
///
/// # Errors
/// The last of [`ERRORS_IN_A_ROW`] errors of the transport; a transport that ends (reads nothing) returns `Ok`.
pub fn serve<const N: usize, S: Storage, T: Read + Write>(
    built_in: &[u8],
    storage: &mut S,
    boot: u32,
    transport: &mut T,
) -> Result<(), T::Error> {
    serve_with::<N, _, _, _>(built_in, storage, (), boot, transport)
}

/// Serves a host as [`serve`] does, with room for a model of maps too: a `&mut` [`Table`](super::Table).
///
/// # Errors
/// Errors of [`serve`].
pub fn serve_with<const N: usize, S: Storage, L: Locates, T: Read + Write>(
    built_in: &[u8],
    storage: &mut S,
    located: L,
    boot: u32,
    transport: &mut T,
) -> Result<(), T::Error> {
    let mut station = Station::<N, &mut S, L>::open_with(built_in, storage, located);
    let mut end = DeviceEnd::new(boot);
    let (mut reads, mut writes) = (Failures(0), Failures(0));
    let mut send = |frame: &[u8], transport: &mut T| {
        let written = transport.write_all(frame).and_then(|()| transport.flush());
        writes.pass(written)
    };
    let mut sent = Ok(None);
    end.start(|frame| sent = send(frame, transport));
    loop {
        sent?;
        let mut buffer = [0; 32];
        sent = Ok(None);
        let Some(count) = reads.pass(transport.read(&mut buffer))? else { continue };
        if count == 0 {
            return Ok(());
        }
        end.receive(buffer.get(..count).unwrap_or_default(), &mut station, |frame| sent = send(frame, transport));
    }
}
