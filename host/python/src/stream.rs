//! Sequences of rows: thresholds that keep a promise, and verdicts. Results come as JSON, which `palpate` turns into values of
//! its own classes.

use crate::arrays::{Input, taken};
use crate::failure::Failure;
use crate::model::Model;
use crate::work::{Callback, long};
use numpy::ndarray::Ix2;
use palpate::calibrate::Per;
use palpate::compile;
use palpate::error::Error;
use palpate::rows::{Features, RowOf, Sequences, SequencesBuilder};
use palpate::strangers;
use palpate::stream::{self, Learned, Settings, StrangerTest, Wanted};
use palpate::with;
use pyo3::prelude::*;

/// Sequences of an array's rows.
fn sequences(
    model: &palpate::onboard::Model<'_>,
    rows: &Input<'_, f64, Ix2>,
    labels: Option<&[String]>,
    ids: &[String],
    groups: Option<&[String]>,
) -> Result<Sequences, Failure> {
    let wanted = model.measured_count();
    let values = taken(&Features::measured(model), rows.rows()?)?;
    let count = values.len() / wanted;
    let lengths =
        [("y", labels.map(<[String]>::len)), ("sequence", Some(ids.len())), ("groups", groups.map(<[String]>::len))];
    for (name, length) in lengths {
        if let Some(length) = length.filter(|length| *length != count) {
            return Err(Error::setting(name, format!("{length} values"), format!("{count}, one for each row")).into());
        }
    }
    let mut classes = compile::names(model);
    classes.truncate(model.known_count());
    let mut builder = SequencesBuilder::new(wanted, &classes);
    for (number, row) in values.chunks_exact(wanted).enumerate() {
        let of = |texts: &'_ [String]| texts.get(number).map(String::as_str).unwrap_or_default().to_owned();
        let (label, group) = (labels.map_or_else(|| "0".into(), of), groups.map(of));
        let own = RowOf { label: &label, sequence: &ids[number], group: group.as_deref() };
        builder.push(row, own).map_err(|error| error.within(format_args!("row {}: ", number + 1)))?;
    }
    Ok(builder.finish()?)
}

/// A fold of a training: a model that was trained without it, its rows, labels, sequences and groups.
type Fold<'py> = (Bound<'py, Model>, Input<'py, f64, Ix2>, Vec<String>, Vec<String>, Option<Vec<String>>);

/// Folds with the margins of their models.
fn learned(folds: Vec<Fold<'_>>) -> Result<Learned, Failure> {
    let mut learned = Learned::default();
    for (model, rows, labels, ids, groups) in folds {
        let opened = model.get().model();
        learned.add(opened, &sequences(opened, &rows, Some(&labels), &ids, groups.as_deref())?)?;
    }
    Ok(learned)
}

/// Sets a model's threshold from the folds of its training, and returns the model and an estimate of its error rate.
#[pyo3::pyfunction]
#[pyo3(signature = (model, folds, *, error_rate, max_rows, guard))]
pub(crate) fn estimate_sequences(
    py: Python<'_>,
    model: Bound<'_, Model>,
    folds: Vec<Fold<'_>>,
    error_rate: f64,
    max_rows: Option<u32>,
    guard: bool,
) -> Result<(Model, String), Failure> {
    let opened = model.get().model();
    let learned = learned(folds)?;
    let settings = with!(Settings::default(), rate = error_rate, max_rows, guard);
    let found = long(py, None, |_| stream::estimate(opened, &learned, &settings))?;
    let text = json(&found);
    Ok((Model::of(found.model)?, text))
}

/// Sets a model's thresholds on sequences of rows, and returns the model and what `palpate rows calibrate --json` prints.
#[pyo3::pyfunction]
#[pyo3(signature = (model, rows, labels, sequence, *, groups=None, error_rate=0.01, per="average", confidence=0.95,
    max_rows=None, strangers=None, background=None, background_sequence=None, guard=false, learned=None,
    seed=1, progress=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn calibrate(
    py: Python<'_>,
    model: Bound<'_, Model>,
    rows: Input<'_, f64, Ix2>,
    labels: Vec<String>,
    sequence: Vec<String>,
    groups: Option<Vec<String>>,
    error_rate: f64,
    per: &str,
    confidence: f64,
    max_rows: Option<u32>,
    strangers: Option<&str>,
    background: Option<Input<'_, f64, Ix2>>,
    background_sequence: Option<Vec<String>>,
    guard: bool,
    learned: Option<Vec<Fold<'_>>>,
    seed: u64,
    progress: Option<Callback>,
) -> Result<(Model, String), Failure> {
    let opened = model.get().model();
    stream::check(opened)?;
    let rows = sequences(opened, &rows, Some(&labels), &sequence, groups.as_deref())?;
    let known = Per::ALL.iter().copied().find(|own| own.name() == per);
    let per = known.ok_or_else(|| Error::setting("per", per, "average, name or object"))?;
    if let Some(name) = strangers.filter(|name| *name != "likely") {
        return Err(Error::setting("strangers", name, "likely or None").into());
    }
    let others = background
        .map(|rows| sequences(opened, &rows, None, background_sequence.as_deref().unwrap_or_default(), None))
        .transpose()?;
    let learned = learned.map(self::learned).transpose()?;
    let calibrated = long(py, progress.as_ref(), |progress| {
        let strangers = strangers
            .map(|_| {
                let test = with!(strangers::Settings::default(), confidence, seed);
                StrangerTest::new(test, opened, others.as_ref())
            })
            .transpose()?;
        let settings = with!(Settings::default(), rate = error_rate, per, confidence, max_rows, guard, strangers, seed);
        match &learned {
            None => stream::calibrate(opened, &rows, &settings, progress),
            Some(learned) => stream::calibrate_with(opened, &rows, learned, &settings, progress),
        }
    })?;
    let text = json(&calibrated);
    Ok((Model::of(calibrated.model)?, text))
}

/// Measures a model on sequences of rows, and returns what `palpate rows evaluate --json` prints.
#[pyo3::pyfunction]
#[pyo3(signature = (model, rows, labels, sequence, *, groups=None, error_rate=None, max_rows=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn evaluate_sequences(
    py: Python<'_>,
    model: Bound<'_, Model>,
    rows: Input<'_, f64, Ix2>,
    labels: Vec<String>,
    sequence: Vec<String>,
    groups: Option<Vec<String>>,
    error_rate: Option<f64>,
    max_rows: Option<u32>,
) -> Result<String, Failure> {
    let opened = model.get().model();
    stream::check(opened)?;
    let rows = sequences(opened, &rows, Some(&labels), &sequence, groups.as_deref())?;
    let wanted = Wanted { error_rate, max_rows, ..Wanted::default() };
    let found = long(py, None, |_| stream::evaluate(opened, &rows, &wanted))?;
    Ok(json(&found))
}

fn json(value: &impl serde::Serialize) -> String {
    // Numbers, names and lists are always JSON.
    serde_json::to_string(value).unwrap_or_default()
}
