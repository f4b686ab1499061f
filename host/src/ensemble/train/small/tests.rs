use super::super::train;
use super::*;
use crate::compile::{self, Layout, Leaf, compile};
use crate::ensemble::OverTouches;
use crate::error::Setting;
use crate::tests::synthetic;
use crate::with;
use palpate_shared::{Descriptor, Touch};
use std::collections::BTreeSet;

fn settings(leaves: usize) -> Settings {
    let small = Some(Small { leaves, threshold_cost: 2e-5 });
    Settings { rounds: 10, depth: 4, min_child_weight: 5.0, leaf_bits: Some(8), small, ..Settings::compact() }
}

fn dataset(seed: u64) -> Dataset {
    synthetic::dataset(&[1_500, 1_500, 1_500], seed)
}

/// The mean loss of a touch, in nats.
fn loss(ensemble: &Ensemble, dataset: &Dataset) -> f64 {
    let takes = ensemble.trained_touches();
    let mut losses = Vec::new();
    for (object, touches) in dataset.objects.iter().enumerate() {
        for touch in touches.touches().iter().filter(|touch| takes.patterns.contains(touch.pattern())) {
            let margins: Vec<f64> = ensemble.margins(touch).into_iter().map(f64::from).collect();
            losses.push(margins.iter().map(|margin| margin.exp()).sum::<f64>().ln() - margins[object]);
        }
    }
    losses.iter().sum::<f64>() / losses.len() as f64
}

fn different_leaves(ensemble: &Ensemble) -> usize {
    let leaves = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(Node::leaf);
    leaves.map(|values| values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>()).collect::<BTreeSet<_>>().len()
}

fn thresholds(ensemble: &Ensemble) -> usize {
    let nodes = ensemble.trees.iter().flat_map(|tree| &tree.nodes);
    let thresholds = nodes.filter_map(|node| match node {
        Node::Split { feature, threshold, .. } => Some((*feature, threshold.to_bits())),
        Node::Leaf(_) => None,
    });
    thresholds.collect::<BTreeSet<_>>().len()
}

#[test]
fn no_more_leaves_differ_than_were_asked_for_and_a_model_of_bytes_is_exact() {
    for leaves in [1, 5, 24] {
        let ensemble = train(&dataset(1), &settings(leaves), &()).unwrap();
        assert_eq!(ensemble.trees.len(), 10);
        assert!(different_leaves(&ensemble) <= leaves);
        let how = with!(compile::Settings::default(), leaf = Leaf::I8, shared_leaves = Some(true));
        for layout in [Layout::Complete, Layout::Compact] {
            let compiled = compile(&ensemble, &with!(how.clone(), layout = Some(layout))).unwrap();
            assert_eq!(compiled.margin_error, 0.0);
            assert_eq!(compiled.shared_leaves, Some(different_leaves(&ensemble)));
        }
    }
}

#[test]
fn shared_leaves_that_are_fitted_lose_little_to_leaves_that_are_not_shared() {
    let (trained, fresh) = (dataset(1), dataset(2));
    let plain = train(&trained, &Settings { small: None, ..settings(1) }, &()).unwrap();
    let all: usize =
        plain.trees.iter().map(|tree| tree.nodes.iter().filter(|node| node.leaf().is_some()).count()).sum();
    let shared = train(&trained, &settings(24), &()).unwrap();
    assert!(all > 4 * different_leaves(&shared), "{all}");
    let [plain, shared] = [plain, shared].map(|ensemble| loss(&ensemble, &fresh));
    assert!(plain < 3_f64.ln() - 0.1 && shared < plain + 0.01, "{plain} {shared}");
    // Nothing is learned from leaves that are all the same.
    let one = train(&trained, &settings(1), &()).unwrap();
    assert!((loss(&one, &fresh) - 3_f64.ln()).abs() < 0.02);
}

#[test]
fn thresholds_that_cost_more_are_fewer() {
    let of = |threshold_cost| {
        let small = Some(Small { leaves: 24, threshold_cost });
        train(&dataset(1), &Settings { small, ..settings(24) }, &()).unwrap()
    };
    let counts = [0.0, 1e-4, 1e-3, 1e3].map(|cost| thresholds(&of(cost)));
    assert!(counts.windows(2).all(|pair| pair[0] > pair[1]) && counts[3] == 0, "{counts:?}");
}

#[test]
fn rounding_is_made_up_for() {
    let (trained, fresh) = (dataset(1), dataset(2));
    let of = |leaf_bits| {
        let ensemble = train(&trained, &Settings { leaf_bits, ..settings(24) }, &()).unwrap();
        loss(&ensemble, &fresh)
    };
    let [exact, eight, five] = [None, Some(8), Some(5)].map(of);
    assert!((eight - exact).abs() < 0.003 && five - exact < 0.02, "{exact} {eight} {five}");
}

#[test]
fn threads_change_no_bit_and_more_trees_change_none_of_the_first() {
    let with = |threads| train(&dataset(1), &Settings { threads, ..settings(24) }, &()).unwrap();
    assert_eq!(with(Some(1)), with(Some(3)));
    assert_eq!(with(Some(1)), with(None));
    let how = Settings { small: None, ..settings(24) };
    let each = train_each(&dataset(1), &how, 2e-5, &[(4, 8), (10, 24)], &()).unwrap();
    assert_eq!(each[1], with(None));
    assert_eq!(each[0], train(&dataset(1), &Settings { rounds: 4, ..settings(8) }, &()).unwrap());
}

#[test]
fn touches_with_missing_contacts_are_learned_from() {
    let data = dataset(3);
    let partial: Vec<&Touch> = data.touches().filter(|touch| !touch.is_full()).collect();
    assert!(partial.len() > 20);
    for descriptor in [Descriptor::Curvature, Descriptor::Times] {
        let how = Settings { descriptor, rounds: 20, ..settings(40) };
        let ensemble = train(&data, &how, &()).unwrap();
        assert_eq!(ensemble.descriptor(), Some(descriptor.for_contacts().unwrap_or(descriptor)));
        assert!(partial.iter().flat_map(|touch| ensemble.margins(touch)).all(f32::is_finite));
        assert!(loss(&ensemble, &data) < 3_f64.ln() - 0.1);
        // Saved and read, it is the same.
        let file = tempfile::NamedTempFile::new().unwrap();
        ensemble.save(file.path()).unwrap();
        assert_eq!(crate::ensemble::load(file.path()).unwrap(), ensemble);
    }
}

#[test]
fn objects_with_fewer_touches_count_as_much() {
    let even = dataset(4);
    let mut uneven = even.clone();
    uneven.objects[1] = uneven.objects[1].select(0..150);
    let fresh = dataset(5);
    for data in [even, uneven] {
        let ensemble = train(&data, &settings(24), &()).unwrap();
        let shares = fresh.touches().map(|touch| {
            let weights = ensemble.margins(touch).into_iter().map(f32::exp).collect::<Vec<f32>>();
            f64::from(weights[1] / weights.iter().sum::<f32>())
        });
        // A third of the fresh touches are its own; few touches, each weighing ten, miss some of that. The prior,
        // had it been counted, would make it a twentieth.
        let mean = shares.sum::<f64>() / fresh.len() as f64;
        assert!((0.15..0.45).contains(&mean), "{mean}");
    }
}

#[test]
fn settings_that_contradict_each_other_are_refused_by_name() {
    let small = |leaves, threshold_cost| Some(Small { leaves, threshold_cost });
    for (how, expected) in [
        (Settings { small: small(0, 0.0), ..settings(1) }, "different_leaves"),
        (Settings { small: small(65_537, 0.0), ..settings(1) }, "different_leaves"),
        (Settings { small: small(8, -1.0), ..settings(1) }, "threshold_cost"),
        (Settings { small: small(8, f64::NAN), ..settings(1) }, "threshold_cost"),
        (Settings { multi_output: false, ..settings(8) }, "leaves"),
        (Settings { trainer: Engine::Xgboost, ..settings(8) }, "trainer"),
        (Settings { rounds: 0, ..settings(8) }, "rounds"),
    ] {
        let error = train(&dataset(1), &how, &()).unwrap_err();
        assert!(matches!(error.problem::<Setting>(), Some(Setting { name, .. }) if *name == expected), "{error}");
    }
}
