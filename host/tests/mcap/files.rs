//! Logs for tests: those of another library, and such as no library writes.

use std::path::PathBuf;

/// A log that MCAP's library for Python wrote: `tests/data/mcap/make.py`.
pub(crate) fn python(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/mcap")).join(name)
}

pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
pub(crate) const SCHEMA: u8 = 3;
pub(crate) const CHANNEL: u8 = 4;
pub(crate) const MESSAGE: u8 = 5;
pub(crate) const CHUNK: u8 = 6;

pub(crate) fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

pub(crate) fn schema(id: u16, name: &str, encoding: &str, data: &str) -> Vec<u8> {
    record(SCHEMA, &[&id.to_le_bytes()[..], &string(name), &string(encoding), &string(data)].concat())
}

pub(crate) fn channel(id: u16, schema: u16, topic: &str, encoding: &str) -> Vec<u8> {
    let body = [&id.to_le_bytes()[..], &schema.to_le_bytes(), &string(topic), &string(encoding), &[0; 4]].concat();
    record(CHANNEL, &body)
}

pub(crate) fn message(channel: u16, time: u64, data: &[u8]) -> Vec<u8> {
    let body = [&channel.to_le_bytes()[..], &[0; 4], &time.to_le_bytes(), &time.to_le_bytes(), data].concat();
    record(MESSAGE, &body)
}

/// A chunk that states this size and checksum.
pub(crate) fn chunk(compression: &str, size: u64, crc: u32, data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let body = [&[0; 16][..], &size.to_le_bytes(), &crc.to_le_bytes(), &string(compression), &length, data].concat();
    record(CHUNK, &body)
}

/// A file with these records, and no checksums.
pub(crate) fn file(records: &[Vec<u8>]) -> Vec<u8> {
    let header = record(1, &[0; 8]);
    let end = [record(15, &[0; 4]), record(2, &[0; 20])].concat();
    [MAGIC, &header, &records.concat(), &end, MAGIC].concat()
}

/// A file with JSON touches on `/touch`.
pub(crate) fn touches(messages: &[&str]) -> Vec<u8> {
    let mut records = vec![schema(1, "palpate.Touch", "jsonschema", "{}"), channel(1, 1, "/touch", "json")];
    records.extend(messages.iter().zip(1..).map(|(text, time)| message(1, time, text.as_bytes())));
    file(&records)
}
