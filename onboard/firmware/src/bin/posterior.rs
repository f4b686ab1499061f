//! The recognizer alone, with the posteriors of its verdicts: links only if nothing in it can panic; its size is what recognition takes.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;

#[path = "../no_panic.rs"]
mod no_panic;

#[entry]
fn main() -> ! {
    // A model and touches that the compiler knows nothing about.
    let bytes: &'static [u8] = black_box(&[]);
    // By reference: moved out of their results they would be copied.
    if let Ok(model) = &Model::new(bytes) {
        let stopping = Stopping::from_model(model);
        if let Ok(recognizer) = &mut Recognizer::<10>::new(model, stopping) {
            loop {
                let touch = Touch::from_micros(black_box([0, 1, 2]));
                let verdict = black_box(recognizer.push(&touch));
                if verdict != Ok(Verdict::Undecided) {
                    black_box(verdict.ok().and_then(|verdict| verdict.posterior()));
                    recognizer.reset();
                }
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
