//! Accuracy of a model, and the touches that it needs.
//!
//! Margins are computed once for every test touch ([`Margins`]); everything else is sums of them over groups of touches,
//! each group drawn at random without replacement from one object's touches:
//!
//! - [`Curve`]: how often the object with the most evidence is the right one, after any fixed number of touches;
//! - [`Sequential`]: touches pushed one after the other until the recognizer is sure;
//! - [`Approaches`]: the same counted in approaches, on a data set that holds those.
//!
//! A touch that the model was not trained for is no evidence: it costs an approach, and nothing else.
//!
//! Models are evaluated by the onboard crate, the lines of code that run on the chip; an ensemble is compiled first, with its
//! own leaves ([`compile::exact`](crate::compile::exact)). The same seed draws the same groups for every model.
//!
//! Standard errors are those of the drawing of groups from the test touches.
//!
//! ```no_run
//! use palpate::compile;
//! use palpate::evaluate::{self, Margins};
//! use palpate::touches::Dataset;
//!
//! # fn main() -> palpate::Result<()> {
//! let compiled = compile::read_any("model.palpate")?;
//! let (model, unseen) = (compiled.model(), Dataset::read("unseen".as_ref())?);
//! let margins = Margins::new(&model, &unseen)?;
//! let evaluation = evaluate::evaluate(&margins, &evaluate::Settings::default())?;
//! println!("right after 10 touches: {:.1} %", 100.0 * evaluation.accuracy[&10]);
//! println!("sure after {:.1} touches", evaluation.sequential.mean_touches);
//! # Ok(())
//! # }
//! ```

mod approaches;
#[cfg(feature = "train")]
mod cost_of_noise;
mod curve;
mod margins;
mod measure;
mod noisy;
pub mod parity;
mod plan;
pub(crate) mod promise;
mod sequential;
mod strangers;
#[cfg(all(test, feature = "train"))]
mod tests;
pub mod together;
mod unfit;

pub use crate::evidence::Outcome;
use approaches::Accuracies;
pub use approaches::Approaches;
#[cfg(feature = "train")]
pub use cost_of_noise::{CostOfNoise, LEAST as LEAST_FOR_COST, cost_of_noise};
pub use curve::{Confidence, Curve};
pub(crate) use margins::OfTouches;
pub use margins::{Margins, delivered};
pub use measure::{Evaluated, Wanted, measure, own_weights};
#[cfg(feature = "train")]
pub(crate) use noisy::ROBOTS;
pub use noisy::add_noise;
pub use palpate_trees::verify::{self, Classes, Estimate, Regression, RowsEvaluation, evaluate_rows, predict};
pub use plan::{ActiveFacts, Hardest, Planned, no_plan, plan};
pub(crate) use plan::{by_pose, check_approaches};
pub(crate) use promise::by_theory;
pub use promise::{AlarmCheck, Finding, PromiseCheck};
pub(crate) use sequential::significant;
pub use sequential::{Sequential, SequentialSettings};
pub use strangers::OnStrangers;
pub(crate) use strangers::strangers;
pub use unfit::{over_touches, raw_features, too_many_objects};

use crate::error::{Error, Result};
use crate::probe::noise::Noise;
use palpate_shared::ContactPattern;
use serde::Serialize;
use std::collections::BTreeMap;

/// Accuracies that rest on fewer different groups than this say little.
pub const LEAST_GROUPS: u64 = 200;

/// Settings of an evaluation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Numbers of touches after which accuracy is wanted.
    pub at: Vec<usize>,
    /// Numbers of approaches after which accuracy is wanted, where the data set holds approaches.
    pub at_approaches: Vec<usize>,
    /// Groups, and sequences, drawn for each object.
    pub groups: usize,
    /// The recognizer stops when the posterior exceeds 1 minus this; `None` takes the model's own thresholds.
    pub error_rate: Option<f64>,
    /// Touches after which the recognizer gives up; `None` takes the model's own limit.
    pub max_touches: Option<u32>,
    /// Seed of the drawing.
    pub seed: u64,
    /// Noise added to the touches: the promise of a model is void with other noise.
    pub noise: Noise,
}

impl Settings {
    /// The settings of its sequences.
    pub(crate) fn sequences(&self) -> SequentialSettings {
        let Self { error_rate, max_touches, groups, seed, .. } = *self;
        SequentialSettings { error_rate, max_touches, sequences: groups, seed }
    }
}

impl Default for Settings {
    fn default() -> Self {
        let (at, at_approaches) = (vec![5, 10, 20, 30, 60], vec![10, 20, 60]);
        let noise = Noise::default();
        Self { at, at_approaches, groups: 1000, error_rate: None, max_touches: None, seed: 1, noise }
    }
}

/// Results of an evaluation; as JSON, `palpate evaluate --json`. Shares are between 0 and 1; maps go from numbers of
/// touches or objects' names to values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// The model's descriptor.
    pub descriptor: &'static str,
    /// Test touches, of all objects together, that are evidence to the model.
    pub touches: usize,
    /// Groups drawn for each object.
    pub groups: usize,
    /// Accuracy after a number of touches, each object weighted equally.
    pub accuracy: BTreeMap<usize, f64>,
    /// Standard error of [`Evaluation::accuracy`].
    pub accuracy_standard_error: BTreeMap<usize, f64>,
    /// [`Evaluation::accuracy`] for each object.
    pub per_object: BTreeMap<String, BTreeMap<usize, f64>>,
    /// Results of the recognizer that stops by itself.
    pub sequential: Sequential,
    /// Counted in approaches, where the data set holds those; touches that are no evidence to the model cost an
    /// approach and change nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub approaches: Option<Approaches>,
    /// Check of the model's promise: counted in approaches where the data set holds those.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promise: Option<PromiseCheck>,
    /// Check of the share of false alarms that the model's misfit test promises, on sequences that stop by its own thresholds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarms: Option<AlarmCheck>,
    /// Share of each contact pattern among the touches of the data set, each object weighted equally.
    pub patterns: BTreeMap<&'static str, f64>,
}

/// Evaluates a model on test touches.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting): `at` if a number of touches is 0 or more than an object has,
/// `groups` if there are none, `error_rate` and `max_touches` if they are out of their ranges.
pub fn evaluate(margins: &Margins<'_>, settings: &Settings) -> Result<Evaluation> {
    let most = settings.at.iter().copied().max().unwrap_or(0);
    let curve = margins.curve(most, settings.groups, settings.seed)?;
    if settings.at.contains(&0) {
        return Err(Error::setting("at", 0, "numbers of touches of at least 1"));
    }
    let stopping = settings.sequences();
    let sequential = margins.sequential(&stopping)?;
    let approaches = margins.hold_approaches.then(|| margins.approaches(&settings.at_approaches, &stopping));
    let approaches = approaches.transpose()?;
    let of_object = |position| settings.at.iter().map(|&at| curve.object_accuracy(position, at)).collect();
    let correct: Vec<Vec<Estimate>> = (0..margins.tested.len()).map(of_object).collect();
    let accuracies = margins.accuracies(&settings.at, &correct);
    Ok(margins.evaluation(settings, accuracies, sequential, approaches, false))
}

impl Margins<'_> {
    /// An evaluation, and what comes of the model's promises in it.
    fn evaluation(
        &self,
        settings: &Settings,
        accuracies: Accuracies,
        sequential: Sequential,
        approaches: Option<Approaches>,
        active: bool,
    ) -> Evaluation {
        let outcomes = approaches.as_ref().map_or(&sequential.outcomes, |approaches| &approaches.sequential.outcomes);
        // Other thresholds promise nothing.
        let is_own = settings.error_rate.is_none();
        let promise = || self.check_promise(outcomes, sequential.max_touches, &settings.noise, active);
        Evaluation {
            descriptor: self.descriptor.name(),
            touches: self.touch_count(),
            groups: settings.groups,
            accuracy: accuracies.all,
            accuracy_standard_error: accuracies.standard_error,
            per_object: accuracies.per_object,
            promise: if is_own { promise() } else { None },
            false_alarms: if is_own { self.check_alarms(outcomes) } else { None },
            sequential,
            approaches,
            patterns: ContactPattern::ALL.iter().map(|pattern| pattern.name()).zip(self.shares).collect(),
        }
    }
}
