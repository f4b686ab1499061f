//! Objects on a table: maps of them, and where one lies.

use crate::arrays::ARRAY_LIKE;
use crate::capture::Meshes;
use crate::cells::{OpenedLocator, OpenedMaps};
use crate::data::DataSet;
use crate::failure::{Failure, note_of};
use crate::objects::{self, Probe, Real, class};
use crate::recognizer::numbers;
use crate::work::{Callback, long};
use palpate::calibrate::{self, Per};
use palpate::compile;
use palpate::error::Error;
use palpate::locate::{self, Aimed, Approach, CastSettings, Hand, Heights, MapsFile, Promised, Seen, Terms, Until};
use palpate::mesh::Object;
use palpate::mesh::facts::sides;
use palpate::output;
use palpate::touches::{located, touch_of_seconds};
use palpate::with;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyType};
use pyo3::{Borrowed, type_hint_identifier};
use std::path::PathBuf;
use std::sync::Arc;

/// Height maps of objects as they lie on a table: the model of a `Locator`.
///
/// >>> import palpate
/// >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
/// >>> maps = palpate.Maps.of_meshes(["bowl", "mouse"], probe=probe, millimeters=10)
/// >>> maps.objects
/// ['bowl', 'mouse']
/// >>> maps.placements[0]
/// ('bowl', '+z')
/// >>> palpate.Maps(maps.to_bytes()).size == maps.size
/// True
#[pyo3::pyclass(frozen, module = "palpate._native")]
pub(crate) struct Maps {
    opened: Arc<OpenedMaps>,
}

impl Maps {
    fn of(bytes: Vec<u8>) -> palpate::Result<Self> {
        let opened = OpenedMaps::try_new(bytes, |bytes| locate::Maps::new(bytes).map_err(locate::refused))?;
        Ok(Self { opened: Arc::new(opened) })
    }

    fn maps(&self) -> &locate::Maps<'_> {
        self.opened.borrow_dependent()
    }
}

/// Settings as Python states them.
fn settings(
    Real(real): &Real,
    cell: f64,
    range: f64,
    error_rate: f64,
    max_touches: u32,
) -> palpate::Result<CastSettings> {
    if cell != 1.0 && cell != 2.0 {
        return Err(Error::setting("cell", cell, "1 or 2, in millimeters"));
    }
    real.check()?;
    let settings = with!(CastSettings::default(), fine = cell < 2.0, range, error_rate, max_touches).expecting(real);
    settings.check()?;
    Ok(settings)
}

/// Objects at their true size, by name.
fn sized(meshes: Meshes, millimeters: Option<f64>) -> palpate::Result<Vec<Object>> {
    if let Some(wrong) = millimeters.filter(|length| !length.is_finite() || *length <= 0.0) {
        return Err(Error::setting("millimeters", wrong, "a finite number above 0"));
    }
    let mut objects = meshes.objects(false)?;
    objects.iter_mut().for_each(|object| object.millimeters = object.millimeters.or(millimeters));
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(objects)
}

/// Sizes that are none of objects for this hand, in words: the length of a unit may be another.
fn odd_sizes(objects: &[Object], probe: &palpate::probe::approach::Probe, range: f64) -> Vec<String> {
    // By default the hand goes to twice the range, and the outer fingers beyond it.
    let usual = probe.spacing..=4.0 * (2.0 * range + probe.spacing);
    let of = |object: &Object| {
        let size = object.instances().find_map(|instance| object.true_size(instance))?;
        (!usual.contains(&size.max_element())).then(|| {
            let (name, sides) = (&object.name, sides(size));
            format!("{name} is {sides} mm, for fingers {} mm apart. See whether `millimeters` is right.", probe.spacing)
        })
    };
    objects.iter().filter_map(of).collect()
}

/// Sequences that are played on a simulated table.
struct Played {
    objects: Meshes,
    millimeters: Option<f64>,
    terms: Terms,
}

impl Played {
    fn play<T>(
        self,
        maps: &locate::Maps<'_>,
        progress: &dyn palpate::progress::Progress,
        with: impl FnOnce(&[locate::Standing], &palpate::probe::approach::Probe, &Terms) -> palpate::Result<T>,
    ) -> palpate::Result<T> {
        let objects = sized(self.objects, self.millimeters)?;
        let probe = locate::hand(maps)?;
        let noise = locate::stated(maps).height;
        let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, noise, progress)?;
        with(&standing, &probe, &self.terms)
    }
}

fn aimed(name: &str) -> palpate::Result<Aimed> {
    match name {
        "chosen" => Ok(Aimed::Chosen),
        "random" => Ok(Aimed::Random),
        other => Err(Error::setting("aimed", other, "chosen or random")),
    }
}

/// A value as Python's own: numbers, names and lists.
fn raw<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).unwrap_or_default();
    py.import("json")?.call_method1("loads", (text,))
}

#[pyo3::pymethods]
impl Maps {
    /// Maps in memory; `content` is checked.
    #[new]
    fn new(content: Vec<u8>) -> Result<Self, Failure> {
        Ok(Self::of(content)?)
    }

    /// Reads maps that `save` or the program wrote.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self, Failure> {
        Ok(py.detach(|| {
            std::fs::metadata(&path).map_err(|source| Error::io(&path, "read the maps", source))?;
            let file = MapsFile::read(&path)?.ok_or_else(|| locate::not_maps().in_file(&path))?;
            Self::of(file.maps().model().to_vec())
        })?)
    }

    /// Learns maps from recorded touches with positions.
    ///
    /// `real` is what is known of hand and table, `cell` the side of a map's cells (1 or 2 mm), `range` half of the side of the
    /// square about the table's origin in which objects are looked for, in millimeters.
    #[staticmethod]
    #[pyo3(signature = (data, *, real=None, cell=1.0, range=30.0, error_rate=0.01, max_touches=25))]
    fn learn(
        py: Python<'_>,
        data: Bound<'_, DataSet>,
        real: Option<Real>,
        cell: f64,
        range: f64,
        error_rate: f64,
        max_touches: u32,
    ) -> Result<Self, Failure> {
        let settings = settings(&real.unwrap_or_default(), cell, range, error_rate, max_touches)?;
        let dataset = Arc::clone(&data.get().dataset);
        long(py, None, |_| {
            let surfaces = locate::learn(&dataset, &settings)?;
            Self::of(locate::write(&surfaces, &dataset.names(), &locate::probe_of(&dataset)?, &settings)?)
        })
    }

    /// Maps of meshes in every pose that they rest in: what a fingertip meets in the middle of each cell. Poses that look the same to
    /// contacts of this noise have one map.
    ///
    /// `meshes` are as for `capture`, at their true size: `millimeters` is the length of a unit of those that state none. The
    /// `probe` is in millimeters.
    #[staticmethod]
    #[pyo3(signature = (meshes, *, probe, millimeters=None, real=None, cell=1.0, range=30.0, error_rate=0.01, max_touches=25,
        progress=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn of_meshes(
        py: Python<'_>,
        meshes: Meshes,
        probe: Probe,
        millimeters: Option<f64>,
        real: Option<Real>,
        cell: f64,
        range: f64,
        error_rate: f64,
        max_touches: u32,
        progress: Option<Callback>,
    ) -> Result<Self, Failure> {
        let settings = settings(&real.unwrap_or_default(), cell, range, error_rate, max_touches)?;
        let Probe(probe) = probe;
        let (maps, odd) = long(py, progress.as_ref(), |progress| {
            let objects = sized(meshes, millimeters)?;
            let odd = odd_sizes(&objects, &probe, range);
            let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, settings.noise, progress)?;
            let names: Vec<String> = standing.iter().map(|object| object.name.clone()).collect();
            let cast = locate::cast(&standing, &probe, &settings)?;
            Ok((Self::of(locate::write(&cast, &names, &probe, &settings)?)?, odd))
        })?;
        for note in odd {
            note_of(py, &note)?;
        }
        Ok(maps)
    }

    /// Finds the loosest threshold at which at most a share of `error_rate` of the names is wrong, with a probability of
    /// `confidence`, on sequences of approaches to these meshes on a simulated table.
    ///
    /// `aimed` says how approaches are aimed, and which approaches the promise is for: "chosen" ones, as by `Locator.next`, or "random"
    /// ones about the place believed in. `real` is what the simulated hand and table add. `until` goes on after the name until the
    /// place is as sure, such as (3.0, 5.0) for 3 mm and 5 degrees. `unknown` makes a test for objects that the maps do not know: nothing
    /// is named before the eighth approach then. `workspace` is how far from the table's origin the middle finger comes down in x and
    /// y, in millimeters, by default twice the range.
    #[pyo3(signature = (meshes, *, millimeters=None, error_rate=0.01, confidence=0.95, sequences=1000, max_touches=25,
        aimed="chosen", real=None, pose=10, until=None, unknown=false, workspace=None, seed=1, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn calibrate<'py>(
        &self,
        py: Python<'py>,
        meshes: Meshes,
        millimeters: Option<f64>,
        error_rate: f64,
        confidence: f64,
        sequences: usize,
        max_touches: u32,
        aimed: &str,
        real: Option<Real>,
        pose: u16,
        until: Option<(f64, f64)>,
        unknown: bool,
        workspace: Option<f64>,
        seed: u64,
        progress: Option<Callback>,
    ) -> Result<objects::CalibratedMaps<'py>, Failure> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let maps = *self.maps();
        let promise = calibrate::Terms { rate: error_rate, confidence, per: Per::Average };
        let terms = Terms {
            promise,
            unknown,
            ..terms(&maps, sequences, max_touches, aimed, real, pose, until, workspace, seed)?
        };
        let played = Played { objects: meshes, millimeters, terms };
        let found = long(py, progress.as_ref(), |progress| {
            played.play(&maps, progress, |standing, probe, terms| {
                locate::calibrate(maps, standing, probe, terms, progress)
            })
        })?;
        let raw = raw(py, &found)?;
        let maps = Self::of(found.model)?;
        let class = CLASS.import(py, "palpate._locate", "CalibratedMaps")?;
        Ok(objects::CalibratedMaps(class.call1((maps, raw))?))
    }

    /// Plays sequences of approaches to these meshes on a simulated table, other ones than those of `calibrate` if the seed is
    /// another, to the maps' own threshold. The arguments are as for `calibrate`.
    #[pyo3(signature = (meshes, *, millimeters=None, sequences=1000, max_touches=25, aimed="chosen", real=None, pose=10,
        until=None, workspace=None, seed=2, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        meshes: Meshes,
        millimeters: Option<f64>,
        sequences: usize,
        max_touches: u32,
        aimed: &str,
        real: Option<Real>,
        pose: u16,
        until: Option<(f64, f64)>,
        workspace: Option<f64>,
        seed: u64,
        progress: Option<Callback>,
    ) -> Result<objects::MapsEvaluation<'py>, Failure> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let maps = *self.maps();
        let terms = terms(&maps, sequences, max_touches, aimed, real, pose, until, workspace, seed)?;
        let played = Played { objects: meshes, millimeters, terms };
        let found = long(py, progress.as_ref(), |progress| {
            played.play(&maps, progress, |standing, probe, terms| {
                locate::evaluate(maps, standing, probe, terms, progress)
            })
        })?;
        let class = CLASS.import(py, "palpate._locate", "MapsEvaluation")?;
        Ok(objects::MapsEvaluation(class.call1((raw(py, &found)?,))?))
    }

    /// Writes the maps, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<(), Failure> {
        Ok(py.detach(|| output::write_bytes(&path, self.maps().model()))?)
    }

    /// The maps' bytes, for the chip.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.maps().model())
    }

    /// The arguments that a pickle holds.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyBytes>,) {
        (self.to_bytes(py),)
    }

    /// The size of the maps in bytes.
    #[getter]
    fn size(&self) -> usize {
        self.maps().model().len()
    }

    /// The objects' names.
    #[getter]
    fn objects(&self) -> Vec<String> {
        locate::names(self.maps())
    }

    /// The placements, each with its object's name first. Equal ones of an object are one.
    #[getter]
    fn placements(&self) -> Vec<(String, String)> {
        let maps = self.maps();
        let of = |placement: u8| {
            let object = maps.object_name(maps.object_of(placement).into()).to_owned();
            (object, maps.placement_name(placement).to_owned())
        };
        (0..=u8::MAX).take(maps.placements()).map(of).collect()
    }

    /// The hand that they were made with, in millimeters.
    #[getter]
    fn probe(&self) -> Result<Probe, Failure> {
        Ok(Probe(locate::hand(self.maps())?))
    }

    /// Promise of a calibration: its rate, the aims that it holds for, and its evidence; `None` without one.
    #[getter]
    fn promise<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        Promised::of(self.maps()).map(|promised| raw(py, &promised)).transpose()
    }

    /// Half of the side of the square about the table's origin in which objects are looked for, in millimeters.
    #[getter]
    fn range(&self) -> f64 {
        f64::from(self.maps().range()) / 1e3
    }

    fn __repr__(&self) -> String {
        let maps = self.maps();
        format!("Maps({} bytes, {} placements of {} objects)", maps.model().len(), maps.placements(), maps.objects())
    }
}

/// Terms with a promise of 1 %.
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
fn terms(
    maps: &locate::Maps<'_>,
    sequences: usize,
    max_touches: u32,
    name: &str,
    real: Option<Real>,
    pose: u16,
    until: Option<(f64, f64)>,
    workspace: Option<f64>,
    seed: u64,
) -> palpate::Result<Terms> {
    let (aimed, Real(real)) = (aimed(name)?, real.unwrap_or_default());
    let until = until.map(|(millimeters, degrees)| Until { millimeters, degrees });
    let promise = calibrate::Terms { rate: 0.01, confidence: 0.95, per: Per::Average };
    let within = locate::workspace(maps, workspace)?;
    Ok(Terms { promise, sequences, max_touches, aimed, real, pose, within, until, unknown: false, seed, effort: None })
}

/// Three numbers, NaN or `None` where one is missing.
pub(crate) struct Three(pub(crate) [Option<f64>; 3]);

impl<'a, 'py> FromPyObject<'a, 'py> for Three {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Touch");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (numbers, count) = numbers::<3>(object)?;
        if count != 3 {
            return Err(pyo3::exceptions::PyValueError::new_err(format!("{count} numbers, where 3 are needed")));
        }
        Ok(Self(numbers.map(|number| Some(number).filter(|number| !number.is_nan()))))
    }
}

impl Three {
    /// All three of them.
    pub(crate) fn all(&self) -> [f64; 3] {
        self.0.map(|number| number.unwrap_or(f64::NAN))
    }
}

/// Direction of the row of fingers: a unit vector, or degrees from the x axis.
pub(crate) struct Row(pub(crate) [f64; 3]);

impl<'a, 'py> FromPyObject<'a, 'py> for Row {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = ARRAY_LIKE;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(degrees) = object.extract::<f64>() {
            return Ok(Self(locate::row(degrees).map_err(Failure::from)?));
        }
        let vector: Three = object.extract()?;
        Ok(Self(vector.all()))
    }
}

/// Recognizes what lies on a table, and where, from touches of a hand that comes straight down and knows where it is; by the code
/// that runs on the chip.
///
/// >>> import palpate
/// >>> probe = palpate.Probe(radius=1.5, spacing=15, speed=100, tilt=0, stroke=20)
/// >>> maps = palpate.Maps.of_meshes(["bowl", "mouse"], probe=probe, millimeters=10)
/// >>> locator = palpate.Locator(maps)
/// >>> x, y, roll = locator.next()
/// >>> located = locator.push_heights((None, 20.0, 17.0), x, y, roll, lowest=0.0)
/// >>> located.state, located.touches
/// ('undecided', 1)
#[pyo3::pyclass(module = "palpate._native")]
pub(crate) struct Locator {
    cell: OpenedLocator,
    hand: Hand,
    /// Half of the side of the square in which the middle finger may go, in micrometers.
    within: u32,
    pose: u16,
    seed: u32,
    next: Option<Approach>,
}

#[pyo3::pymethods]
impl Locator {
    /// It stops when the maps say so, or at a posterior of 1 - `error_rate`, and gives up after `max_touches`. `pose` is how much
    /// where the object lies counts in the choice of approaches, in 64ths, `workspace` how far from the table's origin the middle
    /// finger is sent in x and y, in millimeters (twice the maps' range; the outer ones reach beyond it by their distance from
    /// it), `seed` that of the choice.
    #[new]
    #[pyo3(signature = (maps, *, error_rate=None, max_touches=None, pose=10, workspace=None, seed=1))]
    fn new(
        maps: Bound<'_, Maps>,
        error_rate: Option<f64>,
        max_touches: Option<u32>,
        pose: u16,
        workspace: Option<f64>,
        seed: u32,
    ) -> Result<Self, Failure> {
        let opened = &maps.get().opened;
        let maps = *opened.borrow_dependent();
        let own = maps.stopping();
        let limit = max_touches.unwrap_or(own.max_touches());
        if !(1..=locate::TOUCHES as u32).contains(&limit) {
            return Err(Error::setting("max_touches", limit, format!("1 to {}", locate::TOUCHES)).into());
        }
        let stopping = compile::stopping(error_rate.unwrap_or(own.error_rate()), limit)?;
        let stopping = if error_rate.is_none() { own.with_max_touches(limit) } else { stopping };
        let within = locate::workspace(&maps, workspace)?;
        let hand = Hand::of(&maps).ok_or_else(locate::no_hand)?;
        let mut cell = OpenedLocator::new(Arc::clone(opened), |opened| {
            locate::locating(*opened.borrow_dependent(), stopping, None)
        });
        cell.with_dependent_mut(|_, locating| locating.begin(seed));
        Ok(Self { cell, hand, within, pose, seed, next: None })
    }

    /// Takes in a touch: three contact times in seconds on any clock, `None` or NaN for a finger that touched nothing, neither
    /// object nor table; `position`, x, y and z in millimeters of the middle fingertip's lowest point at the first contact (or of
    /// the approach where there was none), 0 being the table; and `alignment`, the direction from the first finger to the third,
    /// a unit vector or degrees from the x axis, such as the roll that `next` gave.
    fn push<'py>(
        &mut self,
        py: Python<'py>,
        times: Three,
        position: Three,
        alignment: Row,
    ) -> Result<objects::Located<'py>, Failure> {
        let Three(times) = times;
        let touch = touch_of_seconds(times, Some([0.0, 0.0, -1.0]), Some(alignment.0))
            .and_then(|touch| located(touch, position.all()))?;
        let seen = locate::seen(&self.hand, &touch)?;
        self.take(py, seen)
    }

    /// Takes in the heights above the table that three fingertips met, in millimeters, `None` or NaN for a finger that met nothing.
    /// `x` and `y` are the middle finger's, at most 2 m from the table's origin, `alignment` is as for `push`, and `lowest` is the
    /// height down to which the hand went, 0 or less where it would have met the table.
    #[pyo3(signature = (heights, x, y, alignment, *, lowest=0.0))]
    fn push_heights<'py>(
        &mut self,
        py: Python<'py>,
        heights: Three,
        x: f64,
        y: f64,
        alignment: Row,
        lowest: f64,
    ) -> Result<objects::Located<'py>, Failure> {
        let (Three(met), Row(row)) = (heights, alignment);
        let seen = Heights { met, place: [x, y], row, lowest }.seen(&self.hand)?;
        self.take(py, seen)
    }

    /// Next approach: x and y of the middle finger in millimeters, and the roll of the row of fingers in degrees from the x
    /// axis. The same until another touch is taken in.
    fn next(&mut self) -> (f64, f64, f64) {
        let (hand, within, pose, seed) = (self.hand, self.within, self.pose, self.seed);
        let next = self.next.unwrap_or_else(|| {
            self.cell.with_dependent_mut(|_, locating| match locating.touches() {
                // In the middle, as in a calibration.
                0 => Approach { roll: seed.to_le_bytes()[0].wrapping_mul(101), ..Approach::default() },
                _ => locating.choose(&hand, within, pose),
            })
        });
        self.next = Some(next);
        (f64::from(next.x) / 1e3, f64::from(next.y) / 1e3, f64::from(next.roll) * 360.0 / 256.0)
    }

    /// The verdict and the place after the last touch.
    #[getter]
    fn located<'py>(&self, py: Python<'py>) -> Result<objects::Located<'py>, Failure> {
        self.say(py)
    }

    /// The number of touches taken in since the last `reset`.
    #[getter]
    fn touches(&self) -> usize {
        self.cell.borrow_dependent().touches()
    }

    /// The posterior of each object so far.
    #[getter]
    fn posteriors(&self) -> std::collections::HashMap<String, f64> {
        let maps = self.cell.borrow_owner().borrow_dependent();
        let posteriors = self.cell.borrow_dependent().posteriors().into_iter().enumerate();
        posteriors.map(|(object, posterior)| (maps.object_name(object).to_owned(), posterior)).collect()
    }

    /// Forgets all touches, for the next object. `weights` say how often each object lies there, in any unit.
    #[pyo3(signature = (weights=None))]
    fn reset(&mut self, weights: Option<Vec<f64>>) -> Result<(), Failure> {
        let objects = self.cell.borrow_owner().borrow_dependent().objects();
        if let Some(count) = weights.as_ref().map(Vec::len).filter(|&count| count != objects) {
            return Err(Error::setting("weights", format!("a list of {count}"), format!("a list of {objects}")).into());
        }
        let weights = weights.as_deref().map(compile::weights).transpose()?;
        self.seed = self.seed.wrapping_add(1);
        self.next = None;
        let seed = self.seed;
        self.cell.with_dependent_mut(|_, locating| {
            locating.begin(seed);
            if let Some(weights) = weights {
                locating.begin_of(&weights);
            }
        });
        Ok(())
    }
}

impl Locator {
    fn take<'py>(&mut self, py: Python<'py>, seen: Seen) -> Result<objects::Located<'py>, Failure> {
        py.detach(|| self.cell.with_dependent_mut(|_, locating| locating.push(seen)));
        self.next = None;
        self.say(py)
    }

    fn say<'py>(&self, py: Python<'py>) -> Result<objects::Located<'py>, Failure> {
        static LOCATED: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static MODE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let (maps, locating) = (self.cell.borrow_owner().borrow_dependent(), self.cell.borrow_dependent());
        let best = locating.best();
        let degrees = |turn: u16| f64::from(turn) * 360.0 / 65_536.0;
        let mode = class(py, "Mode", &MODE)?;
        let mut modes = Vec::new();
        for pose in locating.poses(best) {
            let [x, y] = pose.position.map(|micrometers| f64::from(micrometers) / 1e3);
            let [x_within, y_within] = pose.within.map(|micrometers| f64::from(micrometers) / 1e3);
            let turned = pose.yaw_within.map(|within| (degrees(pose.yaw), degrees(within)));
            let share = f64::from(pose.share) / 65_536.0;
            let (yaw, yaw_within) = turned.unzip();
            let placement = maps.placement_name(pose.placement);
            modes.push(mode.call1((placement, x, y, yaw, x_within, y_within, yaw_within, share))?);
        }
        let posterior = locating.posteriors().get(best).copied().unwrap_or(0.0);
        let modes = pyo3::types::PyTuple::new(py, modes)?;
        let made = class(py, "Located", &LOCATED)?.call1((
            locating.verdict().name(),
            maps.object_name(best),
            posterior,
            locating.touches(),
            modes,
            locating.met_table_alone(),
            locating.leader() != best,
            locating.is_exhausted(),
        ))?;
        Ok(objects::Located(made))
    }
}
