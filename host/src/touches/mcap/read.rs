//! From a file's records to touches.

use super::message::Encoding;
use super::records::{self, Chunk};
use super::{LARGEST, NAMES, TOUCH, chunk};
use crate::error::{Error, Place, Result, TouchesProblem};
use crate::touches::logged::{Channels, Message};
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
                return Err(Error::variant_at(place, problem(error)));
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
                    return Err(Error::variant_at(Place::file(path), problem(McapError::BadMagic)));
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
        let wrong = |problem| Error::variant_at(Place::byte(self.path, offset), problem);
        match opcode {
            op::CHUNK => {
                let records = Chunk::of(data).and_then(|chunk| chunk::records(&chunk)).map_err(wrong)?;
                self.chunk(&records, offset)
            }
            _ => self.plain(opcode, data, offset),
        }
    }

    /// The records of a chunk, which begins at `offset`.
    fn chunk(&mut self, mut records: &[u8], offset: u64) -> Result<()> {
        while !records.is_empty() {
            let next = split(records).ok_or_else(|| {
                let message = "a record is longer than the chunk that it stands in".into();
                Error::variant_at(Place::byte(self.path, offset), TouchesProblem::NotMcap { message })
            });
            let (opcode, data, rest) = next?;
            self.plain(opcode, data, offset)?;
            records = rest;
        }
        Ok(())
    }

    /// A record other than a chunk.
    fn plain(&mut self, opcode: u8, data: &[u8], offset: u64) -> Result<()> {
        let path = self.path;
        let wrong = |problem| Error::variant_at(Place::byte(path, offset), problem);
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

    fn schema(&mut self, id: u16, schema: Schema) -> Result<(), TouchesProblem> {
        match self.schemas.get(&id) {
            // Files repeat them.
            Some(same) if *same == schema => Ok(()),
            Some(_) => Err(not_mcap(format!("schema {id} is defined twice, and differently"))),
            None => {
                let definition = schema.definition.as_ref().map_or(0, String::len);
                self.take(schema.name.len() + schema.encoding.len() + definition)?;
                self.schemas.insert(id, schema);
                Ok(())
            }
        }
    }

    fn channel(&mut self, id: u16, mut channel: Channel) -> Result<(), TouchesProblem> {
        if let Some(same) = self.channels.get(&id) {
            let key = |channel: &Channel| (channel.schema, channel.topic.clone(), channel.encoding.clone());
            return match key(same) == key(&channel) {
                true => Ok(()),
                false => Err(not_mcap(format!("channel {id} is defined twice, and differently"))),
            };
        }
        self.take(channel.topic.len() + channel.encoding.len())?;
        let Channel { topic, schema: number, encoding, .. } = &channel;
        let schema = self.schemas.get(number);
        if *number != 0 && schema.is_none() {
            return Err(not_mcap(format!("{topic} has the schema {number}, which is missing")));
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
                        let found = found.chars().take(300).collect();
                        return Err(TouchesProblem::OtherDefinition { channel: said(), found, expected });
                    } else {
                        Encoding::Cdr
                    }
                }
                (encoding, schema) => {
                    let (channel, encoding, schema) = (said(), encoding.into(), schema.into());
                    return Err(TouchesProblem::OtherEncoding { channel, encoding, schema });
                }
            });
        }
        self.channels.insert(id, channel);
        Ok(())
    }

    fn message(&mut self, message: &records::Message<'_>, offset: u64) -> Result<()> {
        let wrong = |problem| Error::variant_at(Place::byte(self.path, offset), problem);
        let Some(channel) = self.channels.get_mut(&message.channel) else {
            return Err(wrong(not_mcap(format!("a message of channel {}, which is missing", message.channel))));
        };
        channel.messages += 1;
        let Some(encoding) = channel.reads else { return Ok(()) };
        let read = match message.log_time {
            ..=LATEST => encoding.read(message.data),
            time => Err(TouchesProblem::BadMessage { what: "log time", message: format!("{time} ns, after 2262") }),
        };
        let read = read.map_err(|problem| {
            let (topic, number) = (channel.topic.clone(), channel.messages);
            wrong(TouchesProblem::Message { topic, number, problem: problem.into() })
        });
        let (touch, object) = read?;
        (self.each)(Message { time: message.log_time, offset, touch, object })
    }

    /// Takes memory for names.
    fn take(&mut self, bytes: usize) -> Result<(), TouchesProblem> {
        self.names += bytes;
        let most = MOST_NAMES as u64;
        match self.names <= MOST_NAMES {
            true => Ok(()),
            false => Err(TouchesProblem::TooLarge { what: "names of channels".into(), bytes: self.names as u64, most }),
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
            let problem = TouchesProblem::NoTouchChannel { channels: channels.others };
            return Err(Error::variant_at(Place::file(self.path), problem));
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

fn not_mcap(message: String) -> TouchesProblem {
    TouchesProblem::NotMcap { message }
}

fn problem(error: McapError) -> TouchesProblem {
    not_mcap(match error {
        McapError::BadMagic => "it does not begin or end as one".into(),
        McapError::UnexpectedEof => "it ends early".into(),
        McapError::RecordTooLarge { len, .. } => {
            return TouchesProblem::TooLarge { what: "a record".into(), bytes: len, most: LARGEST as u64 };
        }
        // On one line.
        other => other.to_string().split_whitespace().collect::<Vec<_>>().join(" "),
    })
}
