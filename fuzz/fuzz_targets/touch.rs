//! Any bytes offered as touches give errors that name their line, or touches that are written and read back the same;
//! memory grows with the longest line only.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::touches::text;
use peak_alloc::PeakAlloc;
use std::path::Path;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

fuzz_target!(|bytes: &[u8]| {
    let longest = bytes.split(|&byte| byte == b'\n').map(<[u8]>::len).max().unwrap_or(0);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let mut previous = None;
    for touch in text::touches(bytes, Path::new("fuzz.txt")) {
        match touch {
            Err(error) => assert!(error.to_string().starts_with("fuzz.txt:"), "{error}"),
            Ok(touch) => {
                let mut line = String::new();
                text::write_touch(&mut line, &touch, true);
                assert_eq!(text::parse_touch(&line), Ok(touch), "{line}");
                previous = Some(touch);
            }
        }
    }
    std::hint::black_box(previous);
    let taken = MEMORY.peak_usage() - before;
    assert!(taken <= 4096 + 16 * longest, "{taken} bytes of memory for lines of at most {longest}");
});
