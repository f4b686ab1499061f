//! The records that count, taken apart: no length in them is believed before its bytes are there.
//!
//! `mcap::parse_record` asks for as much memory as a string says that it is long.

use super::not_mcap;
use crate::error::{Error, Result};

/// A schema: how messages are built.
pub(super) struct Schema<'a> {
    pub(super) id: u16,
    pub(super) name: &'a str,
    pub(super) encoding: &'a str,
    pub(super) data: &'a [u8],
}

/// A channel: messages of one schema on one topic.
pub(super) struct Channel<'a> {
    pub(super) id: u16,
    /// 0: none.
    pub(super) schema: u16,
    pub(super) topic: &'a str,
    pub(super) encoding: &'a str,
}

/// A message.
pub(super) struct Message<'a> {
    pub(super) channel: u16,
    /// In nanoseconds.
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

/// Other records, compressed or not.
pub(super) struct Chunk<'a> {
    pub(super) size: u64,
    /// 0: none.
    pub(super) crc: u32,
    pub(super) compression: &'a str,
    pub(super) data: &'a [u8],
}

impl<'a> Schema<'a> {
    pub(super) fn of(record: &'a [u8]) -> Result<Self> {
        let mut fields = Fields(record, "schema");
        let (id, name, encoding) = (fields.u16()?, fields.text()?, fields.text()?);
        let length = fields.u32()?;
        Ok(Self { id, name, encoding, data: fields.bytes(length.into())? })
    }
}

impl<'a> Channel<'a> {
    /// Its metadata are not looked at.
    pub(super) fn of(record: &'a [u8]) -> Result<Self> {
        let mut fields = Fields(record, "channel");
        Ok(Self { id: fields.u16()?, schema: fields.u16()?, topic: fields.text()?, encoding: fields.text()? })
    }
}

impl<'a> Message<'a> {
    pub(super) fn of(record: &'a [u8]) -> Result<Self> {
        let mut fields = Fields(record, "message");
        let (channel, _sequence, log_time, _publish_time) =
            (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
        Ok(Self { channel, log_time, data: fields.0 })
    }
}

impl<'a> Chunk<'a> {
    pub(super) fn of(record: &'a [u8]) -> Result<Self> {
        let mut fields = Fields(record, "chunk");
        let (_first, _last, size, crc) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
        let compression = fields.text()?;
        let length = fields.u64()?;
        Ok(Self { size, crc, compression, data: fields.bytes(length)? })
    }
}

/// Rest of a record, and the record's kind.
struct Fields<'a>(&'a [u8], &'static str);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: u64) -> Result<&'a [u8]> {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let (bytes, rest) = self.0.split_at_checked(count).ok_or_else(|| self.wrong("is shorter than it says"))?;
        self.0 = rest;
        Ok(bytes)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or_else(|| self.wrong("is shorter than its fields"))?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn u16(&mut self) -> Result<u16> {
        self.number().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64> {
        self.number().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<&'a str> {
        let length = self.u32()?;
        let bytes = self.bytes(length.into())?;
        std::str::from_utf8(bytes).map_err(|_| self.wrong("has a name that is no text (no UTF-8)"))
    }

    fn wrong(&self, what: &str) -> Error {
        not_mcap(format_args!("a {} {what}", self.1))
    }
}
