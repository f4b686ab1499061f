//! Ten thousand touches give the same margins, posteriors and verdicts here as on the machine that wrote
//! `identity.bin` (`cargo run -p palpate-tests --bin bench_models`): bit by bit.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::{exit, fail, println};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
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
    for (times, expected) in TOUCHES.as_chunks::<12>().0.iter().zip(EXPECTED.as_chunks::<52>().0) {
        let (times, _) = times.as_chunks();
        let touch = Touch::from_micros([0, 1, 2].map(|finger| u32::from_le_bytes(times[finger])));
        let (margins, posterior, verdict) = outcome(&model, &mut recognizer, &touch);
        let (expected_margins, rest) = expected.split_at(40);
        let (expected_posterior, expected_verdict) = rest.split_at(8);
        let same = margins.iter().zip(expected_margins.as_chunks().0).all(|(a, b)| *a == i32::from_le_bytes(*b))
            && posterior.to_le_bytes() == expected_posterior
            && verdict.to_le_bytes() == expected_verdict;
        touches += 1;
        verdicts += u32::from(verdict != 0);
        different += u32::from(!same);
    }
    println!("{} touches, {} verdicts: {} differ from the host's", touches, verdicts, different);
    if different == 0 && touches == 10_000 { exit() } else { fail() }
}

/// As `palpate_tests::identity::record`.
fn outcome(model: &Model<'_>, recognizer: &mut Recognizer<'_, 10>, touch: &Touch) -> ([i32; 10], u64, u32) {
    let mut margins = [0; 10];
    model.margins(touch, &mut margins);
    let verdict = match recognizer.push(touch) {
        Verdict::Undecided => 0,
        Verdict::Recognized { object, touches } => 1 << 30 | u32::from(object) << 16 | touches,
        Verdict::Unknown => 2 << 30,
    };
    let posterior = recognizer.posterior(recognizer.best()).q56();
    if verdict != 0 {
        recognizer.reset();
    }
    (margins, posterior, verdict)
}
