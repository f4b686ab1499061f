//! Any bytes offered as a Parquet file give an error that names it, or touches: no panic, and no memory out of
//! proportion.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::touches::parquet;
use std::io::Write;

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::Builder::new().suffix(".parquet").tempfile().expect("a temporary file");
    file.write_all(bytes).expect("written");
    match parquet::read(file.path()) {
        Ok(touches) => assert!(!touches.is_empty()),
        Err(error) => assert!(error.to_string().contains(".parquet: "), "{error}"),
    }
});
