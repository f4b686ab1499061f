//! Ten thousand touches give the same margins, posteriors and verdicts here as on the machine that wrote
//! `identity.bin` (`cargo run -p palpate-tests --bin bench_models`): bit by bit.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::{exit, fail, identity, println};
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::Touch;

const MODEL: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bench/identity.palpate"));
const TOUCHES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bench/touches.bin"));
const EXPECTED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bench/identity.bin"));

#[entry]
fn main() -> ! {
    if MODEL.is_empty() {
        println!("identity SKIPPED: PALPATE_BENCH names no directory that bench_models wrote");
        exit();
    }
    let Ok(model) = Model::new(MODEL) else { fail() };
    let Ok(mut recognizer) = Recognizer::<10>::new(&model, Stopping::from_model(&model)) else { fail() };
    let (mut touches, mut verdicts, mut different) = (0, 0, 0);
    for (times, expected) in TOUCHES.as_chunks::<12>().0.iter().zip(EXPECTED.as_chunks::<{ identity::LENGTH }>().0) {
        let (times, _) = times.as_chunks();
        let touch = Touch::from_micros([0, 1, 2].map(|finger| u32::from_le_bytes(times[finger])));
        let record = identity::record(&model, &mut recognizer, &touch);
        touches += 1;
        verdicts += u32::from(!record.ends_with(&[0; 4]));
        different += u32::from(record != *expected);
    }
    println!("{} touches, {} verdicts: {} differ from the host's", touches, verdicts, different);
    if different == 0 && touches == 10_000 { exit() } else { fail() }
}
