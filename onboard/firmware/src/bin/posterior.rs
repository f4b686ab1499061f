//! The recognizer alone, with the posteriors of its verdicts: links only if nothing in it can panic; its size is what recognition takes.
#![no_std]
#![no_main]

#[path = "../alone.rs"]
mod alone;
#[path = "../no_panic.rs"]
mod no_panic;

#[cortex_m_rt::entry]
fn main() -> ! {
    alone::recognize(|verdict| {
        core::hint::black_box(verdict.and_then(|verdict| verdict.posterior()));
    })
}
