//! Bytes that are not a model are refused, and bytes that pass can be walked.

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::with;
use palpate_onboard::{Batch, Model, ModelError, Recognizer, RowsSeen, Stopping};
use palpate_shared::format::{
    Counted, Events, HEADER_LENGTH, Limits, MUST_UNDERSTAND, Position, RAW_FEATURES, Tag, Trained, TrainedNoise,
    TrainedTouches, checksum,
};
use palpate_shared::{Descriptor, Patterns};
use palpate_tests::abuse::{self, places, section};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{trained, with_sections};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

/// Statements that half of the models carry.
const TRAINED: Trained = Trained {
    probe: None,
    touches: Some(TrainedTouches {
        patterns: Patterns::ALL,
        counted: Counted::All,
        needs_pose: false,
        largest_spread: 1_000_000,
    }),
    noise: Some(TrainedNoise { least: 0, largest: 10_000, timer: 1_000, pose: 0 }),
    shares: None,
};

/// A small model in each layout and leaf type, of either version.
fn models() -> Vec<Vec<u8>> {
    let shape = Shape::SMALL;
    let mut models = Vec::new();
    for each in [true, false] {
        for &leaf in Leaf::ALL {
            for &layout in Layout::OF_DATA {
                // Tables by contact pattern have no other descriptor.
                let descriptor =
                    if layout == Layout::Patterns { Descriptor::ContactsCurvature } else { shape.descriptor };
                let ensemble = random::ensemble(Shape { each, descriptor, ..shape }, 5);
                let settings = with!(Settings::default(), leaf, layout = Some(layout));
                models.push(compile(&ensemble, &settings).unwrap().bytes);
                // The same with optional sections.
                models.push(trained(models.last().unwrap(), &TRAINED));
            }
        }
    }
    models
}

/// A model over rows that are numbered and guarded, and whose verdicts go on.
fn sequences() -> Vec<u8> {
    let rows = abuse::changed(&models()[0], 12, &[RAW_FEATURES]);
    let features = usize::from(rows[15]) + 1;
    let guard = Limits { low: -9, high: 1 << 20, may_miss: true, most_equal: 2 }.to_bytes().repeat(features);
    let must = |tag: Tag, content: &[u8]| section(tag.code() | MUST_UNDERSTAND, content);
    let position = Position { feature: 0, step: 1 << 29 }.to_bytes();
    let events = Events {
        background: Some(1),
        hold_off: 2,
        memory: i32::MAX,
        rows_per_hour: f32::NAN,
        per_hour: f32::NAN,
        confidence: f32::NAN,
        grace: u32::MAX,
        longest: 0,
    };
    let events = must(Tag::Events, &events.to_bytes());
    with_sections(&rows, &[must(Tag::Position, &position), must(Tag::Guard, &guard), events].concat())
}

/// Walks a model with touches that reach all over it.
fn walk(model: &Model<'_>) {
    let Ok(mut recognizer) = Recognizer::<256>::new(model, Stopping::from_model(model)) else { return };
    for touch in random::touches(40, 3) {
        let _ = recognizer.push(&touch);
        let mut margins = [0; 256];
        model.margins_of(&[i32::MIN, i32::MAX], &mut margins);
        recognizer.push_margins(&margins);
        recognizer.posterior(0);
    }
    // With room for every feature, and for one.
    let (mut seen, mut one) = (RowsSeen::<256>::new(), RowsSeen::<1>::new());
    for row in [&[][..], &[0], &[0], &[0], &[i32::MIN, i32::MAX], &[7; 256], &[-7; 300]] {
        let _ = recognizer.push_seen(row, &mut seen);
        let _ = recognizer.push_seen(row, &mut one);
        let _ = recognizer.push_features(row);
    }
    for object in 0..model.object_count() {
        model.object_name(object);
    }
}

fn with_checksum(mut bytes: Vec<u8>) -> Vec<u8> {
    let body = bytes.len() - 4;
    let sum = checksum(&bytes[..body]);
    bytes[body..].copy_from_slice(&sum.to_le_bytes());
    bytes
}

#[test]
fn every_truncation_is_refused_and_says_so() {
    for bytes in models() {
        for length in 0..bytes.len() {
            let error = Model::new(&bytes[..length]).unwrap_err();
            assert!(matches!(error, ModelError::Length { found, .. } if found == length), "{length}: {error:?}");
            assert!(error.to_string().contains("truncated"), "{error}");
        }
    }
}

#[test]
fn bytes_after_the_end_are_refused() {
    for mut bytes in models() {
        bytes.push(0);
        assert!(matches!(Model::new(&bytes), Err(ModelError::Length { .. })));
    }
}

#[test]
fn every_change_of_a_single_byte_is_refused() {
    for mut bytes in models() {
        for position in 0..bytes.len() {
            let right = bytes[position];
            for wrong in
                (0..=255).filter(|&wrong| wrong != right).step_by(if position < HEADER_LENGTH { 1 } else { 37 })
            {
                bytes[position] = wrong;
                assert!(Model::new(&bytes).is_err(), "byte {position}: {right} changed to {wrong}");
            }
            bytes[position] = right;
        }
        Model::new(&bytes).unwrap();
    }
}

#[test]
fn a_change_with_a_right_checksum_is_refused_or_can_be_walked() {
    let mut accepted = 0;
    Model::new(&sequences()).unwrap();
    for bytes in models().into_iter().chain([sequences()]) {
        for position in 0..bytes.len() - 4 {
            for wrong in [0, 1, 2, 3, 6, 8, 16, 127, 128, 254, 255] {
                let mut bytes = bytes.clone();
                bytes[position] = wrong;
                let bytes = with_checksum(bytes);
                if let Ok(model) = Model::new(&bytes) {
                    accepted += 1;
                    walk(&model);
                }
            }
        }
    }
    assert!(accepted > 1000, "{accepted} changed models were accepted");
}

#[test]
fn another_version_is_refused_by_name_before_anything_else() {
    let mut bytes = models().remove(0);
    bytes[4] = 3;
    bytes.truncate(200);
    assert_eq!(Model::new(&bytes).unwrap_err(), ModelError::Version(3));
    assert!(ModelError::Version(3).to_string().contains("version 3"));
}

#[test]
fn numbers_of_the_header_that_make_no_sense_are_refused_at_their_place() {
    for bytes in models() {
        Model::new(&bytes).unwrap();
        let wrong: [(usize, &[u8]); 9] = [
            // A unit that never decides, one that is too coarse, none.
            (32, &1e-9_f32.to_le_bytes()),
            (32, &1.0_f32.to_le_bytes()),
            (32, &f32::NAN.to_le_bytes()),
            (36, &bytes[36..40].iter().map(|byte| byte ^ 0x10).collect::<Vec<u8>>()),
            (40, &[64]),
            // A threshold that a tie passes, and no touch at all.
            (48, &(1_u64 << 56).to_le_bytes()),
            (48, &u64::MAX.to_le_bytes()),
            (56, &0_u32.to_le_bytes()),
            (4, &3_u16.to_le_bytes()),
        ];
        for (offset, field) in wrong {
            let mut changed = bytes.clone();
            changed[offset..offset + field.len()].copy_from_slice(field);
            assert_eq!(Model::new(&with_checksum(changed)).unwrap_err().offset(), offset, "{field:?}");
        }
    }
}

#[test]
fn something_else_is_called_something_else() {
    for bytes in [&b"{\"learner\":"[..], b"P", b"PLP0", b"\0\0\0\0\0"] {
        let error = Model::new(bytes).unwrap_err();
        let expected = if b"PLPT".starts_with(bytes) { "truncated" } else { "not a Palpate model" };
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_model_is_read_at_any_alignment() {
    for bytes in models() {
        let margins = |bytes: &[u8]| {
            let model = Model::new(bytes).unwrap();
            let mut margins = [0; 3];
            let touches = random::touches(50, 1);
            touches.iter().map(|touch| (model.margins(touch, &mut margins), margins).1).collect::<Vec<_>>()
        };
        let expected = margins(&bytes);
        for offset in 1..8 {
            let shifted = [vec![0; offset], bytes.clone()].concat();
            assert_eq!(margins(&shifted[offset..]), expected);
        }
    }
}

#[test]
fn changed_bytes_that_are_accepted_give_the_same_margins_at_every_address_and_alone_as_many_at_once() {
    // With thresholds of two and of four bytes, and enough of them for every kind of search.
    let mut rng = SmallRng::seed_from_u64(1);
    let shape = Shape { thresholds: 200, trees: 60, ..Shape::SMALL };
    let many = [Layout::Compact, Layout::Complete, Layout::Grid].map(|layout| {
        let settings = with!(Settings::default(), leaf = Leaf::I16, layout = Some(layout));
        compile(&random::ensemble(shape, 6), &settings).unwrap().bytes
    });
    let models: Vec<Vec<u8>> = models().into_iter().step_by(2).chain(many).collect();
    let (mut accepted, mut batch) = (0, Batch::new());
    for round in 0..4_000 {
        let mut bytes = models[round % models.len()].clone();
        let [_, _, axes, cuts, groups, ..] = places(&bytes);
        for _ in 0..rng.random_range(1..3) {
            let part = match rng.random_range(0..3) {
                0 if axes < cuts => axes..cuts,
                1 if cuts < groups => cuts..groups,
                _ => HEADER_LENGTH..bytes.len() - 4,
            };
            let at = rng.random_range(part);
            bytes[at] = rng.random();
        }
        let bytes = with_checksum(bytes);
        let Ok(model) = Model::new(&bytes) else { continue };
        accepted += 1;
        let (width, objects) = (model.feature_count(), model.object_count());
        let rows: Vec<i32> = (0..20 * width).map(|_| rng.random_range(-300_000..300_000)).collect();
        let margins = |bytes: &[u8]| -> Vec<i32> {
            let model = Model::new(bytes).unwrap();
            let mut margins = vec![0; 20 * objects];
            for (row, margins) in rows.chunks(width).zip(margins.chunks_mut(objects)) {
                assert!(model.margins_of(row, margins));
            }
            margins
        };
        let expected = margins(&bytes);
        for offset in 1..4 {
            let shifted = [vec![0; offset], bytes.clone()].concat();
            assert_eq!(margins(&shifted[offset..]), expected, "round {round} at address {offset}");
        }
        let mut at_once = vec![0; 20 * objects];
        assert!(model.margins_of_rows(&rows, &mut at_once, &mut batch));
        assert_eq!(at_once, expected, "round {round}");
    }
    assert!(accepted > 800, "{accepted}");
}

#[test]
fn an_object_that_a_model_does_not_know_has_no_name_and_a_text_that_is_cut_ends() {
    for bytes in models() {
        let model = Model::new(&bytes).unwrap();
        assert!((0..model.object_count()).all(|object| !model.object_name(object).is_empty()));
        // As many rounds would take centuries.
        assert_eq!(model.object_name(usize::MAX), "");
        assert_eq!(model.object_name(model.object_count()), "");
        // The first name runs over the end of the text: no byte of it is the next one's length.
        let mut cut = bytes.clone();
        cut[HEADER_LENGTH + 1 + usize::from(bytes[HEADER_LENGTH])] = 255;
        let cut = with_checksum(cut);
        let model = Model::new(&cut).unwrap();
        assert!((0..model.object_count() + 3).all(|object| model.object_name(object).is_empty()));
    }
}
