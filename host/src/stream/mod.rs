//! Streams of rows: verdicts as early as a promised error rate allows, of any model over rows of features.
//!
//! ```text
//! sequences of rows ──► margins ─┬─ a quarter ──► what a row adds, how much rows count together (shape)
//!                                └─ the rest ───► sequences (follow) ──► thresholds, by Learn-then-Test
//! ```
//!
//! A sequence is the rows of one object in their order, with one class. It is used once, from its first row, as a whole: so
//! the promise holds whatever the dependence of its rows is. What it costs is rows, and that is what the shape saves:
//!
//! - *Evidence of a row.* A table from a class's margin to evidence, the same for all classes, monotone and bounded, with which
//!   a softmax of one row explains the classes best. It makes evidence of forests' votes, of one-against-all models and of
//!   margins of a hinge loss, which are no log-probabilities, and tames those of a model that is too sure of itself.
//! - *Weights.* Evidence of n rows counts as that of fewer independent ones: for each n the factor with which the posteriors
//!   after n rows explain the classes best. With it the threshold stays where a posterior's is, however long the rows are.
//!
//! Both are kept only if they save 5 % of the rows at the same error rate on sequences that they were not fitted to, or if
//! no threshold that a model can store keeps the rate without them. Nothing of the promise depends on that choice: it rests on
//! the other three quarters alone.
//!
//! Without groups sequences must be independent of each other; the test is binomial. With groups, such as persons or machines,
//! the promise is for new groups, and the test is a bet (Waudby-Smith and Ramdas, 2024).

#[cfg(feature = "train")]
mod background;
mod calibrate;
mod copies;
mod evaluate;
mod folds;
mod follow;
mod guard;
mod parts;
mod settings;
mod shape;

pub use calibrate::{calibrate, calibrate_with};
pub use evaluate::{Comparison, Evaluated, Grown, Point, PromiseOfSequences, Wanted, evaluate};
pub use folds::{Estimated, Learned, estimate};
pub use settings::Settings;
#[cfg(feature = "train")]
pub use settings::StrangerTest;

use crate::error::{Result, problem};
use crate::evaluate::over_touches;
use crate::evaluate::together::units_of_rows;
use palpate_onboard::{Model, Refused, RowsSeen};
use palpate_shared::format::Position;
use palpate_trees::rows::{Encoder, Sequences, feature_names};
use std::borrow::Cow;

/// The margins of rows, in a model's units.
#[derive(Clone, Debug)]
pub(crate) struct Rows<'r> {
    /// Row after row, one margin for each class.
    margins: Cow<'r, [i32]>,
    objects: usize,
    /// Number of classes that can be named.
    known: usize,
    /// Nats in a unit.
    unit: f64,
    /// Evidence before any row, in nats.
    priors: Vec<f64>,
}

impl Rows<'_> {
    /// The margins of all rows of sequences that were [taken], on all threads.
    pub(crate) fn new(model: &Model<'_>, sequences: &Sequences) -> Self {
        Self::of(model, units_of_rows(model, &Encoder::of(model), &sequences.values).into())
    }
}

/// Number of rows of all sequences.
fn rows_of(sequences: &Sequences) -> usize {
    sequences.sequences.iter().map(|sequence| sequence.rows.len()).sum()
}

/// Refuses rows of another number of measured features.
fn check_columns(model: &Model<'_>, sequences: &Sequences) -> Result<()> {
    crate::rows::check_columns(sequences.features, model.measured_count())
}

/// Sequences as a recognizer takes them: with the number of each row, if the model has a [position](Model::position), and
/// without the rows that its [guard](Model::guard) refuses.
///
/// # Errors
/// Errors of [`check`], and for rows of another number of measured features.
fn taken<'s>(model: &Model<'_>, sequences: &'s Sequences) -> Result<Cow<'s, Sequences>> {
    check(model)?;
    check_columns(model, sequences)?;
    let found = sequences.features;
    let position = model.position().map(|position| usize::from(position.feature));
    if position.is_none() && model.guard().is_none() {
        return Ok(Cow::Borrowed(sequences));
    }
    let encoder = Encoder::measured(model);
    let mut seen = RowsSeen::<256>::new();
    let mut all = Sequences { features: model.feature_count(), values: Vec::new(), ..sequences.clone() };
    for sequence in &mut all.sequences {
        let start = all.values.len() / all.features;
        seen.reset();
        for row in sequences.values[sequence.rows.start * found..sequence.rows.end * found].chunks_exact(found) {
            if seen.next(model, &encoder.row(row)).is_ok() {
                let (before, after) = row.split_at(position.unwrap_or(found));
                all.values.extend_from_slice(before);
                all.values.extend(position.map(|_| f64::from(seen.rows().min(Position::MOST))));
                all.values.extend_from_slice(after);
            }
        }
        sequence.rows = start..all.values.len() / all.features;
    }
    Ok(Cow::Owned(all))
}

impl<'r> Rows<'r> {
    /// Margins that were computed before, row after row, one for each of the model's classes, in its units.
    pub(crate) fn of(model: &Model<'_>, margins: Cow<'r, [i32]>) -> Self {
        let unit = f64::from(model.unit());
        let priors = (0..model.object_count()).map(|object| f64::from(model.prior(object)) * unit).collect();
        Self { margins, objects: model.object_count(), known: model.known_count(), unit, priors }
    }

    /// The margins of a row; nothing beyond the rows that there are.
    pub(crate) fn row(&self, row: usize) -> &[i32] {
        self.margins.get(row * self.objects..(row + 1) * self.objects).unwrap_or_default()
    }
}

/// Refuses a model that has no classes of rows.
///
/// # Errors
/// When the model is over touches, and for a model of one output.
pub fn check(model: &Model<'_>) -> Result<()> {
    if model.descriptor().is_some() {
        return Err(over_touches());
    }
    if model.known_count() < 2 {
        return Err(problem!(
            "the model predicts a value ({}), and not classes: its rows are no evidence for any",
            model.object_name(0)
        )
        .fix("Give a model of two or more classes."));
    }
    Ok(())
}

/// Reason why a row or touch is not counted, with the feature's name.
pub fn refusal(model: &Model<'_>, refused: Refused) -> String {
    match refused {
        Refused::Guarded(feature, _) => {
            let names = feature_names(model);
            let name = names.get(usize::from(feature)).map_or("", String::as_str);
            format!("{name}: {refused}")
        }
        _ => refused.to_string(),
    }
}
