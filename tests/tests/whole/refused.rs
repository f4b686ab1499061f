//! Touches that a model was not trained for are not counted, and change nothing.

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Inputs};
use palpate::with;
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::format::{Counted, Trained, TrainedTouches};
use palpate_shared::{ContactPattern, ContactTime, Descriptor, Patterns, Pose, Touch};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::trained;

fn model(descriptor: Descriptor) -> Vec<u8> {
    random::model(Shape { descriptor, thresholds: 20, leaf: 0.5, ..Shape::SMALL }, 1, Leaf::I16)
}

/// Result of a recognizer for a touch; checks that it changed nothing if it refused it.
fn push(bytes: &[u8], touch: &Touch) -> Result<Verdict, Refused> {
    let model = Model::new(bytes).unwrap();
    let mut recognizer = Recognizer::<3>::new(&model, Stopping::from_model(&model)).unwrap();
    let before = (recognizer.evidence().to_vec(), recognizer.touches());
    let verdict = recognizer.push(touch);
    assert_eq!(verdict.is_err(), recognizer.touches() == 0);
    assert_eq!(verdict.is_err(), model.accepts(touch).is_err());
    if verdict.is_err() {
        assert_eq!((recognizer.evidence().to_vec(), recognizer.touches()), before);
        assert_eq!(recognizer.verdict(), Verdict::Undecided);
    }
    verdict
}

/// One touch of each pattern, in the order of their codes.
fn patterns() -> [Touch; 6] {
    let (touched, missing) = (ContactTime::from_micros(7), ContactTime::MISSING);
    [
        [missing; 3],
        [missing, missing, touched],
        [missing, touched, missing],
        [touched, touched, missing],
        [touched, missing, touched],
        [touched; 3],
    ]
    .map(Touch::new)
}

#[test]
fn a_model_that_states_no_patterns_counts_full_touches_only() {
    let bytes = model(Descriptor::Curvature);
    for (pattern, touch) in ContactPattern::ALL.into_iter().zip(patterns()) {
        let expected =
            if pattern == ContactPattern::All { Ok(Verdict::Undecided) } else { Err(Refused::Pattern(pattern)) };
        assert_eq!(push(&bytes, &touch), expected);
    }
    // However far apart the contacts are: version 1 does not say.
    assert_eq!(push(&bytes, &Touch::from_micros([0, u32::MAX - 1, 0])), Ok(Verdict::Undecided));
}

#[test]
fn exactly_the_stated_patterns_are_counted() {
    for bits in 1..64 {
        let patterns_trained = Patterns::from_bits(bits).unwrap();
        let touches = TrainedTouches {
            patterns: patterns_trained,
            counted: Counted::All,
            needs_pose: false,
            largest_spread: 1_000_000,
        };
        let bytes =
            trained(&model(Descriptor::ContactsCurvature), &Trained { touches: Some(touches), ..Trained::default() });
        for (pattern, touch) in ContactPattern::ALL.into_iter().zip(patterns()) {
            let refused = push(&bytes, &touch).err();
            assert_eq!(refused, (!patterns_trained.contains(pattern)).then_some(Refused::Pattern(pattern)));
        }
    }
}

#[test]
fn contacts_further_apart_than_in_training_are_refused() {
    let touches = TrainedTouches { largest_spread: 1_050_000, ..TrainedTouches::full(false) };
    let bytes = trained(&model(Descriptor::Curvature), &Trained { touches: Some(touches), ..Trained::default() });
    assert_eq!(push(&bytes, &Touch::from_micros([0, 1_050_000, 7])), Ok(Verdict::Undecided));
    assert_eq!(push(&bytes, &Touch::from_micros([0, 1_050_001, 7])), Err(Refused::Spread));
}

#[test]
fn a_model_that_needs_a_pose_refuses_touches_without_one() {
    let pose = Pose { direction: [0, 0, -32_767], alignment: [32_767, 0, 0] };
    let full = Touch::from_micros([0, 5, 9]);
    for descriptor in Descriptor::ALL {
        let bytes = model(descriptor);
        assert_eq!(push(&bytes, &full).is_err(), descriptor.needs_pose());
        assert_eq!(push(&bytes, &full).err(), descriptor.needs_pose().then_some(Refused::NoPose));
        assert_eq!(push(&bytes, &full.with_pose(pose)), Ok(Verdict::Undecided));
    }
}

#[test]
fn a_model_over_rows_refuses_touches_and_one_over_touches_refuses_rows() {
    let settings = with!(Settings::default(), leaf = Leaf::F32, layout = Some(Layout::Wide));
    let shape = Shape {
        descriptor: Descriptor::Curvature,
        objects: 3,
        trees: 5,
        depth: 3,
        each: true,
        thresholds: 20,
        leaf: 0.5,
    };
    let ensemble = Ensemble { inputs: Inputs::unnamed(2), ..random::ensemble(shape, 1) };
    let rows = compile(&ensemble, &settings).unwrap().bytes;
    let touches = model(Descriptor::Curvature);
    assert_eq!(push(&rows, &Touch::from_micros([0, 5, 9])), Err(Refused::NeedsFeatures));
    for (bytes, expected) in [(rows, Ok(Verdict::Undecided)), (touches, Err(Refused::NeedsTouches))] {
        let model = Model::new(&bytes).unwrap();
        let mut recognizer = Recognizer::<3>::new(&model, Stopping::from_model(&model)).unwrap();
        assert_eq!(recognizer.push_features(&[1, 2]), expected);
        assert_eq!(recognizer.touches(), u32::from(expected.is_ok()));
    }
}
