//! Objects that a model does not know.

use super::Candidate;
use super::margins::Margins;
use super::sequential::{Outcome, Sequential, SequentialSettings};
use crate::error::Result;
use serde::Serialize;
use std::collections::BTreeMap;

/// Numbers of touches by which strangers are counted as detected.
pub const DETECTED_BY: [usize; 3] = [30, 60, 120];

/// Results of a recognizer that stops by itself on objects that its model does not know. Touches are those that are
/// evidence; each object is weighted equally.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Strangers {
    /// True if the model has a misfit test; without one no stranger is ever detected.
    pub has_test: bool,
    /// Share of the known objects' sequences that ended as unknown.
    pub false_alarms: f64,
    /// By numbers of touches, the share of the strangers' sequences whose verdict was unknown by then.
    pub detected: BTreeMap<usize, f64>,
    /// Share of the strangers' sequences that got a name.
    pub wrong_name: f64,
    /// Share of the strangers' sequences without a verdict.
    pub undecided: f64,
    /// [`Strangers::detected`] for each stranger.
    pub detected_per_object: BTreeMap<String, BTreeMap<usize, f64>>,
    /// [`Strangers::wrong_name`] for each stranger.
    pub wrong_name_per_object: BTreeMap<String, f64>,
    /// Share of sequences that ended as unknown, for each known object.
    pub false_alarms_per_object: BTreeMap<String, f64>,
}

/// Verdicts of a model on sequences of strangers; `known` are those on sequences of objects that it knows, under the
/// same settings. `strangers` are the model's margins for [objects that it does not know](Margins::of_strangers).
///
/// # Errors
/// As [`Margins::sequential`].
pub fn strangers(
    known: (&Margins<'_>, &Sequential),
    strangers: &Margins<'_>,
    settings: &SequentialSettings,
) -> Result<Strangers> {
    let found = strangers.sequential(settings)?;
    let names = || strangers.tested_names().iter().cloned();
    let by = |outcomes: &[Outcome], at: usize| {
        let detected = outcomes.iter().filter(|outcome| outcome.unknown && outcome.touches <= at);
        detected.count() as f64 / outcomes.len().max(1) as f64
    };
    let mean_by = |at: usize| {
        let shares = found.outcomes.iter().map(|outcomes| by(outcomes, at));
        shares.sum::<f64>() / found.outcomes.len().max(1) as f64
    };
    let named = strangers.wrong(&found.outcomes);
    let alarms = known.0.unknown(&known.1.outcomes);
    let has_test = match strangers.candidate {
        Candidate::Compiled(model) => model.strangers().is_some_and(|strangers| strangers.test.is_some()),
        Candidate::Full(_) => false,
    };
    Ok(Strangers {
        has_test,
        false_alarms: alarms.all.value,
        detected: DETECTED_BY.map(|at| (at, mean_by(at))).into(),
        wrong_name: named.all.value,
        undecided: found.undecided,
        detected_per_object: names()
            .zip(&found.outcomes)
            .map(|(name, outcomes)| (name, DETECTED_BY.map(|at| (at, by(outcomes, at))).into()))
            .collect(),
        wrong_name_per_object: named.per_object,
        false_alarms_per_object: alarms.per_object,
    })
}
