//! Models of five kinds, calibrated on sequences of rows.

use palpate::compile::{self, Settings, compile};
use palpate::rows::{Encoder, RowSequence, Rows, Sequences, feature_names};
use palpate::stream;
use palpate::with;
use palpate_onboard::Model;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use std::path::{Path, PathBuf};

const IMPORT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/import");
/// Rows of a sequence.
const LENGTH: usize = 12;

/// The kinds: the file of each, and the text replaced in it.
const KINDS: [(&str, &str, Option<[&str; 2]>); 5] = [
    ("softmax", "xgboost-3.4-softprob.ubj", None),
    ("binary", "xgboost-3.4-binary.json", None),
    ("hinge", "xgboost-3.4-binary.json", Some(["binary:logistic", "binary:hinge"])),
    (
        "one against all",
        "lightgbm-4.7-multiclass.txt",
        Some(["=multiclass num_class:3", "=multiclassova num_class:3 sigmoid:1"]),
    ),
    ("votes of a forest", "sklearn-1.9-forest.onnx", None),
];

/// A calibrated model, and rows for it as it compares them.
pub struct Stream {
    /// Kind of the model.
    pub kind: &'static str,
    /// The model.
    pub bytes: Vec<u8>,
    /// The rows of sequences, one after the other.
    pub rows: Vec<Vec<i32>>,
}

/// A model of each kind, calibrated to at most 10 % of wrong names, and this many rows.
///
/// # Panics
/// If a file is not an ensemble, or a calibration fails.
pub fn streams(rows: usize) -> Vec<Stream> {
    let of = |(number, (kind, file, replaced)): (usize, (&'static str, &str, Option<[&str; 2]>))| {
        let path = Path::new(IMPORT).join(file);
        let directory = tempfile::tempdir().expect("a directory");
        let ensemble = match replaced {
            None => palpate::ensemble::load(&path),
            Some([old, new]) => {
                let text = std::fs::read_to_string(&path).expect("text");
                assert!(text.contains(old), "{file}");
                let changed: PathBuf = directory.path().join(file);
                std::fs::write(&changed, text.replace(old, new)).expect("a file");
                palpate::ensemble::load(&changed)
            }
        };
        let ensemble = ensemble.expect("an ensemble");
        let plain = compile(&ensemble, &with!(Settings::default(), max_touches = 9)).expect("a model").bytes;
        let model = compile::open(&plain).expect("a model");
        let csv = path.with_extension("csv");
        let names = feature_names(&model);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let table = Rows::read(&csv, &names, None).expect("rows");
        let mut rng = SmallRng::seed_from_u64(number as u64);
        let sequences = sequences(&model, &table, 900, &mut rng);
        let settings = with!(stream::Settings::default(), rate = 0.1);
        let bytes = stream::calibrate(&model, &sequences, &settings, &()).expect("a calibrated model").model;
        let more = self::sequences(&model, &table, rows.div_ceil(LENGTH), &mut rng);
        let encoder = Encoder::of(&model);
        let rows = more.values.chunks_exact(more.features).map(|row| encoder.row(row)).collect();
        Stream { kind, bytes, rows }
    };
    KINDS.into_iter().enumerate().map(of).collect()
}

/// Sequences of a table's rows, classes in turn: six of ten rows are such that the model itself takes for the class.
fn sequences(model: &Model<'_>, table: &Rows, count: usize, rng: &mut SmallRng) -> Sequences {
    let encoder = Encoder::of(model);
    let classes = model.object_count();
    let mut of_class: Vec<Vec<&[f64]>> = vec![Vec::new(); classes];
    let mut margins = vec![0; classes];
    for row in table.iter() {
        let class = model.predict_class(&encoder.row(row), &mut margins).expect("as many margins as classes");
        of_class[class].push(row);
    }
    let all: Vec<&[f64]> = table.iter().collect();
    let mut made = Sequences { features: table.features, ..Sequences::default() };
    for number in 0..count {
        let class = number % classes;
        let start = made.len();
        for _ in 0..LENGTH {
            let own = if rng.random_bool(0.6) && !of_class[class].is_empty() { &of_class[class] } else { &all };
            made.values.extend_from_slice(own[rng.random_range(0..own.len())]);
        }
        made.sequences.push(RowSequence { rows: start..start + LENGTH, class, group: None });
    }
    made
}
