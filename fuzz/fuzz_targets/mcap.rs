//! Any bytes offered as a robot's log, or as a message in one, give an error that names the file, or touches: no panic, and no
//! more memory than the largest chunk takes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::touches::Log;
use palpate::touches::mcap::TOUCH;
use peak_alloc::PeakAlloc;
use std::path::Path;

#[allow(dead_code, reason = "for other tests")]
#[path = "../../host/tests/mcap/files.rs"]
mod files;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A chunk of 64 MiB, as much for the window of its compression, and both once more while they grow.
const MOST: usize = 256 << 20;

fuzz_target!(|bytes: &[u8]| {
    // The first byte chooses the kind of the others.
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let ros2 = || {
        let records = [
            files::schema(1, "palpate_msgs/msg/Touch", "ros2msg", TOUCH),
            files::channel(1, 1, "/touch", "cdr"),
            files::message(1, 1, bytes),
        ];
        files::file(&records)
    };
    let log = match first % 4 {
        0 => bytes.to_vec(),
        1 => files::file(&[bytes.to_vec()]),
        2 => files::touches(&[&String::from_utf8_lossy(bytes)]),
        _ => ros2(),
    };
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let read = Log::of(log.as_slice(), Path::new("fuzz.mcap"));
    let taken = MEMORY.peak_usage() - before;
    assert!(taken <= MOST + 8 * log.len(), "{taken} bytes of memory for a file of {} bytes", log.len());
    match read {
        Err(error) => assert!(error.to_string().starts_with("fuzz.mcap: "), "{error}"),
        Ok(log) => {
            assert!(!log.touches().is_empty() && log.touches().is_sorted_by_key(|logged| logged.time));
            if let Ok(objects) = log.by_object("fuzz") {
                assert_eq!(objects.iter().map(|object| object.len()).sum::<usize>(), log.touches().len());
            }
        }
    }
});
