//! Misfit tests in models, and backgrounds.

use palpate::compile::Settings;
use palpate_onboard::{Familiarity, Forgetting, Model, Recognizer, Rivals, SNAPSHOT_LENGTH, Stopping, Verdict};
use palpate_shared::format::{Held, MisfitTerms, ObjectMisfit, Strangers, Tag};
use palpate_tests::random::{self, Shape};

const OBJECTS: usize = 4;

fn model() -> Vec<u8> {
    random::model(Shape { objects: OBJECTS, ..Shape::SMALL }, 5, Settings::default().leaf)
}

const TERMS: MisfitTerms = MisfitTerms {
    held: Held::Likely,
    rivals: 3,
    first: 1,
    least: 3,
    threshold: 0,
    early: 0,
    doubt: 0,
    halving: 0,
    alarms: 20_000,
    sequences: 1_000,
    confidence: 950_000,
};

/// A section in which every number of every record is the same.
fn section(terms: MisfitTerms, background: bool, shift: u8, constant: i32, number: i16) -> Vec<u8> {
    let mut bytes = Strangers::header(background, true).to_vec();
    bytes.extend(terms.to_bytes());
    for object in 0..OBJECTS as u8 - u8::from(background) {
        let rivals: Vec<u8> = (0..OBJECTS as u8).filter(|&rival| rival != object).collect();
        let numbers = (0..12).map(|_| number);
        ObjectMisfit::write([shift; 3], constant, &rivals, numbers, &mut |part| bytes.extend_from_slice(part));
    }
    bytes
}

fn with(model: &[u8], section: Vec<u8>) -> Result<Vec<u8>, palpate::Error> {
    use palpate::compile::{Restated, restate};
    let restated = Restated { sections: vec![(Tag::Strangers, Some((true, section)))], ..Restated::default() };
    restate(&Model::new(model).unwrap(), &restated)
}

#[test]
fn nothing_overflows_at_any_numbers_and_any_evidence() {
    let bytes = model();
    for shift in [0, 1, 20, 40] {
        for constant in [i32::MIN, -1, 0, i32::MAX] {
            for number in [i16::MIN, -1, 0, i16::MAX] {
                let terms = MisfitTerms { threshold: i32::MAX, doubt: i32::MAX, early: i32::MAX as u32, ..TERMS };
                let bytes = with(&bytes, section(terms, shift == 1, shift, constant, number)).unwrap();
                let model = Model::new(&bytes).unwrap();
                for evidence in [[0; 4], [i64::MAX, i64::MIN, 0, -1], [i64::MIN; 4], [i64::MAX, 1 << 40, -(1 << 31), 7]]
                {
                    for touches in [0, 1, 2, 1_000, u32::MAX] {
                        assert!(model.misfit(&evidence, touches).is_some());
                    }
                }
                assert!(model.misfit(&[], 1).is_some());
                let mut recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model)).unwrap();
                for margins in [[i32::MAX, i32::MIN, 0, 1], [i32::MIN; 4], [1, 2, 3, 1 << 30]] {
                    recognizer.push_margins(&margins);
                    recognizer.familiarity();
                    recognizer.posterior(0);
                }
            }
        }
    }
}

#[test]
fn a_name_waits_for_enough_touches_and_a_stranger_for_none_after_the_first_look() {
    let bytes = model();
    // Nothing fits better or worse than anything else: the misfit is always 0.
    let neutral = |threshold: i32, doubt: i32| {
        let terms = MisfitTerms { first: 2, least: 4, threshold, doubt, ..TERMS };
        with(&bytes, section(terms, false, 0, 0, 0)).unwrap()
    };
    let verdicts = |bytes: &[u8]| {
        let model = Model::new(bytes).unwrap();
        let mut recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model).with_max_touches(6)).unwrap();
        (0..6).map(|_| recognizer.push_margins(&[1 << 28, 0, 0, 0])).collect::<Vec<_>>()
    };
    use Verdict::{GaveUp, Recognized, Undecided, Unknown};
    let named = Recognized { object: 0, touches: 4, rivals: Rivals::from_q56(0) };
    assert_eq!(verdicts(&neutral(0, 0)), [Undecided, Undecided, Undecided, named, named, named]);
    assert_eq!(verdicts(&neutral(-1, -1)), [Undecided, Unknown, Unknown, Unknown, Unknown, Unknown]);
    assert_eq!(verdicts(&neutral(0, -1)), [Undecided, Undecided, Undecided, Undecided, Undecided, GaveUp]);
    let model = neutral(-1, -1);
    let model = Model::new(&model).unwrap();
    let recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model)).unwrap();
    assert_eq!(recognizer.familiarity(), Familiarity::Known, "nothing was touched yet");
}

#[test]
fn a_background_with_more_evidence_than_any_object_lets_none_be_named() {
    let bytes = with(&model(), Strangers::header(true, false).to_vec()).unwrap();
    let model = Model::new(&bytes).unwrap();
    assert_eq!((model.known_count(), model.background()), (3, Some(3)));
    let mut recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model)).unwrap();
    for _ in 0..3 {
        assert_eq!(recognizer.push_margins(&[1 << 24, 0, 0, 1 << 28]), Verdict::Undecided);
        assert_eq!((recognizer.best(), recognizer.rivals()), (0, u64::MAX));
    }
    // As a rival it counts as any other.
    recognizer.reset();
    assert!(matches!(recognizer.push_margins(&[1 << 28, 0, 0, 0]), Verdict::Recognized { object: 0, .. }));
}

#[test]
fn verdicts_survive_a_snapshot() {
    let bytes = with(&model(), section(MisfitTerms { threshold: -1, doubt: -1, ..TERMS }, false, 0, 0, 0)).unwrap();
    let model = Model::new(&bytes).unwrap();
    let stopping = Stopping::from_model(&model);
    let mut recognizer = Recognizer::<4>::new(&model, stopping).unwrap();
    recognizer.push_margins(&[0; 4]);
    assert_eq!(recognizer.verdict(), Verdict::Unknown);
    let mut buffer = [0; 80];
    let snapshot = recognizer.snapshot(&mut buffer).unwrap();
    let mut other = Recognizer::<4>::new(&model, stopping).unwrap();
    other.restore(snapshot).unwrap();
    assert_eq!(other.verdict(), Verdict::Unknown);
    let plain = self::model();
    let plain = Model::new(&plain).unwrap();
    let mut recognizer = Recognizer::<4>::new(&plain, Stopping::from_model(&plain).with_max_touches(1)).unwrap();
    recognizer.push_margins(&[0; 4]);
    let snapshot = recognizer.snapshot(&mut buffer).unwrap();
    let mut other = Recognizer::<4>::new(&plain, stopping).unwrap();
    other.restore(snapshot).unwrap();
    assert_eq!(other.verdict(), Verdict::GaveUp);
}

/// Units by which a touch speaks for an object: the largest power of two that is at most a nat.
fn step(model: &Model<'_>) -> i32 {
    1 << ((1.0 / model.unit()) as i32).ilog2()
}

/// A model with a misfit test that only touches fit which speak by a step for an object against each other one.
fn strict() -> Vec<u8> {
    let bytes = model();
    let step = step(&Model::new(&bytes).unwrap());
    let terms = MisfitTerms { first: 2, least: 3, threshold: 2_560, doubt: 2_048, ..TERMS };
    let mut section = Strangers::header(false, true).to_vec();
    section.extend(terms.to_bytes());
    for object in 0..OBJECTS as u8 {
        let rivals: Vec<u8> = (0..OBJECTS as u8).filter(|&rival| rival != object).collect();
        // The means, no slopes, and a diagonal matrix that makes 16 of a step.
        let mean = i16::try_from(-(step >> 4)).unwrap();
        let numbers = [mean, mean, mean, 0, 0, 0, 16, 0, 16, 0, 0, 16];
        let put = &mut |part: &[u8]| section.extend_from_slice(part);
        ObjectMisfit::write([4, step.ilog2() as u8, 0], 0, &rivals, numbers.into_iter(), put);
    }
    with(&bytes, section).unwrap()
}

/// The margins of a touch that speaks by a step for an object.
fn speaks_for(object: usize, model: &Model<'_>) -> [i32; OBJECTS] {
    let mut margins = [0; OBJECTS];
    margins[object] = step(model);
    margins
}

#[test]
fn an_object_that_is_exchanged_is_named_and_not_unknown_for_the_touches_that_were_forgotten() {
    let bytes = strict();
    let model = Model::new(&bytes).unwrap();
    let stopping = Stopping::new(1e-12, 200).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
    // Touches that contradict each other do not fit.
    (0..10).for_each(|index| _ = recognizer.push_margins(&speaks_for(index % 2, &model)));
    assert_eq!(recognizer.familiarity(), Familiarity::Stranger);
    recognizer.reset();
    let mut forgetting = Forgetting::new(&model, 5.0 * step(&model) as f32 * model.unit());
    for object in [0, 3, 1] {
        for number in 0..20 {
            let verdict = recognizer.push_margins_forgetting(&speaks_for(object, &model), &mut forgetting);
            assert_eq!(verdict, Verdict::Undecided, "touch {number} of object {object}");
            // Before the restart touches of both objects are evidence, and after the first touch there is no look.
            if number > 1 && object == 0 || number > 5 {
                assert_eq!(
                    (recognizer.familiarity(), recognizer.best()),
                    (Familiarity::Known, object),
                    "touch {number}"
                );
            }
            // A snapshot holds how many touches are forgotten.
            let mut buffer = [0; SNAPSHOT_LENGTH + 10 * OBJECTS];
            let snapshot = recognizer.snapshot(&mut buffer).unwrap().to_vec();
            let mut restored = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
            restored.restore(&snapshot).unwrap();
            assert_eq!(
                (restored.familiarity(), restored.touches(), restored.evidence()),
                (recognizer.familiarity(), recognizer.touches(), recognizer.evidence())
            );
            assert_eq!(restored.snapshot(&mut buffer).unwrap(), snapshot);
        }
    }
    assert_eq!(forgetting.restarts(), 2);
}

#[test]
fn an_object_of_weight_0_is_none_after_a_restart_and_the_others_keep_their_weights() {
    let bytes = model();
    let model = Model::new(&bytes).unwrap();
    let stopping = Stopping::new(1e-12, 200).unwrap();
    for is_restored in [false, true] {
        let mut recognizer = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
        let mut forgetting = Forgetting::new(&model, 5.0);
        recognizer.reset_to(&[3, 1, 0, 6]).unwrap();
        let expected = recognizer.posterior(1);
        for (object, touches) in [(0, 20), (2, 20), (1, 12)] {
            for _ in 0..touches {
                recognizer.push_margins_forgetting(&speaks_for(object, &model), &mut forgetting);
                assert!(recognizer.best() != 2 && recognizer.posterior(2).q56() == 0);
            }
            // What speaks for an object that is not there is no reason to forget.
            assert_eq!(forgetting.restarts(), u32::from(object == 1));
            if is_restored {
                let mut buffer = [0; SNAPSHOT_LENGTH + 10 * OBJECTS];
                let snapshot = recognizer.snapshot(&mut buffer).unwrap();
                recognizer.restore(snapshot).unwrap();
            }
        }
        // All but the twelve last touches are forgotten, which speak for object 1: the others are as far behind as their weights say.
        let evidence = recognizer.evidence();
        let nats = |object: usize| f64::from((evidence[object] - evidence[0]) as i32) * f64::from(model.unit());
        let own = f64::from(12 * speaks_for(1, &model)[1]) * f64::from(model.unit());
        assert!((nats(3) - 2_f64.ln()).abs() < 1e-3 && (nats(1) - own - (1.0_f64 / 3.0).ln()).abs() < 1e-3);
        assert!((expected.to_f64() - 0.1).abs() < 1e-3);
    }
}

#[test]
fn the_object_before_leaves_nothing_in_the_background_where_weights_begin() {
    let bytes = with(&model(), Strangers::header(true, false).to_vec()).unwrap();
    let model = Model::new(&bytes).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap();
    recognizer.reset_to(&[1, 2, 1]).unwrap();
    let fresh = recognizer.evidence().to_vec();
    for margins in [[0, 0, 0, 1 << 28], [0, 1 << 28, 0, 0]] {
        recognizer.push_margins(&margins);
        recognizer.reset_to(&[1, 2, 1]).unwrap();
        assert_eq!(recognizer.evidence(), fresh);
    }
    assert_eq!(fresh[3], i64::from(model.prior(3)));
}
