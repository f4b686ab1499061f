//! Hard cases of evidence and stopping.

use palpate::compile::{Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate::with;
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::{Descriptor, Touch};
use palpate_tests::random;

/// A touch with this curvature.
fn touch(curvature: u32) -> Touch {
    Touch::from_micros([0, 0, curvature])
}

/// An ensemble that steps at the given curvatures: `margins[i]` below `steps[i]`, the last one above all.
fn steps(steps: &[f32], margins: &[&[f32]]) -> Ensemble {
    let mut nodes = Vec::new();
    for (index, &threshold) in steps.iter().enumerate() {
        let left = 2 * index + 1;
        nodes.push(Node::Split { feature: 0, threshold, missing_left: true, left, right: left + 1 });
        nodes.push(Node::Leaf(margins[index].to_vec()));
    }
    nodes.push(Node::Leaf(margins[steps.len()].to_vec()));
    let objects = margins[0].len();
    Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: (0..objects).map(|object| object.to_string()).collect(),
        base_margins: vec![0.0; objects],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    }
}

fn compiled(ensemble: &Ensemble, leaf: Leaf) -> Vec<u8> {
    compile(ensemble, &with!(Settings::default(), leaf)).unwrap().bytes
}

/// The object that was recognized, and after how many touches.
fn recognized(verdict: Result<Verdict, Refused>) -> Option<(u8, u32)> {
    match verdict {
        Ok(Verdict::Recognized { object, touches, .. }) => Some((object, touches)),
        _ => None,
    }
}

fn stopping(error_rate: f64, max_touches: u32) -> Stopping {
    Stopping::new(error_rate, max_touches).unwrap()
}

#[test]
fn a_million_touches_add_up_without_drift() {
    // Objects 0 and 1 always tie, so nothing is ever decided, while their evidence grows.
    let bytes =
        compiled(&steps(&[300.0, 600.0], &[&[0.9, 0.9, -0.3], &[0.31, 0.31, 0.2], &[-0.1, -0.1, -1.0]]), Leaf::I16);
    let model = Model::new(&bytes).unwrap();
    let mut recognizer: Recognizer<3> = Recognizer::new(&model, stopping(0.01, u32::MAX)).unwrap();
    let mut exact = [0_i128; 3];
    let mut margins = [0; 3];
    for index in 0..1_000_000_u32 {
        let touch = touch(index.wrapping_mul(2_654_435_761) % 1000);
        assert_eq!(recognizer.push(&touch), Ok(Verdict::Undecided));
        model.margins(&touch, &mut margins);
        exact.iter_mut().zip(margins).for_each(|(sum, margin)| *sum += i128::from(margin));
    }
    assert_eq!(recognizer.evidence().iter().map(|&e| i128::from(e)).collect::<Vec<_>>(), exact);
    assert!((recognizer.posterior(0).to_f64() - 0.5).abs() < 1e-9);
    assert!(exact[0] > 1 << 32, "the test should leave 32 bits behind: {exact:?}");
}

#[test]
fn a_touch_that_only_one_object_can_explain_decides_at_once() {
    for leaf in [Leaf::I8, Leaf::I16, Leaf::F32] {
        let bytes = compiled(&steps(&[500.0], &[&[0.01, 0.0, 0.0], &[-900.0, 900.0, -900.0]]), leaf);
        let model = Model::new(&bytes).unwrap();
        let mut recognizer: Recognizer<3> = Recognizer::new(&model, stopping(1e-12, 10)).unwrap();
        assert_eq!(recognizer.push(&touch(0)), Ok(Verdict::Undecided));
        assert_eq!(recognized(recognizer.push(&touch(1000))), Some((1, 2)));
        assert_eq!(recognizer.posterior(1).complement(), 0.0);
        assert_eq!(recognizer.posterior(0).to_f64(), 0.0);
    }
}

#[test]
fn the_posterior_passes_one_minus_a_billionth_exactly_when_the_evidence_says_so() {
    let bytes = compiled(&steps(&[], &[&[0.25, 0.0]]), Leaf::I16);
    let model = Model::new(&bytes).unwrap();
    for error_rate in [1e-9, 1e-10, 1e-12, 1e-14] {
        let mut recognizer: Recognizer<2> = Recognizer::new(&model, stopping(error_rate, 1000)).unwrap();
        let needed = ((1.0 / error_rate - 1.0).ln() / 0.25).ceil() as u32;
        for number in 1..needed {
            assert_eq!(recognizer.push(&touch(0)), Ok(Verdict::Undecided), "after {number} of {needed}");
            assert!(recognizer.posterior(0).complement() > error_rate);
        }
        assert_eq!(recognized(recognizer.push(&touch(0))), Some((0, needed)));
        let complement = recognizer.posterior(0).complement();
        assert!(complement <= error_rate && complement > error_rate / 2.0, "{complement:e}");
    }
}

#[test]
fn ties_and_equal_margins_are_given_up_in_the_end() {
    for objects in [2, 3, 10, 256] {
        let bytes = compiled(&steps(&[], &[&vec![0.5; objects]]), Leaf::I16);
        let model = Model::new(&bytes).unwrap();
        let mut recognizer: Recognizer<256> = Recognizer::new(&model, stopping(0.49, 50)).unwrap();
        for _ in 1..50 {
            assert_eq!(recognizer.push(&touch(1)), Ok(Verdict::Undecided));
        }
        assert_eq!(recognizer.push(&touch(1)), Ok(Verdict::GaveUp));
        assert_eq!(recognizer.push(&touch(1)), Ok(Verdict::GaveUp));
        assert_eq!(recognizer.touches(), 50);
        assert!((recognizer.posterior(objects - 1).to_f64() - 1.0 / objects as f64).abs() < 1e-9);
        recognizer.reset();
        assert_eq!((recognizer.touches(), recognizer.verdict()), (0, Verdict::Undecided));
    }
}

#[test]
fn leaves_at_the_limits_of_their_type_are_exact() {
    for (leaf, most) in [(Leaf::I8, 127), (Leaf::I16, 32767)] {
        let bytes = compiled(&steps(&[500.0], &[&[4.7, -4.7], &[-4.7, 4.7]]), leaf);
        let model = Model::new(&bytes).unwrap();
        let mut margins = [0; 2];
        model.margins(&touch(0), &mut margins);
        assert_eq!(margins, [most, -most]);
        model.margins(&touch(1000), &mut margins);
        assert_eq!(margins, [-most, most]);
    }
}

#[test]
fn leaves_beyond_reason_are_refused_with_the_place() {
    for value in [1e30, -1e30, f32::MAX, f32::INFINITY, f32::NAN] {
        for leaf in [Leaf::I8, Leaf::I16, Leaf::F32] {
            let ensemble = steps(&[500.0], &[&[5.0, -5.0], &[value, 5.0]]);
            let error = compile(&ensemble, &with!(Settings::default(), leaf)).unwrap_err();
            let message = error.to_string();
            assert!(message.contains("margin of the object 0") || message.contains("tree 0: leaf 2"), "{message}");
            assert_eq!(error.exit_code(), 1);
        }
    }
}

#[test]
fn thousands_of_touches_pulling_back_and_forth_leave_nothing_behind() {
    let bytes = compiled(&steps(&[500.0], &[&[1.5, -1.5, 0.7], &[-1.5, 1.5, -0.7]]), Leaf::I8);
    let model = Model::new(&bytes).unwrap();
    let mut recognizer: Recognizer<3> = Recognizer::new(&model, stopping(0.01, u32::MAX)).unwrap();
    for _ in 0..5000 {
        assert_eq!(recognizer.push(&touch(0)), Ok(Verdict::Undecided));
        assert_eq!(recognizer.push(&touch(1000)), Ok(Verdict::Undecided));
    }
    assert_eq!(recognizer.evidence(), [0, 0, 0]);
    recognizer.push(&touch(1000)).unwrap();
    recognizer.push(&touch(1000)).unwrap();
    assert_eq!(recognized(recognizer.push(&touch(1000))), Some((1, 10_003)));
}

#[test]
fn a_verdicts_posterior_is_the_recognizers_bit_for_bit() {
    let bytes =
        compiled(&steps(&[300.0, 600.0], &[&[0.9, 0.2, -0.3], &[0.31, 0.5, 0.2], &[-0.1, 0.6, -1.0]]), Leaf::I16);
    let model = Model::new(&bytes).unwrap();
    for error_rate in [0.3, 0.01, 1e-9] {
        let mut recognizer: Recognizer<3> = Recognizer::new(&model, stopping(error_rate, 200)).unwrap();
        let mut recognitions = 0;
        for touch in random::touches(2_000, 9) {
            // Partial touches are refused.
            let Ok(verdict) = recognizer.push(&touch) else { continue };
            if let Verdict::Recognized { object, .. } = verdict {
                recognitions += 1;
                assert_eq!(verdict.posterior(), Some(recognizer.posterior(object.into())));
                assert!(verdict.posterior().unwrap().complement() <= error_rate);
            } else {
                assert_eq!(verdict.posterior(), None);
            }
            if verdict != Verdict::Undecided {
                recognizer.reset();
            }
        }
        assert!(recognitions >= 3, "{recognitions} at {error_rate}");
    }
}

#[test]
fn priors_count_once() {
    let settings = with!(Settings::default(), priors = Some(vec![0.9, 0.1]));
    let bytes = compile(&steps(&[500.0], &[&[0.0, 0.0], &[0.0, 3.0]]), &settings).unwrap().bytes;
    let model = Model::new(&bytes).unwrap();
    let mut recognizer: Recognizer<2> = Recognizer::new(&model, stopping(0.01, 60)).unwrap();
    assert!((recognizer.posterior(0).to_f64() - 0.9).abs() < 1e-3);
    recognizer.push(&touch(0)).unwrap();
    assert!((recognizer.posterior(0).to_f64() - 0.9).abs() < 1e-3);
}

#[test]
fn level_objects_are_decided_at_once_at_odds_of_one_for_each_other_object_and_not_below() {
    let one = 1_u64 << 56;
    for objects in [2_u8, 3, 10, 255] {
        let bytes = compiled(&steps(&[], &[&vec![0.5; objects.into()]]), Leaf::I16);
        let model = Model::new(&bytes).unwrap();
        let decided = |odds| {
            let mut recognizer: Recognizer<256> = Recognizer::new(&model, Stopping::from_odds(odds, 50)).unwrap();
            recognized(recognizer.push(&touch(1)))
        };
        let others = u64::from(objects) - 1;
        assert_eq!(decided(others * one), Some((0, 1)));
        assert_eq!(decided(others * one - 1), None);
        assert_eq!(decided(u64::MAX), Some((0, 1)));
    }
}
