//! Contents of a chunk: decompressed without C, no further than it says.

use super::records::Chunk;
use super::{LARGEST, not_mcap};
use crate::error::{Error, Result, problem};
use crate::touches::checksum::CRC;
use crate::touches::logged::too_large;
use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;
use std::borrow::Cow;
use std::io::Read;

/// Smallest window of a compressor's back references that covers levels up to 19.
const WINDOW: u64 = 16 << 20;

/// The records of a chunk, with the checksum that it states, if it states one.
pub(super) fn records<'a>(chunk: &Chunk<'a>) -> Result<Cow<'a, [u8]>> {
    let Chunk { size: stated, data, .. } = *chunk;
    if stated > LARGEST as u64 {
        return Err(too_large("a chunk", stated, LARGEST as u64));
    }
    let records = match chunk.compression {
        "" => Cow::Borrowed(data),
        "zstd" => Cow::Owned(zstd(data, stated).map_err(|message| damaged("zstd", &message))?),
        "lz4" => Cow::Owned(lz4(data, stated).map_err(|message| damaged("lz4", &message))?),
        other => {
            return Err(problem!("a chunk is compressed as {other:?}, where zstd and lz4 are known")
                .fix("Compress it again: mcap compress LOG -o OTHER.mcap --compression zstd."));
        }
    };
    if records.len() as u64 != stated {
        let least = if records.len() as u64 > stated { "at least " } else { "" };
        let holds = format_args!("a chunk holds {least}{} bytes where it states {stated}", records.len());
        return Err(not_mcap(holds));
    }
    let (stated, found) = (chunk.crc, CRC.checksum(&records));
    if stated != 0 && stated != found {
        let differs = format_args!("a chunk is damaged: its checksum is {found:08x} where it states {stated:08x}");
        return Err(not_mcap(differs));
    }
    Ok(records)
}

fn damaged(compression: &str, message: &str) -> Error {
    not_mcap(format_args!("a chunk is damaged: no {compression}: {message}"))
}

/// All frames, one after the other, up to one byte more than `size`.
fn zstd(mut data: &[u8], size: u64) -> Result<Vec<u8>, String> {
    let mut records = Vec::new();
    while !data.is_empty() && records.len() as u64 <= size {
        let decoder = StreamingDecoder::new_with_max_window_size(&mut data, size.max(WINDOW));
        unpack(decoder.map_err(|error| error.to_string())?, &mut records, size)?;
    }
    Ok(records)
}

/// Decompresses LZ4 frames.
fn lz4(data: &[u8], size: u64) -> Result<Vec<u8>, String> {
    let mut records = Vec::new();
    unpack(FrameDecoder::new(data), &mut records, size)?;
    Ok(records)
}

/// Reads on, up to one byte more than `size`; memory grows with the bytes that arrive.
fn unpack(mut from: impl Read, records: &mut Vec<u8>, size: u64) -> Result<(), String> {
    loop {
        let left = (size + 1).saturating_sub(records.len() as u64);
        let step = left.min(records.len().max(1 << 16) as u64);
        records.reserve_exact(step as usize);
        let read = from.by_ref().take(step).read_to_end(records).map_err(|error| error.to_string())?;
        if (read as u64) < step || step == left {
            return Ok(());
        }
    }
}
