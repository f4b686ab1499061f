//! Logs that are made to harm: no panic, and no memory out of proportion. Alone in its program, for memory is measured.

#[allow(dead_code, reason = "the other program uses the rest")]
mod files;

use files::{channel, chunk, file, message, python, record, schema};
use palpate::touches::Log;
use peak_alloc::PeakAlloc;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::path::Path;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The memory that reading these bytes takes, and the result.
fn taken(bytes: &[u8]) -> (usize, Result<usize, String>) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let read =
        Log::of(bytes, Path::new("robot.mcap")).map(|log| log.touches().len()).map_err(|error| error.to_string());
    (MEMORY.peak_usage() - before, read)
}

fn touches() -> Vec<Vec<u8>> {
    vec![
        schema(1, "palpate.Touch", "jsonschema", ""),
        channel(1, 1, "/touch", "json"),
        message(1, 1, br#"{"times":[0,0,0]}"#),
    ]
}

/// One, since several at a time would measure each other's memory.
#[test]
fn no_log_panics_or_takes_memory_out_of_proportion() {
    lengths_that_lie_take_no_memory();
    what_unpacks_to_more_than_it_states_is_not_unpacked();
    mutants_neither_panic_nor_take_much();
}

fn lengths_that_lie_take_no_memory() {
    let huge = 1_u64 << 60;
    let good = file(&touches());
    let records = touches().concat();
    for opcode in 1..=16 {
        for length in [huge, u64::MAX, 1 << 26, (1 << 26) + 1] {
            let mut lying = file(&[touches().concat(), record(opcode, &[0; 64])]);
            let at = good.len() - (8 + 29 + 13);
            assert_eq!(lying[at], opcode);
            lying[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
            let (memory, read) = taken(&lying);
            let said = read.unwrap_err();
            let expected = if length > 1 << 26 { "where at most 67108864 are read" } else { "it ends early" };
            assert!(said.contains(expected), "{opcode} {length}: {said}");
            assert!(memory < 1 << 20, "{opcode} {length}: {memory}");
        }
    }
    for compression in ["", "zstd", "lz4"] {
        for size in [huge, u64::MAX, 1 << 26] {
            let (memory, read) = taken(&file(&[chunk(compression, size, 0, &records)]));
            assert!(memory < 1 << 20, "{compression} {size}: {memory}");
            let said = read.unwrap_err();
            let expected = if size > 1 << 26 { "a chunk of " } else { "not a usable MCAP file: a chunk " };
            assert!(said.contains(expected), "{compression} {size}: {said}");
        }
    }
}

fn what_unpacks_to_more_than_it_states_is_not_unpacked() {
    // 40 MB of zeros in LZ4, and in Zstandard: a frame without a size whose blocks repeat a byte, 128 KiB at a time.
    let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
    std::io::copy(&mut std::io::Read::take(std::io::repeat(0), 40 << 20), &mut lz4).unwrap();
    let lz4 = lz4.finish().unwrap();
    let block = |last: u32| [&(last | 1 << 1 | (128 << 10) << 3).to_le_bytes()[..3], &[0]].concat();
    let blocks: Vec<u8> = (0..320).flat_map(|i| block(u32::from(i == 319))).collect();
    let zstd = [&[0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x50][..], &blocks].concat();
    for (compression, data) in [("lz4", &lz4), ("zstd", &zstd)] {
        for size in [0, 1, 70_000] {
            let (memory, read) = taken(&file(&[chunk(compression, size, 0, data)]));
            assert!(memory < 32 << 20, "{compression} {size}: {memory}");
            let said = read.unwrap_err();
            assert!(
                said.contains(&format!("at least {} bytes where it states {size}", size + 1)),
                "{compression}: {said}"
            );
        }
        // What it states is what it is, but no records.
        let said = taken(&file(&[chunk(compression, 40 << 20, 0, data)])).1.unwrap_err();
        assert!(said.contains("a record is longer than the chunk"), "{compression}: {said}");
    }
}

fn mutants_neither_panic_nor_take_much() {
    let mut random = ChaCha8Rng::seed_from_u64(17);
    let names = ["json.mcap", "json-lz4.mcap", "json-zstd.mcap", "ros2.mcap", "plain.mcap"];
    let wholes = names.map(|name| std::fs::read(python(name)).unwrap());
    let (mut read, mut refused) = (0, 0);
    for mutant in 0..2_000 {
        let mut bytes = wholes[mutant % wholes.len()].clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..5) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes[at] = *[0, 0xff, 0x7f, 0x80].get(random.random_range(0..4_usize)).unwrap(),
                2 => bytes.truncate(at.max(1)),
                3 => {
                    let to = (at + random.random_range(1..64)).min(bytes.len());
                    bytes.drain(at..to);
                }
                _ => {
                    let length = bytes.len().min(at + 8);
                    bytes[at..length].fill(0xff);
                }
            }
            if bytes.is_empty() {
                bytes.push(0);
            }
        }
        let (memory, found) = taken(&bytes);
        assert!(memory < 48 << 20, "mutant {mutant}: {memory} bytes");
        match found {
            Ok(touches) => {
                assert!(touches <= 40);
                read += 1;
            }
            Err(error) => {
                assert!(error.starts_with("robot.mcap: "), "mutant {mutant}: {error}");
                refused += 1;
            }
        }
    }
    // Checksums leave only the summary, which is not read.
    assert!(refused > 1_500 && read > 20, "{read} read, {refused} refused");
}
