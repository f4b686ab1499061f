//! The result of a touch that every machine must reproduce, as bytes: the same lines for the `identity` image and for
//! the host's tests.

use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
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
        Ok(Verdict::Recognized { object, touches, .. }) => 1 << 30 | u32::from(object) << 16 | touches,
        Ok(Verdict::Unknown) => 2 << 30,
        Ok(Verdict::GaveUp) => 2 << 30 | 1,
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

/// A number that depends on every bit of the model's answers to a thousand touches, full and partial.
pub fn digest(model: &Model<'_>) -> u32 {
    let Ok(mut recognizer) = Recognizer::<10>::new(model, Stopping::from_model(model)) else { return 0 };
    let (mut random, mut digest) = (1_u32, 0_u32);
    for _ in 0..1_000 {
        let times = [(); 3].map(|()| {
            // Xorshift.
            random ^= random << 13;
            random ^= random >> 17;
            random ^= random << 5;
            if random.is_multiple_of(7) { u32::MAX } else { random % 300_000 }
        });
        for byte in record(model, &mut recognizer, &Touch::from_micros(times)) {
            digest = digest.rotate_left(5) ^ u32::from(byte);
            digest = digest.wrapping_mul(0x0100_0193);
        }
    }
    digest
}
