//! Any bytes offered as a Parquet file give an error that names it, or touches: no panic, and no memory out of
//! proportion.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::touches::parquet;

fuzz_target!(|bytes: &[u8]| {
    // Called like the object of the seeds: rows of another one are refused.
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("tetrahedron.parquet");
    std::fs::write(&path, bytes).expect("written");
    match parquet::read(&path) {
        Ok(touches) => assert!(!touches.is_empty()),
        Err(error) => assert!(error.to_string().contains(".parquet: "), "{error}"),
    }
});
