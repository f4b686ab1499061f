//! What recognition costs on this chip: instructions, stack, flash and RAM.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_firmware::{exit, meter, meter::Meter, println, sections::Sections};
use palpate_shared::{Descriptor, Touch};

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { palpate_firmware::fail() };
    let mut meter = Meter::new(peripherals.SYST);

    let touch = Touch::from_micros([30_000, 0, 50_000]);
    for descriptor in [Descriptor::Times, Descriptor::Curvature] {
        let run = || descriptor.features(black_box(&touch));
        println!(
            "{} features: {} instructions, {} bytes of stack",
            descriptor.name(),
            meter.measure(run),
            meter::stack(run)
        );
    }
    let Sections { text, rodata, data, bss } = Sections::of_this_image();
    println!("text {} rodata {} data {} bss {}", text, rodata, data, bss);
    exit()
}
