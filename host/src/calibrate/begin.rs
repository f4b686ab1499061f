//! The thresholds at which a walk begins.
//!
//! Fixed-sequence testing ends at the first threshold that fails, so the first of all has to pass. The strictest one is not
//! the surest: few sequences get a name there, and of thirty names none may be wrong to promise 10 %. The walk begins where the
//! test passes with the greatest probability, as far as the sequences that are learned from tell; these are few, so errors are
//! also taken to become rarer with the margin as the evidence itself says. Where names are many enough that it costs next to
//! nothing, there are more starts, each with its share of the level. The test does not see these sequences, so that the order
//! in which it tries thresholds is fixed before (Learn then Test, arXiv 2110.01052, on learning hypotheses and their order from
//! other data). What is predicted here decides whether a promise can be made, and never whether it is kept.

use super::terms::Terms;
use super::walk::{allowed, needed, of_share};
use crate::evidence::{self, Odds, Sequence, Unit, odds_of};
use std::collections::{BTreeMap, BTreeSet};

/// The most starts of a walk.
const MOST_STARTS: usize = 7;
/// The share of the greatest probability that several starts may cost.
const COST: f64 = 0.01;
/// Names of each case that are expected, for each that several starts take at least.
const NAMES_TO_SPARE: f64 = 1.5;
/// Names that count beside those that were seen, wrong as often as the evidence itself says.
const PRIOR: f64 = 3.0;
/// Between two margins that are compared, in nats.
const STEP: f64 = 0.5;
/// Margins at which the test passes with nearly the greatest probability: less by at most this.
const NEARLY: f64 = 1e-3;
/// Beyond the margin of the posterior itself, in nats: where a walk begins if nothing can be predicted.
const BEYOND: f64 = 2.5;
/// Two starts are at least that far apart, in nats.
const APART: f64 = 1.0;
/// The share of the greatest probability that a start has at least.
const WORTHWHILE: f64 = 0.5;

/// Margins, in nats, at which the test passes with the greatest probabilities.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Begin {
    /// From strict to loose.
    pub(crate) starts: Vec<f64>,
    /// The loosest at which it passes with nearly the greatest probability.
    pub(crate) loosest: f64,
}

impl Begin {
    /// From sequences that are learned from, followed up to a margin of `most`; `units` are the groups that they belong to, or
    /// their own numbers, and `tested` is how many of these the walk is over.
    pub(crate) fn new(followed: &[Sequence], units: &[usize], tested: usize, terms: &Terms, most: f64) -> Self {
        let steps = (most / STEP) as u32;
        let margins = (1..=steps).rev().map(|step| f64::from(step) * STEP);
        let seen: Vec<Seen> = margins.map(|margin| Seen::new(followed, units, tested, terms, margin)).collect();
        let passes = |starts: usize| -> Vec<f64> { seen.iter().map(|seen| seen.pass(starts, terms)).collect() };
        let greatest = |passes: &[f64]| passes.iter().copied().fold(0.0, f64::max);
        let is_near = |passes: &[f64], at: usize| passes[at] > 0.0 && passes[at] >= greatest(passes) - NEARLY;
        let one = passes(1);
        let near = || (0..seen.len()).filter(|&at| is_near(&one, at));
        let (Some(strictest), Some(loosest)) = (near().next(), near().next_back()) else {
            let margin = (terms.margin() + BEYOND).min(most);
            return Self { starts: vec![margin], loosest: margin };
        };
        let several = (2..=MOST_STARTS).rev().find_map(|count| {
            let passes = passes(count);
            let first = (0..seen.len()).find(|&at| is_near(&passes, at) && seen[at].has_names_for(count, terms))?;
            let is_cheap = passes[first] >= (1.0 - COST) * greatest(&one);
            let chosen = apart(&seen, &passes, first, count);
            (is_cheap && chosen.len() == count).then_some(chosen)
        });
        let mut starts = several.unwrap_or_else(|| vec![strictest]);
        starts.sort_unstable();
        Self { starts: starts.into_iter().map(|at| seen[at].margin).collect(), loosest: seen[loosest].margin }
    }
}

/// The first start, and others where the test passes with the next greatest probabilities, up to so many.
fn apart(seen: &[Seen], passes: &[f64], first: usize, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..seen.len()).filter(|&at| passes[at] >= WORTHWHILE * passes[first]).collect();
    order.sort_by(|&a, &b| passes[b].total_cmp(&passes[a]).then(a.cmp(&b)));
    let mut chosen = vec![first];
    for at in order {
        let is_apart = |other: &usize| (seen[at].margin - seen[*other].margin).abs() >= APART;
        if chosen.len() < count && chosen.iter().all(is_apart) {
            chosen.push(at);
        }
    }
    chosen
}

/// Names of a case that a rate is promised of.
#[derive(Clone, Copy, Debug, Default)]
struct Names {
    /// Names seen, each sequence of a group weighing as much, and the wrong ones.
    wrong: f64,
    given: f64,
    /// Names expected where it is tested.
    expected: f64,
}

/// Names at a margin.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// In nats.
    margin: f64,
    cases: Vec<Names>,
}

impl Seen {
    /// Names in sequences of these units, as for [`Begin::new`].
    pub(super) fn new(followed: &[Sequence], units: &[usize], tested: usize, terms: &Terms, margin: f64) -> Self {
        let odds = Odds::All(odds_of(margin));
        let outcomes =
            followed.iter().zip(units).map(|(sequence, unit)| (sequence.object, *unit, sequence.outcome(&odds)));
        let cases = evidence::units(outcomes, terms.per);
        let times = tested as f64 / units.iter().collect::<BTreeSet<_>>().len().max(1) as f64;
        let names = |units: BTreeMap<usize, Unit>| {
            units.into_values().fold(Names::default(), |names, Unit { wrong, named, all }| Names {
                wrong: names.wrong + wrong / all,
                given: names.given + named / all,
                expected: names.expected + times * named / all,
            })
        };
        Self { margin, cases: cases.into_values().map(names).collect() }
    }

    /// A number of names expected of each case, none of them seen yet.
    pub(super) fn nothing(expected: f64, margin: f64) -> Self {
        Self { margin, cases: vec![Names { expected, ..Names::default() }] }
    }

    /// The probability that the test passes with the share of one of so many starts: of all names, or of each case that the rate
    /// is promised of.
    fn pass(&self, starts: usize, terms: &Terms) -> f64 {
        if self.cases.is_empty() {
            return 0.0;
        }
        // As the posterior says.
        let wrong = (PRIOR / (1.0 + self.margin.exp())).max(f64::MIN_POSITIVE.sqrt());
        let confidence = of_share(terms.confidence, starts);
        let pass = |names: &Names| {
            let all = names.expected as u64;
            let Some(allowed) = allowed(all, terms.rate, confidence) else { return 0.0 };
            // Errors are beta-binomial, as the names seen and the prior ones leave the error rate.
            beta_binomial(allowed, all, names.wrong + wrong, names.given - names.wrong + PRIOR - wrong)
        };
        self.cases.iter().map(pass).product()
    }

    /// True if names are expected to be enough for so many starts, of the case with the fewest.
    fn has_names_for(&self, starts: usize, terms: &Terms) -> bool {
        let needed = needed(terms.rate, of_share(terms.confidence, starts)) as f64;
        !self.cases.is_empty() && self.cases.iter().all(|names| names.expected >= NAMES_TO_SPARE * needed)
    }

    /// The most starts that cost next to nothing at the first of them.
    pub(super) fn most_starts(&self, terms: &Terms) -> usize {
        let is_cheap = |starts: &usize| {
            self.has_names_for(*starts, terms) && self.pass(*starts, terms) >= (1.0 - COST) * self.pass(1, terms)
        };
        (2..=MOST_STARTS).rev().find(is_cheap).unwrap_or(1)
    }
}

/// The probability of at most `most` errors in `all` cases, if the error rate has a beta distribution with `a` and `b`.
fn beta_binomial(most: u64, all: u64, a: f64, b: f64) -> f64 {
    let n = all as f64;
    let log_beta = |a: f64, b: f64| libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    // Each term is the one before times a ratio; the sum is in units of the largest.
    let mut log_term = log_beta(a, b + n) - log_beta(a, b);
    let (mut largest, mut sum) = (log_term, 1.0);
    for k in 0..most.min(all) {
        let k = k as f64;
        log_term += ((n - k) / (k + 1.0) * (k + a) / (n - k - 1.0 + b)).ln();
        if log_term > largest {
            sum *= (largest - log_term).exp();
            largest = log_term;
        }
        sum += (log_term - largest).exp();
    }
    (largest.exp() * sum).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Lead;
    use palpate_shared::format::Per;

    #[test]
    fn a_flat_prior_makes_every_number_of_errors_as_probable() {
        for all in [1, 10, 5_000] {
            for most in [0, all / 3, all] {
                let expected = (most + 1) as f64 / (all + 1) as f64;
                let found = beta_binomial(most, all, 1.0, 1.0);
                assert!((found - expected).abs() < 1e-9, "{all} {most}: {found}");
            }
        }
    }

    #[test]
    fn a_rate_that_is_known_well_makes_errors_binomial() {
        let tally = super::super::walk::Tally { wrong: 23, all: 400 };
        let exact = super::super::walk::binomial_tail(tally, 0.05);
        let found = beta_binomial(23, 400, 5e7, 95e7);
        assert!((found - exact).abs() < 1e-4, "{found} {exact}");
    }

    /// Start of the walk after sequences that are named at a margin, rightly or not.
    fn begin(at: &[(f64, bool)], tested: usize, rate: f64) -> Begin {
        let sequence = |&(margin, right): &(f64, bool)| {
            let mut sequence = Sequence::new(0);
            let look = Lead { name: usize::from(!right), odds: odds_of(margin), touches: 1, approaches: 1 };
            sequence.take(look, true);
            sequence
        };
        let followed: Vec<Sequence> = at.iter().map(sequence).collect();
        let terms = Terms { rate, confidence: 0.95, per: Per::Average };
        Begin::new(&followed, &(0..at.len()).collect::<Vec<_>>(), tested, &terms, 36.0)
    }

    #[test]
    fn a_walk_does_not_begin_where_few_sequences_get_a_name() {
        // Ten of a hundred reach 20 nats; nearly all get to 6, and errors begin below 4.
        let all: Vec<(f64, bool)> = (0..100)
            .map(|number| match number {
                0..10 => (20.2, true),
                10..95 => (6.2, true),
                _ => (3.7, number % 2 == 0),
            })
            .collect();
        let found = begin(&all, 300, 0.1);
        let within = |range: std::ops::RangeInclusive<f64>, margin: &f64| range.contains(margin);
        assert!(within(4.0..=6.0, &found.starts[0]) && within(3.0..=6.0, &found.loosest), "{found:?}");
    }

    #[test]
    fn a_walk_begins_where_errors_are_rarer_than_a_few_sequences_can_show() {
        // Of 37 sequences none is wrong at 1.5 nats; at 3 nats, where as many get a name, fewer will be.
        let all: Vec<(f64, bool)> = (0..37).map(|number| (if number < 33 { 3.2 } else { 1.6 }, true)).collect();
        let found = begin(&all, 113, 0.05);
        assert_eq!(found.starts, [3.0], "{found:?}");
    }

    #[test]
    fn several_starts_are_for_where_names_are_many() {
        let all: Vec<(f64, bool)> =
            (0..100).map(|number| (f64::from(number % 20) * 0.5 + 0.6, number % 20 > 2)).collect();
        for (tested, starts) in [(60, 1..=1), (400, 2..=7), (4_000, 5..=7)] {
            let found = begin(&all, tested, 0.05);
            assert!(starts.contains(&found.starts.len()), "{tested}: {found:?}");
            assert!(found.starts.windows(2).all(|two| two[0] - two[1] >= APART), "{found:?}");
        }
    }

    #[test]
    fn without_a_prediction_it_begins_beyond_the_posteriors_own_margin() {
        let found = begin(&[], 299, 0.01);
        assert!((found.starts[0] - (99.0_f64.ln() + BEYOND)).abs() < 1e-9 && found.starts.len() == 1, "{found:?}");
    }

    #[test]
    fn as_many_starts_are_taken_without_a_prediction_as_cost_next_to_nothing() {
        let terms = Terms { rate: 0.01, confidence: 0.95, per: Per::Average };
        // At 7 nats one name of 1,000 is wrong, at 5 nats seven.
        let starts = |names: f64, margin: f64| Seen::nothing(names, margin).most_starts(&terms);
        assert_eq!([200.0, 500.0, 100_000.0].map(|names| starts(names, 7.0)), [1, 1, 7]);
        assert!(starts(3_000.0, 7.0) >= starts(3_000.0, 5.0));
    }
}
