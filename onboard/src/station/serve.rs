//! The whole program of a chip that recognizes touches from a host.

use super::Memory;
use super::record::{Records, Source};
use super::session::Station;
use crate::Model;
use embedded_io::{Read, Write};
use palpate_shared::link::{DeviceEnd, Event, Progress};

/// Serves a host at the other end of `transport`, with room for models of `N` objects, until the transport fails.
///
/// Continues from the newest record in `memory`; a loaded model is used again if it is still intact.
///
/// Stack: about 3 KB more than [`Recognizer::push`](crate::Recognizer::push).
///
/// # Errors
/// The transport's own, and nothing else; a transport that ends (reads nothing) returns `Ok`.
pub fn serve<const N: usize, T: Read + Write>(memory: Memory<'_>, transport: &mut T) -> Result<(), T::Error> {
    let Memory { built_in, mut models, records } = memory;
    let mut records = Records::new(records);
    let (mut source, progress) = match records.newest() {
        Some(record) => (record.source, record.progress),
        None => (Source::BuiltIn, Progress::NONE),
    };
    let mut end = DeviceEnd::new(progress);
    let mut written = Ok(());
    end.tell(Event::Started, |frame| written = transport.write_all(frame));
    written?;
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
                transport.flush()?;
                (read, done) = (transport.read(&mut buffer)?, 0);
                if read == 0 {
                    return Ok(());
                }
            }
            // Byte by byte, because what comes after a switch is for the next model.
            let byte = buffer.get(done).copied().unwrap_or_default();
            done += 1;
            let mut result = Ok(());
            end.receive(&[byte], &mut station, |frame| result = transport.write_all(frame));
            result?;
        };
    }
}

fn prefix(bytes: &[u8], length: u32) -> &[u8] {
    usize::try_from(length).ok().and_then(|length| bytes.get(..length)).unwrap_or_default()
}
