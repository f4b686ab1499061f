//! The threshold at which a walk begins.
//!
//! Fixed-sequence testing ends at the first threshold that fails, so the first of all has to pass. The strictest one is not
//! the surest: few sequences get a name there, and of thirty names none may be wrong to promise 10 %. The walk begins where the
//! test passes with the greatest probability, as far as the sequences that are learned from tell. The test does not see
//! these, so that the order in which it tries thresholds is fixed before (Learn then Test, arXiv 2110.01052, on learning
//! hypotheses and their order from other data). What is predicted here decides whether a promise can be made, and never
//! whether it is kept.

use crate::calibrate::{Odds, Per, Sequence, Terms, allowed, odds_of};
use palpate_trees::rows::RowSequence;
use std::collections::BTreeMap;

/// Between two margins that are compared, in nats.
const STEP: f64 = 0.5;
/// Margins at which the test passes with nearly the greatest probability: less by at most this.
const NEARLY: f64 = 1e-3;
/// Beyond the margin of the posterior itself, in nats: where a walk begins if nothing can be predicted.
const BEYOND: f64 = 2.5;

/// Margins, in nats, at which the test passes with nearly the greatest probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Begin {
    pub(super) strictest: f64,
    pub(super) loosest: f64,
}

/// Names of a unit: a sequence, or a group, each sequence of which counts as much.
#[derive(Clone, Copy, Debug, Default)]
struct Names {
    wrong: f64,
    given: f64,
}

impl Begin {
    /// From sequences that are learned from, followed up to a margin of `most`, and what they are sequences of; `tested` are
    /// the units that the walk is over.
    pub(super) fn new(followed: &[Sequence], of: &[&RowSequence], tested: usize, terms: &Terms, most: f64) -> Self {
        let steps = (most / STEP) as u32;
        let margins = (1..=steps).map(|step| f64::from(step) * STEP);
        let passes: Vec<(f64, f64)> =
            margins.map(|margin| (margin, pass(followed, of, tested, terms, margin))).collect();
        let greatest = passes.iter().map(|(_, chance)| *chance).fold(0.0, f64::max);
        let near = || passes.iter().filter(|(_, chance)| *chance > 0.0 && *chance >= greatest - NEARLY);
        match (near().next(), near().next_back()) {
            (Some((loosest, _)), Some((strictest, _))) => Self { strictest: *strictest, loosest: *loosest },
            _ => {
                let margin = (((1.0 - terms.rate) / terms.rate).ln() + BEYOND).min(most);
                Self { strictest: margin, loosest: margin }
            }
        }
    }
}

/// The probability that the test passes at a margin: of all names, or of each case that the rate is promised of.
fn pass(followed: &[Sequence], of: &[&RowSequence], tested: usize, terms: &Terms, margin: f64) -> f64 {
    let odds = Odds::All(odds_of(margin));
    // Of each case and unit: wrong names, names, sequences.
    let mut sums: BTreeMap<(usize, usize), (f64, f64, f64)> = BTreeMap::new();
    let mut units = std::collections::BTreeSet::new();
    for (number, (sequence, of)) in followed.iter().zip(of).enumerate() {
        let look = sequence.given(&odds);
        let unit = of.group.unwrap_or(number);
        units.insert(unit);
        let case = match terms.per {
            Per::Average => Some(0),
            Per::Object => Some(sequence.object),
            Per::Name => look.map(|look| look.name),
        };
        let Some(case) = case else { continue };
        let sum = sums.entry((case, unit)).or_default();
        sum.0 += f64::from(u8::from(look.is_some_and(|look| look.name != sequence.object)));
        sum.1 += f64::from(u8::from(look.is_some()));
        sum.2 += 1.0;
    }
    let mut cases: BTreeMap<usize, Names> = BTreeMap::new();
    for ((case, _), (wrong, given, all)) in sums {
        let names = cases.entry(case).or_default();
        names.wrong += wrong / all;
        names.given += given / all;
    }
    let times = tested as f64 / units.len().max(1) as f64;
    if cases.is_empty() {
        return 0.0;
    }
    cases.values().map(|names| names.pass(times, terms)).product()
}

impl Names {
    /// The probability that so many times as many names pass the test: their errors are beta-binomial, as these names leave
    /// the error rate of Jeffreys' prior.
    fn pass(self, times: f64, terms: &Terms) -> f64 {
        let all = (self.given * times) as u64;
        let Some(allowed) = allowed(all, terms.rate, terms.confidence) else { return 0.0 };
        beta_binomial(allowed, all, self.wrong + 0.5, self.given - self.wrong + 0.5)
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
    use crate::calibrate::Look;

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
        let tally = crate::calibrate::Tally { wrong: 23, all: 400 };
        let exact = crate::calibrate::binomial_tail(tally, 0.05);
        let found = beta_binomial(23, 400, 5e7, 95e7);
        assert!((found - exact).abs() < 1e-4, "{found} {exact}");
    }

    /// Sequences that are named at a margin, rightly or not.
    fn named(at: &[(f64, bool)]) -> (Vec<Sequence>, Vec<RowSequence>) {
        let sequence = |&(margin, right): &(f64, bool)| {
            let mut sequence = Sequence::new(0);
            let look = Look { name: usize::from(!right), odds: odds_of(margin), touches: 1, approaches: 1 };
            sequence.look(look, true);
            sequence
        };
        let of = (0..at.len()).map(|row| RowSequence { rows: row..row + 1, class: 0, group: None }).collect();
        (at.iter().map(sequence).collect(), of)
    }

    fn begin(at: &[(f64, bool)], tested: usize, rate: f64) -> Begin {
        let (followed, of) = named(at);
        let terms = Terms { rate, confidence: 0.95, per: Per::Average };
        Begin::new(&followed, &of.iter().collect::<Vec<_>>(), tested, &terms, 36.0)
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
        assert!((4.0..=6.0).contains(&found.strictest) && (3.0..=6.0).contains(&found.loosest), "{found:?}");
    }

    #[test]
    fn without_a_prediction_it_begins_beyond_the_posteriors_own_margin() {
        let found = begin(&[], 299, 0.01);
        assert!((found.strictest - (99.0_f64.ln() + BEYOND)).abs() < 1e-9, "{found:?}");
    }
}
