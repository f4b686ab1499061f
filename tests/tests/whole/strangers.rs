//! Misfit tests in models, and backgrounds.

use palpate::compile::Settings;
use palpate_onboard::{Familiarity, Model, Recognizer, Rivals, Stopping, Verdict};
use palpate_shared::format::{MisfitTerms, ObjectMisfit, Strangers, Tag};
use palpate_tests::random::{self, Shape};

const OBJECTS: usize = 4;

fn model() -> Vec<u8> {
    random::model(Shape { objects: OBJECTS, ..Shape::SMALL }, 5, Settings::default().leaf)
}

const TERMS: MisfitTerms = MisfitTerms {
    rivals: 3,
    first: 1,
    threshold: 0,
    early: 0,
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
                let terms = MisfitTerms { threshold: i32::MAX, early: i32::MAX as u32, ..TERMS };
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
fn a_name_and_a_stranger_wait_for_enough_touches() {
    let bytes = model();
    // Nothing fits better or worse than anything else: the misfit is always 0.
    let neutral = |threshold: i32| {
        let terms = MisfitTerms { first: 4, threshold, ..TERMS };
        with(&bytes, section(terms, false, 0, 0, 0)).unwrap()
    };
    let verdicts = |bytes: &[u8]| {
        let model = Model::new(bytes).unwrap();
        let mut recognizer = Recognizer::<4>::new(&model, Stopping::from_model(&model).with_max_touches(6)).unwrap();
        (0..6).map(|_| recognizer.push_margins(&[1 << 28, 0, 0, 0])).collect::<Vec<_>>()
    };
    use Verdict::{Recognized, Undecided, Unknown};
    let named = Recognized { object: 0, touches: 4, rivals: Rivals::from_q56(0) };
    assert_eq!(verdicts(&neutral(0)), [Undecided, Undecided, Undecided, named, named, named]);
    assert_eq!(verdicts(&neutral(-1)), [Undecided, Undecided, Undecided, Unknown, Unknown, Unknown]);
    let model = neutral(-1);
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
