//! Full models: trained here, or by other libraries.

use crate::arrays::{ArrayLike, Input, Output, columns, features, taken, two};
use crate::data::DataSet;
use crate::failure::Failure;
use crate::named::{descriptor_of, noise_of};
use crate::work::{Callback, long};
use numpy::ndarray::{Ix1, Ix2};
use palpate::ensemble::import::{Options, PartTree, Parts};
use palpate::ensemble::train::{self as library, Outputs, Settings};
use palpate::ensemble::{self, Inputs, Node, OverTouches, Probability, StatedProbe, Threshold};
use palpate::error::Error;
use palpate::evaluate::raw_features;
use palpate::rows::{Features, notes};
use palpate::shared::Descriptor;
use palpate::shared::format::{Counted, Link, Prediction};
use palpate::with;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Feature, threshold, and whether a value that equals it goes left, of each split.
type Splits = (Vec<usize>, Vec<f64>, Vec<bool>);

/// The full model: boosted trees in f32, from `train` or from another library.
///
/// >>> import palpate
/// >>> data = palpate.capture(["bowl", "mouse"], touches=300)
/// >>> ensemble = palpate.train(data, rounds=5)
/// >>> ensemble.objects, ensemble.features, ensemble.trees
/// (['bowl', 'mouse'], ['curvature', 'slope'], 5)
#[pyo3::pyclass(frozen, module = "palpate._native")]
pub(crate) struct Ensemble {
    pub(crate) ensemble: Arc<ensemble::Ensemble>,
    /// Labels of the classifier's classes, an array in their order.
    pub(crate) labels: Option<Py<PyAny>>,
}

impl From<ensemble::Ensemble> for Ensemble {
    fn from(ensemble: ensemble::Ensemble) -> Self {
        Self { ensemble: Arc::new(ensemble), labels: None }
    }
}

/// A tree as columns: output, left, right, feature, threshold, missing_left, values.
type Columns<'py> = (
    Option<usize>,
    Input<'py, i64, Ix1>,
    Input<'py, i64, Ix1>,
    Input<'py, i64, Ix1>,
    Input<'py, f64, Ix1>,
    Input<'py, bool, Ix1>,
    Input<'py, f64, Ix1>,
);

#[pyo3::pymethods]
impl Ensemble {
    /// Reads what `save` or `palpate train` wrote, or a model of XGBoost, LightGBM, CatBoost or ONNX; the content says
    /// which. `names` are the classes'. Where the file says that training stopped early, the trees up to the best
    /// iteration are taken, with `all_trees` all of them. `missing` is the number that stood for a missing value in
    /// training, beside NaN.
    #[staticmethod]
    #[pyo3(signature = (path, names=None, *, all_trees=false, missing=None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        names: Option<Vec<String>>,
        all_trees: bool,
        missing: Option<f32>,
    ) -> Result<Self, Failure> {
        let options = Options { names: names.as_deref(), all_trees, missing, ..Options::default() };
        Ok(py.detach(|| ensemble::load_with(&path, &options))?.into())
    }

    /// Reads the bytes of such a file. `notes` are facts about it that it does not state.
    #[staticmethod]
    #[pyo3(signature = (content, names=None, *, all_trees=false, missing=None, notes=Vec::new()))]
    fn from_bytes(
        py: Python<'_>,
        content: Vec<u8>,
        names: Option<Vec<String>>,
        all_trees: bool,
        missing: Option<f32>,
        notes: Vec<String>,
    ) -> Result<Self, Failure> {
        let options = Options { names: names.as_deref(), all_trees, missing, ..Options::default() };
        let mut ensemble = py.detach(|| ensemble::read(Path::new("the model"), &content, &options))?;
        if let Some(imported) = &mut ensemble.origin.imported {
            imported.notes.extend(notes);
        }
        Ok(ensemble.into())
    }

    /// An ensemble of trees in memory. Each tree is a tuple of columns with one entry per node: the output that its
    /// leaves are for (`None`: each leaf has a value for each output), the left child (where x <= threshold; negative in
    /// a leaf), the right child, the feature, the threshold, whether a missing value goes left, and the values. `base` is
    /// where margins start; an empty name stands for a feature that has none. `link` is "identity", "logistic",
    /// "exponential", "square" or "softplus": what makes a value of a margin. With `last_of_ties` the last of several
    /// largest margins names the class, otherwise the first. With `targets` each output is a value, and none is a class.
    /// `probability` is "softmax", "logistic", "shares" or "unknown": what makes probabilities of margins. With `compares_f64`
    /// the library compares values in f64, otherwise it rounds rows to f32 first.
    #[staticmethod]
    #[pyo3(signature = (kind, features, base, trees, *, names=None, notes=Vec::new(), link="identity", last_of_ties=false, targets=false, probability="softmax", compares_f64=false))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn from_trees(
        py: Python<'_>,
        kind: String,
        features: Vec<String>,
        base: Vec<f64>,
        trees: Vec<Columns<'_>>,
        names: Option<Vec<String>>,
        notes: Vec<String>,
        link: &str,
        last_of_ties: bool,
        targets: bool,
        probability: &str,
        compares_f64: bool,
    ) -> Result<Self, Failure> {
        let found = Link::ALL.iter().copied().find(|known| known.name() == link);
        let link =
            found.ok_or_else(|| Error::setting("link", link, "identity, logistic, exponential, square or softplus"))?;
        let probability = match probability {
            "softmax" => Probability::Softmax,
            "logistic" => Probability::Logistic,
            "shares" => Probability::Shares,
            "unknown" => Probability::Unknown,
            other => return Err(Error::setting("probability", other, "softmax, logistic, shares or unknown").into()),
        };
        let prediction = Prediction { link, last_of_ties, targets, ..Prediction::default() };
        let tree = |(output, left, right, feature, threshold, missing_left, values): Columns<'_>| {
            PyResult::Ok(PartTree {
                output,
                left: left.values()?.to_vec(),
                right: right.values()?.to_vec(),
                feature: feature.values()?.to_vec(),
                threshold: threshold.values()?.to_vec(),
                missing_left: missing_left.values()?.to_vec(),
                values: values.values()?.to_vec(),
            })
        };
        let trees = trees.into_iter().map(tree).collect::<PyResult<_>>()?;
        let parts =
            Parts { kind, features, names: Vec::new(), base, trees, notes, prediction, probability, compares_f64 };
        Ok(py.detach(|| parts.into_ensemble(names.as_deref()))?.into())
    }

    /// The feature and the threshold of each split, and whether a value that equals it goes left.
    fn _splits(&self) -> Result<Splits, Failure> {
        let imported = self.ensemble.origin.imported.as_ref();
        if imported.is_some_and(|imported| imported.sentinel.is_some() || imported.columns.is_some()) {
            let allowed = "a model of at most 256 columns in which NaN alone is missing";
            return Err(Error::setting("model", "a pipeline", allowed).into());
        }
        let mut splits = (Vec::new(), Vec::new(), Vec::new());
        for (tree, node, feature) in self.split_nodes() {
            let Some(Threshold { value, inclusive }) = self.ensemble.threshold(tree, node) else { continue };
            splits.0.push(feature);
            splits.1.push(value);
            splits.2.push(inclusive);
        }
        Ok(splits)
    }

    /// Copies the trees with other thresholds, in the order of `_splits`, and perhaps other names of features; values below them
    /// go left.
    #[pyo3(signature = (thresholds, names=None))]
    fn _with_thresholds(&self, thresholds: Vec<f32>, names: Option<Vec<String>>) -> Self {
        let (mut ensemble, mut notes) = ((*self.ensemble).clone(), Vec::new());
        if let Some(names) = names.filter(|names| names.len() == ensemble.inputs.count()) {
            ensemble.inputs = Inputs::named(names, &mut notes);
        }
        for ((tree, node, _), new) in self.split_nodes().zip(thresholds) {
            if let Node::Split { threshold, .. } = &mut ensemble.trees[tree].nodes[node] {
                *threshold = new;
            }
        }
        if let Some(imported) = &mut ensemble.origin.imported {
            imported.thresholds.clear();
            imported.notes.extend(notes);
            // Scalers compute in f64, whatever the trees do.
            imported.compares_f64 = true;
        }
        ensemble.into()
    }

    /// These trees as a classifier's whose classes have these labels, an array in their order: models predict them.
    fn _with_labels(&self, labels: Py<PyAny>) -> Self {
        Self { ensemble: Arc::clone(&self.ensemble), labels: Some(labels) }
    }

    /// Writes an ensemble over touches as XGBoost's JSON.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<(), Failure> {
        Ok(py.detach(|| self.ensemble.save(&path))?)
    }

    /// The objects' (classes') names, in the order of the margins.
    #[getter]
    fn objects(&self) -> Vec<String> {
        self.ensemble.objects.clone()
    }

    /// The features' names.
    #[getter]
    fn features(&self) -> Vec<String> {
        self.ensemble.inputs.names().into_iter().map(String::from).collect()
    }

    /// The descriptor that turns touches into features; `None` for an ensemble over rows of features.
    #[getter]
    fn descriptor(&self) -> Option<&'static str> {
        self.ensemble.descriptor().map(Descriptor::name)
    }

    /// The number of trees.
    #[getter]
    fn trees(&self) -> usize {
        self.ensemble.trees.len()
    }

    /// Caveats of an ensemble that another library trained, each a sentence.
    #[getter]
    fn notes(&self) -> Vec<String> {
        notes(&self.ensemble, None)
    }

    /// The positions of the features among columns with these names, and a note about them.
    fn _columns(&self, header: Vec<String>) -> Result<(Vec<usize>, Option<&'static str>), Failure> {
        Ok(columns(&Features::from(&*self.ensemble), &header)?)
    }

    /// The margins of rows of features (of an ensemble over touches, of its descriptor's), one column per object: added
    /// in f32, as XGBoost does. The columns of a table are found by their names.
    #[pyo3(signature = (rows))]
    fn margins<'py>(slf: &Bound<'py, Self>, rows: ArrayLike<'py>) -> Result<Output<'py, f32, Ix2>, Failure> {
        let (py, ensemble) = (slf.py(), &slf.get().ensemble);
        let rows: Input<'_, f32, Ix2> = features(slf, rows.0)?.extract()?;
        let values = taken(&Features::from(&**ensemble), rows.rows()?)?;
        let margins = py.detach(|| {
            values
                .par_chunks_exact(ensemble.inputs.count())
                .with_min_len(64)
                .flat_map_iter(|row| ensemble.margins_of_features(row))
                .collect()
        });
        Ok(two(py, margins, ensemble.objects.len())?)
    }

    /// The margins of each touch of a data set.
    fn margins_of<'py>(&self, py: Python<'py>, data: Bound<'py, DataSet>) -> Result<Output<'py, f32, Ix2>, Failure> {
        if self.ensemble.descriptor().is_none() {
            return Err(raw_features().into());
        }
        let data = data.get();
        let margins = py.detach(|| {
            let touches: Vec<_> = data.touches().collect();
            touches.par_iter().with_min_len(64).flat_map_iter(|touch| self.ensemble.margins(touch)).collect()
        });
        Ok(two(py, margins, self.ensemble.objects.len())?)
    }

    fn __repr__(&self) -> String {
        let kind = match &self.ensemble.inputs {
            Inputs::Computed(schema) => schema.name.to_owned(),
            Inputs::Rows(names) => format!("{} features", names.len()),
        };
        format!("Ensemble({} trees, {kind}, {} objects)", self.ensemble.trees.len(), self.ensemble.objects.len())
    }
}

impl Ensemble {
    /// The tree, node and feature of each split.
    fn split_nodes(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        self.ensemble.trees.iter().enumerate().flat_map(|(tree, own)| {
            own.nodes.iter().enumerate().filter_map(move |(node, own)| match own {
                Node::Split { feature, .. } => Some((tree, node, *feature)),
                Node::Leaf { .. } => None,
            })
        })
    }
}

/// Trains an ensemble on a data set: gradient boosting with XGBoost's algorithm and parameters.
///
/// `preset` is "compact" (30 trees with one leaf value per object, on curvature and slope), "small" or "tiny" (two fifths
/// of its bytes, or a seventh) or "paper" (the published method); other arguments replace parts of it. `descriptor` is
/// "times", "curvature", "gravity" or "oriented". `counted` says which touches are evidence: "full", "contacts" or "all"; by
/// default those with a contact of a data set of approaches, and full ones of others. `noise` and `timer`, such as "0..5ms" and
/// "1ms", are added to the touches.
/// With objects on a table each placement is an output, or with `outputs` "objects" each object.
/// `background` is a data set of many other shapes, which stand for everything that the model does not know.
///
/// >>> import palpate
/// >>> data = palpate.capture(["bowl", "mouse"], touches=300)
/// >>> palpate.train(data, rounds=5, noise="0..5ms", timer="1ms")
/// Ensemble(5 trees, curvature, 2 objects)
#[pyo3::pyfunction]
#[pyo3(signature = (data, *, preset="compact", descriptor=None, counted=None, rounds=None, depth=None, eta=None,
    min_child_weight=None, bins=None, leaf_bits=None, multi_output=None, noise="", timer="", outputs="placements", background=None, seed=1, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn train(
    py: Python<'_>,
    data: Bound<'_, DataSet>,
    preset: &str,
    descriptor: Option<&str>,
    counted: Option<&str>,
    rounds: Option<usize>,
    depth: Option<usize>,
    eta: Option<f64>,
    min_child_weight: Option<f64>,
    bins: Option<usize>,
    leaf_bits: Option<u32>,
    multi_output: Option<bool>,
    noise: &str,
    timer: &str,
    outputs: &str,
    background: Option<Bound<'_, DataSet>>,
    seed: u64,
    threads: Option<usize>,
    progress: Option<Callback>,
) -> Result<Ensemble, Failure> {
    let preset = match preset {
        "compact" => Settings::compact(),
        "small" => Settings::small(),
        "tiny" => Settings::tiny(),
        "paper" => Settings::paper(),
        other => return Err(Error::setting("preset", other, "compact, small, tiny or paper").into()),
    };
    let descriptor = descriptor.map(descriptor_of);
    let counted = counted.map(|name| {
        let found = Counted::ALL.iter().copied().find(|counted| counted.name() == name);
        found.ok_or_else(|| Error::setting("counted", name, "full, contacts or all"))
    });
    let dataset = &data.get().dataset;
    let settings = with!(
        preset.clone(),
        descriptor = descriptor.transpose()?.unwrap_or(preset.descriptor),
        counted = counted.transpose()?.or(preset.counted),
        rounds = rounds.unwrap_or(preset.rounds),
        depth = depth.unwrap_or(preset.depth),
        eta = eta.unwrap_or(preset.eta),
        min_child_weight = min_child_weight.unwrap_or(preset.min_child_weight),
        bins = bins.unwrap_or(preset.bins),
        leaf_bits = leaf_bits.map_or(preset.leaf_bits, |bits| (bits > 0).then_some(bits)),
        multi_output = multi_output.unwrap_or(preset.multi_output),
        noise = noise_of(noise, timer)?,
        outputs = match outputs {
            "placements" => Outputs::Placements,
            "objects" => Outputs::Objects,
            other => return Err(Error::setting("outputs", other, "placements or objects").into()),
        },
        seed,
        threads,
        probe = StatedProbe::of(dataset)
    );
    let background = background.as_ref().map(|background| &background.get().dataset);
    let ensemble = long(py, progress.as_ref(), |progress| match background {
        None => library::train(dataset, &settings, progress),
        Some(background) => library::train_with_background(dataset, background, &settings, progress),
    })?;
    Ok(ensemble.into())
}
