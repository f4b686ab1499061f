//! Predictions of a model over rows: the class of each row, or its value.

use super::together::AT_ONCE;
use crate::error::Result;
use crate::rows::Encoder;
use crate::rows::check_columns;
use palpate_onboard::Model;
use palpate_shared::format::Prediction;
use rayon::prelude::*;

/// Predictions of a model for rows.
#[derive(Clone, Debug, PartialEq)]
pub enum Predicted {
    /// The class of each row, as its position among the model's.
    Classes(Vec<usize>),
    /// The value of each row; of a model with several targets those of each row, one after the other.
    Values(Vec<f32>),
}

/// The class with the largest margin, and of several the first or the last.
pub fn class_of(margins: &[f64], last_of_ties: bool) -> usize {
    let better =
        |class: usize, best: usize| margins[class] > margins[best] || last_of_ties && margins[class] == margins[best];
    (1..margins.len()).fold(0, |best, class| if better(class, best) { class } else { best })
}

/// The class by a model's own rule; 0 where outputs are targets, which are not classes.
pub(super) fn class_by(margins: &[f64], prediction: &Prediction) -> usize {
    if prediction.targets { 0 } else { class_of(margins, prediction.last_of_ties) }
}

/// Predicts as the library does that trained the model: classes by the largest margin, or the values of a regression, with
/// `raw` before their inverse link. `values` are rows of as many features as the model has. The model is asked as on a chip,
/// and gives the same bits.
///
/// # Errors
/// For a model that is not over rows, or rows of another number of features.
pub fn predict<V: Copy + Into<f64> + Sync>(
    model: &Model<'_>,
    values: &[V],
    features: usize,
    raw: bool,
) -> Result<Predicted> {
    if model.descriptor().is_some() {
        return Err(super::computes_features());
    }
    check_columns(features, model.feature_count())?;
    let outputs = model.object_count();
    let rows = values.par_chunks_exact(features).with_min_len(AT_ONCE / 16);
    let encoder = Encoder::of(model);
    if outputs == 1 || model.prediction().targets {
        let values = |room: &mut Vec<i32>, row: &[V]| {
            let (row, mut values) = (encoder.row(row), vec![0.0; outputs]);
            if raw {
                model.predict_raw_each(&row, room, &mut values);
            } else {
                model.predict_each(&row, room, &mut values);
            }
            values
        };
        return Ok(Predicted::Values(rows.map_init(|| vec![0; outputs], values).flatten_iter().collect()));
    }
    let class = |margins: &mut Vec<i32>, row: &[V]| model.predict_class(&encoder.row(row), margins).unwrap_or_default();
    Ok(Predicted::Classes(rows.map_init(|| vec![0; outputs], class).collect()))
}
