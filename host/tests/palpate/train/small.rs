use crate::fixtures::*;
use crate::synthetic;
use palpate::compile::{self, Layout, Leaf, compile};
use palpate::ensemble::train::{Engine, Settings, Small, train};
use palpate::ensemble::{self};

fn settings(leaves: usize) -> Settings {
    let small = Some(Small { leaves, threshold_cost: 2e-5 });
    with!(Settings::compact(), rounds = 10, depth = 4, min_child_weight = 5.0, leaf_bits = Some(8), small)
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
    let plain = train(&trained, &with!(settings(1), small = None), &()).unwrap();
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
        train(&dataset(1), &with!(settings(24), small), &()).unwrap()
    };
    let counts = [0.0, 1e-4, 1e-3, 1e3].map(|cost| thresholds(&of(cost)));
    assert!(counts.windows(2).all(|pair| pair[0] > pair[1]) && counts[3] == 0, "{counts:?}");
}

#[test]
fn rounding_is_made_up_for() {
    let (trained, fresh) = (dataset(1), dataset(2));
    let of = |leaf_bits| {
        let ensemble = train(&trained, &with!(settings(24), leaf_bits), &()).unwrap();
        loss(&ensemble, &fresh)
    };
    let [exact, eight, five] = [None, Some(8), Some(5)].map(of);
    assert!((eight - exact).abs() < 0.003 && five - exact < 0.02, "{exact} {eight} {five}");
}

#[test]
fn touches_with_missing_contacts_are_learned_from() {
    let data = dataset(3);
    let partial: Vec<&Touch> = data.touches().filter(|touch| !touch.is_full()).collect();
    assert!(partial.len() > 20);
    for descriptor in [Descriptor::Curvature, Descriptor::Times] {
        let how = with!(settings(40), descriptor, rounds = 20);
        let ensemble = train(&data, &how, &()).unwrap();
        assert_eq!(ensemble.descriptor(), Some(descriptor.for_contacts().unwrap_or(descriptor)));
        assert!(partial.iter().flat_map(|touch| ensemble.margins(touch)).all(f32::is_finite));
        assert!(loss(&ensemble, &data) < 3_f64.ln() - 0.1);
        // Saved and read, it is the same.
        let file = tempfile::NamedTempFile::new().unwrap();
        ensemble.save(file.path()).unwrap();
        assert_eq!(ensemble::load(file.path()).unwrap(), ensemble);
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
        (with!(settings(1), small = small(0, 0.0)), "different_leaves"),
        (with!(settings(1), small = small(65_537, 0.0)), "different_leaves"),
        (with!(settings(1), small = small(8, -1.0)), "threshold_cost"),
        (with!(settings(1), small = small(8, f64::NAN)), "threshold_cost"),
        (with!(settings(8), multi_output = false), "leaves"),
        (with!(settings(8), trainer = Engine::Xgboost), "trainer"),
        (with!(settings(8), rounds = 0), "rounds"),
    ] {
        let error = train(&dataset(1), &how, &()).unwrap_err();
        assert!(matches!(error.problem::<Setting>(), Some(Setting { name, .. }) if *name == expected), "{error}");
    }
}
