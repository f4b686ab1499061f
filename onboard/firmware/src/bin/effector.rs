//! Verdicts of touches that three switches make: links only if nothing in it can panic; its size less that of `verdict` is what
//! feature `effector` takes.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;
use cortex_m_rt::entry;
use embedded_hal::digital::{ErrorType, InputPin};
use palpate_onboard::effector::{Active, Clock, Effector, EffectorSettings, Fingers, Scale, Watcher, drain};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};

#[path = "../no_panic.rs"]
mod no_panic;

/// A pin, and a clock, that the compiler knows nothing about.
struct Anything;

impl ErrorType for Anything {
    type Error = Infallible;
}

impl InputPin for Anything {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(black_box(true))
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(black_box(true))
    }
}

impl Clock for Anything {
    fn micros(&self) -> u32 {
        black_box(0)
    }
}

#[entry]
fn main() -> ! {
    let bytes: &'static [u8] = black_box(&[]);
    if let Ok(model) = &Model::new(bytes) {
        let mut effector = Effector::new(EffectorSettings::default().for_model(model, &Scale::IDENTITY));
        let fingers = Fingers::new(Anything, Anything, Anything, Active::Low);
        let mut watcher = Watcher::<_, _, _, 64>::start(fingers, &Anything);
        if let Ok(recognizer) = &mut Recognizer::<10>::new(model, Stopping::from_model(model)) {
            loop {
                watcher.interrupt(&Anything);
                let Ok(Some(touch)) = drain(&mut effector, || watcher.sense(&Anything)) else { continue };
                if black_box(recognizer.push(&touch)) != Ok(Verdict::Undecided) {
                    recognizer.reset();
                }
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
