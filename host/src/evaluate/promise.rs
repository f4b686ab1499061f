//! Whether a model keeps what it promises.

use super::estimate::Estimate;
use super::margins::{Candidate, Margins};
use super::sequential::Outcome;
use crate::touches::noise::Noise;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::Per;
use serde::Serialize;
use std::collections::BTreeMap;

/// Whether a model keeps its promise on test touches. Shares are of the names that are given; a sequence that ends
/// undecided counts as neither right nor wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PromiseCheck {
    /// The promised error rate.
    pub promised: f64,
    /// Of what it is promised: "average", "name" or "object".
    pub per: &'static str,
    /// The probability that it is kept.
    pub confidence: f64,
    /// Sequences of the calibration.
    pub sequences: u32,
    /// Share of the names given that are wrong; of one name, or to one object, where each is promised: the largest.
    pub error: f64,
    /// Standard error of [`PromiseCheck::error`].
    pub standard_error: f64,
    /// The name or object with the largest error.
    pub of: Option<String>,
    /// By how much [`PromiseCheck::error`] is above the promised rate; negative below it.
    pub exceeded_by: f64,
    /// What differs from the calibration: with any of these the promise is void.
    pub void: Vec<String>,
    /// What the error rate is at most by theory, whatever the priors and the objects, if posteriors can be believed: which
    /// they cannot with other noise than the calibration's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_theory: Option<f64>,
}

impl Margins<'_> {
    /// Compares what the model promises with sequences that stopped by its own thresholds. `None` if it promises nothing.
    pub(super) fn check_promise(
        &self,
        outcomes: &[Vec<Outcome>],
        max_touches: u32,
        noise: &Noise,
        active: bool,
    ) -> Option<PromiseCheck> {
        let Candidate::Compiled(model) = self.candidate else { return None };
        let promise = model.promise()?;
        let (error, of) = match promise.per {
            Per::Average => (self.wrong_of(outcomes, |_, _| true), None),
            Per::Name => largest(self.wrong_by_name(outcomes)),
            Per::Object => largest(self.wrong_by_object(outcomes)),
        };
        let mut void = Vec::new();
        if promise.noise != noise.promised() {
            void.push(format!("promised with {}, tested with {noise}", Noise::of_promise(&promise.noise)));
        }
        if promise.active != active {
            let how = |active| if active { "as the plan proposes" } else { "at random" };
            let (promised, tested) = (how(promise.active), how(active));
            void.push(format!("promised for approaches {promised}, tested with approaches {tested}"));
        }
        if promise.max_touches != max_touches {
            void.push(format!("promised for at most {} touches, tested with {max_touches}", promise.max_touches));
        }
        if self.weights.is_some() {
            void.push("promised for the model's own priors and all of its objects".into());
        }
        Some(PromiseCheck {
            promised: promise.rate,
            per: promise.per.name(),
            confidence: promise.confidence,
            sequences: promise.sequences,
            error: error.value,
            standard_error: error.standard_error,
            of,
            exceeded_by: error.value - promise.rate,
            void,
            by_theory: (promise.noise == noise.promised()).then(|| by_theory(model)),
        })
    }

    /// The share of wrong names among those given of each name that is given.
    pub(super) fn wrong_by_name(&self, outcomes: &[Vec<Outcome>]) -> BTreeMap<String, Estimate> {
        let estimate = |object: usize| self.wrong_of(outcomes, |_, named| named == object);
        let names = self.objects().iter().cloned().enumerate();
        names.map(|(object, name)| (name, estimate(object))).filter(|(_, of)| of.value.is_finite()).collect()
    }

    fn wrong_by_object(&self, outcomes: &[Vec<Outcome>]) -> BTreeMap<String, Estimate> {
        let estimate = |position: usize| self.wrong_of(outcomes, |touched, _| touched == position);
        let names = self.tested_names().iter().cloned().enumerate();
        names.map(|(position, name)| (name, estimate(position))).filter(|(_, of)| of.value.is_finite()).collect()
    }

    /// The share of wrong names among those given that `counts` (tested object's position, named object), each tested
    /// object weighted by its frequency; not a number if there are none.
    fn wrong_of(&self, outcomes: &[Vec<Outcome>], counts: impl Fn(usize, usize) -> bool) -> Estimate {
        let (mut given, mut wrong, mut spread, mut number) = (0.0, 0.0, 0.0, 0.0);
        for (position, outcomes) in outcomes.iter().enumerate() {
            let weight = self.frequency(position);
            let names = outcomes.iter().filter_map(|outcome| outcome.recognized);
            for name in names.filter(|&name| counts(position, name)) {
                given += weight;
                spread += weight * weight;
                number += 1.0;
                wrong += if name == self.tested[position].object { 0.0 } else { weight };
            }
        }
        // As many names of equal weight as say as much.
        let effective = if spread > 0.0 { given * given / spread } else { number };
        let value = wrong / given;
        Estimate { value, standard_error: (value * (1.0 - value) / effective).sqrt() }
    }
}

/// The largest estimate, and whose it is.
fn largest(of: BTreeMap<String, Estimate>) -> (Estimate, Option<String>) {
    let largest = of.into_iter().max_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
    match largest {
        Some((name, estimate)) => (estimate, Some(name)),
        None => (Estimate { value: f64::NAN, standard_error: f64::NAN }, None),
    }
}

/// What the error rate of a model's thresholds is at most by theory, with any priors and of any of its objects: one less
/// the posterior at the loosest threshold. A touch that passes it with little to spare comes close to this, as touches
/// that say little do; a calibration finds how much is to spare on average, for all objects together.
///
/// With a temperature T above 1 the posterior is that of the evidence divided by T. The margin over n others together is
/// then at least (margin − (T − 1) ln n) / T.
pub fn by_theory(model: &Model<'_>) -> f64 {
    let stopping = Stopping::from_model(model);
    let objects = model.object_count();
    let loosest = (0..objects).map(|object| stopping.odds_of(object, model)).max().unwrap_or(0);
    let odds = loosest as f64 / 72_057_594_037_927_936.0;
    let temperature = model.temperature().value().max(1.0);
    let others = objects.saturating_sub(1).max(1) as f64;
    let margin = (-odds.ln() - (temperature - 1.0) * others.ln()) / temperature;
    1.0 / (1.0 + margin.exp())
}
