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
            for (entry, pool) in
                listing.objects.iter().flat_map(|entry| entry.pools.iter().map(move |pool| (entry, pool)))
            {
                let file = entry.path(directory, pool);
                let above = if pool.file.is_some() { directory.join(&entry.name) } else { directory.into() };
                assert_eq!(file.parent(), Some(above.as_path()), "{}", file.display());
            }
            let text = serde_json::to_vec(&listing).expect("a listing is JSON");
            assert_eq!(Listing::parse(&text, directory).expect("what was written can be read"), listing);
        }
        Err(error) => assert!(error.to_string().contains("dataset.json:"), "{error}"),
    }
});
