//! What every machine must make of a touch, as bytes; the firmware's `identity` has the same lines.

use palpate_onboard::{Model, Recognizer, Verdict};
use palpate_shared::Touch;

/// Ten margins, the best object's posterior in Q56, and the verdict with its object and touches: 52 bytes. After a
/// verdict the recognizer starts afresh.
pub fn record(model: &Model<'_>, recognizer: &mut Recognizer<'_, 10>, touch: &Touch) -> Vec<u8> {
    let mut margins = [0; 10];
    model.margins(touch, &mut margins);
    let verdict = match recognizer.push(touch) {
        Verdict::Undecided => 0,
        Verdict::Recognized { object, touches } => 1 << 30 | u32::from(object) << 16 | touches,
        Verdict::Unknown => 2 << 30,
    };
    let posterior = recognizer.posterior(recognizer.best()).q56();
    if verdict != 0 {
        recognizer.reset();
    }
    let margins = margins.into_iter().flat_map(i32::to_le_bytes);
    margins.chain(posterior.to_le_bytes()).chain(verdict.to_le_bytes()).collect()
}
