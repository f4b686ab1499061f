//! Accuracy of a model, and its distance from its ensemble. Results come as JSON, which `palpate` turns into values of
//! its own classes.

use crate::data::DataSet;
use crate::ensemble::Ensemble;
use crate::failure::Failure;
use crate::model::Model;
use crate::named::noise_of;
use crate::work::{Callback, long};
use palpate::compile;
use palpate::ensemble::StatedProbe;
use palpate::evaluate::{self as library, LEAST_GROUPS, Margins, Settings, add_noise, parity::parity as compare};
use palpate::with;
use pyo3::prelude::*;

/// A model of either kind.
#[derive(pyo3::FromPyObject)]
pub(crate) enum Evaluated<'py> {
    /// A compiled one.
    Model(Bound<'py, Model>),
    /// The full one.
    Ensemble(Bound<'py, Ensemble>),
}

/// Evaluates a model on touches that it was not trained on, and returns what `palpate evaluate --json` prints.
#[pyo3::pyfunction]
#[pyo3(signature = (model, data, *, at=None, groups=1000, error_rate=None, max_touches=None, noise="", timer="", seed=1))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn evaluate(
    py: Python<'_>,
    model: Evaluated<'_>,
    data: Bound<'_, DataSet>,
    at: Option<Vec<usize>>,
    groups: usize,
    error_rate: Option<f64>,
    max_touches: Option<u32>,
    noise: &str,
    timer: &str,
    seed: u64,
) -> Result<String, Failure> {
    let noise = noise_of(noise, timer)?;
    let (compiled, exact);
    let model = match &model {
        Evaluated::Model(model) => model.get().model(),
        Evaluated::Ensemble(ensemble) => {
            compiled = compile::exact(&ensemble.get().ensemble)?;
            exact = compiled.model();
            &exact
        }
    };
    let data = &data.get().dataset;
    let names = compile::names(model);
    let evaluation = long(py, None, |_| {
        let mut dataset = (**data).clone().matching(&names);
        // What the touches have already counts too.
        let stated = dataset.real().and(&noise);
        add_noise(&mut dataset, &noise, seed)?;
        let margins = Margins::new(model, &dataset)?;
        let (usual, enough) = (Settings::default(), |count: u64| count >= LEAST_GROUPS);
        let at_approaches = at.clone().unwrap_or(usual.at_approaches);
        let at = at.unwrap_or_else(|| usual.at.into_iter().filter(|&at| enough(margins.distinct_groups(at))).collect());
        let fewest = margins.fewest_approaches();
        let at_approaches = at_approaches.into_iter().filter(|&at| at <= fewest).collect();
        let settings =
            with!(Settings::default(), at, at_approaches, groups, error_rate, max_touches, seed, noise = stated);
        library::evaluate(&margins, &settings)
    })?;
    json(&evaluation)
}

/// Compares a compiled model with its ensemble on every touch of a data set and on random sequences, and returns what
/// `palpate verify --json` prints.
#[pyo3::pyfunction]
#[pyo3(signature = (ensemble, model, data, *, sequences=10_000, seed=1, progress=None))]
pub(crate) fn parity(
    py: Python<'_>,
    ensemble: Bound<'_, Ensemble>,
    model: Bound<'_, Model>,
    data: Bound<'_, DataSet>,
    sequences: usize,
    seed: u64,
    progress: Option<Callback>,
) -> Result<String, Failure> {
    let (ensemble, model, data) = (&ensemble.get().ensemble, model.get().model(), &data.get().dataset);
    let longest = model.trained_touches().largest_spread;
    StatedProbe::compare_with(["the model", "the data set"], model.probe(), longest, data)?;
    let found = long(py, progress.as_ref(), |progress| {
        let data = (**data).clone().matching(&ensemble.objects);
        compare(ensemble, model, &data, sequences, seed, progress)
    })?;
    json(&found)
}

fn json(value: &impl serde::Serialize) -> Result<String, Failure> {
    // Numbers, names and lists are always JSON.
    Ok(serde_json::to_string(value).unwrap_or_default())
}
