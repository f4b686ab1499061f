use super::*;
use crate::compile::{Settings as Compilation, compile};
use crate::ensemble::train::{self, train, train_with_background};
use crate::error::Problem;
use crate::evaluate::{self, Margins, SequentialSettings};
use crate::touches::synthetic;
use palpate_onboard::{Recognizer, Stopping, Verdict};
use std::sync::LazyLock;

/// Object k bends up to 80 ms · (k + 1). Three are known; objects 5 and 9 are not.
const KNOWN: usize = 3;

fn of(objects: std::ops::Range<usize>, count: usize, seed: u64) -> Dataset {
    let mut all = synthetic::dataset(&vec![count; objects.end], seed);
    all.objects.drain(..objects.start);
    all
}

fn training() -> train::Settings {
    train::Settings { rounds: 20, depth: 4, ..train::Settings::compact() }
}

/// A model of three objects, without and with a background.
static MODELS: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
    let touches = of(0..KNOWN, 4_000, 1);
    let background = of(4..9, 2_000, 1);
    let with = train_with_background(&touches, &background, &training(), &()).unwrap();
    [train(&touches, &training(), &()).unwrap(), with]
        .map(|ensemble| compile(&ensemble, &Compilation::default()).unwrap().bytes)
});

fn shapes() -> Vec<Shapes> {
    let others = of(4..9, 400, 7);
    others.objects.into_iter().map(|object| Shapes { touches: object.touches, count: 1 }).collect()
}

fn calibrated(bytes: &[u8], held: Held) -> Calibrated {
    let model = compile::open(bytes).unwrap();
    let fresh = of(0..KNOWN, 30_000, 2);
    calibrate(&model, &fresh, &shapes(), &Settings { held, ..Settings::default() }).unwrap()
}

#[test]
fn strangers_are_found_out_and_known_objects_are_not_taken_for_them() {
    for bytes in &*MODELS {
        for held in [Held::Likely, Held::Certain] {
            let calibrated = calibrated(bytes, held);
            let model = compile::open(&calibrated.bytes).unwrap();
            let (known, unknown) = (of(0..KNOWN, 5_000, 3), of(9..10, 5_000, 3));
            let margins = Margins::new(Candidate::Compiled(&model), &known).unwrap();
            let strangers = Margins::of_strangers(Candidate::Compiled(&model), &unknown).unwrap();
            let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 1_000, seed: 1 };
            let of_known = margins.sequential(&settings).unwrap();
            let found = evaluate::strangers((&margins, &of_known), &strangers, &settings).unwrap();
            // 2 % promised; the standard error of 3,000 sequences is a quarter of a percent.
            assert!(found.false_alarms < 0.028, "{found:?}");
            assert!((found.false_alarms - of_known.unknown).abs() < 1e-12);
            assert!(found.detected[&120] + found.wrong_name + found.undecided <= 1.0 + 1e-9);
            assert!(found.detected[&30] <= found.detected[&60] && found.detected[&60] <= found.detected[&120]);
            if held == Held::Certain {
                assert!(found.detected[&120] > 0.9 && found.wrong_name < 0.05, "{found:?}");
            }
            assert!(of_known.error < 0.02, "{of_known:?}");
        }
    }
}

#[test]
fn the_chip_computes_the_misfit_that_was_learned() {
    for bytes in &*MODELS {
        let model = compile::open(bytes).unwrap();
        let (objects, unit) = (model.object_count(), f64::from(model.unit()));
        let supplies = supplies(&model, &of(0..KNOWN, 4_000, 2), 1).unwrap();
        let learn: Vec<&[i32]> = supplies.iter().map(|supply| &supply.rows[..]).collect();
        let moments = Moments::new(&learn, &of_shapes(&model, &shapes()), model.known_count(), objects, unit);
        let fits = fit::fits(&moments, None).unwrap();
        let settings = Settings::default();
        let tested = stated(&model, &terms(&settings, &fits, 0.0, FIRST), &fits).unwrap();
        let tested = compile::open(&tested).unwrap();
        for rows in &learn {
            let mut sums = vec![0_i64; objects];
            for (touches, row) in (1_u32..=200).zip(rows.chunks_exact(objects)) {
                sums.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += i64::from(margin));
                let nats: Vec<f64> = sums.iter().map(|&sum| sum as f64 * unit).collect();
                let leader = (0..model.known_count()).fold(0, |a, b| if sums[b] > sums[a] { b } else { a });
                let exact = fits[leader].misfit(&nats, leader, touches);
                let chip = tested.misfit(&sums, touches).unwrap() as f64 / NAT;
                assert!((chip - exact).abs() < 0.05 + 0.02 * exact.abs(), "{touches}: {chip} for {exact}");
            }
        }
    }
}

#[test]
fn a_background_is_a_rival_and_is_never_named() {
    let model = compile::open(&MODELS[1]).unwrap();
    assert_eq!((model.object_count(), model.known_count(), model.background()), (4, 3, Some(3)));
    assert_eq!(model.object_name(3), "background");
    let mut led = 0;
    for object in &of(4..9, 2_000, 5).objects {
        for touches in object.touches.chunks_exact(200) {
            let mut recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model)).unwrap();
            touches.iter().for_each(|touch| _ = recognizer.push(touch));
            assert!(recognizer.best() < 3);
            led += u32::from(recognizer.evidence()[3] > recognizer.evidence()[recognizer.best()]);
            assert_ne!(recognizer.verdict(), Verdict::Unknown, "there is no test");
            if let Verdict::Recognized { object, .. } = recognizer.verdict() {
                assert!(object < 3);
            }
        }
    }
    assert!(led > 30, "the background leads on its own touches: {led} of 50");
}

#[test]
fn full_and_compiled_model_agree_on_a_background() {
    let touches = of(0..KNOWN, 4_000, 1);
    let ensemble = train_with_background(&touches, &of(4..9, 2_000, 1), &training(), &()).unwrap();
    assert_eq!((ensemble.objects.len(), ensemble.known_count()), (4, 3));
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ensemble.json");
    ensemble.save(&path).unwrap();
    let loaded = crate::ensemble::Ensemble::load(&path).unwrap();
    assert_eq!(loaded, ensemble);
    let model = compile::open(&MODELS[1]).unwrap();
    let parity = evaluate::parity::parity(&loaded, &model, &of(0..KNOWN, 2_000, 3), 500, 1, &()).unwrap();
    assert_eq!(parity.verdict_differs, 0);
}

#[test]
fn what_was_learned_does_not_depend_on_threads() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let make = || calibrated(&MODELS[1], Held::Likely);
    assert_eq!(one.install(make), three.install(make));
}

#[test]
fn a_test_is_replaced_and_taken_out_again() {
    let bytes = &MODELS[1];
    let once = calibrated(bytes, Held::Likely).bytes;
    assert_eq!(calibrated(&once, Held::Likely).bytes, once);
    assert_eq!(&without(&compile::open(&once).unwrap()).unwrap(), bytes);
    let plain = calibrated(&MODELS[0], Held::Certain).bytes;
    assert_eq!(&without(&compile::open(&plain).unwrap()).unwrap(), &MODELS[0]);
}

#[test]
fn without_other_shapes_a_test_is_made_too() {
    let model = compile::open(&MODELS[0]).unwrap();
    let settings = Settings { held: Held::Certain, ..Settings::default() };
    let calibrated = calibrate(&model, &of(0..KNOWN, 30_000, 2), &[], &settings).unwrap();
    assert!(calibrated.terms.least >= FIRST && calibrated.terms.sequences > 300);
    assert!(calibrated.alarms as f64 <= 0.02 * f64::from(calibrated.terms.sequences));
}

#[test]
fn what_cannot_be_calibrated_says_so() {
    let model = compile::open(&MODELS[0]).unwrap();
    let message =
        |dataset: &Dataset, settings: &Settings| calibrate(&model, dataset, &[], settings).unwrap_err().to_string();
    let usual = Settings::default();
    assert!(message(&of(0..2, 1_000, 2), &usual).contains("no touches of object2"));
    assert!(message(&of(0..4, 1_000, 2), &usual).contains("object3"));
    assert!(message(&of(0..KNOWN, 200, 2), &usual).contains("sequences of an object"));
    assert!(message(&of(0..KNOWN, 1_000, 2), &Settings { alarms: 0.0, ..usual }).contains("alarms is 0"));
    let strangers = Margins::of_strangers(Candidate::Compiled(&model), &of(0..KNOWN, 100, 1));
    assert!(matches!(
        strangers.err().unwrap().problem(),
        Some(Problem::Evaluate(EvaluateProblem::KnownObject { object })) if object == "object0"
    ));
}
