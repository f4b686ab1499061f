//! Touch by touch to a verdict.

use crate::arrays::{ArrayLike, Input, columns, taken};
use crate::cells::OpenedRecognizer;
use crate::failure::Failure;
use crate::model::{Model, other_fields, touch};
use crate::objects::{self, class};
use numpy::ndarray::Ix1;
use palpate::compile;
use palpate::error::Error;
use palpate::evaluate::too_many_objects;
use palpate::onboard::{Refused, RowsSeen, Stopping, Verdict};
use palpate::rows::{Encoder, Features};
use palpate::shared::Touch;
use palpate::touches::Longest;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyList, PyString, PyTuple, PyType};
use pyo3::{Borrowed, type_hint_identifier};
use std::collections::HashMap;
use std::sync::Arc;

/// The first `N` numbers of a tuple, a list, an array or an iterator, NaN for `None`, and how many there are in all.
pub(crate) fn numbers<const N: usize>(object: Borrowed<'_, '_, PyAny>) -> PyResult<([f64; N], usize)> {
    let mut numbers = [f64::NAN; N];
    let mut count = 0;
    let mut take = |item: Bound<'_, PyAny>| {
        if let Some(slot) = numbers.get_mut(count)
            && !item.is_none()
        {
            *slot = item.extract()?;
        }
        count += 1;
        PyResult::Ok(())
    };
    if let Ok(tuple) = object.cast::<PyTuple>() {
        tuple.iter().try_for_each(&mut take)?;
    } else if let Ok(list) = object.cast::<PyList>() {
        list.iter().try_for_each(&mut take)?;
    } else {
        object.try_iter()?.try_for_each(|item| take(item?))?;
    }
    Ok((numbers, count))
}

/// A touch: three contact times in seconds, with the pose nine numbers.
pub(crate) struct TouchInput(Touch);

impl<'a, 'py> FromPyObject<'a, 'py> for TouchInput {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("palpate._types", "Touch");

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (numbers, count) = numbers::<9>(object)?;
        let touch = match numbers.get(..count) {
            Some(numbers) => touch(numbers),
            None => Err(other_fields(count)),
        };
        touch.map(Self).map_err(|error| Failure::from(error).into())
    }
}

/// Recognizes objects by touch, by the code that runs on the chip.
///
/// It stops when the model says so, or at a posterior of 1 - `error_rate`, and gives up after `max_touches`.
///
/// >>> import palpate
/// >>> model = palpate.compile(palpate.train(palpate.capture(["bowl", "mouse"], touches=1000)))
/// >>> recognizer = palpate.Recognizer(model)
/// >>> for touch in palpate.capture(["bowl", "fork"], touches=100, seed=2).times:
/// ...     verdict = recognizer.push(touch)
/// ...     if verdict.decided:
/// ...         break
/// >>> verdict.object
/// 'bowl'
#[pyo3::pyclass(module = "palpate._native")]
pub(crate) struct Recognizer {
    cell: OpenedRecognizer,
    encoder: Encoder,
    features: Features,
    seen: Box<RowsSeen<256>>,
    names: Vec<Py<PyString>>,
    /// The longest time between contacts that makes sense, in seconds.
    longest: Option<Longest>,
}

#[pyo3::pymethods]
impl Recognizer {
    #[new]
    #[pyo3(signature = (model, *, error_rate=None, max_touches=None))]
    fn new(
        py: Python<'_>,
        model: Bound<'_, Model>,
        error_rate: Option<f64>,
        max_touches: Option<u32>,
    ) -> Result<Self, Failure> {
        let model = model.get();
        let own = Stopping::from_model(model.model());
        let limit = max_touches.unwrap_or(own.max_touches());
        let stopping = compile::stopping(error_rate.unwrap_or(own.error_rate()), limit)?;
        // The model's own threshold stays as it is, to the last bit.
        let stopping = if error_rate.is_none() { own.with_max_touches(limit) } else { stopping };
        let cell = OpenedRecognizer::try_new(Arc::clone(&model.opened), |opened| {
            palpate::onboard::Recognizer::new(opened.borrow_dependent(), stopping).map_err(too_many_objects)
        })?;
        let names = compile::names(model.model()).iter().map(|name| PyString::new(py, name).unbind()).collect();
        let longest = model.model().descriptor().map(|_| compile::longest(model.model()));
        let (encoder, features) = (Encoder::measured(model.model()), Features::measured(model.model()));
        Ok(Self { cell, encoder, features, seen: Box::default(), names, longest })
    }

    /// Takes in a touch: three contact times in seconds on any clock, `None` or NaN for a finger that did not touch, with
    /// the probe's direction and alignment nine numbers. A touch that the model was not trained for is not counted: the
    /// verdict says why.
    fn push<'py>(&mut self, py: Python<'py>, touch: TouchInput) -> Result<objects::Verdict<'py>, Failure> {
        let TouchInput(touch) = touch;
        if let Some(longest) = &self.longest {
            longest.check(&touch)?;
        }
        // A little later than the stroke is missing, as on the chip.
        let touch = palpate::evaluate::delivered(self.cell.borrow_dependent().model(), &touch);
        let pushed = self.cell.with_dependent_mut(|_, recognizer| recognizer.push(&touch));
        self.say(py, pushed)
    }

    /// Takes in a row of features, for a model over those, with NaN for a missing one. The features of a pandas series are
    /// found by their names. A model with a `position` counts it itself since the last `reset`: the row has the other features.
    #[pyo3(signature = (row))]
    fn push_row<'py>(slf: &Bound<'py, Self>, row: ArrayLike<'py>) -> Result<objects::Verdict<'py>, Failure> {
        let (py, ArrayLike(row)) = (slf.py(), row);
        let is_series = row.hasattr("to_frame")?;
        let row = if is_series { py.import("palpate._rows")?.call_method1("row_of", (slf, row))? } else { row };
        let row: Input<'_, f64, Ix1> = row.extract()?;
        let mut own = slf.try_borrow_mut().map_err(PyErr::from)?;
        let row = match own.cell.borrow_dependent().model().descriptor() {
            None => own.encoder.row(&taken(&own.features, (row.values()?, row.values()?.len()))?),
            Some(_) => own.encoder.row(row.values()?),
        };
        let Self { cell, seen, .. } = &mut *own;
        let pushed = cell.with_dependent_mut(|_, recognizer| recognizer.push_seen(&row, seen));
        own.say(py, pushed)
    }

    /// The positions of the features among columns with these names, and a note about them.
    fn _columns(&self, header: Vec<String>) -> Result<(Vec<usize>, Option<&'static str>), Failure> {
        Ok(columns(&self.features, &header)?)
    }

    /// The verdict after the last touch.
    #[getter]
    fn verdict<'py>(&self, py: Python<'py>) -> Result<objects::Verdict<'py>, Failure> {
        self.say(py, Ok(self.cell.borrow_dependent().verdict()))
    }

    /// The number of touches counted since the last `reset`.
    #[getter]
    fn touches(&self) -> u32 {
        self.cell.borrow_dependent().touches()
    }

    /// The object with the most evidence so far, or the placement.
    #[getter]
    fn best(&self, py: Python<'_>) -> Py<PyString> {
        self.names[self.cell.borrow_dependent().best()].clone_ref(py)
    }

    /// The posterior of each output so far: of each object, or, of objects on a table, of each of their placements.
    #[getter]
    fn posteriors(&self) -> HashMap<String, f64> {
        let recognizer = self.cell.borrow_dependent();
        let names = compile::names(recognizer.model());
        names.into_iter().enumerate().map(|(object, name)| (name, recognizer.posterior(object).to_f64())).collect()
    }

    /// Forgets all touches, for the next object. `weights` say how often each object is touched, in place of the model's
    /// priors, in any unit.
    #[pyo3(signature = (weights=None))]
    fn reset(&mut self, weights: Option<Vec<f64>>) -> Result<(), Failure> {
        let weights = weights.as_deref().map(compile::weights).transpose()?;
        self.seen.reset();
        self.cell.with_dependent_mut(|_, recognizer| match weights {
            None => {
                recognizer.reset();
                Ok(())
            }
            Some(weights) => recognizer.reset_to(&weights).map_err(|_| {
                Error::setting("weights", "0 for every object", "a weight above 0 for an object at least")
            }),
        })?;
        Ok(())
    }
}

impl Recognizer {
    /// The verdict, or why the touch was not counted beside the verdict so far.
    fn say<'py>(&self, py: Python<'py>, pushed: Result<Verdict, Refused>) -> Result<objects::Verdict<'py>, Failure> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let recognizer = self.cell.borrow_dependent();
        let refused = pushed.err().map(|refused| palpate::stream::refusal(recognizer.model(), refused));
        let verdict = pushed.unwrap_or_else(|_| recognizer.verdict());
        let class = class(py, "Verdict", &CLASS)?;
        let made = match verdict {
            Verdict::Recognized { object, touches, .. } => {
                let object = usize::from(object);
                let (posterior, share) = recognizer.posterior_together(object);
                let (posterior, share) = (posterior.to_f64(), share.to_f64());
                let name = self.names[object].bind(py);
                class.call1((verdict.name(), name, posterior, touches, refused, share))?
            }
            other => class.call1((other.name(), py.None(), py.None(), recognizer.touches(), refused))?,
        };
        Ok(objects::Verdict(made))
    }
}
