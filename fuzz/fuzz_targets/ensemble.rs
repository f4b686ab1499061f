//! Any bytes offered as an ensemble give an error that names the file, or an ensemble that is sound, and take memory in
//! proportion to their length.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::ensemble::{import::Options, read};
use peak_alloc::PeakAlloc;
use std::path::Path;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The memory that any file may take, and how much more for each of its bytes: a leaf of a few bytes may become 256 values
/// of 8 bytes.
const BASE: usize = 1 << 20;
const EACH: usize = 4096;

fuzz_target!(|bytes: &[u8]| {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let found = read(Path::new("fuzz.model"), bytes, &Options::default());
    let taken = MEMORY.peak_usage() - before;
    assert!(taken <= BASE + EACH * bytes.len(), "{taken} bytes of memory for a file of {} bytes", bytes.len());
    match found {
        Err(error) => assert!(error.to_string().starts_with("fuzz.model:"), "{error}"),
        Ok(ensemble) => {
            ensemble.check().expect("what was read is sound");
            ensemble.margins_of_features(&vec![0.5; ensemble.inputs.count()]);
        }
    }
});
