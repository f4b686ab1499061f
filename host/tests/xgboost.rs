//! The trainers compared: `cargo test --release -p palpate --features xgboost --test xgboost`.

use palpate::compile;
use palpate::ensemble::Ensemble;
use palpate::ensemble::train::{Engine, Settings, train};
use palpate::evaluate::Margins;
use palpate::shared::Touch;
use palpate::touches::{Dataset, ObjectTouches, Source};
use palpate::with;

#[allow(dead_code, reason = "the library's own tests use all of it")]
#[path = "../src/tests/synthetic.rs"]
mod synthetic;

/// Ensembles of both trainers from the same touches.
fn both(dataset: &Dataset, settings: &Settings) -> [Ensemble; 2] {
    [Engine::Palpate, Engine::Xgboost]
        .map(|trainer| train(dataset, &with!(settings.clone(), trainer, threads = Some(1)), &()).unwrap())
}

#[test]
fn both_trainers_make_the_same_trees_bit_for_bit_over_the_same_bins() {
    let settings = with!(Settings::paper(), rounds = 30);
    for counts in [[2_000, 2_000, 2_000], [2_000, 500, 1_000]] {
        let mut dataset = synthetic::dataset(&counts, 10);
        // XGBoost 1.6 has no threshold that tells a missing value from all others; ours has.
        for object in &mut dataset.objects {
            // So few different values leave nothing to the quantile sketch, which XGBoost changed after 1.6.
            let rounded = |touch: &Touch| {
                touch
                    .is_full()
                    .then(|| Touch::from_micros(touch.times().map(|time| time.micros().unwrap() / 6_000 * 6_000)))
            };
            let touches = object.touches().iter().filter_map(rounded).collect();
            *object = ObjectTouches::new(&object.name, touches, Source::Object);
        }
        let [ours, theirs] = both(&dataset, &settings);
        assert_eq!(ours, theirs);
        eprintln!("{counts:?}: {} trees alike, bit for bit", ours.trees.len());
    }
}

#[test]
fn both_trainers_are_as_accurate_with_the_published_method() {
    let unseen = synthetic::dataset(&[2_000, 2_000, 2_000], 11);
    for counts in [[6_000, 6_000, 6_000], [6_000, 2_000, 3_000]] {
        let [ours, theirs] =
            both(&synthetic::dataset(&counts, 10), &with!(Settings::paper(), rounds = 30)).map(|ensemble| {
                let compiled = compile::exact(&ensemble).unwrap();
                let model = compiled.model();
                let margins = Margins::new(&model, &unseen).unwrap();
                margins.curve(10, 1_000, 1).unwrap().accuracy(10).value
            });
        eprintln!("{counts:?}: accuracy at 10 touches {ours:.3} with ours, {theirs:.3} with XGBoost");
        // Bins at other values: other thresholds, and a percent or so either way.
        assert!((ours - theirs).abs() < 0.02, "{ours} {theirs}");
    }
}

#[test]
fn xgboost_refuses_multi_output_trees() {
    let settings = with!(Settings::compact(), trainer = Engine::Xgboost);
    let error = train(&synthetic::dataset(&[50, 50], 12), &settings, &()).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("leaves is each. Use one"), "{error}");
}
