//! Any bytes offered as `dataset.json` give an error that names it, or a listing that is written and read back the same,
//! and whose files lie in its directory.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::touches::Listing;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let directory = Path::new("data");
    match Listing::parse(bytes, &Listing::path(directory)) {
        Ok(listing) => {
            for entry in &listing.objects {
                let file = entry.file(directory);
                assert_eq!(file.parent(), Some(directory), "{}", file.display());
            }
            let text = serde_json::to_vec(&listing).expect("a listing is JSON");
            assert_eq!(Listing::parse(&text, directory).expect("what was written can be read"), listing);
        }
        Err(error) => assert!(error.to_string().contains("dataset.json:"), "{error}"),
    }
});
