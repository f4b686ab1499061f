//! What every machine must make of a touch, as bytes: the same lines for the `identity` image and for the host's tests.

use palpate_onboard::{Model, Recognizer, Verdict};
use palpate_shared::Touch;

/// Bytes of [`record`].
pub const LENGTH: usize = 52;

/// Ten margins, the best object's posterior in Q56, and the verdict with its object and touches, or that the
/// touch was refused. After a verdict the recognizer starts again.
pub fn record(model: &Model<'_>, recognizer: &mut Recognizer<'_, 10>, touch: &Touch) -> [u8; LENGTH] {
    let mut margins = [0; 10];
    model.margins(touch, &mut margins);
    let verdict = match recognizer.push(touch) {
        Ok(Verdict::Undecided) => 0,
        Ok(Verdict::Recognized { object, touches }) => 1 << 30 | u32::from(object) << 16 | touches,
        Ok(Verdict::Unknown) => 2 << 30,
        Err(_) => 3 << 30,
    };
    let posterior = recognizer.posterior(recognizer.best()).q56();
    if recognizer.verdict() != Verdict::Undecided {
        recognizer.reset();
    }
    let mut bytes = [0; LENGTH];
    let margins = margins.into_iter().flat_map(i32::to_le_bytes);
    let fields = margins.chain(posterior.to_le_bytes()).chain(verdict.to_le_bytes());
    bytes.iter_mut().zip(fields).for_each(|(to, from)| *to = from);
    bytes
}
