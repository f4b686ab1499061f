//! Files that other libraries wrote, with their own margins: `tests/data/import`.

use crate::fixtures::{
    FIXTURES, Fixture, assert_says, directory, files, fixture, leaf, of_one_value, parsed, predicted, split,
};
use palpate_base::with;
use palpate_trees::compile::{self, Leaf, Settings};
use palpate_trees::ensemble::import::Options;
use palpate_trees::ensemble::{Ensemble, Node, Threshold};
use palpate_trees::prove::prove;
use palpate_trees::rows::{self, Encoder, Features, Rows, columns_of, scales};
use palpate_trees::shared::format::f32_key;
use palpate_trees::verify::predict::{Predicted, predict};
use palpate_trees::verify::{Library, verify};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

fn compiled(ensemble: &Ensemble, leaf: Leaf) -> Vec<u8> {
    compile::compile(ensemble, &with!(Settings::default(), leaf)).unwrap().bytes
}

fn best(margins: &[f64]) -> usize {
    (0..margins.len()).fold(0, |best, object| if margins[object] > margins[best] { object } else { best })
}

#[test]
fn margins_are_the_librarys_own_on_plain_tied_and_missing_rows() {
    let mut exact = 0;
    for fixture in FIXTURES.iter() {
        let (name, ensemble, expected) = (&fixture.name, &fixture.ensemble, &fixture.margins);
        // Numbers that f32 does not hold.
        if name.ends_with("-seconds") {
            continue;
        }
        assert_eq!(ensemble.inputs.count(), 4, "{name}");
        let (rows, rounding) = (fixture.singles(), fixture.rounding());
        assert!(rows.len() == expected.len() && rows.len() >= 40, "{name}: {} rows", rows.len());
        let is_exact = name.starts_with("xgboost");
        let largest = expected.iter().flatten().fold(0.0, |most: f64, margin| most.max(margin.abs()));
        assert!(rounding < 1e-5 * largest.max(1.0) && is_exact == (rounding == 0.0), "{name}: {rounding}");
        for (number, (row, expected)) in rows.iter().zip(expected).enumerate() {
            let margins: Vec<f64> = ensemble.margins_of_features(row).into_iter().map(f64::from).collect();
            // A binary model has one column in the file: the score of its second class.
            let own = if margins.len() == 2 && expected.len() == 1 { &margins[1..] } else { &margins };
            assert_eq!(own.len(), expected.len(), "{name}");
            for (own, expected) in own.iter().zip(expected) {
                let is_same =
                    if is_exact { *own == f64::from(*expected as f32) } else { (own - expected).abs() <= rounding };
                assert!(is_same, "{name}, row {number}: {own} instead of {expected} ({rounding:e})");
            }
            if expected.len() > 1 {
                assert_eq!(best(&margins), best(expected), "{name}, row {number}: the class");
            }
        }
        exact += usize::from(is_exact);
    }
    assert!(exact > 20);
}

#[test]
fn what_is_saved_as_xgboosts_json_has_the_same_margins_bit_for_bit() {
    let place = tempfile::tempdir().unwrap();
    let mut objectives = BTreeMap::<String, usize>::new();
    for fixture in FIXTURES.iter() {
        let (name, ensemble) = (&fixture.name, &fixture.ensemble);
        let saved = place.path().join("saved.json");
        ensemble.save(&saved).unwrap();
        let again = Ensemble::load(&saved).unwrap();
        assert_eq!((&again.inputs, &again.objects), (&ensemble.inputs, &ensemble.objects), "{name}");
        for row in fixture.singles() {
            let bits = |ensemble: &Ensemble| ensemble.margins_of_features(&row).into_iter().map(f32::to_bits).collect();
            let (own, expected): (Vec<u32>, Vec<u32>) = (bits(&again), bits(ensemble));
            assert_eq!(own, expected, "{name}: {row:?}");
        }
        // What XGBoost itself decides on margins by; `reopen.py` there compares its own.
        let document: serde_json::Value = serde_json::from_slice(&std::fs::read(&saved).unwrap()).unwrap();
        let objective = document["learner"]["objective"]["name"].as_str().unwrap();
        *objectives.entry(objective.to_owned()).or_default() += 1;
        let expected = match ensemble.objects.len() {
            1 => objective == "reg:squarederror",
            _ if ensemble.prediction().targets => objective == "reg:squarederror",
            2 => objective.starts_with("binary:") || objective == "multi:softprob",
            _ => objective == "multi:softprob",
        };
        assert!(expected, "{name}: {objective}");
    }
    println!("{objectives:?}");
    assert!(objectives.len() == 4 && objectives.values().sum::<usize>() > 40, "{objectives:?}");
}

/// A generator of numbers: xorshift.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % limit as u64).unwrap()
    }
}

#[test]
fn damaged_files_are_refused_or_are_sound_and_never_panic() {
    let mut numbers = Numbers(0x9e37_79b9_7f4a_7c15);
    for path in files() {
        let whole = std::fs::read(&path).unwrap();
        // Each file with CatBoost's hashes of categories takes a search among all categories.
        let has_hashes = path.to_str().unwrap().contains("catboost-1.2-one-hot");
        for mutant in 0..if has_hashes { 10 } else { 150 } {
            let mut bytes = whole.clone();
            for _ in 0..=numbers.below(3) {
                let at = numbers.below(bytes.len());
                match mutant % 5 {
                    0 => bytes.truncate(at.max(1)),
                    1 => bytes[at] = bytes[at].wrapping_add(1),
                    2 => bytes[at] = numbers.below(256) as u8,
                    3 => {
                        // A digit, so that counts and children change.
                        let digits = bytes.iter().enumerate().skip(at).find(|(_, byte)| byte.is_ascii_digit());
                        if let Some((at, _)) = digits {
                            bytes[at] = b'0' + numbers.below(10) as u8;
                        }
                    }
                    _ => {
                        let from = numbers.below(bytes.len());
                        let piece = bytes[from..bytes.len().min(from + 40)].to_vec();
                        bytes.splice(at..at, piece);
                    }
                }
            }
            if let Ok(ensemble) = parsed("mutant", &bytes) {
                ensemble.check().unwrap();
                ensemble.margins_of_features(&vec![0.5; ensemble.inputs.count()]);
            }
        }
    }
}

#[test]
fn counts_and_nesting_without_end_are_refused_soon() {
    let huge = "9".repeat(30);
    for text in [
        "[".repeat(1_000_000),
        format!("{{\"learner\":{}", "{\"a\":".repeat(100_000)),
        format!("tree\nnum_tree_per_iteration={huge}\nmax_feature_idx=1\nend of trees\n"),
        format!("tree\nnum_tree_per_iteration=1\nmax_feature_idx={}\nend of trees\n", u64::MAX),
        "tree\nnum_tree_per_iteration=1\nmax_feature_idx=0\nfeature_names=a\nTree=0\nnum_leaves=99999999999\n\
         leaf_value=1\nend of trees\n"
            .to_owned(),
    ] {
        assert!(parsed("endless", text.as_bytes()).is_err());
    }
    // A field whose length is beyond the file.
    assert!(parsed("endless", b"\x08\x0a\x3a\xff\xff\xff\xff\x7f").is_err());
}

/// A LightGBM file of one tree with one split.
fn stump(threshold: &str, decision: u8) -> Ensemble {
    let text = format!(
        "tree\nversion=v4\nnum_class=1\nnum_tree_per_iteration=1\nlabel_index=0\nmax_feature_idx=0\n\
         objective=regression\nfeature_names=a\n\nTree=0\nnum_leaves=2\nnum_cat=0\nsplit_feature=0\n\
         threshold={threshold}\ndecision_type={decision}\nleft_child=-1\nright_child=-2\nleaf_value=1 2\n\nend of trees\n"
    );
    parsed("stump", text.as_bytes()).unwrap()
}

#[test]
fn lightgbms_zeros_and_missing_values_go_where_lightgbm_sends_them() {
    // What LightGBM does: everything within ZERO of 0 is read as 0.
    const ZERO: f32 = 1e-35;
    let goes_left = |threshold: f64, decision: u8, x: f32| {
        let x = if x.abs() <= ZERO { 0.0 } else { f64::from(x) };
        let (default_left, missing) = (decision & 2 != 0, decision >> 2);
        let x = if x.is_nan() && missing != 2 { 0.0 } else { x };
        if (missing == 1 && x == 0.0) || x.is_nan() { default_left } else { x <= threshold }
    };
    let values = [0.0, -0.0, ZERO, -ZERO, ZERO.next_up(), (-ZERO).next_down(), 1e-40, 0.5, -0.5, 1.5, -1.5, f32::NAN];
    let infinite = [f32::INFINITY, f32::NEG_INFINITY];
    for threshold in
        ["inf", "-inf", "0", "1.0000000180025095e-35", "-1.0000000180025095e-35", "0.5", "-0.5", "1e-40", "1e300"]
    {
        for decision in [0, 2, 4, 6, 8, 10] {
            let ensemble = stump(threshold, decision);
            for x in values.into_iter().chain(infinite) {
                let expected = if goes_left(threshold.parse().unwrap(), decision, x) { 1.0 } else { 2.0 };
                let margins = ensemble.margins_of_features(&[x]);
                assert_eq!(margins, [expected], "{x:e} at {threshold}, decision type {decision}");
            }
        }
    }
}

#[test]
fn classes_and_values_are_the_librarys_own_predictions_for_every_link() {
    let mut counts = [0; 2];
    // Numbers that f32 does not hold have a test of their own.
    for fixture in
        FIXTURES.iter().filter(|fixture| !fixture.predictions.is_empty() && !fixture.name.ends_with("-seconds"))
    {
        let Fixture { name, ensemble, rows, predictions: said, .. } = fixture;
        for leaf in [Leaf::F32, Leaf::I16, Leaf::I8] {
            let compiled = compile::compile(ensemble, &with!(Settings::default(), leaf)).unwrap();
            let model = compile::open(&compiled.bytes).unwrap();
            let library = Library { margins: Some(&fixture.margins), values: Some(said) };
            let verified = verify(&model, ensemble, rows, library, &()).unwrap();
            match verified.check() {
                // Leaves of 8 bits may be too coarse, which is said.
                Err(error)
                    if error.what().starts_with("the library predicts other values")
                        && leaf == Leaf::I8
                        && !compiled.notes.is_empty() => {}
                checked => checked.unwrap_or_else(|problem| panic!("{name}, {leaf:?}: {problem}")),
            }
            assert!(leaf == Leaf::I8 || compiled.notes.is_empty(), "{name}, {leaf:?}: {:?}", compiled.notes);
            let is_value = verified.library_max_value_error.is_some();
            counts[usize::from(is_value)] += 1;
            if leaf == Leaf::F32 {
                assert_eq!(verified.library_values_differ, Some(0), "{name}");
            }
        }
        // The same of the file's own trees.
        match predicted(ensemble, &rows.values) {
            Predicted::Values(values) => {
                let expected = said.iter().flatten().map(|text| text.parse::<f64>().unwrap());
                let largest = expected.clone().fold(0.0, |most: f64, value| most.max(value.abs()));
                assert_eq!(values.len(), expected.clone().count(), "{name}");
                for (value, expected) in values.into_iter().zip(expected) {
                    assert!((f64::from(value) - expected).abs() <= 3e-6 * largest, "{name}: {value}, {expected}");
                }
            }
            Predicted::Classes(classes) => {
                let own: Vec<&String> = classes.iter().map(|&class| &ensemble.objects[class]).collect();
                assert_eq!(own, said.iter().flatten().collect::<Vec<_>>(), "{name}");
            }
        }
    }
    assert!(counts[0] >= 3 * 50 && counts[1] >= 3 * 20, "{counts:?}");
}

#[test]
fn another_class_or_value_than_the_librarys_is_found_with_its_row() {
    let of = |name: &str| {
        let Fixture { ensemble, rows, predictions, .. } = fixture(name);
        (compiled(ensemble, Leaf::F32), ensemble, rows, predictions.clone())
    };
    for (name, changed, expected) in [
        ("lightgbm-4.7-forest-regression", "1234.5", "the library predicts other values for 1 rows"),
        ("lightgbm-4.7-binary", "other", "the prediction \"other\" of row 3 is none of the model's classes: 0, 1"),
        ("xgboost-3.2-reg-gamma", "much", "the prediction \"much\" of row 3 is no number"),
    ] {
        let (bytes, ensemble, rows, mut said) = of(name);
        let model = compile::open(&bytes).unwrap();
        said[2] = vec![changed.into()];
        let with = |said: &[Vec<String>]| {
            let library = Library { margins: None, values: Some(said) };
            verify(&model, ensemble, rows, library, &()).and_then(|verified| verified.check())
        };
        let error = with(&said).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("row 3"), "{name}: {error}");
        assert_says(with(&said[1..]).unwrap_err(), &["it has predictions of 59 rows, but there are 60 rows"]);
        said[4].push("1".into());
        said[2] = said[3].clone();
        assert_says(with(&said).unwrap_err(), &["row 5 has 2 predictions, where 1 is needed"]);
    }
    // Another class, which no rounding of XGBoost's own sums explains.
    let (bytes, ensemble, rows, mut said) = of("xgboost-3.2-binary");
    said[7][0] = if said[7][0] == "0" { "1".into() } else { "0".into() };
    let library = Library { margins: None, values: Some(&said) };
    let model = compile::open(&bytes).unwrap();
    let verified = verify(&model, ensemble, rows, library, &()).unwrap();
    assert_eq!((verified.library_values_differ, verified.library_values_unexplained), (Some(1), Some(1)));
    assert_says(verified.check().unwrap_err(), &["1 rows get another class", "the first is row 8"]);
}

#[test]
fn posteriors_of_averaged_forests_and_steeper_logistic_functions_are_the_librarys_probabilities() {
    let mut seen = 0;
    for name in ["forest", "forest-multiclass", "sigmoid"] {
        let fixture = fixture(&format!("lightgbm-4.7-{name}"));
        assert!(fixture.ensemble.origin.imported.as_ref().unwrap().notes.is_empty(), "{name}");
        let bytes = compiled(&fixture.ensemble, Leaf::F32);
        let model = compile::open(&bytes).unwrap();
        for (row, shares) in fixture.singles().iter().zip(&fixture.probabilities) {
            let keys: Vec<i32> = row.iter().map(|&value| f32_key(value)).collect();
            let mut margins = vec![0.0; model.object_count()];
            assert!(model.f32_margins_of(&keys, &mut margins));
            // What a recognizer makes posteriors of: margins without the scale that makes the library's of them.
            let powers: Vec<f64> = margins.iter().map(|margin| f64::from(*margin).exp()).collect();
            let all: f64 = powers.iter().sum();
            let expected = match shares[..] {
                [second] => vec![1.0 - second, second],
                _ => shares.clone(),
            };
            for (power, expected) in powers.iter().zip(expected) {
                assert!((power / all - expected).abs() < 1e-6, "{name}: {} instead of {expected}", power / all);
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 60 * 7);
}

#[test]
fn a_catboost_model_with_another_probability_threshold_is_refused_by_name() {
    let text = std::fs::read_to_string(directory().join("catboost-1.2-binary.json")).unwrap();
    let with = |threshold: &str| {
        let about = format!("\"model_info\":{{\"binclass_probability_threshold\":{threshold},");
        let text = text.replacen("\"model_info\":{", &about, 1);
        parsed("model.json", text.as_bytes())
    };
    for threshold in ["\"0.5\"", "0.5", "null"] {
        assert!(with(threshold).is_ok(), "{threshold}");
    }
    for threshold in ["\"0.8\"", "0.25", "\"most\""] {
        let error = with(threshold).unwrap_err();
        assert_says(error, &["model.json: it has the probability threshold ", "set_probability_threshold(0.5)"]);
    }
}

#[test]
fn tied_votes_of_a_forest_go_to_the_class_that_the_library_takes() {
    for (name, ties) in [("sklearn-1.9-ties", 20), ("sklearn-1.9-ties-three", 5)] {
        let Fixture { ensemble, rows, margins: shares, predictions, .. } = fixture(name);
        let expected: Vec<usize> = predictions.iter().flatten().map(|class| class.parse().unwrap()).collect();
        let is_tie = |shares: &&Vec<f64>| match shares[..] {
            [second] => second == 0.5,
            _ => shares.iter().filter(|share| **share == shares[best(shares)]).count() > 1,
        };
        assert!(shares.iter().filter(is_tie).count() >= ties, "{name}");
        // Whole votes fit every type of leaf.
        for leaf in [Leaf::F32, Leaf::I16, Leaf::I8] {
            let bytes = compiled(ensemble, leaf);
            let model = compile::open(&bytes).unwrap();
            let classes = predict(&model, &rows.values, 4, false).unwrap();
            assert_eq!(classes, Predicted::Classes(expected.clone()), "{name}, {leaf:?}");
        }
    }
}

#[test]
fn whole_numbers_that_f32_does_not_hold_are_compared_as_lightgbm_does_where_they_have_a_scale() {
    let Fixture { ensemble, rows, margins, .. } = fixture("lightgbm-4.7-seconds");
    let expected: Vec<usize> = margins.iter().flatten().map(|margin| usize::from(*margin > 0.0)).collect();
    let classes = |scales: Option<Vec<f32>>| {
        let settings = with!(Settings::default(), leaf = Leaf::F32, scales);
        let bytes = compile::compile(ensemble, &settings).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let Predicted::Classes(classes) = predict(&model, &rows.values, 4, false).unwrap() else { panic!("classes") };
        classes
    };
    assert_ne!(classes(None), expected, "f32 holds every 128th second");
    assert_eq!(classes(Some(vec![1e6, 1.0, 1.0, 1e6])), expected);
    let singles = scales::singles(ensemble);
    let [seconds] = &singles[..] else { panic!("{singles:?}") };
    assert_eq!((&*seconds.feature, seconds.scale), ("height", Some(1.0)));
    assert!(seconds.thresholds >= seconds.different + 3 && seconds.share > 1e-3, "{seconds:?}");
}

#[test]
fn zeros_that_are_missing_everywhere_make_no_tree_larger() {
    for name in ["zeros-missing-deep", "zero-as-missing"] {
        let fixture = fixture(&format!("lightgbm-4.7-{name}"));
        let text = String::from_utf8(fixture.bytes()).unwrap();
        let lines = text.lines().filter_map(|line| line.strip_prefix("num_leaves="));
        let leaves: Vec<usize> = lines.map(|count| count.parse().unwrap()).collect();
        let own =
            fixture.ensemble.trees.iter().map(|tree| tree.nodes.iter().filter(|node| node.leaf().is_some()).count());
        assert_eq!(own.collect::<Vec<_>>(), leaves, "{name}");
    }
}

#[test]
fn regressions_of_any_size_of_target_give_the_ensembles_own_bits() {
    let Fixture { ensemble, rows, .. } = fixture("lightgbm-4.7-regression");
    for factor in [1e-40_f32, 1e-30, 1e-12, 1e-3, 1.0, 4e3, 1e5, 1e12, 1e30] {
        let mut scaled = ensemble.clone();
        for node in scaled.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Leaf(values) = node {
                values.iter_mut().for_each(|value| *value *= factor);
            }
        }
        let imported = scaled.origin.imported.as_mut().unwrap();
        imported.rounding *= f64::from(factor);
        imported.exact = None;
        let bytes = compiled(&scaled, Leaf::F32);
        let model = compile::open(&bytes).unwrap();
        let full = predicted(&scaled, &rows.values);
        assert_eq!(predict(&model, &rows.values, 4, false).unwrap(), full, "{factor:e}");
        let bytes = compiled(&scaled, Leaf::I16);
        let model = compile::open(&bytes).unwrap();
        let (Predicted::Values(full), Predicted::Values(own)) =
            (full, predict(&model, &rows.values, 4, false).unwrap())
        else {
            panic!("values")
        };
        let largest = full.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        let worst = own.iter().zip(&full).fold(0.0_f32, |worst, (own, full)| worst.max((own - full).abs()));
        // Next to nothing only what the model states.
        let stated = f64::from(model.margin_error()) * f64::from(model.prediction().scale);
        let allowed = if factor < 1e-30 { stated } else { 1e-4 * f64::from(largest) };
        assert!(f64::from(worst) <= allowed, "{factor:e}: {worst:e} of {largest:e}");
    }
}

#[test]
fn training_that_stopped_early_gives_the_best_trees_or_all_and_says_so() {
    let path = directory().join("xgboost-3.2-early-stopping.json");
    let best = Ensemble::load(&path).unwrap();
    let all = Ensemble::load_with(&path, &Options { all_trees: true, ..Options::default() }).unwrap();
    assert!(best.trees.len() < all.trees.len());
    assert_eq!(best.trees, all.trees[..best.trees.len()]);
    for (ensemble, said) in [(&best, "up to the best iteration"), (&all, "as asked")] {
        let notes = &ensemble.origin.imported.as_ref().unwrap().notes;
        assert!(notes.iter().any(|note| note.contains(said)), "{notes:?}");
    }
}

/// A field of protocol buffers with bytes.
fn field(number: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len()).unwrap();
    [&[number << 3 | 2, (length & 0x7f) as u8 | 0x80, (length >> 7) as u8][..], content].concat()
}

/// An ONNX regressor of one leaf, whose margins start from these, as often as asked for.
fn onnx_regressor(base_values: &[f32], transform: &str, times: usize) -> Vec<u8> {
    let attribute = |name: &str, content: Vec<u8>| field(5, &[field(1, name.as_bytes()), content].concat());
    let integers = |name: &str, values: &[u8]| attribute(name, field(8, values));
    let floats = |name: &str, values: &[f32]| {
        attribute(name, field(7, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>()))
    };
    let node = [
        field(1, b"X"),
        field(2, b"Y"),
        field(4, b"TreeEnsembleRegressor"),
        integers("nodes_nodeids", &[0]),
        integers("nodes_treeids", &[0]),
        integers("nodes_featureids", &[0]),
        integers("nodes_truenodeids", &[0]),
        integers("nodes_falsenodeids", &[0]),
        attribute("nodes_modes", field(9, b"LEAF")),
        floats("nodes_values", &[0.0]),
        integers("target_ids", &[0]),
        integers("target_treeids", &[0]),
        integers("target_nodeids", &[0]),
        floats("target_weights", &[1.5]),
        floats("base_values", base_values),
        attribute("post_transform", field(4, transform.as_bytes())),
    ]
    .concat();
    let shape = field(2, &field(1, &[8, 1]));
    let input = [field(1, b"X"), field(2, &field(1, &shape))].concat();
    let graph = [field(1, &node).repeat(times), field(11, &input)].concat();
    [vec![8, 10], field(2, b"test"), field(7, &graph)].concat()
}

#[test]
fn an_onnx_regressor_that_starts_from_several_values_is_refused_and_is_no_classifier() {
    let of = |base: &[f32], transform: &str| parsed("m.onnx", &onnx_regressor(base, transform, 1));
    for base in [&[][..], &[0.5]] {
        let ensemble = of(base, "NONE").unwrap();
        assert_eq!(ensemble.margins_of_features(&[0.0]), [1.5 + base.iter().sum::<f32>()]);
    }
    let error = parsed("m.onnx", &onnx_regressor(&[], "NONE", 2)).unwrap_err();
    assert_says(error, &["it has 2 tree ensembles", "AdaBoost, Bagging"]);
    assert_says(of(&[0.5, 0.25], "NONE").unwrap_err(), &["base_values has 2 numbers for 1 target"]);
    let rows: [f32; 1] = [0.0];
    let Predicted::Values(values) = predicted(&of(&[], "LOGISTIC").unwrap(), &rows) else { panic!("a value") };
    assert!((values[0] - 0.817_574_5).abs() < 1e-6, "{values:?}");
}

#[test]
fn rows_for_models_with_categories_are_made_at_every_category_and_beside_it() {
    for fixture in FIXTURES.iter().filter(|fixture| fixture.is_categorical()) {
        let (name, ensemble) = (&fixture.name, &fixture.ensemble);
        let notes = &ensemble.origin.imported.as_ref().unwrap().notes;
        assert!(notes.iter().any(|note| note.starts_with("Categories are the numbers")), "{name}: {notes:?}");
        let around = |_: usize, threshold: Threshold| {
            let at = threshold.value as f32;
            [at.next_down(), at, at.next_up()].map(f64::from)
        };
        let mut seen = BTreeSet::new();
        rows::generate(ensemble, &[0.0; 4], around, |row| _ = seen.insert((row[2] as f32).to_bits()));
        let thresholds = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match node {
            Node::Split { feature: 2, threshold, .. } if threshold.is_finite() => Some(*threshold),
            _ => None,
        });
        for threshold in thresholds {
            assert!(seen.contains(&threshold.to_bits()) && seen.contains(&threshold.next_down().to_bits()), "{name}");
        }
    }
}

#[test]
fn categories_as_whole_numbers_of_a_scaled_model_go_where_the_library_sends_them() {
    let mut scaled = 0;
    for fixture in FIXTURES.iter().filter(|fixture| fixture.is_categorical()) {
        let (name, ensemble) = (&fixture.name, &fixture.ensemble);
        let scales = Some(vec![1e4, 1e4, 1.0, 1e4]);
        let settings = with!(Settings::default(), leaf = Leaf::F32, scales);
        // A threshold of CatBoost's for missing values is no whole number of units.
        let Ok(compile::Compiled { bytes, .. }) = compile::compile(ensemble, &settings) else { continue };
        scaled += 1;
        let model = compile::open(&bytes).unwrap();
        let encoder = Encoder::of(&model);
        let mut whole = 0;
        for mut row in fixture.singles() {
            // Away from thresholds of the other features, which fall together; a fraction would be rounded.
            for feature in [0, 1, 3] {
                row[feature] = (row[feature] * 7.0).round() / 7.0 + 0.013;
            }
            if row[2].fract() != 0.0 || row[2].abs() > 2e9 {
                continue;
            }
            whole += 1;
            let own: Vec<f32> =
                row.iter().enumerate().map(|(at, &x)| if at == 2 { x } else { (x * 1e4).round() / 1e4 }).collect();
            let mut margins = vec![0.0; model.object_count()];
            model.f32_margins_of(&encoder.row(&row), &mut margins);
            assert_eq!(margins, ensemble.margins_of_features(&own), "{name}: {row:?}");
        }
        assert!(whole > 60, "{name}: {whole} rows");
    }
    assert!(scaled >= 8, "{scaled} models");
}

#[test]
fn several_targets_are_values_with_names_and_no_classes() {
    let targets: Vec<&Fixture> = FIXTURES.iter().filter(|fixture| fixture.name.contains("-targets")).collect();
    assert!(targets.len() >= 5, "{}", targets.len());
    for Fixture { name, ensemble, .. } in targets {
        assert_eq!(ensemble.objects, ["target0", "target1", "target2"], "{name}");
        for leaf in [Leaf::F32, Leaf::I16] {
            let bytes = compiled(ensemble, leaf);
            let model = compile::open(&bytes).unwrap();
            assert!(model.prediction().targets, "{name}");
            assert!(!model.predict_each(&[0; 4], &mut [0; 2], &mut [0.0; 3]), "too little room");
        }
    }
}

/// Models that are proved and costed in every way, beside those that split by categories: of each library, kind of tree, and rule
/// for missing values.
const EVERY_WAY: [&str; 12] = [
    "catboost-1.2-lossguide",
    "catboost-1.2-max-missing",
    "catboost-1.2-targets-symmetrictree",
    "lightgbm-4.7-forest-gamma",
    "lightgbm-4.7-missing-alone",
    "lightgbm-4.7-seconds",
    "lightgbm-4.7-zeros-missing-deep",
    "onnx-opset5",
    "sklearn-1.9-forest",
    "xgboost-3.2-missing-0",
    "xgboost-3.2-vector-leaves",
    "xgboost-3.4-dart",
];

#[test]
fn every_model_is_proved_and_some_with_every_leaf_each_also_in_whole_units() {
    let mut counts = BTreeMap::new();
    for fixture in FIXTURES.iter() {
        let (name, ensemble) = (&fixture.name, &fixture.ensemble);
        let is_every = EVERY_WAY.contains(&name.as_str()) || fixture.is_categorical();
        for &leaf in if is_every { Leaf::ALL } else { &[Leaf::I16] } {
            for scales in [None, Some(scales::fit(ensemble, &fixture.rows))] {
                let is_scaled = scales.is_some();
                let of = || format!("{name}, {leaf:?}, in whole units: {is_scaled}");
                let compiled = match compile::compile(ensemble, &with!(Settings::default(), leaf, scales)) {
                    Ok(compiled) => compiled,
                    // One number stands for a missing value in every feature, of whatever scale.
                    Err(error) if is_scaled && error.to_string().contains("the same scale for all features") => {
                        continue;
                    }
                    Err(error) => panic!("{}: {error}", of()),
                };
                prove(&compiled.bytes, ensemble).unwrap_or_else(|error| panic!("{}: {error}", of()));
                let model = compile::open(&compiled.bytes).unwrap();
                let verified = verify(&model, ensemble, &fixture.rows, Library::default(), &()).unwrap();
                verified.check().unwrap_or_else(|problem| panic!("{}: {problem}", of()));
                *counts.entry((is_scaled, compiled.layout.name())).or_insert(0) += 1;
            }
        }
    }
    println!("{counts:?}");
    assert!(counts[&(false, "compact")] > 50 && counts[&(true, "compact")] > 40, "{counts:?}");
}

/// FNV-1a, 32 of its 64 bits.
fn checksum(bytes: &[u8]) -> u32 {
    let all =
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    all as u32
}

/// Checksums of every model, as they were. `PALPATE_GOLDENS=write` records them again, for a change that is
/// meant to change them.
#[test]
fn the_bytes_of_every_model_stay() {
    let mut text = String::new();
    for Fixture { name, ensemble, .. } in FIXTURES.iter() {
        let compiled = compile::compile(ensemble, &Settings::default()).unwrap();
        writeln!(text, "{name} {:08x}", checksum(&compiled.bytes)).unwrap();
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/trees/models.txt");
    if std::env::var_os("PALPATE_GOLDENS").is_some_and(|value| value == "write") {
        std::fs::write(&path, &text).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (found, expected) in text.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(text.lines().count(), expected.lines().count());
}

/// A fixture's rows, and for every split one of them at its threshold, one just below, and one without the feature.
fn rows_at_thresholds(fixture: &Fixture) -> Vec<Vec<f32>> {
    let mut rows = fixture.singles();
    let count = rows.len();
    let nodes = fixture.ensemble.trees.iter().flat_map(|tree| &tree.nodes);
    for (number, node) in nodes.enumerate() {
        if let &Node::Split { feature, threshold, .. } = node {
            for value in [threshold, threshold.next_down(), f32::NAN] {
                let mut row = rows[number % count].clone();
                row[feature] = value;
                rows.push(row);
            }
        }
    }
    rows
}

/// The checksum of a model's margins of these rows.
fn checksum_of_margins(bytes: &[u8], rows: &[Vec<f32>]) -> u32 {
    let model = compile::open(bytes).unwrap();
    let mut all = Vec::new();
    for row in rows {
        let keys: Vec<i32> = row.iter().map(|&value| f32_key(value)).collect();
        if model.leaf_type() == Leaf::F32 {
            let mut margins = vec![0.0; model.object_count()];
            assert!(model.f32_margins_of(&keys, &mut margins));
            all.extend(margins.iter().flat_map(|margin| margin.to_le_bytes()));
        } else {
            let mut margins = vec![0; model.object_count()];
            assert!(model.margins_of(&keys, &mut margins));
            all.extend(margins.iter().flat_map(|margin| margin.to_le_bytes()));
        }
    }
    checksum(&all)
}

/// Checksums of the margins of every model with leaves of each type, as they were in a layout of version 2, of complete trees.
/// `PALPATE_GOLDENS=write` records them again, for a change that is meant to change them.
#[test]
fn margins_of_every_model_stay_with_every_type_of_leaf() {
    let mut text = String::new();
    for fixture in FIXTURES.iter() {
        let rows = rows_at_thresholds(fixture);
        text += &fixture.name;
        for &leaf in Leaf::ALL {
            let margins = checksum_of_margins(&compiled(&fixture.ensemble, leaf), &rows);
            write!(text, " {margins:08x}").unwrap();
        }
        text.push('\n');
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/trees/margins.txt");
    if std::env::var_os("PALPATE_GOLDENS").is_some_and(|value| value == "write") {
        std::fs::write(&path, &text).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (found, expected) in text.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(text.lines().count(), expected.lines().count());
}

#[test]
fn trees_of_one_split_whose_thresholds_fall_together_in_whole_units_are_proved() {
    // More thresholds than a merged tree may have, and ten in tenths.
    let stumps = (0..300)
        .map(|number| vec![split(0, number as f32 / 300.0, 1, 2), leaf(&[0.01]), leaf(&[-0.01 * number as f32])]);
    let ensemble = of_one_value(1, stumps.collect());
    for scales in [None, Some(vec![10.0])] {
        let settings = with!(Settings::default(), scales);
        let bytes = compile::compile(&ensemble, &settings).unwrap().bytes;
        prove(&bytes, &ensemble).unwrap();
    }
}

/// LightGBM's text of a tree over this many columns that splits on two of them, with these names or none.
fn many_columns(columns: usize, name: impl Fn(usize) -> String) -> String {
    let names: Vec<String> = (0..columns).map(name).collect();
    format!(
        "tree\nversion=v4\nnum_class=1\nnum_tree_per_iteration=1\nlabel_index=0\nmax_feature_idx={}\n\
         objective=regression\nfeature_names={}\n\nTree=0\nnum_leaves=3\nnum_cat=0\nsplit_feature={} 7\n\
         threshold=0.5 2\ndecision_type=2 2\nleft_child=1 -1\nright_child=-2 -3\nleaf_value=1 2 3\n\nend of trees\n",
        columns - 1,
        names.join(" "),
        columns - 1
    )
}

#[test]
fn of_more_columns_than_a_model_can_have_those_that_are_used_are_stored_by_number_and_name() {
    let place = tempfile::tempdir().unwrap();
    for is_named in [true, false] {
        let name = |column: usize| if is_named { format!("sensor{column}") } else { format!("Column_{column}") };
        let text = many_columns(561, name);
        let ensemble = parsed("wide.txt", text.as_bytes()).unwrap();
        assert_eq!(ensemble.inputs.names(), [name(7), name(560)]);
        let compiled = compile::compile(&ensemble, &with!(Settings::default(), leaf = Leaf::F32)).unwrap();
        let model = compile::open(&compiled.bytes).unwrap();
        assert_eq!((model.feature_count(), columns_of(&model)), (2, Some((561, vec![7, 560]))));
        let features = Features::from(&model);
        assert_eq!(features, Features::from(&ensemble));
        // Rows of all columns by name, in another order; by number; without names; and of the two features.
        let value = |column: usize| match column {
            7 => "2.5",
            560 => "0.25",
            _ => "9",
        };
        let table = |columns: &mut dyn Iterator<Item = usize>, name: &dyn Fn(usize) -> String| {
            let columns: Vec<usize> = columns.collect();
            let header: Vec<String> = columns.iter().map(|&column| name(column)).collect();
            let row: Vec<&str> = columns.iter().map(|&column| value(column)).collect();
            format!("{}\n{}\n", header.join(","), row.join(","))
        };
        let numbered = |column: usize| column.to_string();
        let mut tables = vec![
            table(&mut (0..561).rev(), &name),
            table(&mut (0..561), &numbered),
            table(&mut [560, 7].into_iter(), &name),
        ];
        if !is_named {
            tables.push(table(&mut (0..561), &|column| format!("c{column}")));
        }
        for text in tables {
            let file = place.path().join("rows.csv");
            std::fs::write(&file, &text).unwrap();
            let rows = Rows::read(&file, &model, None).unwrap();
            assert_eq!(rows.values, [2.5, 0.25], "{}", &text[..60]);
        }
        let few = table(&mut (0..560), &|column| format!("c{column}"));
        std::fs::write(place.path().join("few.csv"), few).unwrap();
        let error = Rows::read(&place.path().join("few.csv"), &model, None).unwrap_err().to_string();
        let expected = if is_named {
            "no column is named sensor7, sensor560"
        } else {
            "560 columns for 2 features of the library's 561"
        };
        assert!(error.contains(expected), "{error}");
        // Proved against the same file; and XGBoost's JSON has all columns again.
        prove(&compiled.bytes, &ensemble).unwrap();
        let saved = place.path().join("saved.json");
        ensemble.save(&saved).unwrap();
        let document: serde_json::Value = serde_json::from_slice(&std::fs::read(&saved).unwrap()).unwrap();
        assert_eq!(document["learner"]["learner_model_param"]["num_feature"], "561");
        let again = Ensemble::load(&saved).unwrap();
        assert_eq!((&again.inputs, Features::from(&again)), (&ensemble.inputs, features));
        assert_eq!(again.margins_of_features(&[2.5, 0.25]), ensemble.margins_of_features(&[2.5, 0.25]));
    }
}

#[test]
fn an_xgboost_classifier_of_one_class_starts_where_xgboost_does_and_other_classifiers_of_one_are_refused() {
    let ensemble = &fixture("xgboost-3.2-one-class").ensemble;
    assert_eq!(ensemble.objects, ["0", "1"]);
    assert_eq!(ensemble.margins_of_features(&[0.0; 4]), [0.0, -13.815_51]);
    let text = std::fs::read_to_string(directory().join("xgboost-3.2-one-class.json")).unwrap();
    for (objective, base) in [("multi:softprob", None), ("count:poisson", Some("its base_score [0E0] is no margin"))] {
        let text = text.replace("binary:logistic", objective).replace("\"num_class\":\"0\"", "\"num_class\":\"1\"");
        assert_says(
            parsed("m.json", text.as_bytes()).unwrap_err(),
            &[base.unwrap_or("it has one class, and nothing to distinguish")],
        );
    }
}

#[test]
fn json_of_windows_is_read_and_xgboosts_settings_are_called_what_they_are() {
    let bytes = std::fs::read(directory().join("xgboost-3.2-binary.json")).unwrap();
    let marked = [&b"\xef\xbb\xbf"[..], &bytes].concat();
    let plain = parsed("m.json", &bytes).unwrap();
    assert_eq!(parsed("m.json", &marked).unwrap(), plain);
    let mut document: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    document["learner"]["gradient_booster"].as_object_mut().unwrap().remove("model");
    let error = parsed("m.json", document.to_string().as_bytes()).unwrap_err();
    assert_says(error, &["settings and no trees", "save_model"]);
}
