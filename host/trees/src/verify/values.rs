//! A model's classes and values compared with the output of the library's own `predict`.

use super::reference::{Reference, Rounding, margins};
use super::{ClassDiffers, ValueDiffers};
use crate::compile::bound_of;
use crate::ensemble::TOLERATED;
use crate::error::{Error, Kind, Result, problem};
use crate::rows::{Rows, class, some};
use palpate_onboard::Model;
use palpate_shared::format::{Link, Prediction};

/// Distance between a model's predictions and the library's.
#[derive(Default)]
pub(super) struct OfPredictions {
    /// The largest difference of a value; `None` for classes.
    pub(super) error: Option<f64>,
    /// Rows with another class, or with a value farther away than rounding explains.
    pub(super) differ: usize,
    /// Rows of these that the rounding that the model states does not explain.
    pub(super) unexplained: usize,
    pub(super) first_class: Option<ClassDiffers>,
    pub(super) first_value: Option<ValueDiffers>,
}

/// Predictions that are not what the library's `predict` says.
fn wrong_values(what: &str) -> Error {
    Error::new(what).as_kind(Kind::Predictions).fix(
        "Give what the library's `predict` says of each row: a class, or the value of a regression, a column for each of \
         several targets. Where it gives probabilities (XGBoost's and LightGBM's boosters), give the class with the largest \
         one, of two classes the second one above 0.5.",
    )
}

/// Compares the given rows' classes or values with the library's.
pub(super) fn compare(
    model: &Model<'_>,
    reference: &Reference<'_>,
    rows: &Rows,
    library: &[Vec<String>],
) -> Result<OfPredictions> {
    if library.len() != rows.len() {
        let (values, rows) = (library.len(), rows.len());
        return Err(problem!("it has predictions of {values} rows, but there are {rows} rows")
            .fix("Give one line for each row, without a header.")
            .as_kind(Kind::Predictions));
    }
    let outputs = model.object_count();
    let is_value = outputs == 1 || model.prediction().targets;
    let wanted = if is_value { outputs } else { 1 };
    let mut found = OfPredictions { error: is_value.then_some(0.0), ..OfPredictions::default() };
    // A bound that is large against what the trees add up to explains nothing.
    let reach = reference.ensemble.reach();
    let allowed = |(output, reach): (usize, &f64)| bound_of(model, output).min(TOLERATED * reach);
    let allowed: Vec<f64> = reach.iter().enumerate().filter(|_| is_value).map(allowed).collect();
    for (number, (row, said)) in (1..).zip(rows.iter().zip(library)) {
        if said.len() != wanted {
            let (found, are) = (said.len(), if wanted == 1 { "is" } else { "are" });
            return Err(wrong_values(&format!("row {number} has {found} predictions, where {wanted} {are} needed")));
        }
        if is_value {
            values(model, reference, (number, row), (said, &allowed), &mut found)?;
        } else {
            classes(model, reference, (number, row), said.first().map_or("", String::as_str), &mut found)?;
        }
    }
    Ok(found)
}

fn classes(
    model: &Model<'_>,
    reference: &Reference<'_>,
    (number, row): (usize, &[f64]),
    said: &str,
    found: &mut OfPredictions,
) -> Result<()> {
    let names = crate::compile::names(model);
    let expected = class(&names, said);
    let unknown = || {
        let known = some(&names);
        wrong_values(&format!("the prediction {said:?} of row {number} is none of the model's classes: {known}"))
    };
    let expected = expected.ok_or_else(unknown)?;
    let encoded = reference.encoder.row(row);
    let own = model.predict_class(&encoded, &mut vec![0; model.object_count()]).unwrap_or_default();
    if own == expected {
        return Ok(());
    }
    found.differ += 1;
    let full = reference.margins(row, &encoded);
    let gap = (full[expected] - full[own]).abs();
    if !Rounding::of(model, reference).explains(gap) {
        found.unexplained += 1;
        let classes = [own, expected].map(|class| names[class].clone());
        found.first_class.get_or_insert(ClassDiffers { row: number, classes, gap });
    }
    Ok(())
}

/// Accepted distance of a value from the library's, beside the rounding of margins, in shares of the value: links are within
/// 5e-7 of it.
const LINK_ERROR: f64 = 2e-6;
/// Accepted distance without a link, where the library's value may be an f32.
const F32_ERROR: f64 = f32::EPSILON as f64;

fn values(
    model: &Model<'_>,
    reference: &Reference<'_>,
    (number, row): (usize, &[f64]),
    (said, allowed): (&[String], &[f64]),
    found: &mut OfPredictions,
) -> Result<()> {
    let prediction = model.prediction();
    let of_value = if prediction.link == Link::Identity { F32_ERROR } else { LINK_ERROR };
    let encoded = reference.encoder.row(row);
    let outputs = model.object_count();
    let mut own = vec![0.0; outputs];
    model.predict_each(&encoded, &mut vec![0; outputs], &mut own);
    let mut is_within = true;
    let mut first = None;
    for (((text, &own), margin), allowed) in said.iter().zip(&own).zip(margins(model, &encoded)).zip(allowed) {
        let own = f64::from(own);
        let wrong = |_| wrong_values(&format!("the prediction {text:?} of row {number} is no number"));
        let expected: f64 = text.parse().map_err(wrong)?;
        let ends = [-1.0, 1.0].map(|sign| exact(prediction, margin + sign * allowed));
        let slack = of_value * ends[0].abs().max(ends[1].abs()) + f64::from(f32::MIN_POSITIVE);
        if !(ends[0] - slack..=ends[1] + slack).contains(&expected) {
            is_within = false;
            first.get_or_insert(ValueDiffers { row: number, values: [own, expected] });
        }
        let error = (own - expected).abs();
        found.error = found.error.map(|worst| if error > worst || error.is_nan() { error } else { worst });
    }
    if !is_within {
        found.differ += 1;
        found.unexplained += 1;
        found.first_value = found.first_value.take().or(first);
    }
    Ok(())
}

/// The value that a margin stands for, in f64.
fn exact(prediction: Prediction, margin: f64) -> f64 {
    let x = margin / f64::from(prediction.average);
    match prediction.link {
        Link::Identity => x,
        Link::Logistic => 1.0 / (1.0 + (-x).exp()),
        Link::Exponential => x.exp(),
        Link::Square => x * x.abs(),
        Link::Softplus => x.max(0.0) + (-x.abs()).exp().ln_1p(),
    }
}
