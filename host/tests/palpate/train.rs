use crate::fixtures::*;
use crate::synthetic;
use palpate::compile::{self, compile};
use palpate::ensemble::train::{Engine, Settings, train};
use palpate::ensemble::{self};
use palpate::progress::Progress;
use palpate::shared::Patterns;

fn quick() -> Settings {
    with!(Settings::compact(), rounds = 8, depth = 3, counted = Some(Counted::Full))
}

#[test]
fn threads_change_no_bit() {
    let dataset = synthetic::dataset(&[700, 900, 800], 2);
    let with = |threads| train(&dataset, &with!(quick(), threads, noise = Noise::gaussian(3_000.0)), &()).unwrap();
    assert_eq!(with(Some(1)), with(Some(3)));
    assert_eq!(with(Some(1)), with(None));
}

#[test]
fn margins_do_not_count_how_many_touches_an_object_had() {
    // The same two objects, once with equally many touches and once with ten times as many of the first.
    let even = synthetic::dataset(&[4_000, 4_000], 3);
    let mut uneven = even.clone();
    uneven.objects[1] = uneven.objects[1].part(0..1, 10);
    let settings = with!(quick(), min_child_weight = 5.0);
    let [even_margins, uneven_margins] = [&even, &uneven].map(|data| {
        let ensemble = train(data, &settings, &()).unwrap();
        let touches = synthetic::dataset(&[2_000, 2_000], 4);
        let all = touches.touches();
        let advantage = all.map(|touch| ensemble.margins(touch)).map(|m| f64::from(m[0] - m[1]));
        advantage.sum::<f64>() / 4_000.0
    });
    // The prior, had it been counted, would shift the mean by ln 10 ≈ 2.3.
    assert!((even_margins - uneven_margins).abs() < 0.3, "{even_margins} {uneven_margins}");
}

#[test]
fn touches_with_missing_contacts_train_and_predict() {
    let dataset = synthetic::dataset(&[500, 500], 5);
    let touches = dataset.touches();
    let partial: Vec<&Touch> = touches.filter(|touch| !touch.is_full()).collect();
    assert!(partial.len() > 20);
    let ensemble = train(&dataset, &quick(), &()).unwrap();
    assert!(partial.iter().flat_map(|touch| ensemble.margins(touch)).all(f32::is_finite));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let dataset = synthetic::dataset(&[50, 50], 6);
    for (settings, expected) in [
        (with!(quick(), rounds = 0), "rounds"),
        (with!(quick(), depth = 0), "depth"),
        (with!(quick(), depth = 17), "depth"),
        (with!(quick(), eta = 0.0), "eta"),
        (with!(quick(), eta = f64::NAN), "eta"),
        (with!(quick(), min_child_weight = -1.0), "min_child_weight"),
        (with!(quick(), bins = 1), "bins"),
        (with!(quick(), leaf_bits = Some(3)), "leaf_bits"),
        (with!(quick(), noise = Noise::gaussian(f64::INFINITY)), "noise"),
        (with!(quick(), threads = Some(0)), "threads"),
    ] {
        let error = train(&dataset, &settings, &()).unwrap_err();
        assert!(
            matches!(error.kind(), Kind::Setting { name, .. } if *name == expected) && error.exit_code() == 2,
            "{error}"
        );
        assert!(!error.to_string().contains("--"), "the library names an option: {error}");
    }
}

#[test]
fn a_pose_descriptor_without_poses_says_how_to_get_them() {
    let settings = with!(quick(), descriptor = Descriptor::Gravity);
    let error = train(&synthetic::dataset(&[50, 50], 7), &settings, &()).unwrap_err();
    assert!(error.to_string().contains("with their pose"), "{error}");
    assert!(error.to_string().contains("the descriptor gravity needs the probe's pose"), "{error}");
}

#[test]
fn more_objects_or_other_names_than_a_model_can_hold_are_refused_before_training() {
    /// Fails the test as soon as the training begins.
    struct Never;
    impl Progress for Never {
        fn begin(&self, stage: &str, _: Option<u64>) {
            panic!("{stage} began");
        }
    }
    let error = train(&synthetic::dataset(&[2; 300], 8), &quick(), &Never).unwrap_err();
    assert!(error.to_string().contains("there are 300 objects to train on"), "{error}");
    for (name, what) in [
        ("", "an object has an empty name"),
        ("fo\trk", "the object's name \"fo\\trk\" has a control character in it"),
        ("object0", "it has the object \"object0\" twice"),
    ] {
        let mut dataset = synthetic::dataset(&[50, 50], 8);
        dataset.objects[1].name = name.into();
        let error = train(&dataset, &quick(), &Never).unwrap_err();
        assert_eq!(error.what(), what);
    }
}

#[test]
fn the_most_objects_that_can_be_trained_can_be_saved_loaded_and_compiled() {
    let dataset = synthetic::dataset(&[4; 256], 8);
    let ensemble = train(&dataset, &with!(quick(), rounds = 1, depth = 2), &()).unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    ensemble.save(file.path()).unwrap();
    assert_eq!(ensemble::load(file.path()).unwrap(), ensemble);
    compile(&ensemble, &compile::Settings::default()).unwrap();
}

#[test]
fn one_object_or_an_empty_one_cannot_be_trained() {
    let error = train(&synthetic::dataset(&[50], 8), &quick(), &()).unwrap_err();
    assert!(error.to_string().contains("only one object"), "{error}");
    let error = train(&synthetic::dataset(&[50, 0], 8), &quick(), &()).unwrap_err();
    assert!(error.to_string().contains("object1 has no touches"), "{error}");
}

#[cfg(not(feature = "xgboost"))]
#[test]
fn a_build_without_xgboost_says_how_to_get_it() {
    let settings = with!(Settings::paper(), trainer = Engine::Xgboost);
    let error = train(&synthetic::dataset(&[50, 50], 9), &settings, &()).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("--features xgboost"), "{error}");
}

#[test]
fn rounded_leaves_compile_without_any_error_and_add_up_exactly_in_f32() {
    let dataset = synthetic::dataset(&[300, 300, 300], 1);
    let ensemble = train(&dataset, &with!(Settings::compact(), rounds = 20), &()).unwrap();
    let compiled = compile(&ensemble, &compile::Settings::default()).unwrap();
    assert_eq!(compiled.margin_error, 0.0);
    let model = palpate::onboard::Model::new(&compiled.bytes).unwrap();
    for touch in dataset.touches() {
        let mut margins = [0; 3];
        model.margins(touch, &mut margins);
        assert_eq!(ensemble.margins(touch), margins.map(|units| units as f32 * model.unit()));
    }
}

#[test]
fn rounding_moves_no_leaf_by_more_than_half_a_unit_and_uses_the_bits_it_was_given() {
    let dataset = synthetic::dataset(&[300, 300, 300], 1);
    let settings = |leaf_bits| with!(Settings::compact(), rounds = 5, leaf_bits);
    let plain = train(&dataset, &settings(None), &()).unwrap();
    let leaves = |ensemble: &Ensemble| -> Vec<f32> {
        ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| node.leaf()).flatten().copied().collect()
    };
    let largest = leaves(&plain).iter().fold(0.0_f32, |most, leaf| most.max(leaf.abs()));
    for bits in [4, 8, 12] {
        let rounded = leaves(&train(&dataset, &settings(Some(bits)), &()).unwrap());
        let unit = (1..=15)
            .rev()
            .map(|digits| 0.5_f32.powi(digits))
            .find(|unit| (largest / unit).round() < 2.0_f32.powi(bits as i32 - 1))
            .unwrap();
        for (before, after) in leaves(&plain).into_iter().zip(rounded) {
            assert!(
                (before - after).abs() <= unit / 2.0 && after % unit == 0.0,
                "{bits} bits: {before} became {after}"
            );
        }
    }
}

/// The approaches of two objects: every pattern occurs.
fn approaches() -> Dataset {
    let touch = |index: u32, bend: u32| {
        let missing = |finger: u32| index >> finger & 1 == 1;
        let times = [0, 1_000 + index % 7 * bend, 3_000 + index % 5 * 100].map(ContactTime::from_micros);
        let mut fingers = 0..;
        Touch::new(times.map(|time| if missing(fingers.next().unwrap()) { ContactTime::MISSING } else { time }))
    };
    let object =
        |name: &str, bend| ObjectTouches::new(name, (0..800).map(|index| touch(index, bend)).collect(), Source::Object);
    Dataset::new(vec![object("cup", 100), object("fork", 400)])
}

#[test]
fn approaches_are_trained_on_by_their_contacts_unless_full_touches_or_all_are_asked_for() {
    let dataset = approaches();
    assert!(dataset.holds_approaches());
    let trained = |counted, descriptor| {
        let settings = with!(quick(), counted, descriptor);
        train(&dataset, &settings, &()).unwrap()
    };
    for (counted, descriptor, expected, patterns) in [
        (None, Descriptor::Curvature, Descriptor::ContactsCurvature, Patterns::CONTACTS),
        (Some(Counted::All), Descriptor::Curvature, Descriptor::ContactsCurvature, Patterns::ALL),
        (Some(Counted::Full), Descriptor::Curvature, Descriptor::Curvature, Patterns::FULL),
        (Some(Counted::Full), Descriptor::ContactsCurvature, Descriptor::Curvature, Patterns::FULL),
        (None, Descriptor::Times, Descriptor::Times, Patterns::CONTACTS),
    ] {
        let ensemble = trained(counted, descriptor);
        assert_eq!(ensemble.descriptor(), Some(expected));
        let stated = ensemble.trained_touches();
        assert_eq!((stated.patterns, stated.needs_pose), (patterns, false), "{descriptor:?}");
        assert!((3_000..=3_400).contains(&stated.largest_spread), "{stated:?}");
        let shares = TouchOrigin::of(&ensemble.origin).unwrap().trained.unwrap().shares.unwrap();
        assert_eq!(shares, [0.125, 0.25, 0.125, 0.25, 0.125, 0.125]);
        // The file and every compiled model state the same.
        let file = tempfile::NamedTempFile::new().unwrap();
        ensemble.save(file.path()).unwrap();
        assert_eq!(ensemble::load(file.path()).unwrap(), ensemble);
        let compiled = compile(&ensemble, &compile::Settings::default()).unwrap();
        let model = compile::open(&compiled.bytes).unwrap();
        assert_eq!(model.trained_touches(), stated);
        assert_eq!(model.pattern_shares().unwrap().0, shares.map(|share| (share * 65_535.0).round() as u16));
    }
    // The paper's preset stays with full touches.
    let paper = train(&dataset, &with!(Settings::paper(), rounds = 2), &()).unwrap();
    assert_eq!(paper.trained_touches().patterns, Patterns::FULL);
}

#[test]
fn an_object_without_a_touch_that_counts_is_named() {
    let mut dataset = approaches();
    dataset.objects[1] = filtered(&dataset.objects[1], |touch| !touch.is_full());
    let error = train(&dataset, &with!(quick(), counted = Some(Counted::Full)), &()).unwrap_err();
    assert!(error.to_string().contains("no touch of fork is evidence: none has three contacts"), "{error}");
}
