//! Accuracy of a model over rows, row by row, or the error of a regression.

use super::estimate::Estimate;
use super::predict::{Predicted, predict};
use crate::error::{Result, problem};
use crate::rows::Rows;
use crate::rows::not_a_class;
use palpate_onboard::Model;
use std::collections::BTreeMap;

/// Results of a model on labeled rows.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RowsEvaluation {
    /// Rows.
    pub rows: usize,
    /// Results of a model of classes.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub classes: Option<Classes>,
    /// Results of a model with one output.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub regression: Option<Regression>,
}

/// Results of a model of classes, each row taken alone.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Classes {
    /// Share of the rows whose class is the predicted one.
    pub accuracy: f64,
    /// Its standard error.
    pub accuracy_standard_error: f64,
    /// This share for the rows of each class present.
    pub per_class: BTreeMap<String, f64>,
    /// The classes, in the model's order.
    pub names: Vec<String>,
    /// Confusion matrix: number of rows of each class (outer) recognized as each (inner).
    pub confusion: Vec<Vec<usize>>,
}

/// Error of a regression: its values after the inverse link, as the library predicts them.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Regression {
    /// The mean of the absolute differences.
    pub mean_absolute_error: f64,
    /// The root of the mean of their squares.
    pub root_mean_square_error: f64,
}

/// Compares a model's answers with the rows' labels: names of classes or their numbers, or for one output numbers.
///
/// # Errors
/// For a model that is not over rows, rows of another number of features, and labels that are none.
pub fn evaluate_rows(model: &Model<'_>, rows: &Rows) -> Result<RowsEvaluation> {
    let names = crate::compile::names(model);
    let predicted = predict(model, &rows.values, rows.features, false)?;
    let label = |row: usize| rows.labels.get(row).map_or("", String::as_str);
    let wrong = |row: usize, known: &str| not_a_class(label(row), row + 1, known);
    let classes = match predicted {
        Predicted::Classes(classes) => classes,
        Predicted::Values(_) if names.len() > 1 => {
            return Err(problem!("the model has {} targets, and a row has one label", names.len()).fix(
                "Compare the values that `palpate rows recognize` prints for each row, or `palpate verify` with the \
                 library's margins.",
            ));
        }
        Predicted::Values(values) => {
            let (mut absolute, mut squares) = (0.0, 0.0);
            for (row, &value) in values.iter().enumerate() {
                let truth: f64 = label(row).parse().map_err(|_| wrong(row, "numbers"))?;
                let difference = f64::from(value) - truth;
                absolute += difference.abs();
                squares += difference * difference;
            }
            let count = values.len() as f64;
            let regression =
                Regression { mean_absolute_error: absolute / count, root_mean_square_error: (squares / count).sqrt() };
            return Ok(RowsEvaluation { rows: values.len(), classes: None, regression: Some(regression) });
        }
    };
    let mut confusion = vec![vec![0; names.len()]; names.len()];
    for (row, &class) in classes.iter().enumerate() {
        let truth = crate::rows::class(&names, label(row)).ok_or_else(|| wrong(row, &names.join(", ")))?;
        confusion[truth][class] += 1;
    }
    let right: usize = (0..names.len()).map(|class| confusion[class][class]).sum();
    let accuracy = Estimate::share(right, rows.len());
    let of_class = |(class, name): (usize, &String)| {
        let count: usize = confusion[class].iter().sum();
        (count > 0).then(|| (name.clone(), confusion[class][class] as f64 / count as f64))
    };
    let per_class = names.iter().enumerate().filter_map(of_class).collect();
    let (accuracy, accuracy_standard_error) = (accuracy.value, accuracy.standard_error);
    let classes = Classes { accuracy, accuracy_standard_error, per_class, names, confusion };
    Ok(RowsEvaluation { rows: rows.len(), classes: Some(classes), regression: None })
}
