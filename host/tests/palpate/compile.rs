use crate::fixtures::*;
use palpate::compile::{Instructions, Leaf, Settings, compile, exact, longest_time, open, read_any, usual};
use palpate::ensemble::inputs;

fn split(feature: usize, threshold: f32, left: usize, right: usize) -> Node {
    Node::Split { feature, threshold, missing_left: true, left, right }
}

fn leaf(values: &[f32]) -> Node {
    Node::Leaf(values.into())
}

/// An ensemble of two objects over these trees, whose leaves have a value for each.
fn ensemble(descriptor: Descriptor, trees: Vec<Vec<Node>>) -> Ensemble {
    Ensemble {
        inputs: inputs(descriptor),
        objects: vec!["bowl".into(), "fork".into()],
        base_margins: vec![0.0; 2],
        trees: trees.into_iter().map(|nodes| Tree { nodes, output: Output::Each }).collect(),
        origin: Provenance::default(),
    }
}

/// One split.
fn stump(threshold: f32, leaves: [[f32; 2]; 2]) -> Ensemble {
    ensemble(Descriptor::Curvature, vec![vec![split(0, threshold, 1, 2), leaf(&leaves[0]), leaf(&leaves[1])]])
}

/// A tree that is a chain of splits, one below the other to the right, at whole thresholds.
fn chain(splits: usize, feature: impl Fn(usize) -> usize) -> Vec<Node> {
    let mut nodes = Vec::new();
    for number in 0..splits {
        nodes.push(split(feature(number), 1_000.0 * (number + 1) as f32, 2 * number + 1, 2 * number + 2));
        nodes.push(leaf(&[0.5, -0.5]));
    }
    nodes.push(leaf(&[-0.5, 0.5]));
    nodes
}

#[test]
fn a_model_states_the_probe_of_its_touches_and_the_published_one_only_where_none_is_known() {
    let header = |probe: Option<StatedProbe>| {
        let mut ensemble = stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]);
        TouchOrigin { probe, ..TouchOrigin::default() }.state(&mut ensemble.origin);
        let compiled = compile(&ensemble, &Settings::default()).unwrap();
        let model = open(&compiled.bytes).unwrap();
        (model.header().spacing(), model.header().speed(), model.probe())
    };
    assert_eq!(header(None), (1.5, 10.0, None));
    let mut stated = StatedProbe::default();
    (stated.probe.spacing, stated.probe.speed) = (2.0, 25.0);
    assert_eq!(header(Some(stated)), (2.0, 25.0, Some(stated.trained())));
}

#[test]
fn leaves_take_a_byte_where_two_would_hold_nothing_more_or_objects_are_many() {
    let of = |leaf: f32| stump(500.0, [[leaf, -1.0], [-1.0, leaf]]);
    assert_eq!([of(0.3), of(0.25)].map(|ensemble| usual(&ensemble).leaf), [Leaf::I16, Leaf::I8]);
    let rows = Ensemble { inputs: Inputs::unnamed(2), ..of(0.25) };
    assert_eq!(usual(&rows), Settings::default());
    let many = |count: usize| Ensemble { objects: (0..count).map(|object| object.to_string()).collect(), ..of(0.3) };
    assert_eq!([many(50), many(51)].map(|ensemble| usual(&ensemble).leaf), [Leaf::I16, Leaf::I8]);
}

#[test]
fn a_model_over_rows_states_nothing_of_touches() {
    let mut ensemble = Ensemble { inputs: Inputs::unnamed(2), ..stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]) };
    let plain = compile(&ensemble, &Settings::default()).unwrap().bytes;
    TouchOrigin { probe: Some(StatedProbe::default()), ..TouchOrigin::default() }.state(&mut ensemble.origin);
    assert_eq!(compile(&ensemble, &Settings::default()).unwrap().bytes, plain);
}

#[test]
fn estimates_from_a_models_bytes_are_those_of_its_compilation() {
    let trees: Vec<Vec<Node>> = (1..8).map(|splits| chain(splits, |number| number % 2)).collect();
    let many: Vec<Vec<Node>> = (1..8).map(|splits| chain(splits, |number| number % 8)).collect();
    let some: Vec<Vec<Node>> = (1..8).map(|splits| chain(splits, |number| number % 4)).collect();
    let kinds = [(Descriptor::Curvature, trees), (Descriptor::Oriented, many), (Descriptor::ContactsCurvature, some)];
    for (descriptor, trees) in kinds {
        let ensemble = ensemble(descriptor, trees);
        for &leaf in Leaf::ALL {
            let compiled = compile(&ensemble, &with!(Settings::default(), leaf)).unwrap();
            let model = open(&compiled.bytes).unwrap();
            assert_eq!(Instructions::of_model(&model), compiled.instructions, "{leaf:?}");
        }
    }
}

#[test]
fn what_is_read_from_a_model_is_found_behind_its_optional_sections() {
    let trees = (1..8).map(|splits| chain(splits, |number| number % 2)).collect();
    let ensemble = ensemble(Descriptor::Curvature, trees);
    let compiled = |probe| {
        let mut ensemble = ensemble.clone();
        TouchOrigin { probe, ..TouchOrigin::default() }.state(&mut ensemble.origin);
        compile(&ensemble, &Settings::default()).unwrap()
    };
    let [plain, stated] = [None, Some(StatedProbe::default())].map(compiled);
    assert!(stated.bytes.len() > plain.bytes.len());
    let [plain, stated] = [&plain, &stated].map(|compiled| open(&compiled.bytes).unwrap());
    assert_eq!(Instructions::of_model(&stated), Instructions::of_model(&plain));
    assert_eq!(longest_time(&stated), longest_time(&plain));
}

#[test]
fn the_longest_time_is_that_of_ten_units_or_follows_larger_thresholds() {
    let longest = |threshold: f32| {
        let compiled = compile(&stump(threshold, [[1.0, -1.0], [-1.0, 1.0]]), &Settings::default()).unwrap();
        longest_time(&open(&compiled.bytes).unwrap())
    };
    assert!((longest(500_000.0) - (10.0 * 3.0_f64.sqrt() + 3.0) / 10.0).abs() < 1e-9);
    assert!((longest(-16_000_000.0) - 64.0).abs() < 1e-9, "{}", longest(-16_000_000.0));
}

#[test]
fn models_and_ensembles_are_read_as_models_and_anything_else_is_refused_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let ensemble = stump(20_000.0, [[0.123_456_7, -0.5], [-0.5, 0.5]]);
    ensemble.save(path("ensemble.json")).unwrap();
    let compiled = compile(&ensemble, &Settings::default()).unwrap();
    std::fs::write(path("model"), &compiled.bytes).unwrap();
    assert_eq!(read_any(path("model")).unwrap().bytes(), compiled.bytes);
    let read = read_any(path("ensemble.json")).unwrap();
    assert_eq!(read.bytes(), exact(&ensemble).unwrap().bytes());
    assert_eq!((read.model().leaf_type(), read.path()), (Leaf::F32, Some(&*path("ensemble.json"))));
    std::fs::write(path("truncated"), &compiled.bytes[..compiled.bytes.len() - 1]).unwrap();
    std::fs::write(path("empty"), b"").unwrap();
    // More thresholds than a model can have: it is an ensemble, and no model.
    let many = (0..264).map(|tree| chain(250, |_| 0).into_iter().map(move |node| shifted(node, tree)).collect());
    self::ensemble(Descriptor::Curvature, many.collect()).save(path("large")).unwrap();
    for bad in ["truncated", "empty", "missing", "large"] {
        let error = read_any(path(bad)).err().unwrap();
        assert!(error.to_string().contains(bad) && error.exit_code() == 1, "{error}");
    }
    let error = read_any(path("large")).unwrap_err();
    assert_eq!(error.what(), "the ensemble has 66000 different thresholds, and a model can have 65,536");
}

/// A split at a threshold that no other tree's chain has.
fn shifted(node: Node, tree: usize) -> Node {
    match node {
        Node::Split { feature, threshold, missing_left, left, right } => {
            Node::Split { feature, threshold: threshold + tree as f32, missing_left, left, right }
        }
        leaf @ Node::Leaf(_) => leaf,
    }
}
