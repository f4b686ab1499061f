use crate::fixtures::*;
use crate::synthetic::{self, MODEL};
use palpate::calibrate::{Calibrated, Settings, calibrate, calibrate_recorded};

const OBJECTS: usize = 3;

fn simulated(count: usize, seed: u64) -> Dataset {
    synthetic::dataset(&[count; OBJECTS], seed)
}

static SIMULATED: LazyLock<Dataset> = LazyLock::new(|| simulated(30_000, 2));

/// Recordings of a robot, which are not what the simulation says. Its hand is faster, and its contacts are noisy.
fn recorded(count: usize, seed: u64) -> Dataset {
    let mut dataset = simulated(count, seed);
    dataset.add_noise(&with!(Noise::gaussian(8_000.0), speed = 1.12), seed, 1);
    dataset
}

fn settings(rate: f64) -> Settings {
    with!(Settings::default(), rate, sequences = 6_000, max_touches = Some(200))
}

/// The refusal of recordings that are too few for a promise.
fn too_few(result: palpate::Result<Calibrated>) -> String {
    let error = result.unwrap_err();
    assert!(error.is(&Kind::TooFew), "{error}");
    error.to_string()
}

/// The text between two others.
fn between<'t>(text: &'t str, before: &str, after: &str) -> &'t str {
    text.split_once(before)
        .and_then(|(_, rest)| rest.split_once(after))
        .unwrap_or_else(|| panic!("{before}…{after}: {text}"))
        .0
}

/// The share of wrong names among those that a model gives to touches of a robot.
fn error(bytes: &[u8], touches: &Dataset) -> f64 {
    let model = Model::new(bytes).unwrap();
    let margins = Margins::new(&model, touches).unwrap();
    let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 3_000, seed: 1 };
    margins.sequential(&settings).unwrap().error
}

/// `PALPATE_REPETITIONS=200 cargo test --release -p palpate --test palpate found_on_simulated -- --nocapture` repeats it as often.
#[test]
fn thresholds_found_on_simulated_touches_and_tested_on_recorded_ones_keep_the_promise_for_recorded_ones() {
    let repetitions = repetitions(20);
    let unseen = recorded(10_000, 1_000);
    let rate = 0.05;
    // The second has so few that a sequence is a large share of them.
    for (rate, approaches) in [(rate, 1_200), (0.2, 150)] {
        let (mut broken, mut made, mut used) = (0, 0, 0.0);
        for run in 0..repetitions {
            let of_robot = recorded(approaches, 2_000 + run);
            let result = calibrate_recorded(&MODEL.model(), SIMULATED.clone(), &of_robot, &settings(rate), &());
            let Ok(calibrated) = result else { continue };
            let error = error(&calibrated.model, &unseen);
            made += 1;
            used += error / rate;
            // Within the standard error of 9,000 sequences.
            broken += u64::from(error > rate + (rate * (1.0 - rate) / 9_000.0).sqrt());
        }
        let used = 100.0 * used / f64::from(made as u32);
        println!("{made} of {repetitions} promises made and {broken} broken, {used:.0} % of the rate used");
        assert!(2 * made > repetitions, "{made} of {repetitions} promises made");
        assert_rare("promise on recordings", broken, repetitions, 0.05);
    }
    // What the simulation alone promises does not hold for them.
    let alone = calibrate(&MODEL.model(), SIMULATED.clone(), &settings(rate), &()).unwrap();
    let alone = error(&alone.model, &unseen);
    assert!(alone > 1.3 * rate, "{alone}");
}

#[test]
fn a_promise_takes_fewer_recordings_than_a_calibration_from_nothing() {
    let settings_of_rate = settings(0.03);
    let alone = |count: usize| calibrate(&MODEL.model(), simulated(count, 3), &settings_of_rate, &());
    let with = |count: usize| {
        calibrate_recorded(&MODEL.model(), SIMULATED.clone(), &simulated(count, 3), &settings_of_rate, &())
    };
    let few = (2..14).map(|hundreds| 100 * hundreds).find(|&count| with(count).is_ok()).unwrap();
    let error = alone(few).unwrap_err().to_string();
    assert!(error.contains("too few to promise 3 %") && error.contains("which support"), "{few}: {error}");
    let (calibrated, recorded) = (with(few).unwrap(), simulated(700, 3));
    let facts = calibrated.recorded.unwrap();
    assert_eq!((facts.approaches, facts.recordings), (few, None));
    assert_eq!((calibrated.promise.rate, calibrated.promise.noise), (0.03, Noise::default().promised()));
    assert!(calibrated.promise.given >= 99, "{:?}", calibrated.promise);
    for per in [Per::Object, Per::Name] {
        let each = with!(settings(0.1), per);
        let calibrated = calibrate_recorded(&MODEL.model(), SIMULATED.clone(), &recorded, &each, &()).unwrap();
        assert_eq!(calibrated.errors.len(), OBJECTS, "{calibrated:?}");
        assert!(calibrated.objects.values().all(|of| of.given >= 29), "{calibrated:?}");
    }
}

#[test]
fn recordings_that_are_too_few_say_which_rate_they_support_and_that_rate_can_be_promised() {
    let of = |count: usize, rate: f64| {
        calibrate_recorded(&MODEL.model(), SIMULATED.clone(), &recorded_as_simulated(count), &settings(rate), &())
    };
    let text = too_few(of(300, 0.01));
    assert!(
        text.contains("names given on the recordings are too few to promise 1 %: at least 299 are needed"),
        "{text}"
    );
    let supported = between(&text, "300 recorded approaches to each object support about ", " %");
    let supported = supported.parse::<f64>().unwrap() / 100.0;
    // "2400 in all, from 700 to object2 to 900 to object0"
    let enough = between(&text, "1 % takes about ", ", if the simulation is right");
    let (all, each) = enough.split_once(" in all, from ").unwrap();
    let words: Vec<&str> = each.split(" to ").collect();
    let &[least, easy, most, hard] = &words[..] else { panic!("{text}") };
    let [all, least, most] = [all, least, most].map(|number| number.parse::<usize>().unwrap());
    assert!((0.015..0.4).contains(&supported) && (400..6_000).contains(&most), "{text}");
    assert!(least < most && all < OBJECTS * most, "{text}");
    of(300, supported).unwrap();
    // As many of each object as it takes.
    let as_much = |object: &ObjectTouches| match &object.name {
        name if name == easy => least,
        name if name == hard => most,
        _ => all - least - most,
    };
    let recorded = recorded_as_simulated(most).each(|object| object.part(0..as_much(object), object.len()));
    calibrate_recorded(&MODEL.model(), SIMULATED.clone(), &recorded, &settings(0.01), &()).unwrap();
}

/// Recordings that agree with the simulation.
fn recorded_as_simulated(count: usize) -> Dataset {
    simulated(count, 77)
}
