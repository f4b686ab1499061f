//! Rows of a sequence, also those that are no evidence: for models that state which rows they take.

use super::recognizer::{Recognizer, Verdict};
use crate::model::{Model, Refused};
use palpate_shared::MISSING_FEATURE;

/// Rows of a sequence so far, for a model that states which rows it [takes](Model::guard): it refuses those of a sensor that is
/// dead, stuck or out of its range. Has room for up to `F` features.
///
/// State: two numbers of 32 bits for each feature, and one more.
#[derive(Clone, Debug)]
pub struct RowsSeen<const F: usize> {
    rows: u32,
    /// For each feature its value in the last row, and the number of rows that it has been the same.
    last: [(i32, u32); F],
}

impl<const F: usize> Default for RowsSeen<F> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const F: usize> RowsSeen<F> {
    /// No row of a sequence.
    pub const fn new() -> Self {
        Self { rows: 0, last: [(MISSING_FEATURE, 0); F] }
    }

    /// Begins another sequence, beside [`Recognizer::reset`].
    pub const fn reset(&mut self) {
        self.rows = 0;
    }

    /// Number of rows since the last [`reset`](Self::reset), with those that were refused.
    pub const fn rows(&self) -> u32 {
        self.rows
    }

    /// Takes in the measured features of the next row, and returns all of them, with the row's number if the model has a
    /// [position](Model::position): those that [`Model::margins_of`] takes.
    ///
    /// Cost: a few instructions for each feature. Cannot fail otherwise.
    ///
    /// # Errors
    /// [`Refused::Guarded`] for the first feature that the model does not take; the row counts nevertheless.
    /// [`Refused::NeedsSeen`] for a model with more than `F` features, and [`Refused::NeedsTouches`] for one over touches.
    pub fn next(&mut self, model: &Model<'_>, measured: &[i32]) -> Result<[i32; F], Refused> {
        if model.descriptor().is_some() {
            return Err(Refused::NeedsTouches);
        }
        if model.feature_count() > F {
            return Err(Refused::NeedsSeen);
        }
        let is_first = self.rows == 0;
        self.rows = self.rows.saturating_add(1);
        let mut features = [MISSING_FEATURE; F];
        model.number(measured, self.rows, &mut features);
        let Some(guard) = model.guard() else { return Ok(features) };
        let sentinel = model.sentinel();
        let mut refused = None;
        for (number, ((feature, last), limits)) in (0..).zip(features.iter().zip(&mut self.last).zip(guard.limits())) {
            let value = sentinel.map_or(*feature, |sentinel| sentinel.or_missing(*feature));
            let (before, equal) = *last;
            let equal = if is_first || value != before { 1 } else { equal.saturating_add(1) };
            *last = (value, equal);
            if let (Err(fault), None) = (limits.check(value, equal), refused) {
                refused = Some(Refused::Guarded(number, fault));
            }
        }
        refused.map_or(Ok(features), Err)
    }
}

impl<const N: usize> Recognizer<'_, N> {
    /// Takes in a row like [`push_features`](Self::push_features), unless the model does not [take](Model::guard) it: such a row
    /// adds nothing to the evidence and is not one of the [`touches`](Self::touches), but it counts where the model has a
    /// [position](Model::position). Both states begin a sequence together: [`reset`](Self::reset) and [`RowsSeen::reset`].
    ///
    /// Cost: that of `push_features`, and a few instructions for each feature. Cannot fail otherwise.
    ///
    /// # Errors
    /// Errors of [`RowsSeen::next`].
    pub fn push_seen<const F: usize>(&mut self, measured: &[i32], seen: &mut RowsSeen<F>) -> Result<Verdict, Refused> {
        let features = seen.next(self.model(), measured)?;
        let mut margins = [0; N];
        self.model().margins_of(&features, &mut margins);
        Ok(self.push_margins(&margins))
    }
}
