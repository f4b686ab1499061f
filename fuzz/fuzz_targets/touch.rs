//! Any line offered as a touch gives an error or a touch that is the same once written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::dataset::{parse_touch, write_touch};

fuzz_target!(|line: &str| {
    let Ok(touch) = parse_touch(line) else { return };
    let mut written = String::new();
    write_touch(&mut written, &touch, touch.pose().is_some());
    assert_eq!(parse_touch(written.trim_end()), Ok(touch));
});
