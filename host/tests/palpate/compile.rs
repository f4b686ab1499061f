use crate::fixtures::*;
use palpate::compile::{Instructions, Layout, Leaf, Settings, compile, longest_time, open};
use palpate::ensemble::inputs;
use palpate::error::CompileProblem;

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

fn with(layout: Option<Layout>, leaf: Leaf) -> Settings {
    with!(Settings::default(), layout, leaf)
}

fn refusal(ensemble: &Ensemble, settings: &Settings) -> CompileProblem {
    let error = compile(ensemble, settings).unwrap_err();
    error.problem::<CompileProblem>().unwrap_or_else(|| panic!("{error}")).clone()
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
fn a_model_over_rows_states_nothing_of_touches() {
    let mut ensemble = Ensemble { inputs: Inputs::unnamed(2), ..stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]) };
    let plain = compile(&ensemble, &Settings::default()).unwrap().bytes;
    TouchOrigin { probe: Some(StatedProbe::default()), ..TouchOrigin::default() }.state(&mut ensemble.origin);
    assert_eq!(compile(&ensemble, &Settings::default()).unwrap().bytes, plain);
}

#[test]
fn what_is_read_from_a_model_is_found_behind_its_optional_sections() {
    let trees = (1..8).map(|splits| chain(splits, |number| number % 2)).collect();
    let ensemble = ensemble(Descriptor::Curvature, trees);
    for &layout in Layout::OF_DATA {
        let compiled = |probe| {
            let mut ensemble = ensemble.clone();
            TouchOrigin { probe, ..TouchOrigin::default() }.state(&mut ensemble.origin);
            compile(&ensemble, &with(Some(layout), Leaf::I16))
        };
        let [Ok(plain), Ok(stated)] = [None, Some(StatedProbe::default())].map(compiled) else {
            continue;
        };
        assert!(stated.bytes.len() > plain.bytes.len());
        let instructions = plain.instructions;
        let [plain, stated] = [&plain, &stated].map(|compiled| open(&compiled.bytes).unwrap());
        assert_eq!([&stated, &plain].map(Instructions::of_model), [instructions; 2], "{layout:?}");
        assert_eq!(longest_time(&stated), longest_time(&plain), "{layout:?}");
    }
}

/// A tree over patterns and differences: a chain of splits, with a missing value to either side in turn.
fn chain_over_patterns(splits: usize, tree: usize) -> Vec<Node> {
    let mut nodes = Vec::new();
    for number in 0..splits {
        let feature = (number + tree) % 4;
        let threshold = if feature == 0 { (number % 6) as f32 } else { 500.0 * (number + tree) as f32 - 2_000.0 };
        let (left, right) = (2 * number + 1, 2 * number + 2);
        nodes.push(Node::Split { feature, threshold, missing_left: number % 3 == 0, left, right });
        nodes.push(leaf(&[0.5 - 0.015_625 * number as f32, 0.25 * (tree % 3) as f32]));
    }
    nodes.push(leaf(&[-0.5, 0.5]));
    nodes
}

/// Touches of every contact pattern, at thresholds of `chain_over_patterns` and elsewhere.
fn touches_of_every_pattern() -> Vec<Touch> {
    let some = ContactTime::from_micros;
    let times = [0, 1, 499, 500, 999, 1_000, 1_500, 2_999, 7_000, 40_000].map(some);
    let mut touches = vec![];
    for fingers in 0..8 {
        for first in times {
            for last in times {
                let of = |finger: u32, time| if fingers >> finger & 1 == 1 { time } else { ContactTime::MISSING };
                touches.push(Touch::new([of(0, first), of(1, some(0)), of(2, last)]));
            }
        }
    }
    touches
}

#[test]
fn tables_by_contact_pattern_give_the_ensembles_margins_for_touches_of_every_pattern() {
    for splits in [1, 7, 30] {
        let trees = (0..12).map(|tree| chain_over_patterns(splits, tree)).collect();
        let ensemble = ensemble(Descriptor::ContactsCurvature, trees);
        let [table, trees] = [Layout::Patterns, Layout::Compact]
            .map(|layout| compile(&ensemble, &with(Some(layout), Leaf::I16)).unwrap());
        // Leaves are whole multiples of a power of two: nothing is rounded in 16 bits.
        assert_eq!((table.margin_error, trees.margin_error), (0.0, 0.0));
        let bytes = compile(&ensemble, &with(Some(Layout::Patterns), Leaf::I8)).unwrap();
        assert!(bytes.margin_error < 0.1, "{}", bytes.margin_error);
        let floats = compile(&ensemble, &with(Some(Layout::Patterns), Leaf::F32)).unwrap();
        for touch in touches_of_every_pattern() {
            let full = ensemble.margins(&touch);
            for compiled in [&table, &trees, &bytes, &floats] {
                let model = open(&compiled.bytes).unwrap();
                let mut margins = vec![0; full.len()];
                assert!(model.margins(&touch, &mut margins));
                for (full, margin) in full.iter().zip(margins) {
                    let error = (f64::from(*full) - f64::from(margin) * f64::from(model.unit())).abs();
                    assert!(error <= f64::from(compiled.margin_error), "{error} for {touch:?}, {:?}", compiled.layout);
                }
            }
        }
    }
}

#[test]
fn a_table_for_each_contact_pattern_has_no_cell_that_no_touch_reaches() {
    // Thresholds: the pattern's below 3 and below 5, three of κ, two of slope and one of pair.
    let cuts = [(0, 3.0), (0, 5.0), (1, -7.0), (1, 0.0), (1, 9.0), (2, 4.0), (2, 8.0), (3, 2.0)];
    let trees = cuts.map(|(feature, cut)| vec![split(feature, cut, 1, 2), leaf(&[0.5, 0.25]), leaf(&[-0.5, 0.125])]);
    let ensemble = ensemble(Descriptor::ContactsCurvature, trees.into());
    let compiled = compile(&ensemble, &with(Some(Layout::Patterns), Leaf::I16)).unwrap();
    let model = open(&compiled.bytes).unwrap();
    assert_eq!(model.header().leaves_length(), 2 * 2 * (3 + 2 + 3 + 4 * 3));
    // Full touches are not what it is for, nor rows of features.
    let problem = CompileProblem::DoesNotFit { layout: Layout::Patterns };
    let rows = Ensemble { inputs: Inputs::unnamed(4), ..ensemble };
    assert_eq!(refusal(&rows, &with(Some(Layout::Patterns), Leaf::I16)), problem);
    assert_eq!(refusal(&stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]), &with(Some(Layout::Patterns), Leaf::I16)), problem);
}

#[test]
fn the_longest_time_is_that_of_ten_units_or_follows_larger_thresholds() {
    let longest = |threshold: f32, layout| {
        let compiled = compile(&stump(threshold, [[1.0, -1.0], [-1.0, 1.0]]), &with(Some(layout), Leaf::I16)).unwrap();
        longest_time(&open(&compiled.bytes).unwrap())
    };
    for layout in [Layout::Compact, Layout::Wide, Layout::Grid] {
        assert!((longest(500_000.0, layout) - (10.0 * 3.0_f64.sqrt() + 3.0) / 10.0).abs() < 1e-9);
        assert!((longest(-16_000_000.0, layout) - 64.0).abs() < 1e-9, "{}", longest(-16_000_000.0, layout));
    }
}
