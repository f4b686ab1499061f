//! Touches from a host, verdicts back: links only if nothing in it can panic; its size less that of `posterior` is what
//! feature `link` takes.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_onboard::shared::link::{Decision, Device, DeviceEnd, Refusal, VerdictMessage};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;

#[path = "../no_panic.rs"]
mod no_panic;

/// A recognizer of one model.
struct Chip<'m>(Recognizer<'m, 10>);

impl Device for Chip<'_> {
    fn touch(&mut self, touch: &Touch, _: bool) -> Result<VerdictMessage, Refusal> {
        let decision = match self.0.push(touch) {
            Ok(Verdict::Undecided) => Decision::Undecided,
            Ok(Verdict::Recognized { object, .. }) => Decision::Recognized(object),
            Ok(Verdict::Unknown) => Decision::Unknown,
            Ok(Verdict::GaveUp) => Decision::GaveUp,
            Err(_) => return Err(Refusal::Pattern),
        };
        Ok(VerdictMessage { decision, best: 0, touches: self.0.touches(), detail: None })
    }

    fn reset(&mut self) -> Result<(), Refusal> {
        self.0.reset();
        Ok(())
    }

    fn name(&self, object: u8) -> Option<&str> {
        Some(self.0.model().object_name(object.into()))
    }

    fn posterior(&self, object: u8) -> Option<u64> {
        Some(self.0.posterior(object.into()).q56())
    }
}

#[entry]
fn main() -> ! {
    let bytes: &'static [u8] = black_box(&[]);
    if let Ok(model) = &Model::new(bytes)
        && let Ok(recognizer) = Recognizer::<10>::new(model, Stopping::from_model(model))
    {
        let mut chip = Chip(recognizer);
        let mut end = DeviceEnd::new(0);
        loop {
            end.receive(black_box(&[0; 32]), &mut chip, |frame| {
                black_box(frame);
            });
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
