//! Data sets.

use crate::arrays::{Input, Output, one, triples, two};
use crate::failure::Failure;
use crate::named::{descriptor_of, noise_of};
use crate::objects::{DataFrame, Probe};
use crate::work::long;
use numpy::ndarray::{Ix1, Ix2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use palpate::ensemble::feature_row;
use palpate::error::{Error, problem};
use palpate::shared::format::Length;
use palpate::shared::{Q15_ONE, Touch};
use palpate::touches::{
    Dataset, Listing, Longest, ObjectTouches, Origin, Pool, Source, Surroundings, folds, located, touch_of_seconds,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Touches of one or more objects.
///
/// Its arrays have one row per touch, the objects one after the other. They are made when they are first asked for, belong
/// to the data set, and cannot be written to: every access gives the same memory.
///
/// >>> import numpy, palpate
/// >>> data = palpate.DataSet.from_arrays(
/// ...     times=[[0.0, 0.012, 0.031], [0.004, 0.0, numpy.nan], [0.0, 0.2, 0.1]],
/// ...     objects=[0, 0, 1],
/// ...     names=["cup", "fork"],
/// ... )
/// >>> len(data), data.names, data.counts
/// (3, ['cup', 'fork'], [2, 1])
/// >>> data.times
/// array([[0.   , 0.012, 0.031],
///        [0.004, 0.   ,   nan],
///        [0.   , 0.2  , 0.1  ]])
#[pyo3::pyclass(frozen, module = "palpate._native")]
pub(crate) struct DataSet {
    pub(crate) dataset: Arc<Dataset>,
    approaches: Option<Vec<u64>>,
    times: PyOnceLock<Py<PyArray2<f64>>>,
    objects: PyOnceLock<Py<PyArray1<i16>>>,
    instances: PyOnceLock<Py<PyArray1<i16>>>,
    poses: PyOnceLock<[Py<PyArray2<f32>>; 2]>,
    positions: PyOnceLock<Py<PyArray2<f64>>>,
    robots: PyOnceLock<Py<PyArray1<i64>>>,
}

impl DataSet {
    pub(crate) fn new(dataset: Dataset, approaches: Option<Vec<u64>>) -> Self {
        Self {
            dataset: Arc::new(dataset),
            approaches,
            times: PyOnceLock::new(),
            objects: PyOnceLock::new(),
            instances: PyOnceLock::new(),
            poses: PyOnceLock::new(),
            positions: PyOnceLock::new(),
            robots: PyOnceLock::new(),
        }
    }

    /// Reads a directory.
    pub(crate) fn of_directory(directory: &std::path::Path) -> palpate::Result<Self> {
        let approaches = Listing::read(directory)?.map(|listing| {
            let mut entries = listing.objects;
            entries.sort_by(|a, b| a.name.cmp(&b.name));
            entries.iter().map(|entry| entry.approaches).collect()
        });
        Ok(Self::new(Dataset::read_any(directory)?, approaches))
    }

    pub(crate) fn touches(&self) -> impl Iterator<Item = &Touch> {
        self.dataset.touches()
    }

    /// Columns one after the other as an array with one row for each touch, without a copy.
    fn columns<'py, T: numpy::Element>(py: Python<'py>, values: Vec<T>) -> PyResult<Py<PyArray2<T>>> {
        let rows = values.len() / 3;
        let array = values.into_pyarray(py).reshape([3, rows])?;
        array.call_method("setflags", (), Some(&pyo3::types::IntoPyDict::into_py_dict([("write", false)], py)?))?;
        Ok(array.getattr("T")?.cast_into::<PyArray2<T>>().map_err(PyErr::from)?.unbind())
    }

    fn poses(&self, py: Python<'_>) -> PyResult<Option<&[Py<PyArray2<f32>>; 2]>> {
        if self.touches().all(|touch| touch.pose().is_none()) {
            return Ok(None);
        }
        let made = self.poses.get_or_try_init(py, || {
            let cosine = |value: Option<i16>| value.map_or(f32::NAN, |value| f32::from(value) / f32::from(Q15_ONE));
            let column = |axis: usize, alignment: bool| {
                self.touches().map(move |touch| {
                    cosine(touch.pose().map(|pose| if alignment { pose.alignment[axis] } else { pose.direction[axis] }))
                })
            };
            let all = |alignment| (0..3).flat_map(|axis| column(axis, alignment)).collect::<Vec<_>>();
            PyResult::Ok([Self::columns(py, all(false))?, Self::columns(py, all(true))?])
        })?;
        Ok(Some(made))
    }
}

#[pyo3::pymethods]
impl DataSet {
    /// Reads the data set in a directory, which `capture` or `palpate capture` wrote, or which holds `<object>.txt`
    /// for each object.
    #[staticmethod]
    fn read(py: Python<'_>, directory: PathBuf) -> Result<Self, Failure> {
        long(py, None, |_| Self::of_directory(&directory))
    }

    /// A data set of touches from elsewhere.
    ///
    /// `times` has three contact times per touch, in seconds on any clock, NaN for a finger that did not touch; they are
    /// rounded to microseconds, and the earliest becomes 0. `objects` says which of the `names` each touch is of.
    /// `direction` and `alignment` are unit vectors, `position` where the hand was at the first contact, on a table, in
    /// millimeters (the `probe` is in millimeters then). Without a `probe` nothing is known about it. `instances` are numbers
    /// that say which mesh, or recording, of its object each touch is of, where objects have several: a sequence is of one.
    /// `robots` are numbers that say which robot made each touch, where robots differ: a sequence is of one, too. The data set has
    /// the touches by object, instance and robot.
    #[staticmethod]
    #[pyo3(signature = (
        times, objects, names, *, direction=None, alignment=None, position=None, probe=None, approaches=false,
        instances=None, robots=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn from_arrays(
        times: Input<'_, f64, Ix2>,
        objects: Input<'_, i64, Ix1>,
        names: Vec<String>,
        direction: Option<Input<'_, f64, Ix2>>,
        alignment: Option<Input<'_, f64, Ix2>>,
        position: Option<Input<'_, f64, Ix2>>,
        probe: Option<Probe>,
        approaches: bool,
        instances: Option<Input<'_, i64, Ix1>>,
        robots: Option<Input<'_, i64, Ix1>>,
    ) -> Result<Self, Failure> {
        let times = triples(&times, "times")?;
        let objects = objects.values()?;
        let direction = direction.as_ref().map(|array| triples(array, "direction")).transpose()?;
        let alignment = alignment.as_ref().map(|array| triples(array, "alignment")).transpose()?;
        let position = position.as_ref().map(|array| triples(array, "position")).transpose()?;
        let instances = instances.as_ref().map(Input::values).transpose()?;
        let robots = robots.as_ref().map(Input::values).transpose()?;
        let vectors = [direction, alignment, position].map(|vectors| vectors.map(<[_]>::len));
        let numbers = [instances, robots].map(|numbers| numbers.map(<[_]>::len));
        let lengths = [Some(objects.len())].into_iter().chain(numbers).chain(vectors);
        if lengths.flatten().any(|length| length != times.len()) {
            let rows = "as many rows as times";
            let all = "objects, direction, alignment, position, instances and robots";
            return Err(Error::setting(all, "of another length", rows).into());
        }
        let mut order: Vec<usize> = (0..names.len()).collect();
        order.sort_by(|&a, &b| names[a].cmp(&names[b]));
        if let Some(pair) = order.windows(2).find(|pair| names[pair[0]] == names[pair[1]]) {
            return Err(Error::setting("names", format!("{} twice", names[pair[0]]), "different names").into());
        }
        // For each object its touches by the numbers of their instance and robot.
        let mut parts = vec![BTreeMap::<(i64, Option<u32>), Vec<Touch>>::new(); names.len()];
        for (row, (times, object)) in times.iter().zip(objects).enumerate() {
            let there = |vectors: Option<&[[f64; 3]]>| {
                vectors.map(|vectors| vectors[row]).filter(|vector| !vector.iter().all(|cosine| cosine.is_nan()))
            };
            let touch = touch_of_seconds(
                times.map(|time| Some(time).filter(|time| !time.is_nan())),
                there(direction),
                there(alignment),
            );
            let touch = match position {
                Some(position) => touch.and_then(|touch| located(touch, position[row])),
                None => touch,
            };
            let touch = touch.map_err(|error| error.within(format_args!("row {}: ", row + 1)));
            let index = usize::try_from(*object).ok().filter(|object| *object < names.len());
            let index =
                index.ok_or_else(|| Error::setting("objects", object, format!("0 to {}", names.len().max(1) - 1)))?;
            let number = |robot: i64| {
                u32::try_from(robot).map_err(|_| Error::setting("robots", robot, "numbers of 32 bits, from 0"))
            };
            let robot = robots.map(|robots| number(robots[row])).transpose()?;
            let instance = instances.map_or(0, |instances| instances[row]);
            parts[index].entry((instance, robot)).or_default().push(touch?);
        }
        let objects = order.into_iter().map(|index| {
            let parts = std::mem::take(&mut parts[index]);
            let first = parts.keys().next().map(|(instance, _)| *instance);
            let is_one = parts.keys().all(|(instance, _)| Some(*instance) == first);
            let source = |instance: i64| if is_one { Source::Object } else { Source::Instance(instance.to_string()) };
            let parts = parts.into_iter().map(|((instance, robot), touches)| (source(instance), robot, touches));
            ObjectTouches::of_parts(&names[index], parts)
        });
        let objects: Vec<ObjectTouches> = objects.collect();
        if objects.is_empty() || objects.iter().any(|object| object.is_empty()) {
            return Err(problem!("an object has no touches").fix("Give at least one touch of each object.").into());
        }
        let origin = probe.map(|Probe(probe)| Origin {
            probe,
            approaches: approaches || position.is_some(),
            pose: direction.is_some(),
            position: position.is_some(),
            unit: if position.is_some() { Length::Millimeter } else { Length::Tenth },
            scene: if position.is_some() { Surroundings::Table { cone: 0.0 } } else { Surroundings::Floating },
            touches: objects.iter().map(|object| object.len()).max().unwrap_or(0) as u64,
            ..Origin::default()
        });
        let longest = origin.as_ref().map_or_else(Longest::default, Origin::longest);
        objects.iter().try_for_each(|object| object.check_times(&longest))?;
        Ok(Self::new(Dataset { origin, ..Dataset::new(objects) }, None))
    }

    /// The objects' names, sorted.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.dataset.names()
    }

    /// The number of touches of each object, in the order of the names.
    #[getter]
    fn counts(&self) -> Vec<usize> {
        self.dataset.objects.iter().map(|object| object.len()).collect()
    }

    /// The number of approaches to each object, if known.
    #[getter]
    fn approaches(&self) -> Option<Vec<u64>> {
        self.approaches.clone()
    }

    /// True if every approach is kept, including those in which not all three fingers touched.
    #[getter]
    fn holds_approaches(&self) -> bool {
        self.dataset.holds_approaches()
    }

    /// The probe that made the touches, if known.
    #[getter]
    fn probe(&self) -> Option<Probe> {
        self.dataset.probe().copied().map(Probe)
    }

    /// Warnings from reading the data set, which may be about something intended.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.dataset.warnings.iter().map(ToString::to_string).collect()
    }

    fn __len__(&self) -> usize {
        self.dataset.len()
    }

    fn __repr__(&self) -> String {
        format!("DataSet({} touches of {} objects)", self.dataset.len(), self.dataset.objects.len())
    }

    /// Contact times in seconds after the first contact, one row of three per touch, NaN for a finger that did not touch.
    /// Columns are contiguous.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Output<'py, f64, Ix2>> {
        let made = self.times.get_or_try_init(py, || {
            let seconds = |micros: Option<u32>| micros.map_or(f64::NAN, |micros| f64::from(micros) / 1e6);
            let column = |finger: usize| self.touches().map(move |touch| seconds(touch.times()[finger].micros()));
            Self::columns(py, (0..3).flat_map(column).collect::<Vec<_>>())
        })?;
        Ok(Output(made.bind(py).clone()))
    }

    /// The object of each touch, as its position in the names.
    #[getter]
    fn objects<'py>(&self, py: Python<'py>) -> PyResult<Output<'py, i16, Ix1>> {
        let made = self.objects.get_or_try_init(py, || {
            let numbers = (0_i16..).zip(&self.dataset.objects);
            let all: Vec<i16> =
                numbers.flat_map(|(number, object)| std::iter::repeat_n(number, object.len())).collect();
            let Output(array) = one(py, all);
            array.call_method("setflags", (), Some(&pyo3::types::IntoPyDict::into_py_dict([("write", false)], py)?))?;
            PyResult::Ok(array.unbind())
        })?;
        Ok(Output(made.bind(py).clone()))
    }

    /// Number of the instance, recording or log of each touch, from 0: all touches of a sequence are from one.
    #[getter]
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Output<'py, i16, Ix1>> {
        let made = self.instances.get_or_try_init(py, || {
            let of = |object: &ObjectTouches| {
                let sources = object.sources();
                let number =
                    |pool: &Pool| sources.iter().position(|source| **source == pool.source).unwrap_or_default();
                let number = |pool: &Pool| i16::try_from(number(pool)).unwrap_or(i16::MAX);
                let of = |pool| std::iter::repeat_n(number(pool), pool.range.len());
                object.pools().iter().flat_map(of).collect::<Vec<i16>>()
            };
            let Output(array) = one(py, self.dataset.objects.iter().flat_map(of).collect());
            array.call_method("setflags", (), Some(&pyo3::types::IntoPyDict::into_py_dict([("write", false)], py)?))?;
            PyResult::Ok(array.unbind())
        })?;
        Ok(Output(made.bind(py).clone()))
    }

    /// Number of the robot that made each touch: all touches of a sequence are from one; `None` if robots do not differ.
    #[getter]
    fn robots<'py>(&self, py: Python<'py>) -> PyResult<Option<Output<'py, i64, Ix1>>> {
        let pools = self.dataset.objects.iter().flat_map(|object| object.pools());
        let of = |pool: &Pool| pool.robot.map(|robot| std::iter::repeat_n(i64::from(robot), pool.range.len()));
        let all: Vec<i64> = pools.filter_map(of).flatten().collect();
        if all.len() < self.dataset.len() {
            return Ok(None);
        }
        let made = self.robots.get_or_try_init(py, || {
            let Output(array) = one(py, all);
            array.call_method("setflags", (), Some(&pyo3::types::IntoPyDict::into_py_dict([("write", false)], py)?))?;
            PyResult::Ok(array.unbind())
        })?;
        Ok(Some(Output(made.bind(py).clone())))
    }

    /// The probe's direction at each touch, a unit vector; `None` if no touch has a pose.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> PyResult<Option<Output<'py, f32, Ix2>>> {
        Ok(self.poses(py)?.map(|[direction, _]| Output(direction.bind(py).clone())))
    }

    /// The direction of the row of fingers at each touch, a unit vector; `None` if no touch has a pose.
    #[getter]
    fn alignment<'py>(&self, py: Python<'py>) -> PyResult<Option<Output<'py, f32, Ix2>>> {
        Ok(self.poses(py)?.map(|[_, alignment]| Output(alignment.bind(py).clone())))
    }

    /// The position of the hand at each touch, in millimeters; `None` if no touch has one.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Option<Output<'py, f64, Ix2>>> {
        if self.touches().all(|touch| touch.position().is_none()) {
            return Ok(None);
        }
        let made = self.positions.get_or_try_init(py, || {
            let column = |axis: usize| {
                self.touches().map(move |touch| {
                    touch.position().map_or(f64::NAN, |position| f64::from(position.micrometers[axis]) / 1e3)
                })
            };
            Self::columns(py, (0..3).flat_map(column).collect::<Vec<_>>())
        })?;
        Ok(Some(Output(made.bind(py).clone())))
    }

    /// The features of each touch under a descriptor, one row of whole numbers per touch (microseconds, and direction cosines times
    /// 32767), NaN where one is missing: for training with another library. The code is the chip's.
    #[pyo3(signature = (descriptor="curvature"))]
    fn features<'py>(&self, py: Python<'py>, descriptor: &str) -> Result<Output<'py, f32, Ix2>, Failure> {
        let descriptor = descriptor_of(descriptor)?;
        let rows = py.detach(|| self.touches().flat_map(|touch| feature_row(descriptor, touch)).collect());
        Ok(two(py, rows, descriptor.feature_count())?)
    }

    /// Some touches to train on and others to test on: `test_share` of each object's touches are drawn for testing.
    #[pyo3(signature = (test_share=0.1, seed=1))]
    fn split(&self, py: Python<'_>, test_share: f64, seed: u64) -> Result<(Self, Self), Failure> {
        let split = py.detach(|| folds::split(&self.dataset, test_share, seed))?;
        Ok((Self::new(split.train, None), Self::new(split.test, None)))
    }

    /// The touches with noise: `noise` is a standard deviation such as "5ms" or a range such as "0..10ms", `timer` the
    /// timer's resolution. Every touch is made by a robot of its own.
    #[pyo3(signature = (noise="", timer="", seed=1))]
    fn noisy(&self, py: Python<'_>, noise: &str, timer: &str, seed: u64) -> Result<Self, Failure> {
        let noise = noise_of(noise, timer)?;
        noise.check()?;
        let noisy = py.detach(|| {
            let mut noisy = (*self.dataset).clone();
            noisy.add_noise(&noise, seed, 1);
            noisy
        });
        Ok(Self::new(noisy, self.approaches.clone()))
    }

    /// The touches as a table: object (a category), t1, t2 and t3, and, if known, direction, alignment and position by their
    /// axes, such as direction_x; instance, where objects have several, and robot, where robots differ. The columns are those of
    /// the arrays, without copies. Needs pandas, which also writes and reads Parquet.
    fn to_pandas<'py>(slf: Bound<'py, Self>) -> PyResult<DataFrame<'py>> {
        let frames = slf.py().import("palpate._frames")?;
        Ok(DataFrame(frames.call_method1("to_pandas", (slf,))?))
    }

    /// A data set of a table with the columns of `to_pandas`; times are rounded to microseconds. Rows keep their order within an
    /// object. Without a `probe` nothing is known about it. Needs pandas.
    #[staticmethod]
    #[pyo3(signature = (table, *, probe=None, approaches=false))]
    fn from_pandas<'py>(
        py: Python<'py>,
        table: DataFrame<'py>,
        probe: Option<Probe>,
        approaches: bool,
    ) -> PyResult<Bound<'py, Self>> {
        let DataFrame(table) = table;
        let made = py.import("palpate._frames")?.call_method1("from_pandas", (table, probe, approaches))?;
        Ok(made.cast_into::<Self>()?)
    }

    /// Writes `<object>.txt` for each object, or `<object>/1.txt`, `<object>/2.txt` and so on for its instances, recordings and robots,
    /// one line per touch, and, if the probe is known, `dataset.json`, into a directory that holds no touches yet: what `read` and
    /// `palpate train` read.
    fn to_text(&self, py: Python<'_>, directory: PathBuf) -> Result<(), Failure> {
        long(py, None, |_| self.dataset.write(&directory, self.approaches.as_deref()))
    }
}
