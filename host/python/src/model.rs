//! Compiled models.

use crate::arrays::{ARRAY_LIKE, Input, Output, columns, features, one, taken, two};
use crate::cells::OpenedModel;
use crate::data::DataSet;
use crate::ensemble::Ensemble;
use crate::failure::Failure;
use crate::objects;
use numpy::ndarray::Ix2;
use palpate::compile::{self as library, Compiled, CompiledModel, Language, Leaf, Settings};
use palpate::ensemble::Probability;
use palpate::error::{Error, problem};
use palpate::evaluate::predict::{Predicted, predict};
use palpate::evaluate::together::{AT_ONCE, Together, TouchesTogether};
use palpate::evaluate::{over_touches, raw_features};
use palpate::onboard;
use palpate::output;
use palpate::rows::{Encoder, Features, feature_names, notes};
use palpate::shared::{Descriptor, Touch};
use palpate::touches::touch_of_seconds;
use palpate::with;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use pyo3::{Borrowed, PyTypeInfo, type_hint_union};
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A compiled model: the bytes that a microcontroller reads, and that are read here by the same code.
///
/// >>> import palpate
/// >>> data = palpate.capture(["bowl", "mouse"], touches=300)
/// >>> model = palpate.compile(palpate.train(data, rounds=5))
/// >>> model.objects
/// ['bowl', 'mouse']
/// >>> model.margins(data).shape
/// (600, 2)
/// >>> palpate.Model(model.to_bytes()).checksum == model.checksum
/// True
#[pyo3::pyclass(frozen, module = "palpate._native")]
pub(crate) struct Model {
    pub(crate) opened: Arc<OpenedModel>,
    /// Encoder of a row of features into the values that the model compares.
    pub(crate) encoder: Encoder,
    /// Its features among the columns of tables and arrays.
    pub(crate) features: Features,
    /// Facts about its source.
    notes: Vec<String>,
    /// Labels of the classifier that it was compiled from, an array in the order of its objects.
    labels: Option<Py<PyAny>>,
    /// The ensemble that it was compiled from, how, and the result; none of a model that was loaded.
    source: Option<(Arc<palpate::ensemble::Ensemble>, Settings, Compiled)>,
}

impl Model {
    pub(crate) fn of(bytes: Vec<u8>) -> palpate::Result<Self> {
        let opened = OpenedModel::try_new(bytes, |bytes| library::open(bytes))?;
        let encoder = Encoder::of(opened.borrow_dependent());
        let features = Features::from(opened.borrow_dependent());
        Ok(Self { opened: Arc::new(opened), encoder, features, notes: Vec::new(), labels: None, source: None })
    }

    pub(crate) fn model(&self) -> &onboard::Model<'_> {
        self.opened.borrow_dependent()
    }
}

/// Rows, or the touches of a data set.
pub(crate) enum Rows<'py> {
    Data(Bound<'py, DataSet>),
    Array(Bound<'py, PyAny>),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Rows<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_union!(<DataSet as PyTypeInfo>::TYPE_HINT, ARRAY_LIKE);

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(match object.cast::<DataSet>() {
            Ok(data) => Self::Data(data.to_owned()),
            Err(_) => Self::Array(object.to_owned()),
        })
    }
}

/// With fewer rows than this the lock is kept, and one thread does it all.
const FEW: usize = 256;

/// Number of rows computed between two checks for signals.
const BATCH: usize = 1 << 20;

impl Model {
    /// The margins of rows of `width` values each.
    fn fill<V: Sync>(
        &self,
        py: Python<'_>,
        values: &[V],
        width: usize,
        margins: impl Fn(&mut Together, &[V], &mut [f64]) + Sync,
    ) -> PyResult<Vec<f64>> {
        let objects = self.model().object_count();
        let rows = values.len() / width;
        let mut all = vec![0.0; rows * objects];
        if rows < FEW {
            margins(&mut Together::new(), values, &mut all);
            return Ok(all);
        }
        for (values, slots) in values.chunks(BATCH * width).zip(all.chunks_mut(BATCH * objects)) {
            py.check_signals()?;
            py.detach(|| {
                let slots = slots.par_chunks_mut(AT_ONCE * objects);
                let tasks = values.par_chunks(AT_ONCE * width).zip(slots);
                tasks.for_each_init(Together::new, |together, (values, slots)| margins(together, values, slots));
            });
        }
        Ok(all)
    }

    /// The margins of rows of features, with the number of values in each.
    fn of_rows<V: Copy + Into<f64> + Sync>(&self, py: Python<'_>, rows: (&[V], usize)) -> Result<Vec<f64>, Failure> {
        let (model, wanted) = (self.model(), self.model().feature_count());
        let values = taken(&self.features, rows)?;
        let margins = self.fill(py, &values, wanted, |together, values, slots| {
            together.rows(model, &self.encoder, values, slots);
        });
        Ok(margins?)
    }

    fn predicted<V: Copy + Into<f64> + Sync>(
        &self,
        py: Python<'_>,
        rows: (&[V], usize),
        raw: bool,
    ) -> palpate::Result<Predicted> {
        let values = taken(&self.features, rows)?;
        py.detach(|| predict(self.model(), &values, self.features.count(), raw))
    }

    /// The margins of all rows.
    fn of_all<'py>(slf: &Bound<'py, Self>, rows: Rows<'py>) -> Result<Vec<f64>, Failure> {
        let (py, own) = (slf.py(), slf.get());
        let rows = match rows {
            Rows::Array(array) if own.model().descriptor().is_none() => Rows::Array(features(slf, array)?),
            other => other,
        };
        Ok(match (rows, own.model().descriptor()) {
            (Rows::Data(_), None) => return Err(raw_features().into()),
            (Rows::Data(data), Some(_)) => {
                let touches: Vec<Touch> = data.get().touches().copied().collect();
                own.of_touches(py, &touches)?
            }
            (Rows::Array(array), Some(_)) => {
                let array: Input<'_, f64, Ix2> = array.extract()?;
                let (values, columns) = array.rows()?;
                let touches = touches(values, columns)?;
                own.of_touches(py, &touches)?
            }
            (Rows::Array(array), None) => match &own.encoder {
                Encoder::Real => {
                    let array: Input<'_, f32, Ix2> = array.extract()?;
                    own.of_rows(py, array.rows()?)?
                }
                // f32 does not hold all whole numbers.
                Encoder::Scaled(_) => {
                    let array: Input<'_, f64, Ix2> = array.extract()?;
                    own.of_rows(py, array.rows()?)?
                }
            },
        })
    }

    fn of_touches(&self, py: Python<'_>, touches: &[Touch]) -> PyResult<Vec<f64>> {
        let model = self.model();
        self.fill(py, touches, 1, |together, touches, slots| together.touches_in_nats(model, touches, slots))
    }
}

#[pyo3::pymethods]
impl Model {
    /// A model in memory; `content` is checked.
    #[new]
    fn new(content: Vec<u8>) -> Result<Self, Failure> {
        Ok(Self::of(content)?)
    }

    /// Reads a model that `save` or `palpate export` wrote.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self, Failure> {
        Ok(py.detach(|| CompiledModel::read(&path).and_then(|model| Self::of(model.into_bytes())))?)
    }

    /// Writes the model, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<(), Failure> {
        Ok(py.detach(|| output::write_bytes(&path, self.model().bytes()))?)
    }

    /// Writes the model as source code, and returns the files. `form` is "c" (an array), "rust", "c-code" (trees as C) or
    /// "rust-code" (trees as Rust); without it a name that ends in ".h" means "c", and ".rs" "rust". What has to be built with it,
    /// such as palpate.h, is written beside it, and for trees as Rust the model. Directories that are missing are made.
    #[pyo3(signature = (path, *, form=None))]
    fn emit(&self, py: Python<'_>, path: PathBuf, form: Option<&str>) -> Result<Vec<PathBuf>, Failure> {
        let of_suffix = path.extension().and_then(|extension| match extension.to_str() {
            Some("h") => Some("c"),
            Some("rs") => Some("rust"),
            _ => None,
        });
        let refuse = |form: &str, allowed: &str| Err(Error::setting("form", form, allowed).into());
        let all = "c, rust, c-code or rust-code, or a path that ends in .h or .rs";
        let Some(name) = form.or(of_suffix) else { return refuse("not given", all) };
        let (plain, is_code) = name.strip_suffix("-code").map_or((name, false), |plain| (plain, true));
        let Some(language) = Language::ALL.into_iter().find(|language| language.name() == plain) else {
            return refuse(name, all);
        };
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(py.detach(|| {
            let Some((ensemble, settings, compiled)) = &self.source else {
                if is_code {
                    return Err(Error::setting("form", name, library::NO_CODE));
                }
                let text = library::emit(self.model(), &stem, language);
                return library::write_sources(&path, &[(language.extension(), text)]);
            };
            if !is_code {
                return library::write_sources(&path, &compiled.sources(&stem, &[language])?);
            }
            let settings = with!(settings.clone(), code = true);
            let compiled = library::compile(ensemble, &settings)?;
            let mut written = library::write_sources(&path, &compiled.sources(&stem, &[language])?)?;
            if language == Language::Rust {
                written.push(path.with_extension("palpate"));
                output::write_bytes(&path.with_extension("palpate"), &compiled.bytes)?;
            }
            Ok(written)
        })?)
    }

    /// The model's bytes, for the chip.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.model().bytes())
    }

    /// The arguments that a pickle holds.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyBytes>,) {
        (self.to_bytes(py),)
    }

    /// The size of the model in bytes.
    #[getter]
    fn size(&self) -> usize {
        self.model().bytes().len()
    }

    /// The objects' (classes') names, in the order of the margins.
    #[getter]
    fn objects(&self) -> Vec<String> {
        library::names(self.model())
    }

    /// Facts about the model's source, each a sentence; none for a loaded model.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// The positions of the features among columns with these names, and a note about them.
    fn _columns(&self, header: Vec<String>) -> Result<(Vec<usize>, Option<&'static str>), Failure> {
        Ok(columns(&self.features, &header)?)
    }

    /// The features' names.
    #[getter]
    fn features(&self) -> Vec<String> {
        match self.model().descriptor() {
            Some(descriptor) => descriptor.feature_names().iter().map(|&name| name.into()).collect(),
            None => feature_names(self.model()),
        }
    }

    /// The descriptor that turns touches into features; `None` for a model over rows of features.
    #[getter]
    fn descriptor(&self) -> Option<&'static str> {
        self.model().descriptor().map(Descriptor::name)
    }

    /// The layout of the trees.
    #[getter]
    fn layout(&self) -> &'static str {
        self.model().layout().name()
    }

    /// The type of stored leaves: "i8", "i16" or "f32".
    #[getter]
    fn leaf(&self) -> &'static str {
        self.model().leaf_type().name()
    }

    /// The largest possible difference of a margin from the full model's, in nats, or of a value's: of several targets that of
    /// the one with the largest.
    #[getter]
    fn margin_error(&self) -> f32 {
        palpate::trees::verify::bound(self.model()) as f32
    }

    /// A number that identifies the model: models with the same number are the same.
    #[getter]
    fn checksum(&self) -> u32 {
        self.model().checksum()
    }

    /// The margins of each row, in nats, one column per object: unnormalized log-probabilities, to be added up over the
    /// touches of one object.
    ///
    /// A model over touches takes a data set, or rows of three contact times in seconds (NaN where a finger did not
    /// touch), with the probe's direction and alignment nine numbers. A model over features takes rows of those, NaN where
    /// one is missing; with leaves as f32 its margins are an XGBoost model's own, bit for bit, and those of a regression with
    /// other leaves have the digits that f32 values lack. Of a table (pandas, polars, pyarrow)
    /// the columns are found by their names, in any order and among others.
    #[pyo3(signature = (rows))]
    fn margins<'py>(slf: &Bound<'py, Self>, rows: Rows<'py>) -> Result<Output<'py, f64, Ix2>, Failure> {
        let margins = Self::of_all(slf, rows)?;
        Ok(two(slf.py(), margins, slf.get().model().object_count())?)
    }

    /// The probabilities of each row's classes, one column per class, as `predict_proba` of the library that trained the model
    /// gives them: for margins within `margin_error`, within half of it for boosted trees. Rows are as for `margins`. A model
    /// that was loaded has none: its bytes do not say how probabilities are made of margins.
    #[pyo3(signature = (rows))]
    fn predict_proba<'py>(slf: &Bound<'py, Self>, rows: Rows<'py>) -> Result<Output<'py, f64, Ix2>, Failure> {
        let own = slf.get();
        let (prediction, objects) = (own.model().prediction(), own.model().object_count());
        if own.model().descriptor().is_some() {
            return Err(over_touches().into());
        }
        let rule = own.source.as_ref().map(|(_, _, compiled)| compiled.probability);
        let is_class = objects > 1 && !prediction.targets;
        let rule = rule.filter(|rule| is_class && *rule != Probability::Unknown);
        let is_loaded = own.source.is_none() && is_class;
        let rule = rule.ok_or_else(|| no_probabilities(is_loaded))?;
        let margins = Self::of_all(slf, rows)?;
        let shares = margins.chunks_exact(objects).filter_map(|row| rule.of(row));
        Ok(two(slf.py(), shares.flatten().collect(), objects)?)
    }

    /// The prediction of the library that trained a model over rows of features, as an array: the class of each row, or its value
    /// (its values, a column for each of several targets), with `raw` the margin before the inverse link. Classes are the labels
    /// of the classifier, of its own type; without it (of a model or ensemble from a file or bytes), or with other `names`, they are
    /// the objects' names. Rows are as for `margins`.
    #[pyo3(signature = (rows, *, raw=false))]
    fn predict<'py>(slf: &Bound<'py, Self>, rows: Rows<'py>, raw: bool) -> Result<objects::Predictions<'py>, Failure> {
        let Rows::Array(array) = rows else { return Err(over_touches().into()) };
        let (py, own) = (slf.py(), slf.get());
        if own.model().descriptor().is_some() {
            return Err(over_touches().into());
        }
        let array = features(slf, array)?;
        let predicted = match &own.encoder {
            Encoder::Real => {
                let array: Input<'_, f32, Ix2> = array.extract()?;
                own.predicted(py, array.rows()?, raw)?
            }
            Encoder::Scaled(_) => {
                let array: Input<'_, f64, Ix2> = array.extract()?;
                own.predicted(py, array.rows()?, raw)?
            }
        };
        Ok(objects::Predictions(match predicted {
            Predicted::Values(values) if own.model().object_count() > 1 => {
                two(py, values, own.model().object_count())?.0.into_any()
            }
            Predicted::Values(values) => one(py, values).0.into_any(),
            Predicted::Classes(classes) => {
                let labels = match &own.labels {
                    Some(labels) => labels.bind(py).clone(),
                    None => py.import("numpy")?.call_method1("array", (own.objects(),))?,
                };
                let classes = classes.into_iter().map(|class| class as i64).collect();
                labels.call_method1("take", (one(py, classes),))?
            }
        }))
    }

    fn __repr__(&self) -> String {
        let model = self.model();
        format!("Model({} bytes, {} objects, {})", model.bytes().len(), model.object_count(), model.layout().name())
    }
}

/// Touches from rows of three or nine numbers.
fn touches(values: &[f64], columns: usize) -> palpate::Result<Vec<Touch>> {
    if columns != 3 && columns != 9 {
        return Err(other_fields(columns));
    }
    let of = |(row, numbers): (usize, &[f64])| {
        touch(numbers).map_err(|error| error.within(format_args!("row {}: ", row + 1)))
    };
    values.chunks_exact(columns).enumerate().map(of).collect()
}

/// A touch from three or nine numbers, NaN where one is missing.
pub(crate) fn touch(numbers: &[f64]) -> palpate::Result<Touch> {
    let time = |time: f64| Some(time).filter(|time| !time.is_nan());
    let vector = |vector: [f64; 3]| Some(vector).filter(|vector| !vector.iter().all(|cosine| cosine.is_nan()));
    match *numbers {
        [a, b, c] => touch_of_seconds([a, b, c].map(time), None, None),
        [a, b, c, dx, dy, dz, ax, ay, az] => {
            touch_of_seconds([a, b, c].map(time), vector([dx, dy, dz]), vector([ax, ay, az]))
        }
        _ => Err(other_fields(numbers.len())),
    }
}

/// The problem of as many numbers, which are no touch.
pub(crate) fn other_fields(count: usize) -> Error {
    problem!("{count} numbers where a touch has three times, or three times and six direction cosines")
        .fix("Give three times in seconds, NaN for a missing contact, and optionally direction and alignment.")
}

/// The problem of a model whose margins do not say which probabilities the library predicts.
fn no_probabilities(is_loaded: bool) -> Error {
    match is_loaded {
        true => problem!("the bytes of a loaded model do not say how its library makes probabilities of margins")
            .fix("Compile its estimator again."),
        false => problem!(
            "the model's margins do not determine probabilities: it predicts values, or classes of a calibrator or a hinge loss"
        )
        .fix("Use `predict` or `margins`."),
    }
}

/// Compiles an ensemble to the bytes that a microcontroller reads. (`palpate.compile` also takes models of other
/// libraries.)
///
/// `leaf` is "i8", "i16" or "f32": what leaves are stored as; by default what `palpate export` chooses. With `max_bytes` leaves
/// are stored in fewer bits where the model would be larger; if it still is, that is an error. `error_rate` and `max_touches` are where recognizers stop; `priors` say
/// how likely each object is. `scales` say how many units make up 1 of each feature, for a chip that measures in whole numbers.
/// `row_number` names the feature that is a row's number in its sequence, counted from 1.
///
/// >>> import palpate
/// >>> data = palpate.capture(["bowl", "mouse"], touches=300)
/// >>> model = palpate.compile(palpate.train(data, rounds=5), max_bytes=4000)
/// >>> model.size <= 4000
/// True
#[pyo3::pyfunction]
#[pyo3(signature = (ensemble, *, max_bytes=None, leaf=None, error_rate=0.01, max_touches=200,
    priors=None, scales=None, row_number=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn compile(
    py: Python<'_>,
    ensemble: Bound<'_, Ensemble>,
    max_bytes: Option<usize>,
    leaf: Option<&str>,
    error_rate: f64,
    max_touches: u32,
    priors: Option<Vec<f64>>,
    scales: Option<Vec<f32>>,
    row_number: Option<String>,
) -> Result<Model, Failure> {
    let labels = ensemble.get().labels.as_ref().map(|labels| labels.clone_ref(py));
    let ensemble = &ensemble.get().ensemble;
    let named = |name: &str| Leaf::ALL.iter().copied().find(|known| known.name() == name);
    let leaf =
        leaf.map(|leaf| named(leaf).ok_or_else(|| Error::setting("leaf", leaf, "i8, i16 or f32"))).transpose()?;
    let usual = library::usual(ensemble);
    let leaf = leaf.unwrap_or(usual.leaf);
    let settings = with!(usual, leaf, error_rate, max_touches, priors, scales, position = row_number);
    let compiled = py.detach(|| match max_bytes {
        None => library::compile(ensemble, &settings),
        Some(most) => library::compile_within(ensemble, &settings, most),
    })?;
    let model = Model::of(compiled.bytes.clone())?;
    let settings = with!(settings, leaf = model.model().leaf_type());
    let notes = [notes(ensemble, settings.scales.as_deref()), compiled.notes.clone()].concat();
    Ok(Model { notes, labels, source: Some((Arc::clone(ensemble), settings, compiled)), ..model })
}
