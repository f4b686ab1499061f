//! Check of a model's promise.

use super::Estimate;
use super::margins::Margins;
use crate::evidence::Outcome;
use crate::probe::noise::Noise;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{Counted, Per};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Finding about a promise on test touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Finding {
    /// The measured error rate is at most the promised one.
    Kept,
    /// It is above, but if the promise were just kept, more errors than these would be no surprise: their probability is
    /// at least 1 % (binomial; divided by the number of names or objects, since the worst is looked at).
    Unclear,
    /// It is above by more than that.
    Broken,
    /// No name was given.
    Untested,
}

impl Finding {
    /// Finding about wrong names of those given, compared with a promised rate.
    pub fn of(wrong: usize, given: usize, rate: f64) -> Self {
        Wrong { wrong: wrong as f64, given: given as f64, spread: given as f64 }.finding_of(rate, 1)
    }

    /// Finding about an error rate, not a number without names, compared with a promised one: one of `number` that are looked
    /// at. `chance` is the probability of as many errors if the promise is just kept.
    pub(crate) fn of_error(error: f64, rate: f64, number: usize, chance: impl FnOnce() -> f64) -> Self {
        match () {
            () if error.is_nan() => Self::Untested,
            () if error <= rate => Self::Kept,
            () if chance() < BY_CHANCE / number.max(1) as f64 => Self::Broken,
            () => Self::Unclear,
        }
    }

    /// Finding about a promise that is for each of these.
    pub(crate) fn of_each(each: impl IntoIterator<Item = Self>) -> Self {
        let each: Vec<Self> = each.into_iter().collect();
        let worst = [Self::Broken, Self::Unclear, Self::Kept].into_iter().find(|finding| each.contains(finding));
        worst.unwrap_or(Self::Untested)
    }
}

/// The probability of errors that a promise just kept is taken to be able to make.
const BY_CHANCE: f64 = 0.01;

/// Check of a model's promise on test touches. Shares are of the names that are given; a sequence that ends undecided
/// counts as neither right nor wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PromiseCheck {
    /// The promised error rate.
    pub promised: f64,
    /// Cases that the promise covers: "average", "name" or "object".
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
    /// Result of a test of significance of that error rate.
    pub finding: Finding,
    /// Differences from the calibration: with any of these the promise was made for other touches, and is void for
    /// these.
    pub void: Vec<String>,
    /// Noise that the promise was made with, where recorded touches are tested, which hold the noise of their probe.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<String>,
    /// Largest error rate by theory, whatever the priors and the objects, if posteriors can be believed: which they
    /// cannot with other noise than the calibration's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_theory: Option<f64>,
}

/// Check of a model's promised share of false alarms on test touches: of known objects' sequences, those that end as unknown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlarmCheck {
    /// The promised share.
    pub promised: f64,
    /// The probability that it is kept.
    pub confidence: f64,
    /// Sequences of the calibration.
    pub sequences: u32,
    /// Share of the sequences that ended as unknown, each object weighted equally.
    pub found: f64,
    /// Standard error of [`AlarmCheck::found`].
    pub standard_error: f64,
    /// Result of a test of significance of that share.
    pub finding: Finding,
    /// The share of each object, where it is above the promised one by more than chance; the promise is of all together.
    pub above: BTreeMap<String, f64>,
}

impl Margins<'_> {
    /// Compares the share of false alarms that the model's misfit test promises with sequences that stopped by its own
    /// thresholds. `None` if it has no test.
    pub(super) fn check_alarms(&self, outcomes: &[Vec<Outcome>]) -> Option<AlarmCheck> {
        let terms = self.model.strangers()?.test?.terms;
        let promised = f64::from(terms.alarms) / 1e6;
        let of = |outcomes: &Vec<Outcome>| {
            let given = outcomes.len() as f64;
            let wrong = outcomes.iter().filter(|outcome| outcome.unknown).count() as f64;
            Wrong { given, wrong, spread: given }
        };
        let each: Vec<Wrong> = outcomes.iter().map(of).collect();
        let sum = |of: fn(&Wrong) -> f64| each.iter().map(of).sum();
        let all = Wrong { given: sum(|of| of.given), wrong: sum(|of| of.wrong), spread: sum(|of| of.spread) };
        let is_above = |of: &Wrong| of.finding_of(promised, each.len()) == Finding::Broken;
        let named = self.tested_names.iter().zip(&each).filter(|(_, of)| is_above(of));
        let Estimate { value, standard_error } = all.estimate();
        Some(AlarmCheck {
            promised,
            confidence: f64::from(terms.confidence) / 1e6,
            sequences: terms.sequences,
            found: value,
            standard_error,
            finding: all.finding_of(promised, 1),
            above: named.map(|(name, of)| (name.clone(), of.share())).collect(),
        })
    }

    /// Compares what the model promises with sequences that stopped by its own thresholds. `None` if it promises nothing.
    pub(super) fn check_promise(
        &self,
        outcomes: &[Vec<Outcome>],
        max_touches: u32,
        noise: &Noise,
        active: bool,
    ) -> Option<PromiseCheck> {
        let model = self.model;
        let promise = model.promise()?;
        let found = self.wrong_of(outcomes, promise.per);
        let finding = Wrong::finding(found.values(), promise.rate);
        let worst = found.into_iter().max_by(|(_, a), (_, b)| a.share().total_cmp(&b.share()));
        let (of, wrong) = worst.unwrap_or_default();
        let (of, error) = (Some(of).filter(|of| !of.is_empty()), wrong.estimate());
        let mut void = Vec::new();
        let simulated = Noise::of_promise(&promise.noise);
        // Recorded touches hold the noise of their probe: the promise is tested on that, and is not void.
        let is_own = self.is_recorded && noise.is_none();
        if promise.noise != noise.promised() && !is_own {
            let on = if self.is_recorded { "on recorded touches with more noise:" } else { "with" };
            void.push(format!("promised with {simulated}, tested {on} {noise}"));
        }
        // A model that waits for full touches gets no other ones, whatever the data set holds.
        let takes_others = model.trained_touches().counted != Counted::Full;
        if takes_others && promise.approaches != self.hold_approaches {
            let what = |approaches| if approaches { "every approach" } else { "full touches only" };
            void.push(format!("promised for {}, tested on {}", what(promise.approaches), what(self.hold_approaches)));
        }
        let (known, tested) = (model.known_count(), self.tested_outputs());
        if tested < known {
            let what = if model.outputs().is_some() { "placements" } else { "objects" };
            void.push(format!("promised for all {known} {what} of the model, tested on {tested}"));
        }
        let is_unstated = (0..self.tested.len()).any(|position| self.is_of_any_placement(position));
        if promise.per == Per::Object && is_unstated {
            void.push("promised in each placement, tested on touches that state none".into());
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
            finding,
            void,
            recorded: (is_own && !simulated.is_none()).then(|| simulated.to_string()),
            by_theory: (promise.noise == noise.promised()).then(|| by_theory(model)),
        })
    }

    /// Wrong names among those given, by the cases that a rate is of: names, or tested objects, that there are; or all together.
    /// Each tested object is weighted by its frequency.
    pub(super) fn wrong_of(&self, outcomes: &[Vec<Outcome>], per: Per) -> BTreeMap<String, Wrong> {
        let mut found = BTreeMap::<String, Wrong>::new();
        for (position, outcomes) in outcomes.iter().enumerate() {
            let weight = self.frequency(position);
            let is_any = self.is_of_any_placement(position);
            for outcome in outcomes {
                let Some(name) = outcome.recognized else { continue };
                let case = match per {
                    Per::Average => "",
                    // Of touches that may be of any placement, the one that was named counts.
                    Per::Name => &self.objects[outcome.output.filter(|_| is_any).unwrap_or(name)],
                    Per::Object => &self.tested_names[position],
                };
                let of = found.entry(case.into()).or_default();
                of.given += weight;
                of.spread += weight * weight;
                of.wrong += if outcome.is_wrong(self.tested[position].object) { weight } else { 0.0 };
            }
        }
        found
    }

    /// The objects whose names are wrong more often than `rate`, by more than chance.
    pub(super) fn objects_above(&self, outcomes: &[Vec<Outcome>], rate: f64) -> Vec<String> {
        let objects = self.wrong_of(outcomes, Per::Object);
        let number = objects.len();
        let is_above = |(_, wrong): &(String, Wrong)| wrong.finding_of(rate, number) == Finding::Broken;
        objects.into_iter().filter(is_above).map(|(name, _)| name).collect()
    }
}

/// Names that are given, each with a weight.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wrong {
    given: f64,
    wrong: f64,
    /// The sum of the weights' squares.
    spread: f64,
}

impl Wrong {
    /// The share of wrong names; not a number if none is given.
    pub(super) fn share(&self) -> f64 {
        self.wrong / self.given
    }

    /// Effective number of names: as many of equal weight say as much.
    fn effective(&self) -> f64 {
        if self.spread > 0.0 { self.given * self.given / self.spread } else { 0.0 }
    }

    fn estimate(self) -> Estimate {
        let value = self.share();
        Estimate { value, standard_error: (value * (1.0 - value) / self.effective()).sqrt() }
    }

    /// Finding about all of these, each compared with `rate`.
    fn finding<'w>(all: impl Iterator<Item = &'w Self> + Clone, rate: f64) -> Finding {
        let number = all.clone().count();
        Finding::of_each(all.map(|wrong| wrong.finding_of(rate, number)))
    }

    /// Finding about one of `number` that are looked at.
    fn finding_of(self, rate: f64, number: usize) -> Finding {
        Finding::of_error(self.share(), rate, number, || {
            let trials = self.effective().round().max(1.0);
            at_least((self.share() * trials).round().max(1.0), trials, rate)
        })
    }
}

/// The probability of at least `errors` in `trials` at a rate: the binomial upper tail. There is at least one error.
pub(crate) fn at_least(errors: f64, trials: f64, rate: f64) -> f64 {
    let ln_choose = libm::lgamma(trials + 1.0) - libm::lgamma(errors + 1.0) - libm::lgamma(trials - errors + 1.0);
    let mut term = (ln_choose + errors * rate.ln() + (trials - errors) * (1.0 - rate).ln()).exp();
    let (mut tail, mut count) = (term, errors);
    while count < trials && term > 1e-12 * tail {
        term *= (trials - count) / (count + 1.0) * rate / (1.0 - rate);
        tail += term;
        count += 1.0;
    }
    tail.min(1.0)
}

/// Largest error rate of a model's thresholds by theory, with any priors and of any of its objects: 1 minus the
/// posterior at the loosest threshold. A touch that passes it with little to spare comes close to this, as touches that
/// say little do; a calibration finds how much is to spare on average, for all objects together.
///
/// With a temperature T above 1 the posterior is that of the evidence divided by T. The margin over n others together is
/// then at least (margin − (T − 1) ln n) / T.
pub(crate) fn by_theory(model: &Model<'_>) -> f64 {
    let stopping = Stopping::from_model(model);
    let objects = model.object_count();
    let loosest = (0..objects).map(|object| stopping.odds_of(object, model)).max().unwrap_or(0);
    let odds = loosest as f64 / 72_057_594_037_927_936.0;
    let temperature = model.temperature().value().max(1.0);
    let others = objects.saturating_sub(1).max(1) as f64;
    let margin = (-odds.ln() - (temperature - 1.0) * others.ln()) / temperature;
    1.0 / (1.0 + margin.exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_is_broken_only_by_more_errors_than_chance_makes() {
        let of = |wrong: f64, given: f64| Wrong { given, wrong, spread: given };
        for (wrong, given, expected) in [
            (0.0, 0.0, Finding::Untested),
            (0.0, 10.0, Finding::Kept),
            (20.0, 1_000.0, Finding::Kept),
            // 1.3 standard errors above 2 %.
            (26.0, 1_000.0, Finding::Unclear),
            (40.0, 1_000.0, Finding::Broken),
            // One error of three names is rare at 2 %, and no proof.
            (1.0, 3.0, Finding::Unclear),
            (3.0, 3.0, Finding::Broken),
        ] {
            assert_eq!(of(wrong, given).finding_of(0.02, 1), expected, "{wrong} of {given}");
        }
        // The worst of many is further up by chance: the probability of 36 errors is .0006.
        assert_eq!(
            (of(36.0, 1_000.0).finding_of(0.02, 1), of(36.0, 1_000.0).finding_of(0.02, 40)),
            (Finding::Broken, Finding::Unclear)
        );
        // 1 - .98^100, and .98^100 · (1 + 100 · .02 / .98) left out of it.
        assert!((at_least(1.0, 100.0, 0.02) - 0.867_380).abs() < 1e-6);
        assert!((at_least(2.0, 100.0, 0.02) - 0.596_729).abs() < 1e-5);
        let all = [of(0.0, 100.0), of(40.0, 1_000.0), of(0.0, 0.0)];
        assert_eq!(Wrong::finding(all.iter(), 0.02), Finding::Broken);
        assert_eq!(Wrong::finding(all[..1].iter(), 0.02), Finding::Kept);
        assert_eq!(Wrong::finding(all[2..].iter(), 0.02), Finding::Untested);
    }
}
