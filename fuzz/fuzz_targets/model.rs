//! Any bytes offered as a model give an error or a model that can be walked. The version, the length and the checksum are
//! corrected first, since hardly any input would pass them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_onboard::{Model, Recognizer, RowsSeen, Stopping};
use palpate_shared::Touch;
use palpate_shared::format::{CHECKSUM_LENGTH, MAGIC, VERSION, checksum};

fuzz_target!(|bytes: &[u8]| {
    let _ = Model::new(bytes).map(|model| walk(&model));
    let mut bytes = bytes.to_vec();
    let Ok(length) = u32::try_from(bytes.len()) else { return };
    if bytes.len() < 12 + CHECKSUM_LENGTH {
        return;
    }
    bytes[..4].copy_from_slice(&MAGIC);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let body = bytes.len() - CHECKSUM_LENGTH;
    let sum = checksum(&bytes[..body]);
    bytes[body..].copy_from_slice(&sum.to_le_bytes());
    let _ = Model::new(&bytes).map(|model| walk(&model));
});

/// Touches and rows that reach all over a model.
fn walk(model: &Model<'_>) {
    for object in 0..=model.object_count() {
        let _ = (model.object_name(object), model.prior(object), model.tool_version());
    }
    let _ = (model.probe(), model.trained_touches(), model.noise(), model.optional_sections().count());
    let stopping = Stopping::from_model(model);
    let _ = stopping.error_rate();
    let Ok(mut recognizer) = Recognizer::<256>::new(model, stopping) else { return };
    for times in [[0, 0, 0], [30_000, 0, 50_000], [0, u32::MAX, 7], [u32::MAX; 3], [0, 4_000_000_000, 1]] {
        let _ = recognizer.push(&Touch::from_micros(times));
        recognizer.posterior(recognizer.best());
    }
    let mut seen = RowsSeen::<256>::new();
    for row in [&[][..], &[i32::MIN; 256], &[i32::MAX; 256], &[0; 256], &[1000, -1000, 5]] {
        let _ = recognizer.push_features(row);
        let _ = recognizer.push_seen(row, &mut seen);
        let mut margins = [0; 256];
        model.margins_of(row, &mut margins);
        recognizer.push_margins(&margins);
    }
}
