//! What the evaluator costs on this chip, layout by layout: instructions and stack a touch, margins alone and with
//! evidence and stopping.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_firmware::{exit, meter, meter::Meter, println};
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::Touch;

/// Touches that are averaged over.
const TOUCHES: usize = 50;

macro_rules! models {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_bytes!(concat!(env!("OUT_DIR"), "/bench/", $name, ".palpate")))),*] as [(&str, &'static [u8]); _]
    };
}

/// Never stops, so that every touch costs the same.
const NEVER: Option<Stopping> = Stopping::new(1e-15, u32::MAX);

#[entry]
fn main() -> ! {
    let (Some(peripherals), Some(stopping)) = (cortex_m::Peripherals::take(), NEVER) else { palpate_firmware::fail() };
    let mut meter = Meter::new(peripherals.SYST);
    let models = models![
        "one-i16",
        "one-compact",
        "each100-i16",
        "each100-i8",
        "each40-i16",
        "each40-i8",
        "each40-compact",
        "grid-i8",
        "grid-i16",
    ];
    let bytes = include_bytes!(concat!(env!("OUT_DIR"), "/bench/touches.bin"));
    let mut touches = [Touch::from_micros([0; 3]); TOUCHES];
    for (touch, bytes) in touches.iter_mut().zip(bytes.as_chunks::<12>().0) {
        let (times, _) = bytes.as_chunks::<4>();
        *touch = Touch::from_micros([0, 1, 2].map(|finger| u32::from_le_bytes(times[finger])));
    }
    println!("model              bytes  margins   verdict  posterior  stack");
    for (name, bytes) in models {
        let Ok(model) = Model::new(bytes) else {
            println!("{} skipped: PALPATE_BENCH names no directory with models", name);
            continue;
        };
        let Ok(mut recognizer) = Recognizer::<10>::new(&model, stopping) else { palpate_firmware::fail() };
        let mut margins = [0; 10];
        let margins_cost = meter.mean(&touches, |touch| model.margins(touch, &mut margins));
        let verdict_cost = meter.mean(&touches, |touch| recognizer.push(touch));
        let posterior_cost = meter.measure(|| recognizer.posterior(black_box(3)));
        let stack = meter::stack(|| recognizer.push(&touches[0]));
        println!(
            "{:16} {:7} {:8} {:9} {:10} {:6}",
            name,
            bytes.len(),
            margins_cost,
            verdict_cost,
            posterior_cost,
            stack
        );
    }
    println!("state: {} bytes of recogniser, {} of model", size_of::<Recognizer<10>>(), size_of::<Model>());
    exit()
}
