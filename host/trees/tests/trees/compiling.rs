//! Compiling by hand-made ensembles: layouts, exactness, what the header says, and what is refused.

use crate::fixtures::{assert_says, leaf, of_one_value, of_two_objects, split, stump};
use palpate_base::with;
use palpate_onboard::Stopping;
use palpate_trees::compile::{
    Compiled, CompiledModel, Layout, Leaf, Restated, Settings, compile, compile_within, names, open, restate,
};
use palpate_trees::ensemble::{Ensemble, Inputs, Node, Output, Tree};
use palpate_trees::error::{Error, Kind};
use palpate_trees::shared::format::f32_key;
use palpate_trees::shared::{Descriptor, MISSING_FEATURE};

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

fn settings_of(leaf: Leaf) -> Settings {
    with!(Settings::default(), leaf)
}

/// Error of an ensemble that is not compiled.
pub(crate) fn refusal(ensemble: &Ensemble, settings: &Settings) -> Error {
    compile(ensemble, settings).unwrap_err()
}

/// Name of the setting that was refused.
fn setting(settings: &Settings) -> &'static str {
    let error = compile(&stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]), settings).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    match error.kind() {
        Kind::Setting { name, .. } => name,
        other => panic!("{other:?}"),
    }
}

#[test]
fn trees_with_more_left_splits_than_a_byte_counts_take_the_wide_layout() {
    /// A full tree: 2^depth − 1 splits, then the leaves.
    fn full(depth: u32) -> Vec<Node> {
        let splits = 2_usize.pow(depth) - 1;
        let mut nodes: Vec<Node> =
            (0..splits).map(|n| split(n % 8, 1_000.0 * (n % 100) as f32, 2 * n + 1, 2 * n + 2)).collect();
        nodes.extend((0..=splits).map(|_| leaf(&[0.5, 0.25])));
        nodes
    }
    // 255 splits below the root's left side, then 511.
    for (depth, expected) in [(9, Layout::Compact), (10, Layout::Wide)] {
        let deep = of_two_objects(Descriptor::Oriented, vec![full(depth)]);
        assert_eq!(compile(&deep, &Settings::default()).unwrap().layout, expected);
    }
}

#[test]
fn models_of_300_leaves_300_columns_and_70_000_thresholds_compile_or_say_what_to_do() {
    /// A tree as shallow as can be, whose leaves are between the thresholds 1000, 2000 and so on.
    fn shallow(nodes: &mut Vec<Node>, from: usize, to: usize) {
        let (at, middle) = (nodes.len(), usize::midpoint(from, to));
        nodes.push(leaf(&[from as f32 / 300.0, -0.5]));
        if to - from > 1 {
            shallow(nodes, from, middle);
            let right = nodes.len();
            shallow(nodes, middle, to);
            nodes[at] = split(from % 8, 1_000.0 * middle as f32, at + 1, right);
        }
    }
    // More than 255 splits are to the left of the root; each feature has two columns, one for each side of a missing value.
    let mut nodes = vec![leaf(&[0.0, 0.0])];
    shallow(&mut nodes, 0, 300);
    let right = nodes.len();
    nodes.push(leaf(&[0.25, 0.75]));
    nodes[0] = split(0, 400_000.0, 1, right);
    let leaves = of_two_objects(Descriptor::Oriented, vec![nodes]);
    let mut columns = of_one_value(150, Vec::new());
    for feature in 0..150 {
        for missing_left in [true, false] {
            let root = Node::Split { feature, threshold: 0.5, missing_left, left: 1, right: 2 };
            let nodes = vec![root, split((feature + 1) % 150, 2.5, 3, 4), leaf(&[0.5]), leaf(&[0.25]), leaf(&[-0.5])];
            columns.trees.push(Tree { nodes, output: Output::One(0) });
        }
    }
    for ensemble in [leaves, columns] {
        let compiled = compile(&ensemble, &Settings::default()).unwrap();
        let model = open(&compiled.bytes).unwrap();
        let mut margins = vec![0; model.object_count()];
        for at in -1..310 {
            let row: Vec<f32> =
                (0..model.feature_count()).map(|feature| 1_000.0 * at as f32 + feature as f32).collect();
            let key = |&value: &f32| if ensemble.schema().is_some() { value as i32 } else { f32_key(value) };
            assert!(model.margins_of(&row.iter().map(key).collect::<Vec<_>>(), &mut margins));
            for (margin, own) in margins.iter().zip(ensemble.margins_of_features(&row)) {
                let error = (f64::from(*margin) * f64::from(model.unit()) - f64::from(own)).abs();
                assert!(error <= f64::from(model.margin_error()), "{error}");
            }
        }
    }
    let stumps = (0..70_000).map(|n| vec![split(n % 8, n as f32, 1, 2), leaf(&[0.01, 0.0]), leaf(&[0.0, 0.01])]);
    let refused = refusal(&of_two_objects(Descriptor::Oriented, stumps.collect()), &settings_of(Leaf::F32));
    assert_says(refused, &["the ensemble has 70000 different thresholds", "Round the features"]);
}

#[test]
fn the_stated_margin_error_is_what_rounding_does_and_no_more() {
    // Leaves that no power of two divides: i8 has 127 units for 1 nat.
    let leaves = [[1.0, -0.3], [0.123_456, 0.7]];
    let ensemble = stump(500.0, leaves);
    for (kind, most) in [(Leaf::I8, 127.0), (Leaf::I16, 32_767.0), (Leaf::F32, f64::INFINITY)] {
        let compiled = compile(&ensemble, &settings_of(kind)).unwrap();
        let model = open(&compiled.bytes).unwrap();
        let mut worst = 0.0_f64;
        for (curvature, leaf) in [(0, leaves[0]), (500, leaves[1])] {
            let mut margins = [0; 2];
            model.margins_of(&[curvature, curvature], &mut margins);
            for (margin, value) in margins.into_iter().zip(leaf) {
                worst = worst.max((f64::from(margin) * f64::from(model.unit()) - f64::from(value)).abs());
            }
        }
        let stated = f64::from(compiled.margin_error);
        assert_eq!(model.margin_error(), compiled.margin_error);
        assert!(worst <= stated, "{worst} > {stated} with {kind:?}");
        assert!(stated <= 0.5 / most * 1.01 || kind == Leaf::F32, "{stated} with {kind:?}");
        if kind != Leaf::F32 {
            assert!(worst > 0.0 && stated <= 1.001 * worst, "{stated} for {worst} with {kind:?}");
        }
    }
}

#[test]
fn sums_that_f32_rounds_are_not_stated_to_be_exact_where_no_leaf_is_rounded() {
    // Leaves of 127 times the unit, whose threefold has more digits than an f32.
    let value = 127.0 * 131_071.0 * 0.5_f32.powi(24);
    let tree = |feature| vec![split(feature, 500.0, 1, 2), leaf(&[value, -value]), leaf(&[-value, value])];
    for features in [[0, 0, 0], [0, 1, 2]] {
        let ensemble = of_two_objects(Descriptor::Oriented, features.map(tree).into());
        let compiled = compile(&ensemble, &settings_of(Leaf::I8)).unwrap();
        let model = open(&compiled.bytes).unwrap();
        let mut margins = [0; 2];
        model.margins_of(&[0; 8], &mut margins);
        let error = f64::from(margins[0]) * f64::from(model.unit()) - f64::from(value + value + value);
        assert!(error != 0.0 && error.abs() <= f64::from(compiled.margin_error), "{error} {}", compiled.margin_error);
    }
}

#[test]
fn leaves_of_a_common_power_of_two_are_exact_in_every_width() {
    for kind in [Leaf::I8, Leaf::I16] {
        let compiled = compile(&stump(500.0, [[1.5, -0.25], [0.75, 0.5]]), &settings_of(kind)).unwrap();
        assert_eq!(compiled.margin_error, 0.0);
    }
}

#[test]
fn the_header_says_what_was_compiled() {
    let mut ensemble = stump(500.0, [[1.0, -0.3], [0.1, 0.7]]);
    let settings = with!(Settings::default(), error_rate = 0.05, max_touches = 77, priors = Some(vec![1.0, 4.0]));
    let compiled = compile(&ensemble, &settings).unwrap();
    let model = open(&compiled.bytes).unwrap();
    let header = model.header();
    assert_eq!(usize::try_from(header.length()).unwrap(), compiled.bytes.len());
    assert_eq!((header.trees(), header.splits(), header.leaves()), (1, 1, 2));
    assert_eq!((compiled.splits, compiled.leaves), (1, 2));
    assert_eq!((model.descriptor(), model.layout()), (Some(Descriptor::Curvature), compiled.layout));
    assert_eq!(model.leaf_type(), Leaf::I16);
    assert_eq!(model.tool_version(), env!("CARGO_PKG_VERSION"));
    assert_eq!(names(&model), ["bowl", "fork"]);
    let stopping = Stopping::from_model(&model);
    assert!((stopping.error_rate() - 0.05).abs() < 1e-12 && stopping.max_touches() == 77);
    let prior = f64::from(model.prior(0)) * f64::from(model.unit());
    assert!((prior - 0.25_f64.ln()).abs() <= f64::from(model.unit()) && model.prior(1) == 0, "{prior}");
    // Which ensemble it was, wherever that came from.
    let hash = |ensemble: &Ensemble| open(&compile(ensemble, &settings).unwrap().bytes).unwrap().header().ensemble();
    let first = hash(&ensemble);
    ensemble.origin.attributes.insert("palpate_other".into(), "{}".into());
    assert_eq!(hash(&ensemble), first);
    ensemble.base_margins[0] = 0.25;
    assert_ne!(hash(&ensemble), first);
}

#[test]
fn objects_margins_depths_and_names_that_no_model_can_have_are_refused_by_what_is_wrong() {
    let refused = |change: fn(&mut Ensemble)| {
        let mut changed = stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]);
        change(&mut changed);
        refusal(&changed, &Settings::default())
    };
    let none: fn(&mut Ensemble) = |e| {
        e.objects.clear();
        e.base_margins.clear();
    };
    assert_says(refused(|e| e.objects.push("cup".into())), &["an ensemble of 3 objects and 2 base margins"]);
    assert_says(refused(none), &["an ensemble of 0 objects and 0 base margins"]);
    let too_deep = "cannot compile the ensemble: tree 0: it is deeper than 256 splits. Train it again";
    assert_says(refused(|e| e.trees[0].nodes = chain(257, |_| 0)), &[too_deep]);
    let too_large = refused(|e| e.trees[0].nodes[2] = leaf(&[0.0, 1e5]));
    assert_says(
        too_large,
        &["the margin of the object ", "(the largest single value is 1e5)", "beyond the 16384 that"],
    );
    let long = "x".repeat(256);
    assert_says(refused(|e| e.objects[0] = "x".repeat(256)), &[&format!("the name {long:?} is too long for a model")]);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    assert_eq!(setting(&with!(Settings::default(), error_rate = 0.5)), "error_rate");
    assert_eq!(setting(&with!(Settings::default(), error_rate = f64::NAN)), "error_rate");
    assert_eq!(setting(&with!(Settings::default(), max_touches = 0)), "max_touches");
    assert_eq!(setting(&with!(Settings::default(), priors = Some(vec![1.0]))), "priors");
    assert_eq!(setting(&with!(Settings::default(), priors = Some(vec![1.0, 0.0]))), "priors");
    // Features that a model computes are whole numbers already, and a row has a scale for each feature.
    assert_eq!(setting(&with!(Settings::default(), scales = Some(vec![1.0, 1.0]))), "scales");
}

#[test]
fn thresholds_that_fall_together_when_rounded_are_refused_by_their_feature() {
    // Trained on seconds: curvature from -0.2 to 0.2.
    let seconds: Vec<Vec<Node>> = (0..9)
        .map(|number| vec![split(0, number as f32 * 0.05 - 0.2, 1, 2), leaf(&[1.0, 0.0]), leaf(&[0.0, 1.0])])
        .collect();
    let refused = refusal(&of_two_objects(Descriptor::Curvature, seconds.clone()), &Settings::default());
    assert_says(
        refused,
        &["the threshold -0.2 of curvature is neither whole nor halfway between two, and of 9 thresholds 2 stay \
             different when rounded to whole units. Train on features in whole units: units. If it is not a model of things"],
    );
    // Rows of features are compared as they are, fractions and all.
    let rows = Ensemble { inputs: Inputs::unnamed(2), ..of_two_objects(Descriptor::Curvature, seconds) };
    compile(&rows, &with!(Settings::default(), leaf = Leaf::F32)).unwrap();
    for scales in [vec![1.0], vec![1.0, 0.0], vec![f32::NAN, 1.0]] {
        let error = compile(&rows, &with!(Settings::default(), scales = Some(scales))).unwrap_err();
        assert!(matches!(error.kind(), Kind::Setting { name: "scales", .. }), "{error}");
    }
    // Whole thresholds, and halves between neighbors, are what trainers put between whole numbers.
    for step in [1.0, 0.5] {
        let whole = (0..9).map(|n| vec![split(0, n as f32 * step, 1, 2), leaf(&[1.0, 0.0]), leaf(&[0.0, 1.0])]);
        compile(&of_two_objects(Descriptor::Curvature, whole.collect()), &Settings::default()).unwrap();
    }
}

#[test]
fn a_compiled_model_opens_in_one_place_and_says_what_is_wrong_at_which_byte() {
    let compiled = compile(&stump(500.0, [[1.0, -1.0], [-1.0, 1.0]]), &Settings::default()).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("model.palpate");
    std::fs::write(&path, &compiled.bytes).unwrap();
    let read = CompiledModel::read(&path).unwrap();
    assert_eq!((read.bytes(), read.path()), (&compiled.bytes[..], Some(&*path)));
    assert_eq!(read.names(), ["bowl", "fork"]);
    assert_eq!(read.model().checksum(), open(&compiled.bytes).unwrap().checksum());
    let cut = &compiled.bytes[..50];
    std::fs::write(&path, cut).unwrap();
    let error = CompiledModel::read(&path).unwrap_err();
    assert!(error.to_string().contains("model.palpate: byte 50: the model is truncated"), "{error}");
    for error in [error, CompiledModel::from_bytes(cut.to_vec()).unwrap_err(), open(cut).map(|_| ()).unwrap_err()] {
        assert_says(error, &["the model is truncated: 50 bytes of 96. Copy the model again"]);
    }
}

#[test]
fn what_fits_a_budget_is_as_exact_as_there_is_room_for() {
    let leaf_of = |compiled: &Compiled| open(&compiled.bytes).unwrap().leaf_type();
    let trees = (0..40).map(|i| vec![split(0, 10.0 * i as f32, 1, 2), leaf(&[0.7, -0.3]), leaf(&[-0.123, 0.456])]);
    let ensemble = of_two_objects(Descriptor::Oriented, trees.collect());
    let settings = settings_of(Leaf::F32);
    let [f32, i16, i8] =
        [Leaf::F32, Leaf::I16, Leaf::I8].map(|leaf| compile(&ensemble, &settings_of(leaf)).unwrap().bytes.len());
    assert!(f32 > i16 && i16 > i8);
    for (most, leaf) in
        [(usize::MAX, Leaf::F32), (f32, Leaf::F32), (f32 - 1, Leaf::I16), (i16 - 1, Leaf::I8), (i8, Leaf::I8)]
    {
        let compiled = compile_within(&ensemble, &settings, most).unwrap();
        assert!(compiled.bytes.len() <= most && leaf_of(&compiled) == leaf, "{most}");
    }
    let refused = compile_within(&ensemble, &settings, i8 - 1).unwrap_err();
    assert_says(refused, &[&format!("the model has {i8} bytes at least, more than the {} that fit", i8 - 1)]);
}

/// Trees of three splits over eight features, whose leaves are taken from the start of a sequence.
fn few_leaves(trees: usize, different: usize) -> Ensemble {
    let values = |number: usize| leaf(&[(number % different) as f32 / 1024.0, -((number % different) as f32) / 2048.0]);
    let tree = |tree: usize| {
        let at = |number: usize| 1_000.0 * ((7 * tree + number) % 90) as f32;
        let splits =
            [split(tree % 8, at(0), 1, 2), split((tree + 1) % 8, at(1), 3, 4), split((tree + 3) % 8, at(2), 5, 6)];
        splits.into_iter().chain((0..4).map(|number| values(4 * tree + number))).collect()
    };
    of_two_objects(Descriptor::Oriented, (0..trees).map(tree).collect())
}

#[test]
fn equal_leaves_stand_once_where_that_is_smaller_and_give_the_ensembles_margins() {
    let forest = few_leaves(100, 5);
    for &leaf in Leaf::ALL {
        let shared = compile(&forest, &settings_of(leaf)).unwrap();
        assert_eq!(shared.shared_leaves, Some(5), "{leaf:?}");
        let model = open(&shared.bytes).unwrap();
        let mut margins = [0; 2];
        for at in 0..50 {
            let mut row = [MISSING_FEATURE; 8];
            row[..2].copy_from_slice(&[2_600 * at, 1_200 * at]);
            assert!(model.margins_of(&row, &mut margins));
            for (margin, own) in margins.iter().zip(forest.margins_of_features(&row.map(|feature| feature as f32))) {
                let error = (f64::from(*margin) * f64::from(model.unit()) - f64::from(own)).abs();
                assert!(error <= f64::from(model.margin_error()), "{leaf:?}: {error}");
            }
        }
    }
    // Where all of them differ, a number is only more.
    assert_eq!(compile(&few_leaves(100, 400), &settings_of(Leaf::I16)).unwrap().shared_leaves, None);
}

#[test]
fn the_number_of_a_leaf_has_two_bytes_if_more_than_256_leaves_differ() {
    for (different, width) in [(256, 1), (257, 2)] {
        let compiled = compile(&few_leaves(100, different), &settings_of(Leaf::F32)).unwrap();
        assert_eq!(compiled.shared_leaves, Some(different));
        let model = open(&compiled.bytes).unwrap();
        assert_eq!(model.shared_leaves().unwrap().number_length(), width);
        assert_eq!(model.header().leaves_length(), 400 * width as u32);
    }
}

#[test]
fn what_is_restated_about_a_model_leaves_its_table_of_leaves_alone() {
    let compiled = compile(&few_leaves(20, 5), &Settings::default()).unwrap();
    assert_eq!(compiled.shared_leaves, Some(5));
    let restated = Restated { max_touches: Some(7), priors: Some(vec![0, -5]), ..Restated::default() };
    let bytes = restate(&open(&compiled.bytes).unwrap(), &restated).unwrap();
    let (model, own) = (open(&bytes).unwrap(), open(&compiled.bytes).unwrap());
    assert_eq!((model.shared_leaves(), model.header().max_touches(), model.prior(1)), (own.shared_leaves(), 7, -5));
}
