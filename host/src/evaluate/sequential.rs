//! Touching until sure.

use super::Estimate;
use super::margins::Margins;
use crate::compile;
use crate::error::{Error, Result};
use crate::evidence::{Outcome, Totals, chip, outcome};
use palpate_onboard::Stopping;
use palpate_shared::format::Per;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Settings for drawing and stopping sequences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequentialSettings {
    /// The recognizer stops when the posterior exceeds 1 minus this; `None` takes the model's own thresholds.
    pub error_rate: Option<f64>,
    /// Touches after which it gives up; `None` takes the model's own limit. An object with fewer test touches gives up when
    /// they are used up.
    pub max_touches: Option<u32>,
    /// Sequences for each object.
    pub sequences: usize,
    /// Seed of the drawing.
    pub seed: u64,
}

/// Results of a recognizer that stops by itself, counted in touches or approaches. Each object is weighted by its prior: equally, unless the model or
/// weights of the objects say otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sequential {
    /// Error rate that it was asked to keep: the promised rate, or that of the posterior.
    pub error_rate: f64,
    /// The error rate that the model promises; none for thresholds that nothing was calibrated for.
    pub promised: Option<f64>,
    /// Cases that the promise covers: "average", "name" or "object".
    pub per: Option<&'static str>,
    /// Touches after which it gave up.
    pub max_touches: u32,
    /// Approaches used on average, also where it gave up, if these are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_approaches: Option<f64>,
    /// Standard error of [`Sequential::mean_approaches`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_approaches_standard_error: Option<f64>,
    /// Touches used on average that were evidence, also where it gave up.
    pub mean_touches: f64,
    /// Standard error of [`Sequential::mean_touches`], if touches are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_touches_standard_error: Option<f64>,
    /// Share of sequences with a wrong verdict.
    pub error: f64,
    /// Standard error of [`Sequential::error`].
    pub error_standard_error: f64,
    /// Share of sequences without a verdict.
    pub undecided: f64,
    /// Share of sequences that ended as unknown, although the object is known.
    pub unknown: f64,
    /// Approaches used on average for each object if these are counted, otherwise touches.
    pub per_object: BTreeMap<String, f64>,
    /// Share of sequences with a wrong verdict, for each object.
    pub error_per_object: BTreeMap<String, f64>,
    /// Share of sequences without a verdict, for each object.
    pub undecided_per_object: BTreeMap<String, f64>,
    /// Share of wrong names among those given; not a number if there are none.
    pub error_of_given: f64,
    /// Share of wrong names among those given to each object; without objects that never got a name.
    pub error_of_given_per_object: BTreeMap<String, f64>,
    /// Objects of whose names more are wrong than [`Sequential::error_rate`], by more than chance.
    pub above: Vec<String>,
    /// Share of right names with which the placement that was touched was named; none where outputs are objects, and of touches
    /// that state no placement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<f64>,
    /// Share of wrong names among those given of each name; without names that were never given.
    pub error_per_name: BTreeMap<String, f64>,
    /// For each tested object, how it went for every sequence.
    #[serde(skip)]
    pub outcomes: Vec<Vec<Outcome>>,
}

impl Sequential {
    /// Approaches used on average if these are counted, otherwise touches.
    pub fn mean(&self) -> Estimate {
        let standard_error = self.mean_approaches_standard_error.or(self.mean_touches_standard_error);
        let value = self.mean_approaches.unwrap_or(self.mean_touches);
        Estimate { value, standard_error: standard_error.unwrap_or_default() }
    }
}

/// A figure of sequences.
pub(super) struct Figure {
    /// Each object weighted equally.
    pub(super) all: Estimate,
    pub(super) per_object: BTreeMap<String, f64>,
}

impl Margins<'_> {
    /// Pushes random sequences of each object's touches into a recognizer until it stops.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) if there are no sequences, or the error rate or the limit of
    /// touches is out of its range.
    pub fn sequential(&self, settings: &SequentialSettings) -> Result<Sequential> {
        let SequentialSettings { sequences, seed, .. } = *settings;
        let stopping = self.stopping(settings)?;
        let most = usize::try_from(stopping.max_touches()).unwrap_or(usize::MAX);
        let outcomes = self.each(sequences, |position, sequence| {
            let limit = most.min(self.most_touches_of(position, sequence));
            self.outcome(position, stopping, self.draw(position, sequence, limit, seed).map(Some))
        });
        Ok(self.of_outcomes(outcomes, self.stated(settings, stopping), stopping.max_touches(), false))
    }

    /// The figures of sequences, for each tested object as many, in touches or in approaches.
    pub(super) fn of_outcomes(
        &self,
        outcomes: Vec<Vec<Outcome>>,
        stated: Stated,
        max_touches: u32,
        in_approaches: bool,
    ) -> Sequential {
        let Stated { error_rate, promised, per } = stated;
        let touches = self.mean(&outcomes, |outcome| outcome.touches);
        let approaches = in_approaches.then(|| self.mean(&outcomes, |outcome| outcome.approaches));
        let error = self.share(&outcomes, |totals| totals.wrong);
        let undecided = self.share(&outcomes, Totals::undecided);
        let shares =
            |per| self.wrong_of(&outcomes, per).into_iter().map(|(case, wrong)| (case, wrong.share())).collect();
        Sequential {
            error_rate,
            promised,
            per,
            max_touches,
            mean_approaches: approaches.as_ref().map(|of| of.all.value),
            mean_approaches_standard_error: approaches.as_ref().map(|of| of.all.standard_error),
            mean_touches: touches.all.value,
            mean_touches_standard_error: (!in_approaches).then_some(touches.all.standard_error),
            error: error.all.value,
            error_standard_error: error.all.standard_error,
            undecided: undecided.all.value,
            unknown: self.share(&outcomes, |totals| totals.unknown).all.value,
            per_object: approaches.unwrap_or(touches).per_object,
            error_per_object: error.per_object,
            undecided_per_object: undecided.per_object,
            error_of_given: self.wrong_of(&outcomes, Per::Average).remove("").unwrap_or_default().share(),
            error_of_given_per_object: shares(Per::Object),
            above: self.objects_above(&outcomes, error_rate),
            error_per_name: shares(Per::Name),
            placement: if in_approaches { None } else { self.placement_named(&outcomes) },
            outcomes,
        }
    }

    /// Share of right names with the right placement, each tested placement weighted by its frequency; of touches that state
    /// theirs.
    fn placement_named(&self, outcomes: &[Vec<Outcome>]) -> Option<f64> {
        self.model.outputs()?;
        let (mut right, mut placed) = (0.0, 0.0);
        let stated = |(position, _): &(usize, &Vec<Outcome>)| !self.is_of_any_placement(*position);
        for (position, outcomes) in outcomes.iter().enumerate().filter(stated) {
            let (touched, weight) = (self.tested[position].object, self.frequency(position));
            let named = outcomes.iter().filter(|outcome| outcome.recognized == Some(touched));
            for outcome in named {
                right += weight;
                placed += if outcome.output == Some(touched) { weight } else { 0.0 };
            }
        }
        (right > 0.0).then(|| placed / right)
    }

    /// The share of sequences that a number of their totals is.
    pub(super) fn share(&self, outcomes: &[Vec<Outcome>], number: fn(&Totals) -> usize) -> Figure {
        self.figure(outcomes, |position, outcomes| {
            let object = self.tested[position].object;
            let totals = Totals::of(outcomes.iter().map(|outcome| (object, *outcome)));
            Estimate::share(number(&totals), totals.sequences)
        })
    }

    /// The mean of a number over sequences.
    pub(super) fn mean(&self, outcomes: &[Vec<Outcome>], number: impl Fn(&Outcome) -> usize) -> Figure {
        self.figure(outcomes, |_, outcomes| Estimate::mean(outcomes.iter().map(|outcome| number(outcome) as f64)))
    }

    /// Estimate that `of` computes from a tested object's position and the sequences of it.
    fn figure(&self, outcomes: &[Vec<Outcome>], of: impl Fn(usize, &[Outcome]) -> Estimate) -> Figure {
        let estimates: Vec<Estimate> =
            outcomes.iter().enumerate().map(|(position, outcomes)| of(position, outcomes)).collect();
        let values = estimates.iter().map(|estimate| estimate.value);
        let weights = (0..).map(|position| self.frequency(position));
        Figure {
            per_object: self.tested_names.iter().cloned().zip(values).collect(),
            all: Estimate::weighted(estimates.iter().copied().zip(weights)),
        }
    }

    /// Results of a number of sequences of each tested object, by its position and their numbers.
    pub(super) fn each<T: Send>(&self, sequences: usize, of: impl Fn(usize, usize) -> T + Sync) -> Vec<Vec<T>> {
        let each = |position| (0..sequences).into_par_iter().map(|sequence| of(position, sequence)).collect();
        (0..self.tested.len()).map(each).collect()
    }

    /// When to stop.
    pub(super) fn stopping(&self, settings: &SequentialSettings) -> Result<Stopping> {
        if settings.sequences == 0 {
            return Err(Error::setting("groups", 0, "at least 1"));
        }
        let own = Stopping::from_model(self.model);
        let max_touches = settings.max_touches.unwrap_or(own.max_touches());
        match settings.error_rate {
            // The model's own thresholds stay as they are, to the last bit.
            None if max_touches > 0 => Ok(own.with_max_touches(max_touches)),
            error_rate => Ok(compile::stopping(error_rate.unwrap_or(own.error_rate()), max_touches)?),
        }
    }

    /// Error rate that a recognizer with this stopping rule was asked to keep, and the model's promise for it.
    pub(super) fn stated(&self, settings: &SequentialSettings, stopping: Stopping) -> Stated {
        match (settings.error_rate, self.model.promise()) {
            (Some(error_rate), _) => Stated { error_rate, promised: None, per: None },
            // Other priors than those of the calibration, or fewer objects: nothing was promised for these.
            (None, Some(promise)) if self.weights.is_some() => {
                Stated { error_rate: promise.rate, promised: None, per: None }
            }
            (None, Some(promise)) => {
                Stated { error_rate: promise.rate, promised: Some(promise.rate), per: Some(promise.per.name()) }
            }
            (None, None) => Stated { error_rate: significant(stopping.error_rate()), promised: None, per: None },
        }
    }

    /// Outcome of a sequence of approaches of a tested object: each the position of a touch among those that are
    /// evidence, or none.
    pub(super) fn outcome(
        &self,
        position: usize,
        stopping: Stopping,
        approaches: impl Iterator<Item = Option<u32>>,
    ) -> Outcome {
        let mut steps = self.steps(position, approaches);
        let Ok(outcome) = outcome(&mut steps, &mut *chip(self.model, stopping, self.weights.as_deref()));
        Outcome { recognized: outcome.recognized.map(|output| self.named(position, output)), ..outcome }
    }
}

/// Error rate that a model was asked to keep, and its promise.
pub(super) struct Stated {
    pub(super) error_rate: f64,
    pub(super) promised: Option<f64>,
    pub(super) per: Option<&'static str>,
}

/// A stored threshold holds an error rate to about sixteen digits; nine say what was meant.
pub(crate) fn significant(rate: f64) -> f64 {
    format!("{rate:.8e}").parse().unwrap_or(rate)
}
