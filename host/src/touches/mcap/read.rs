//! From a file's records to touches.

use super::message::Encoding;
use super::records::{self, Chunk};
use super::{CORRECT, LARGEST, NAMES, TOUCH, chunk, not_mcap};
use crate::error::{Error, Place, Result, problem};
use crate::touches::logged::{Channels, Message, too_large};
use ::mcap::records::op;
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{MAGIC, McapError};
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Number of bytes requested at a time.
const STEP: usize = 1 << 16;
/// Largest size of the names and definitions of a file's channels, in bytes.
const MOST_NAMES: usize = 16 << 20;
/// An opcode and a length.
const HEAD: usize = 9;
/// The end of the definition of a touch that earlier versions did not have.
const LOCATED: &str = "; bool has_position; float64[3] position";
/// Remedy for channels of touches in other encodings, or by other definitions.
const LOG_OTHERWISE: &str = "Log them as docs/reference/mcap.md says: JSON, or CDR by the definitions in host/msg.";
/// The latest log time, in nanoseconds: in the year 2262.
const LATEST: u64 = i64::MAX as u64;

/// Reads a log from its first byte to its last, and hands on every touch in the order of the file.
///
/// # Errors
/// Errors of `each`; when the file cannot be read, is damaged or ends early, has no channel of touches, or a message on a
/// channel of touches that is none. The byte is named at which the record, or the chunk with it, begins.
pub fn read(mut bytes: impl Read, path: &Path, each: impl FnMut(Message) -> Result<()>) -> Result<Channels> {
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_check_finishes_after_end_magic(true)
        .with_validate_data_section_crc(true)
        .with_record_length_limit(LARGEST);
    let mut reader = LinearReader::new_with_options(options);
    let mut log = Reading { path, each, schemas: BTreeMap::new(), channels: BTreeMap::new(), names: 0 };
    let mut offset = MAGIC.len() as u64;
    let (mut in_data, mut is_first) = (true, true);
    loop {
        match reader.next_event() {
            None => break,
            Some(Err(error)) => {
                // What comes before the first record has no record's place.
                let place = match error {
                    McapError::BadMagic => Place::file(path),
                    _ => Place::byte(path, offset),
                };
                return Err(unread(error).at(place));
            }
            Some(Ok(LinearReadEvent::ReadRequest(count))) => {
                let buffer = reader.insert(count.clamp(1, STEP));
                let count = loop {
                    match bytes.read(buffer) {
                        Err(error) if error.kind() == ErrorKind::Interrupted => {}
                        read => break read.map_err(|error| Error::io(path, "read the touches", error))?,
                    }
                };
                // Said here, since a short text would be called a log that ends early.
                if is_first && count > 0 && buffer[0] != MAGIC[0] {
                    return Err(unread(McapError::BadMagic).at(Place::file(path)));
                }
                is_first = false;
                reader.notify_read(count);
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                // A summary of the records above follows.
                in_data &= opcode != op::DATA_END;
                if in_data {
                    log.record(opcode, data, offset)?;
                }
                offset += (HEAD + data.len()) as u64;
            }
        }
    }
    log.finish()
}

/// State of reading a file.
struct Reading<'p, F> {
    path: &'p Path,
    each: F,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Number of bytes of the two.
    names: usize,
}

#[derive(PartialEq)]
struct Schema {
    name: String,
    encoding: String,
    /// Essence of a definition, where it counts.
    definition: Option<String>,
}

struct Channel {
    topic: String,
    schema: u16,
    encoding: String,
    reads: Option<Encoding>,
    messages: u64,
}

impl<F: FnMut(Message) -> Result<()>> Reading<'_, F> {
    fn record(&mut self, opcode: u8, data: &[u8], offset: u64) -> Result<()> {
        match opcode {
            op::CHUNK => {
                let records = Chunk::of(data).and_then(|chunk| chunk::records(&chunk));
                let records = records.map_err(|error| error.at(Place::byte(self.path, offset)))?;
                self.chunk(&records, offset)
            }
            _ => self.plain(opcode, data, offset),
        }
    }

    /// The records of a chunk, which begins at `offset`.
    fn chunk(&mut self, mut records: &[u8], offset: u64) -> Result<()> {
        while !records.is_empty() {
            let (opcode, data, rest) = split(records).ok_or_else(|| {
                not_mcap("a record is longer than the chunk that it stands in").at(Place::byte(self.path, offset))
            })?;
            self.plain(opcode, data, offset)?;
            records = rest;
        }
        Ok(())
    }

    /// A record other than a chunk.
    fn plain(&mut self, opcode: u8, data: &[u8], offset: u64) -> Result<()> {
        let path = self.path;
        let wrong = |error: Error| error.at(Place::byte(path, offset));
        match opcode {
            op::SCHEMA => {
                let records::Schema { id, name, encoding, data } = records::Schema::of(data).map_err(wrong)?;
                let definition = NAMES.contains(&name).then(|| super::message::essence(data));
                self.schema(id, Schema { name: name.into(), encoding: encoding.into(), definition }).map_err(wrong)
            }
            op::CHANNEL => {
                let records::Channel { id, schema, topic, encoding } = records::Channel::of(data).map_err(wrong)?;
                let (topic, encoding) = (topic.into(), encoding.into());
                self.channel(id, Channel { topic, schema, encoding, reads: None, messages: 0 }).map_err(wrong)
            }
            op::MESSAGE => self.message(&records::Message::of(data).map_err(wrong)?, offset),
            _ => Ok(()),
        }
    }

    fn schema(&mut self, id: u16, schema: Schema) -> Result<()> {
        match self.schemas.get(&id) {
            // Files repeat them.
            Some(same) if *same == schema => Ok(()),
            Some(_) => Err(not_mcap(format_args!("schema {id} is defined twice, and differently"))),
            None => {
                let definition = schema.definition.as_ref().map_or(0, String::len);
                self.take(schema.name.len() + schema.encoding.len() + definition)?;
                self.schemas.insert(id, schema);
                Ok(())
            }
        }
    }

    fn channel(&mut self, id: u16, mut channel: Channel) -> Result<()> {
        if let Some(same) = self.channels.get(&id) {
            let key = |channel: &Channel| (channel.schema, channel.topic.clone(), channel.encoding.clone());
            return match key(same) == key(&channel) {
                true => Ok(()),
                false => Err(not_mcap(format_args!("channel {id} is defined twice, and differently"))),
            };
        }
        self.take(channel.topic.len() + channel.encoding.len())?;
        let Channel { topic, schema: number, encoding, .. } = &channel;
        let schema = self.schemas.get(number);
        if *number != 0 && schema.is_none() {
            return Err(not_mcap(format_args!("{topic} has the schema {number}, which is missing")));
        }
        if let Some(schema) = schema.filter(|schema| NAMES.contains(&schema.name.as_str())) {
            let said = || format!("{topic} ({})", schema.name);
            channel.reads = Some(match (encoding.as_str(), schema.encoding.as_str()) {
                ("json", _) => Encoding::Json,
                ("cdr", "ros2msg") => {
                    let expected = super::message::essence(TOUCH.as_bytes());
                    let found = schema.definition.clone().unwrap_or_default();
                    if expected.strip_suffix(LOCATED) == Some(found.as_str()) {
                        Encoding::CdrBefore
                    } else if found != expected {
                        let found: String = found.chars().take(300).collect();
                        let what = problem!("{} is defined as {found:?}, where Palpate has {expected:?}", said());
                        return Err(what.fix(LOG_OTHERWISE));
                    } else {
                        Encoding::Cdr
                    }
                }
                (encoding, schema) => {
                    let channel = said();
                    return Err(problem!("{channel} is in the encoding {encoding:?} with a schema in {schema:?}")
                        .fix(LOG_OTHERWISE));
                }
            });
        }
        self.channels.insert(id, channel);
        Ok(())
    }

    fn message(&mut self, message: &records::Message<'_>, offset: u64) -> Result<()> {
        let place = Place::byte(self.path, offset);
        let Some(channel) = self.channels.get_mut(&message.channel) else {
            let channel = message.channel;
            return Err(not_mcap(format_args!("a message of channel {channel}, which is missing")).at(place));
        };
        channel.messages += 1;
        let Some(encoding) = channel.reads else { return Ok(()) };
        let read = match message.log_time {
            ..=LATEST => encoding.read(message.data),
            time => Err(problem!("no log time: {time} ns, after 2262")),
        };
        let (touch, object) = read.map_err(|error| {
            let (topic, number) = (&channel.topic, channel.messages);
            error.within(format_args!("message {number} on {topic}: ")).fix(CORRECT).at(place)
        })?;
        (self.each)(Message { time: message.log_time, offset, touch, object })
    }

    /// Takes memory for names.
    fn take(&mut self, bytes: usize) -> Result<()> {
        self.names += bytes;
        match self.names <= MOST_NAMES {
            true => Ok(()),
            false => Err(too_large("names of channels", self.names as u64, MOST_NAMES as u64)),
        }
    }

    fn finish(self) -> Result<Channels> {
        let mut channels = Channels::default();
        for channel in self.channels.values() {
            let schema = self.schemas.get(&channel.schema).map_or("no schema", |schema| schema.name.as_str());
            let said = format!("{} ({schema})", channel.topic);
            match channel.reads {
                Some(_) => channels.touches.push(said),
                None => channels.others.push(said),
            }
        }
        if channels.touches.is_empty() {
            return Err(no_touch_channel(&channels.others).at(Place::file(self.path)));
        }
        Ok(channels)
    }
}

/// The first record of some, and what follows it.
fn split(records: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (&opcode, rest) = records.split_first()?;
    let (length, rest) = rest.split_first_chunk()?;
    let (data, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    Some((opcode, data, rest))
}

/// The problem of a log that has these channels, and none of touches.
fn no_touch_channel(channels: &[String]) -> Error {
    const SHOWN: usize = 20;
    let shown = channels.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    let they = match channels.len() {
        0 => "no channel at all".into(),
        1..=SHOWN => shown,
        count => format!("{shown} and {} more", count - SHOWN),
    };
    problem!("no channel of touches in this log: it has {they}").fix(
        "Name the schema of the touches palpate.Touch, or in ROS 2 palpate_msgs/msg/Touch: docs/reference/mcap.md.",
    )
}

fn unread(error: McapError) -> Error {
    match error {
        McapError::BadMagic => not_mcap("it does not begin or end as one"),
        McapError::UnexpectedEof => not_mcap("it ends early"),
        McapError::RecordTooLarge { len, .. } => too_large("a record", len, LARGEST as u64),
        // On one line.
        other => not_mcap(other.to_string().split_whitespace().collect::<Vec<_>>().join(" ")),
    }
}
