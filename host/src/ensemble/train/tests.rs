use super::*;
use crate::compile;
use crate::touches::synthetic;

fn quick() -> Settings {
    Settings { rounds: 8, depth: 3, ..Settings::compact() }
}

#[test]
fn an_ensemble_predicts_what_its_trainer_predicts_bit_for_bit() {
    let dataset = synthetic::dataset(&[400, 300, 500], 1);
    for settings in [quick(), Settings { rounds: 5, ..Settings::paper() }] {
        let rows = Rows::new(&dataset, &settings);
        let features = rows.features.clone();
        let data = rows.matrix().unwrap();
        let model = hessboost::training::train(&parameters(&settings, 3).unwrap(), &data, settings.rounds).unwrap();
        let ensemble = ensemble(&model, settings.descriptor, dataset.names());
        let margins = model.predict_margin(&data, hessboost::model::Iterations::Best).unwrap();
        for (row, features) in features.chunks(settings.descriptor.feature_count()).enumerate() {
            assert_eq!(ensemble.margins_of_features(features), margins.row(row).unwrap());
        }
    }
}

#[test]
fn threads_change_no_bit() {
    let dataset = synthetic::dataset(&[700, 900, 800], 2);
    let with = |threads| train(&dataset, &Settings { threads, noise: 3_000.0, ..quick() }, &()).unwrap();
    assert_eq!(with(Some(1)), with(Some(3)));
    assert_eq!(with(Some(1)), with(None));
}

#[test]
fn margins_do_not_count_how_many_touches_an_object_had() {
    // The same two objects, once with equally many touches and once with ten times as many of the first.
    let even = synthetic::dataset(&[4_000, 4_000], 3);
    let mut uneven = even.clone();
    uneven.objects[1].touches.truncate(400);
    let settings = Settings { min_child_weight: 5.0, ..quick() };
    let [even_margins, uneven_margins] = [&even, &uneven].map(|data| {
        let ensemble = train(data, &settings, &()).unwrap();
        let touches = synthetic::dataset(&[2_000, 2_000], 4);
        let all = touches.objects.iter().flat_map(|object| &object.touches);
        let advantage = all.map(|touch| ensemble.margins(touch)).map(|m| f64::from(m[0] - m[1]));
        advantage.sum::<f64>() / 4_000.0
    });
    // The prior, had it been counted, would shift the mean by ln 10 ≈ 2.3.
    assert!((even_margins - uneven_margins).abs() < 0.3, "{even_margins} {uneven_margins}");
}

#[test]
fn touches_with_missing_contacts_train_and_predict() {
    let dataset = synthetic::dataset(&[500, 500], 5);
    let touches = dataset.objects.iter().flat_map(|object| &object.touches);
    let partial: Vec<&Touch> = touches.filter(|touch| !touch.is_full()).collect();
    assert!(partial.len() > 20);
    let ensemble = train(&dataset, &quick(), &()).unwrap();
    assert!(partial.iter().flat_map(|touch| ensemble.margins(touch)).all(f32::is_finite));
}

#[test]
fn settings_out_of_range_are_argument_errors() {
    let dataset = synthetic::dataset(&[50, 50], 6);
    for (settings, option) in [
        (Settings { rounds: 0, ..quick() }, "--rounds"),
        (Settings { depth: 0, ..quick() }, "--depth"),
        (Settings { depth: 17, ..quick() }, "--depth"),
        (Settings { eta: 0.0, ..quick() }, "--eta"),
        (Settings { eta: f64::NAN, ..quick() }, "--eta"),
        (Settings { min_child_weight: -1.0, ..quick() }, "--min-child-weight"),
        (Settings { bins: 1, ..quick() }, "--bins"),
        (Settings { feature_bins: Some(vec![9]), ..quick() }, "--bins"),
        (Settings { feature_bins: Some(vec![9, 1]), ..quick() }, "--bins"),
        (Settings { noise: f64::INFINITY, ..quick() }, "--noise"),
        (Settings { threads: Some(0), ..quick() }, "thread"),
    ] {
        let error = train(&dataset, &settings, &()).unwrap_err();
        assert!(matches!(error, Error::Argument { .. }) && error.to_string().contains(option), "{error}");
    }
}

#[test]
fn no_feature_has_more_thresholds_than_its_bins_leave() {
    let settings = Settings { rounds: 20, feature_bins: Some(vec![12, 5]), ..quick() };
    let ensemble = train(&synthetic::dataset(&[2_000, 2_000], 7), &settings, &()).unwrap();
    let mut thresholds = [const { std::collections::BTreeSet::new() }; 2];
    for node in ensemble.trees.iter().flat_map(|tree| &tree.nodes) {
        if let Node::Split { feature, threshold, .. } = node {
            thresholds[*feature].insert(threshold.to_bits());
        }
    }
    let [curvature, slope] = thresholds.map(|set| set.len());
    // One threshold fewer than bins, and one that tells missing values from all others.
    assert!((6..=12).contains(&curvature) && (2..=5).contains(&slope), "{curvature} {slope}");
}

#[test]
fn a_pose_descriptor_without_poses_says_how_to_get_them() {
    let settings = Settings { descriptor: Descriptor::Gravity, ..quick() };
    let error = train(&synthetic::dataset(&[50, 50], 7), &settings, &()).unwrap_err();
    assert!(error.to_string().contains("--pose"), "{error}");
}

#[test]
fn one_object_or_an_empty_one_cannot_be_trained() {
    let error = train(&synthetic::dataset(&[50], 8), &quick(), &()).unwrap_err();
    assert!(error.to_string().contains("only one object"), "{error}");
    let error = train(&synthetic::dataset(&[50, 0], 8), &quick(), &()).unwrap_err();
    assert!(error.to_string().contains("object1 has no touches"), "{error}");
}

#[test]
#[cfg(not(feature = "xgboost"))]
fn a_build_without_xgboost_says_how_to_get_it() {
    let settings = Settings { engine: Engine::Xgboost, ..Settings::paper() };
    let error = train(&synthetic::dataset(&[50, 50], 9), &settings, &()).unwrap_err();
    assert!(matches!(error, Error::Argument { .. }) && error.to_string().contains("--features xgboost"), "{error}");
}

/// The comparison of trainers; shown as ignored where XGBoost is not built in.
mod xgboost {
    use super::*;
    use crate::evaluate::{Candidate, Margins};

    /// What each trainer makes of the same touches.
    fn both(dataset: &Dataset, settings: &Settings) -> [Ensemble; 2] {
        [Engine::Hessboost, Engine::Xgboost]
            .map(|engine| train(dataset, &Settings { engine, threads: Some(1), ..settings.clone() }, &()).unwrap())
    }

    #[test]
    #[cfg_attr(not(feature = "xgboost"), ignore = "needs XGBoost: cargo test -p palpate --features xgboost")]
    fn both_trainers_grow_the_same_trees_bit_for_bit_over_the_same_bins() {
        // So few different values leave nothing to the quantile sketch, which XGBoost changed after 1.6.
        let settings = Settings { rounds: 30, feature_bins: Some(vec![40; 3]), ..Settings::paper() };
        for counts in [[2_000, 2_000, 2_000], [2_000, 500, 1_000]] {
            let mut dataset = synthetic::dataset(&counts, 10);
            // XGBoost 1.6 has no threshold that tells a missing value from all others; hessboost has.
            dataset.objects.iter_mut().for_each(|object| object.touches.retain(Touch::is_full));
            let [ours, theirs] = both(&dataset, &settings);
            assert_eq!(ours, theirs);
            eprintln!("{counts:?}: {} trees alike, bit for bit", ours.trees.len());
        }
    }

    #[test]
    #[cfg_attr(not(feature = "xgboost"), ignore = "needs XGBoost: cargo test -p palpate --features xgboost")]
    fn both_trainers_are_as_accurate_with_the_published_method() {
        let unseen = synthetic::dataset(&[2_000, 2_000, 2_000], 11);
        for counts in [[6_000, 6_000, 6_000], [6_000, 2_000, 3_000]] {
            let [ours, theirs] = both(&synthetic::dataset(&counts, 10), &Settings { rounds: 30, ..Settings::paper() })
                .map(|ensemble| {
                    let margins = Margins::new(Candidate::Full(&ensemble), &unseen).unwrap();
                    margins.curve(10, 1_000, 1).unwrap().accuracy(10).value
                });
            eprintln!("{counts:?}: accuracy at 10 touches {ours:.3} with hessboost, {theirs:.3} with XGBoost");
            // Bins at other values: other thresholds, and a percent or so either way.
            assert!((ours - theirs).abs() < 0.02, "{ours} {theirs}");
        }
    }

    #[test]
    #[cfg_attr(not(feature = "xgboost"), ignore = "needs XGBoost: cargo test -p palpate --features xgboost")]
    fn xgboost_refuses_multi_output_trees() {
        let settings = Settings { engine: Engine::Xgboost, ..quick() };
        let error = train(&synthetic::dataset(&[50, 50], 12), &settings, &()).unwrap_err();
        assert!(matches!(error, Error::Argument { .. }) && error.to_string().contains("--leaves one"), "{error}");
    }
}

#[test]
fn rounded_leaves_compile_without_any_error_and_add_up_exactly_in_f32() {
    let dataset = synthetic::dataset(&[300, 300, 300], 1);
    let ensemble = train(&dataset, &Settings { rounds: 20, ..Settings::compact() }, &()).unwrap();
    let compiled = compile::compile(&ensemble, &compile::Settings::default()).unwrap();
    assert_eq!(compiled.margin_error, 0.0);
    let model = palpate_onboard::Model::new(&compiled.bytes).unwrap();
    for touch in dataset.objects.iter().flat_map(|object| &object.touches) {
        let mut margins = [0; 3];
        model.margins(touch, &mut margins);
        assert_eq!(ensemble.margins(touch), margins.map(|units| units as f32 * model.unit()));
    }
}

#[test]
fn rounding_moves_no_leaf_by_more_than_half_a_unit_and_uses_the_bits_it_was_given() {
    let dataset = synthetic::dataset(&[300, 300, 300], 1);
    let settings = |leaf_bits| Settings { rounds: 5, leaf_bits, ..Settings::compact() };
    let plain = train(&dataset, &settings(None), &()).unwrap();
    let leaves = |ensemble: &crate::ensemble::Ensemble| -> Vec<f32> {
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
