//! Models that other libraries wrote, each read once: `tests/data/import`.

use crate::table::cells;
use palpate_trees::Result;
use palpate_trees::ensemble::import::{Options, read};
use palpate_trees::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Schema, Tree};
use palpate_trees::onboard::predicted_value;
use palpate_trees::rows::Rows;
use palpate_trees::shared::Descriptor;
use palpate_trees::verify::predict::{Predicted, class_of};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::LazyLock;

/// A model that another library wrote.
pub(crate) struct Fixture {
    /// Name of its file, without the extension.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) ensemble: Ensemble,
    pub(crate) rows: Rows,
    pub(crate) margins: Vec<Vec<f64>>,
    /// Empty where the library was not asked, as are probabilities.
    pub(crate) predictions: Vec<Vec<String>>,
    pub(crate) probabilities: Vec<Vec<f64>>,
}

/// Files of models that no compiled model can be.
pub(crate) const REFUSED: [&str; 3] = ["catboost-1.2-one-hot-words", "catboost-1.2-statistics", "lightgbm-4.7-linear"];

/// The models that can be compiled, in the order of their names.
pub(crate) static FIXTURES: LazyLock<Vec<Fixture>> = LazyLock::new(|| {
    let all = files().into_iter().filter_map(Fixture::read).collect::<Vec<_>>();
    assert!(all.len() > 80, "{} models", all.len());
    all
});

/// Predictions of an ensemble's own trees, in f32.
pub(crate) fn predicted<V: Copy + Into<f64>>(ensemble: &Ensemble, values: &[V]) -> Predicted {
    let prediction = ensemble.prediction();
    let margins = values.chunks_exact(ensemble.inputs.count()).map(|row| {
        let row: Vec<f32> = row.iter().map(|&value| value.into() as f32).collect();
        ensemble.margins_of_features(&row)
    });
    if ensemble.objects.len() == 1 || prediction.targets {
        return Predicted::Values(margins.flatten().map(|margin| predicted_value(prediction, margin)).collect());
    }
    let class =
        |margins: Vec<f32>| class_of(&margins.into_iter().map(f64::from).collect::<Vec<_>>(), prediction.last_of_ties);
    Predicted::Classes(margins.map(class).collect())
}

/// The directory of the files.
pub(crate) fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/import")
}

/// Files of all models, in order.
pub(crate) fn files() -> Vec<PathBuf> {
    let is_model = |path: &PathBuf| {
        let extension = path.extension().and_then(|extension| extension.to_str());
        matches!(extension, Some("json" | "ubj" | "txt" | "onnx"))
    };
    let entries = std::fs::read_dir(directory()).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries.filter(is_model).collect();
    files.sort();
    files
}

/// The model with this name.
pub(crate) fn fixture(name: &str) -> &'static Fixture {
    FIXTURES.iter().find(|fixture| fixture.name == name).unwrap_or_else(|| panic!("{name}"))
}

fn numbers<T: FromStr>(table: &str, kind: &str) -> Vec<Vec<T>> {
    let number = |cell: &str| cell.parse().unwrap_or_else(|_| panic!("{cell}"));
    cells(table, kind).into_iter().map(|row| row.into_iter().map(number).collect()).collect()
}

impl Fixture {
    /// None for a file that is refused.
    fn read(path: PathBuf) -> Option<Self> {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        // The file does not say that zeros were missing.
        let missing = name.contains("missing-0").then_some(0.0);
        let read = Ensemble::load_with(&path, &Options { missing, ..Options::default() });
        assert_eq!(read.is_err(), REFUSED.contains(&name.as_str()), "{name}");
        let (ensemble, file) = (read.ok()?, directory().join(format!("{name}.csv")));
        let table = std::fs::read_to_string(&file).unwrap();
        let texts = |row: Vec<&str>| row.into_iter().map(String::from).collect();
        Some(Self {
            rows: Rows::read(&file, &ensemble, None).unwrap(),
            margins: numbers(&table, "margin"),
            predictions: cells(&table, "prediction").into_iter().map(texts).collect(),
            probabilities: numbers(&table, "probability"),
            name,
            path,
            ensemble,
        })
    }

    /// The content of its file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        std::fs::read(&self.path).unwrap()
    }

    /// Its rows as f32 values.
    pub(crate) fn singles(&self) -> Vec<Vec<f32>> {
        self.rows.iter().map(|row| row.iter().map(|&value| value as f32).collect()).collect()
    }

    /// The largest of the errors that rounding may make of a margin.
    pub(crate) fn rounding(&self) -> f64 {
        self.ensemble.origin.imported.as_ref().unwrap().rounding
    }

    /// True if it splits by categories.
    pub(crate) fn is_categorical(&self) -> bool {
        self.name.contains("-categorical") || self.name.contains("-one-hot")
    }
}

/// The model in a file of this name and content.
pub(crate) fn parsed(name: &str, bytes: &[u8]) -> Result<Ensemble> {
    read(Path::new(name), bytes, &Options::default())
}

/// Checks that an error says all of this.
#[track_caller]
pub(crate) fn assert_says(said: impl std::fmt::Display, parts: &[&str]) {
    let said = said.to_string();
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
}

/// A split that sends missing values to the left.
pub(crate) fn split(feature: usize, threshold: f32, left: usize, right: usize) -> Node {
    Node::Split { feature, threshold, missing_left: true, left, right }
}

pub(crate) fn leaf(values: &[f32]) -> Node {
    Node::Leaf(values.into())
}

/// An ensemble of these trees, which start from margins of 0.
fn of_trees(inputs: Inputs, objects: &[&str], output: Output, trees: Vec<Vec<Node>>) -> Ensemble {
    Ensemble {
        inputs,
        objects: objects.iter().map(ToString::to_string).collect(),
        base_margins: vec![0.0; objects.len()],
        trees: trees.into_iter().map(|nodes| Tree { nodes, output }).collect(),
        origin: Provenance::default(),
    }
}

/// An ensemble of two objects over these trees, whose leaves have a value for each.
pub(crate) fn of_two_objects(descriptor: Descriptor, trees: Vec<Vec<Node>>) -> Ensemble {
    of_trees(computed(descriptor).into(), &["bowl", "fork"], Output::Each, trees)
}

/// An ensemble of one value over rows of this many features.
pub(crate) fn of_one_value(features: usize, trees: Vec<Vec<Node>>) -> Ensemble {
    of_trees(Inputs::unnamed(features), &["value"], Output::One(0), trees)
}

/// One split of curvature between two objects.
pub(crate) fn stump(threshold: f32, leaves: [[f32; 2]; 2]) -> Ensemble {
    of_two_objects(Descriptor::Curvature, vec![vec![split(0, threshold, 1, 2), leaf(&leaves[0]), leaf(&leaves[1])]])
}

/// Schema of a descriptor's features, without planes.
pub(crate) fn computed(descriptor: Descriptor) -> Schema {
    Schema {
        code: descriptor.code(),
        name: descriptor.name(),
        features: descriptor.feature_names(),
        of: "things",
        whole: "whole units",
        units: "units",
        planes: &[],
        has_all_planes: false,
    }
}
