//! Bytes that are not a model are refused, and bytes that pass can be walked.

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate_onboard::{Batch, Model, ModelError, Recognizer, RowsSeen, Stopping};
use palpate_shared::Descriptor;
use palpate_shared::format::{HEADER_LENGTH, MUST_UNDERSTAND, PatternShares, TrainedTouches};
use palpate_tests::abuse::{self, cuts, places, sealed, section};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{Trained, trained, with_sections};
use palpate_tests::wide::widened;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

/// A small model in each layout and leaf type, with leaves of every object or of one, and models with every optional section.
fn models() -> Vec<Vec<u8>> {
    let of_layout = |layout| Leaf::ALL.iter().flat_map(move |&leaf| [true, false].map(|each| (layout, leaf, each)));
    let plain = [Layout::Compact, Layout::Wide].into_iter().flat_map(of_layout);
    let plain = plain.map(|(layout, leaf, each)| abuse::model(layout, leaf, each));
    plain.chain(cuts().into_iter().map(|(_, base, _)| base)).collect()
}

/// Walks a model with touches that reach all over it.
fn walk(model: &Model<'_>) {
    let Ok(mut recognizer) = Recognizer::<256>::new(model, Stopping::from_model(model)) else { return };
    for touch in random::touches(10, 3) {
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
fn a_change_with_a_right_checksum_is_refused_or_can_be_walked() {
    let mut accepted = 0;
    for bytes in models() {
        for position in 0..bytes.len() - 4 {
            for wrong in [0, 1, 2, 3, 6, 8, 16, 127, 128, 254, 255] {
                let mut bytes = bytes.clone();
                bytes[position] = wrong;
                let bytes = sealed(bytes);
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
fn something_else_is_called_something_else() {
    let model = abuse::model(Layout::Compact, Leaf::I8, true);
    // Its version comes before its length.
    let [earlier, later] = [2, 4].map(|version| [&b"PLPT"[..], &[version], &[0; 101]].concat());
    let unknown = with_sections(&model, &section(77 | MUST_UNDERSTAND, &[1, 2, 3]));
    for (bytes, expected) in [
        (&b"{\"learner\":"[..], "not a Palpate model"),
        (b"PLP0", "not a Palpate model"),
        (b"\0\0\0\0\0", "not a Palpate model"),
        (b"P", "truncated"),
        (&earlier, "version 2"),
        (&later, "version 4"),
        (&unknown, "section 77"),
    ] {
        let error = Model::new(bytes).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn statements_about_the_training_are_read_back_and_change_no_margin() {
    let expected = Trained { shares: Some(PatternShares([1, 2, 3, 4, 5, 65_520])), ..abuse::TRAINED };
    let plain = random::model(Shape { descriptor: Descriptor::ContactsCurvature, ..Shape::SMALL }, 1, Leaf::I16);
    let stated = trained(&plain, &expected);
    let [plain, stated] = [&plain, &stated].map(|bytes| Model::new(bytes).unwrap());
    let read = |model: &Model<'_>| Trained {
        probe: model.probe(),
        touches: Some(model.trained_touches()),
        noise: model.noise(),
        shares: model.pattern_shares(),
    };
    assert_eq!(read(&stated), expected);
    assert_eq!(read(&plain), Trained { touches: Some(TrainedTouches::full(false)), ..Trained::default() });
    assert_eq!(stated.optional_sections().map(|section| section.tag).collect::<Vec<_>>(), [1, 2, 3, 9]);
    assert_eq!((stated.object_name(2), stated.prior(1)), (plain.object_name(2), plain.prior(1)));
    let (mut a, mut b) = ([0; 3], [0; 3]);
    for touch in random::touches(500, 1) {
        plain.margins(&touch, &mut a);
        stated.margins(&touch, &mut b);
        assert_eq!(a, b);
    }
}

/// More rows than one pass of a batch takes, and some for which it is not whole.
const ROWS: usize = 140;

#[test]
fn changed_bytes_that_are_accepted_give_the_same_margins_at_every_address_and_alone_as_many_at_once() {
    // With thresholds of two and of four bytes, and enough of them for every kind of search.
    let mut rng = SmallRng::seed_from_u64(1);
    let shape = Shape { thresholds: 200, trees: 60, ..Shape::SMALL };
    let many = compile(&random::ensemble(shape, 6), &Settings::default()).unwrap().bytes;
    let many = [widened(&many), many];
    let models: Vec<Vec<u8>> = models().into_iter().chain(many).collect();
    let (mut accepted, mut batch) = (0, Batch::new());
    for round in 0..1_500 {
        let mut bytes = models[round % models.len()].clone();
        let [_, _, axes, cuts, groups, ..] = places(&bytes);
        for _ in 0..rng.random_range(0..3) {
            let part = match rng.random_range(0..3) {
                0 if axes < cuts => axes..cuts,
                1 if cuts < groups => cuts..groups,
                _ => HEADER_LENGTH..bytes.len() - 4,
            };
            let at = rng.random_range(part);
            bytes[at] = rng.random();
        }
        let bytes = sealed(bytes);
        let Ok(model) = Model::new(&bytes) else { continue };
        accepted += 1;
        let (width, objects) = (model.feature_count(), model.object_count());
        let rows: Vec<i32> = (0..ROWS * width).map(|_| rng.random_range(-300_000..300_000)).collect();
        let margins = |bytes: &[u8]| -> Vec<i32> {
            let model = Model::new(bytes).unwrap();
            let mut margins = vec![0; ROWS * objects];
            for (row, margins) in rows.chunks(width).zip(margins.chunks_mut(objects)) {
                assert!(model.margins_of(row, margins));
            }
            margins
        };
        let expected = margins(&bytes);
        for offset in 1..8 {
            let shifted = [vec![0; offset], bytes.clone()].concat();
            assert_eq!(margins(&shifted[offset..]), expected, "round {round} at address {offset}");
        }
        let mut at_once = vec![0; ROWS * objects];
        assert!(model.margins_of_rows(&rows, &mut at_once, &mut batch));
        assert_eq!(at_once, expected, "round {round}");
    }
    assert!(accepted > 500, "{accepted}");
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
        let cut = sealed(cut);
        let model = Model::new(&cut).unwrap();
        assert!((0..model.object_count() + 3).all(|object| model.object_name(object).is_empty()));
    }
}
