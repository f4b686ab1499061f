//! Any bytes offered as a snapshot are refused, and change nothing, or give a state that goes on.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::Touch;
use palpate_shared::link::checksum;

static MODEL: &[u8] = include_bytes!("../../models/household.palpate");

fuzz_target!(|bytes: &[u8]| {
    let model = Model::new(MODEL).expect("the model of the repository");
    let mut recognizer = Recognizer::<16>::new(&model, Stopping::from_model(&model)).expect("it has ten objects");
    let _ = recognizer.push(&Touch::from_micros([0, 10_000, 30_000]));
    // As they are; with a right checksum; and after this model's number as well.
    let mut whole = bytes.to_vec();
    whole.extend(checksum(bytes).to_le_bytes());
    let mut own = recognizer.snapshot(&mut [0; 300]).expect("a long buffer").to_vec();
    own.truncate(5);
    own.extend(bytes);
    own.extend(checksum(&own).to_le_bytes());
    for snapshot in [bytes, &whole, &own] {
        let before = recognizer.evidence().to_vec();
        if recognizer.restore(snapshot).is_err() {
            assert_eq!(recognizer.evidence(), before);
        }
        let _ = recognizer.push(&Touch::from_micros([30_000, 0, 50_000]));
        let best = recognizer.best();
        let _ = (recognizer.posterior(best), recognizer.verdict());
        let taken = recognizer.snapshot(&mut [0; 300]).expect("a long buffer").to_vec();
        recognizer.restore(&taken).expect("its own snapshot");
    }
});
