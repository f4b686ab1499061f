//! More from few sequences: those that a model was trained on, with margins of models that were trained without them.

use super::follow::follow;
use super::shape::{self, STRICTEST, shaped};
use super::{Rows, Settings, guard, taken};
use crate::calibrate::{Limit, Odds, odds_of};
use crate::compile::{self, Restated, restate};
use crate::error::{Error, Result, problem};
use crate::evidence::{Outcome, Totals};
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::Tag;
use palpate_trees::rows::{RowSequence, Sequences};
use serde::Serialize;

/// Sequences of the training, fold by fold, with margins of models that were trained on the other folds. The shape of evidence,
/// where a walk begins, and a guard can be learned from them. A promise cannot: these models are not the one that it is for.
#[derive(Clone, Debug, Default)]
pub struct Learned {
    /// Measured features of all of them.
    pub(super) sequences: Sequences,
    /// Row after row, one margin for each class, in nats.
    margins: Vec<f64>,
    /// Number of the first sequence of each fold.
    starts: Vec<usize>,
}

impl Learned {
    /// Adds a fold, with a model of the same features and classes that was trained without it.
    ///
    /// # Errors
    /// Errors of [`evaluate`](super::evaluate()); a model with other classes than those before.
    pub fn add(&mut self, model: &Model<'_>, fold: &Sequences) -> Result<()> {
        let rows = taken(model, fold)?;
        let margins = Rows::new(model, &rows);
        let all = &mut self.sequences;
        let (features, count) = (fold.features, fold.len() * margins.objects);
        if !self.starts.is_empty() && (all.features != features || self.margins.len() != all.len() * margins.objects) {
            return Err(other_folds());
        }
        all.features = features;
        self.starts.push(all.sequences.len());
        let (offset, groups) = (all.len(), all.groups.len());
        all.sequences.extend(fold.sequences.iter().map(|sequence| moved(sequence, offset, groups)));
        all.values.extend_from_slice(&fold.values);
        all.groups.extend(fold.groups.iter().cloned());
        self.margins.extend(margins.margins.iter().take(count).map(|&margin| f64::from(margin) * margins.unit));
        Ok(())
    }

    /// Its margins in the units of the model that was trained on all folds.
    ///
    /// # Errors
    /// A model with other features or classes.
    pub(super) fn units(&self, model: &Model<'_>) -> Result<Vec<i32>> {
        let is_same = self.sequences.features == model.measured_count()
            && self.margins.len() == self.sequences.len() * model.object_count();
        if !is_same {
            return Err(other_folds());
        }
        let most = f64::from(1 << 30);
        let unit = f64::from(model.unit());
        Ok(self.margins.iter().map(|margin| (margin / unit).round().clamp(-most, most) as i32).collect())
    }
}

/// Folds that do not belong to the model.
fn other_folds() -> Error {
    problem!("the folds have other features or classes than the model, or are fewer than two")
        .fix("Train the model of each fold as the model itself, on sequences of every class.")
}

/// Moves a sequence behind `rows` other rows and `groups` other groups.
pub(super) fn moved(sequence: &RowSequence, rows: usize, groups: usize) -> RowSequence {
    RowSequence {
        rows: sequence.rows.start + rows..sequence.rows.end + rows,
        class: sequence.class,
        group: sequence.group.map(|group| group + groups),
    }
}

/// A model with thresholds that promise nothing, and an estimate of its error rate.
#[derive(Clone, Debug, Serialize)]
pub struct Estimated {
    /// Bytes of the model.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// The error rate that was aimed at.
    pub aimed: f64,
    /// Share of the names given that were wrong: each fold under the shape and threshold of the others.
    pub error: f64,
    /// Share of the sequences without a name.
    pub undecided: f64,
    /// Rows used on average.
    pub mean_rows: f64,
    /// Sequences.
    pub sequences: usize,
    /// Margin at which the model stops, in nats.
    pub margin: f64,
}

/// Sets a model's shape and threshold for an error rate from the folds of its training, and estimates the error rate by
/// cross-fitting: each fold under the shape and the threshold that the others give. It is an estimate and no promise: losses
/// of folds depend on each other, and the model itself was tested on nothing.
///
/// # Errors
/// Fewer than two folds, or those of another model; errors of [`calibrate`](super::calibrate()) for settings out of their
/// ranges.
pub fn estimate(model: &Model<'_>, learned: &Learned, settings: &Settings) -> Result<Estimated> {
    super::check(model)?;
    settings.check()?;
    if learned.starts.len() < 2 {
        return Err(other_folds());
    }
    let rows = Rows::of(model, learned.units(model)?.into());
    let max_rows = settings.max_rows.unwrap_or(Stopping::from_model(model).max_touches());
    compile::stopping(settings.rate, max_rows)?;
    let all: Vec<&RowSequence> = learned.sequences.sequences.iter().collect();
    let limit = Limit { margin: STRICTEST, max_touches: max_rows };
    let fit = |own: &[&RowSequence]| -> Result<(Vec<u8>, f64)> {
        let fitted = shape::fit(&rows, own, settings.rate, max_rows);
        let bytes = shaped(model, &fitted, max_rows)?;
        let followed = follow(&compile::open(&bytes)?, &rows, own, limit);
        Ok((bytes, shape::margin_at(&followed, settings.rate).unwrap_or(STRICTEST)))
    };
    let mut outcomes: Vec<(usize, Outcome)> = Vec::new();
    let ends = learned.starts.iter().skip(1).copied().chain([all.len()]);
    for (start, end) in learned.starts.iter().copied().zip(ends) {
        let (bytes, margin) = fit(&[&all[..start], &all[end..]].concat())?;
        let odds = Odds::All(odds_of(margin));
        let own = follow(&compile::open(&bytes)?, &rows, &all[start..end], limit);
        outcomes.extend(own.iter().map(|sequence| (sequence.object, sequence.outcome(&odds))));
    }
    let totals = Totals::of(outcomes);
    let (bytes, margin) = fit(&all)?;
    let shaped = compile::open(&bytes)?;
    let guard = settings.guard.then(|| (true, guard::section(&shaped, &learned.sequences, &all)));
    let odds = Some(odds_of(margin));
    let restated = Restated { odds, sections: vec![(Tag::Guard, guard)], ..Restated::default() };
    Ok(Estimated {
        model: restate(&shaped, &restated)?,
        aimed: settings.rate,
        error: totals.error(),
        undecided: totals.share(totals.undecided()),
        mean_rows: totals.mean_touches(),
        sequences: totals.sequences,
        margin,
    })
}
