//! Files that other libraries wrote, with their own margins: `tests/data/import`.

use palpate::ensemble::import::read;
use palpate::ensemble::{Ensemble, Inputs};
use std::path::{Path, PathBuf};

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/import")
}

/// The models, in order.
fn models() -> Vec<PathBuf> {
    let is_model = |path: &PathBuf| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        matches!(extension, Some("json" | "ubj" | "txt" | "onnx"))
    };
    let entries = std::fs::read_dir(directory()).unwrap().map(|entry| entry.unwrap().path());
    let mut models: Vec<PathBuf> = entries.filter(is_model).collect();
    models.sort();
    assert!(models.len() > 40, "{} models", models.len());
    models
}

fn numbers<T: std::str::FromStr>(path: &Path, header: usize, missing: impl Fn() -> T) -> Vec<Vec<T>> {
    let text = std::fs::read_to_string(path).unwrap();
    let number =
        |cell: &str| if cell.is_empty() { missing() } else { cell.parse().unwrap_or_else(|_| panic!("{cell}")) };
    text.lines().skip(header).map(|line| line.split(',').map(number).collect()).collect()
}

fn best(margins: &[f64]) -> usize {
    (0..margins.len()).fold(0, |best, object| if margins[object] > margins[best] { object } else { best })
}

#[test]
fn margins_are_the_librarys_own_on_plain_tied_and_missing_rows() {
    let mut exact = 0;
    for path in models() {
        let name = path.file_stem().unwrap().to_str().unwrap();
        if name.ends_with("-categorical") || name.ends_with("-linear") {
            continue;
        }
        let ensemble = Ensemble::load(&path).unwrap_or_else(|error| panic!("{error}"));
        let Inputs::Rows(features) = &ensemble.inputs else { panic!("{name}") };
        assert_eq!(features.len(), 4);
        let rows: Vec<Vec<f32>> = numbers(&directory().join(format!("{name}.rows.csv")), 1, || f32::NAN);
        let expected: Vec<Vec<f64>> = numbers(&directory().join(format!("{name}.margins.csv")), 0, || f64::NAN);
        assert!(rows.len() == expected.len() && rows.len() >= 40, "{name}: {} rows", rows.len());
        let rounding = ensemble.origin.imported.as_ref().unwrap().rounding;
        let is_exact = name.starts_with("xgboost");
        assert!(rounding < 1e-5 && is_exact == (rounding == 0.0), "{name}: {rounding}");
        for (number, (row, expected)) in rows.iter().zip(&expected).enumerate() {
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
    let mut objectives = std::collections::BTreeMap::<String, usize>::new();
    for path in models() {
        let name = path.file_stem().unwrap().to_str().unwrap();
        // Those that are refused.
        let Ok(ensemble) = Ensemble::load(&path) else { continue };
        let saved = place.path().join("saved.json");
        ensemble.save(&saved).unwrap();
        let again = Ensemble::load(&saved).unwrap();
        assert_eq!((&again.inputs, &again.objects), (&ensemble.inputs, &ensemble.objects), "{name}");
        for row in numbers(&directory().join(format!("{name}.rows.csv")), 1, || f32::NAN) {
            let bits = |ensemble: &Ensemble| ensemble.margins_of_features(&row).into_iter().map(f32::to_bits).collect();
            let (own, expected): (Vec<u32>, Vec<u32>) = (bits(&again), bits(&ensemble));
            assert_eq!(own, expected, "{name}: {row:?}");
        }
        // What XGBoost itself decides on margins by; `reopen.py` there compares its own.
        let document: serde_json::Value = serde_json::from_slice(&std::fs::read(&saved).unwrap()).unwrap();
        let objective = document["learner"]["objective"]["name"].as_str().unwrap();
        *objectives.entry(objective.to_owned()).or_default() += 1;
        let expected = match ensemble.objects.len() {
            1 => objective == "reg:squarederror",
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
    for path in models() {
        let whole = std::fs::read(&path).unwrap();
        for mutant in 0..150 {
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
            if let Ok(ensemble) = read(Path::new("mutant"), &bytes, None) {
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
        assert!(read(Path::new("endless"), text.as_bytes(), None).is_err());
    }
    // A field whose length is beyond the file.
    assert!(read(Path::new("endless"), b"\x08\x0a\x3a\xff\xff\xff\xff\x7f", None).is_err());
}

/// A LightGBM file of one tree with one split.
fn stump(threshold: &str, decision: u8) -> Ensemble {
    let text = format!(
        "tree\nversion=v4\nnum_class=1\nnum_tree_per_iteration=1\nlabel_index=0\nmax_feature_idx=0\n\
         objective=regression\nfeature_names=a\n\nTree=0\nnum_leaves=2\nnum_cat=0\nsplit_feature=0\n\
         threshold={threshold}\ndecision_type={decision}\nleft_child=-1\nright_child=-2\nleaf_value=1 2\n\nend of trees\n"
    );
    read(Path::new("stump"), text.as_bytes(), None).unwrap()
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
    for threshold in ["0", "1.0000000180025095e-35", "-1.0000000180025095e-35", "0.5", "-0.5", "1e-40", "1e300"] {
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
