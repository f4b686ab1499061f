//! XGBoost itself as the trainer: version 1.6.2, built from source behind the cargo feature `xgboost`.

use super::{BASE_MARGIN, Rows, Settings, trainer_refused};
use crate::ensemble::{Ensemble, schema};
use crate::error::Result;
use crate::progress::{self, Progress};
use std::collections::HashMap;
use xgboost_rs::{Booster, DMatrix, XGBError};

/// Trains as [`super::train`] does, on rows of `objects`.
pub(super) fn train(
    rows: &Rows,
    settings: &Settings,
    objects: Vec<String>,
    progress: &dyn Progress,
) -> Result<Ensemble> {
    let failed = |error: XGBError| trainer_refused("XGBoost", &error);
    let data = matrix(rows, settings).map_err(failed)?;
    let mut booster = Booster::new_with_json_config(&[&data], parameters(settings, objects.len())).map_err(failed)?;
    progress.begin("training", u64::try_from(settings.rounds).ok());
    for round in 0..settings.rounds {
        // At most 10,000 rounds are allowed.
        booster.update(&data, i32::try_from(round).unwrap_or(i32::MAX)).map_err(failed)?;
        progress::advance(progress, 1)?;
    }
    let json = booster.save_to_buffer("json".into()).map_err(failed)?;
    Ensemble::from_xgboost(json.as_bytes(), schema(settings.descriptor), objects)
}

/// The wrapper swallows what XGBoost says about parameters, so each is written out, defaults that later versions changed
/// included.
fn parameters(settings: &Settings, objects: usize) -> HashMap<String, String> {
    let threads = settings.threads.unwrap_or_else(rayon::current_num_threads);
    let parameters = [
        ("objective", "multi:softprob".into()),
        ("num_class", objects.to_string()),
        ("tree_method", "hist".into()),
        ("base_score", BASE_MARGIN.to_string()),
        ("max_depth", settings.depth.to_string()),
        ("eta", settings.eta.to_string()),
        ("min_child_weight", settings.min_child_weight.to_string()),
        ("max_bin", settings.bins.to_string()),
        ("seed", settings.seed.to_string()),
        ("nthread", threads.to_string()),
        ("verbosity", "0".into()),
    ];
    parameters.map(|(name, value)| (name.into(), value)).into()
}

/// The rows as XGBoost's matrix. Its simpler constructor would take every 0, the first contact's time, as missing.
fn matrix(rows: &Rows, settings: &Settings) -> Result<DMatrix, XGBError> {
    let (count, columns) = (rows.labels.len(), rows.columns);
    let threads = i32::try_from(settings.threads.unwrap_or(1)).unwrap_or(1);
    let value = size_of::<f32>();
    let (row_stride, column_stride) = (columns * value, value);
    let mut matrix =
        DMatrix::from_col_major_f32(&rows.features, row_stride, column_stride, count, columns, threads, f32::NAN)?;
    // There are at most 256 objects.
    let labels: Vec<f32> = rows.labels.iter().map(|&label| label as f32).collect();
    matrix.set_labels(&labels)?;
    if let Some(weights) = &rows.weights {
        matrix.set_weights(weights)?;
    }
    Ok(matrix)
}
