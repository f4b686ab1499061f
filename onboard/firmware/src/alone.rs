//! The recognizer of a model and of touches that the compiler knows nothing about.

use core::hint::black_box;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;

/// Pushes touches forever; `last` sees the verdict that ends an object, or nothing where a touch was refused.
#[inline(always)]
pub(crate) fn recognize(last: impl Fn(Option<Verdict>)) -> ! {
    let bytes: &'static [u8] = black_box(&[]);
    // By reference: moved out of their results they would be copied.
    if let Ok(model) = &Model::new(bytes) {
        let stopping = Stopping::from_model(model);
        if let Ok(recognizer) = &mut Recognizer::<10>::new(model, stopping) {
            loop {
                let touch = Touch::from_micros(black_box([0, 1, 2]));
                let verdict = black_box(recognizer.push(&touch));
                if verdict != Ok(Verdict::Undecided) {
                    last(verdict.ok());
                    recognizer.reset();
                }
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
