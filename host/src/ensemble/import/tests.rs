//! Files that other libraries wrote, with their own margins: `tests/data/import`.

use super::*;
use crate::ensemble::Inputs;
use std::path::PathBuf;

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
    let number = |cell: &str| if cell.is_empty() { missing() } else { cell.parse().unwrap_or_else(|_| panic!("{cell}")) };
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
                let is_same = if is_exact { *own == f64::from(*expected as f32) } else { (own - expected).abs() <= rounding };
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
