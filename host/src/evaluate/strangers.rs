//! Objects that a model does not know.

use super::margins::Margins;
use super::sequential::{Sequential, SequentialSettings};
use crate::error::Result;
use crate::evidence::Outcome;
use serde::Serialize;
use std::collections::BTreeMap;

/// Numbers of touches by which strangers are counted as detected.
const DETECTED_BY: [usize; 3] = [30, 60, 120];

/// The largest share of sequences with used up touches at which a figure is given.
const USED_UP: f64 = 0.01;

/// Results of a recognizer that stops by itself on objects that its model does not know. Touches are those that are
/// evidence; each object is weighted equally. A share is not a number (null in JSON) where more than one sequence in a
/// hundred used up its touches before that: with more touches it could have got a name, or been detected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OnStrangers {
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
    /// Share of the strangers' sequences that used up their touches before a verdict and before the limit of touches.
    pub used_up: f64,
    /// The fewest touches that a stranger's sequence is drawn from.
    pub fewest_touches: usize,
    /// The limit of touches.
    pub max_touches: u32,
    /// [`OnStrangers::detected`] for each stranger.
    pub detected_per_object: BTreeMap<String, BTreeMap<usize, f64>>,
    /// [`OnStrangers::wrong_name`] for each stranger.
    pub wrong_name_per_object: BTreeMap<String, f64>,
    /// Share of sequences that ended as unknown, for each known object.
    pub false_alarms_per_object: BTreeMap<String, f64>,
}

/// Verdicts of a model on sequences of strangers; `known` are those on sequences of objects that it knows, under the
/// same settings. `strangers` are the model's margins for [objects that it does not know](Margins::of_strangers).
///
/// # Errors
/// Errors of [`Margins::sequential`].
pub(crate) fn strangers(
    known: (&Margins<'_>, &Sequential),
    strangers: &Margins<'_>,
    settings: &SequentialSettings,
) -> Result<OnStrangers> {
    let found = strangers.sequential(settings)?;
    let names = || strangers.tested_names.iter().cloned();
    let limit = usize::try_from(found.max_touches).unwrap_or(usize::MAX);
    let mean = |of: &dyn Fn(&[Outcome]) -> f64| {
        found.outcomes.iter().map(|outcomes| of(outcomes)).sum::<f64>() / found.outcomes.len().max(1) as f64
    };
    let used_up = |at: usize| move |outcomes: &[Outcome]| used_up(outcomes, at.min(limit));
    let known_if = |used_up: f64, share: f64| if used_up > USED_UP { f64::NAN } else { share };
    let detected = |at: usize| move |outcomes: &[Outcome]| share(outcomes, |own| own.unknown && own.touches <= at);
    let by = |outcomes: &[Outcome], at: usize| known_if(used_up(at)(outcomes), detected(at)(outcomes));
    let mean_by = |at: usize| known_if(mean(&used_up(at)), mean(&detected(at)));
    let named = strangers.share(&found.outcomes, |totals| totals.wrong);
    let alarms = known.0.share(&known.1.outcomes, |totals| totals.unknown);
    let all_used_up = mean(&used_up(limit));
    let has_test = strangers.model.strangers().is_some_and(|strangers| strangers.test.is_some());
    Ok(OnStrangers {
        has_test,
        false_alarms: alarms.all.value,
        detected: DETECTED_BY.map(|at| (at, mean_by(at))).into(),
        wrong_name: known_if(all_used_up, named.all.value),
        undecided: found.undecided,
        used_up: all_used_up,
        fewest_touches: strangers.fewest_touches(),
        max_touches: found.max_touches,
        detected_per_object: names()
            .zip(&found.outcomes)
            .map(|(name, outcomes)| (name, DETECTED_BY.map(|at| (at, by(outcomes, at))).into()))
            .collect(),
        wrong_name_per_object: named
            .per_object
            .into_iter()
            .map(|(name, share)| {
                let own = strangers.tested_names.iter().position(|tested| *tested == name);
                let outcomes = own.and_then(|own| found.outcomes.get(own)).map_or(&[][..], Vec::as_slice);
                (name, known_if(used_up(limit)(outcomes), share))
            })
            .collect(),
        false_alarms_per_object: alarms.per_object,
    })
}

fn share(outcomes: &[Outcome], is: impl Fn(&Outcome) -> bool) -> f64 {
    outcomes.iter().filter(|outcome| is(outcome)).count() as f64 / outcomes.len().max(1) as f64
}

/// Share of sequences that ended without a verdict before touch `at`, and before the limit: their touches were used up.
fn used_up(outcomes: &[Outcome], at: usize) -> f64 {
    share(outcomes, |outcome| outcome.recognized.is_none() && !outcome.unknown && outcome.touches < at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_that_used_up_their_touches_are_those_without_a_verdict_before_the_limit() {
        let outcome = |touches: usize, recognized: Option<usize>, unknown: bool| Outcome {
            touches,
            approaches: touches,
            recognized,
            output: recognized,
            unknown,
        };
        let outcomes =
            [outcome(15, None, false), outcome(15, None, true), outcome(9, Some(0), false), outcome(200, None, false)];
        assert_eq!([10, 30, 200].map(|at| used_up(&outcomes, at)), [0.0, 0.25, 0.25]);
    }
}
