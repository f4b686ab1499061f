//! Thresholds that keep a promise for new groups, such as persons or machines, from groups of sequences.
//!
//! Sequences of one group resemble each other, so it is groups that are independent. The loss of a group is the mean over its
//! sequences of wrong − rate · named, from −rate to 1 − rate; the promise is that its expectation is not above 0: of the
//! names given in new groups, each group weighing the same, at most that share is wrong.
//!
//! A threshold's hypothesis, that the expectation is above 0, is rejected by a bet against it (Waudby-Smith and Ramdas,
//! Estimating means of bounded random variables by betting, 2024): with a fraction λ that is fixed beforehand, from 0 to
//! 1 / (1 − rate), no factor 1 − λ · loss is below 0, and the expectation of their product over independent groups is at
//! most 1 under the hypothesis. So by Markov's inequality the product reaches 1 / (1 − confidence) with a probability of at
//! most 1 − confidence. λ is chosen on groups that the test does not see, for the number of groups that it sees. With
//! λ = 1 / (1 − rate) and no error at all the product is (1 − rate)^−groups, so as many groups are needed as independent
//! sequences for a binomial test: 299 at 1 %. The inverse of the product is thus a p-value, and thresholds are walked over as
//! binomial tests are, from as many starts ([`walk`](super::walk())).

use super::terms::Terms;
use super::walk::{LOOSEST, Tally, Test, grid, of_share};
use crate::evidence::{self, Odds, Sequence, Unit, odds_of};
use palpate_shared::format::Per;
use std::collections::BTreeSet;

/// The most fractions that are tried.
const FRACTIONS: u32 = 200;

/// Losses of the groups that have one.
#[derive(Clone, Debug, Default)]
struct Losses {
    /// Mean over the sequences of each group.
    of: Vec<f64>,
    /// Share of the sequences of each group that got a name.
    named: Vec<f64>,
    /// Names of all groups.
    tally: Tally,
}

fn group_of(sequence: &Sequence) -> usize {
    sequence.group.unwrap_or(0)
}

/// The losses of each case.
fn losses(sequences: &[Sequence], odds: &Odds, (per, cases): (Per, usize), rate: f64) -> Vec<Losses> {
    let of = |sequence: &Sequence| (sequence.object, group_of(sequence), sequence.outcome(odds));
    let mut units = evidence::units(sequences.iter().map(of), per);
    let losses = |case| {
        let mut losses = Losses::default();
        for Unit { wrong, named, all } in units.remove(&case).unwrap_or_default().into_values() {
            losses.of.push((wrong - rate * named) / all);
            losses.named.push(named / all);
            losses.tally = Tally { wrong: losses.tally.wrong + wrong as u64, all: losses.tally.all + named as u64 };
        }
        losses
    };
    (0..cases).map(losses).collect()
}

/// The fraction to bet, for a number of groups, from the losses of others: it tolerates the most errors of their size.
fn fraction(losses: &[f64], groups: f64, rate: f64, confidence: f64) -> f64 {
    let enough = -(1.0 - confidence).ln() / groups.max(1.0);
    let most = 1.0 / (1.0 - rate);
    // With less than that no number of groups without an error would do.
    let least = (enough.exp_m1() / rate).min(most);
    if losses.iter().any(|loss| *loss > -0.999 * rate) {
        // With their variance: the fraction with which this number of groups reaches the level at the smallest advantage.
        let count = losses.len() as f64;
        let mean = losses.iter().sum::<f64>() / count;
        let variance = losses.iter().map(|loss| (loss - mean).powi(2)).sum::<f64>() / count;
        return (2.0 * enough / variance.max(1e-12)).sqrt().min(0.9 * most).max(least);
    }
    // Nothing is known of errors: as if each were of a whole group.
    let wrong_loss = 1.0 - rate;
    let allowed = |fraction: f64| {
        let right = (fraction * rate).ln_1p();
        let wrong = (-fraction * wrong_loss).ln_1p();
        // The share q of errors with which (1 − q) · right + q · wrong is still enough.
        (right >= enough).then(|| (right - enough) / (right - wrong))
    };
    let fractions = (1..FRACTIONS).map(|step| most * f64::from(step) / f64::from(FRACTIONS));
    let allowed = fractions.filter_map(|fraction| Some((fraction, allowed(fraction)?)));
    allowed.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(most, |(fraction, _)| fraction)
}

/// The fraction to bet for each case, from groups that are not tested: at the loosest threshold at which they seem to keep the rate.
fn fractions(learned_on: &[Sequence], cases: (Per, usize), strictest: f64, groups: usize, terms: &Terms) -> Vec<f64> {
    let learned: BTreeSet<usize> = learned_on.iter().map(group_of).collect();
    let mut seen = vec![Losses::default(); cases.1];
    for margin in grid(strictest, LOOSEST).step_by(10) {
        let losses = losses(learned_on, &Odds::All(odds_of(margin)), cases, terms.rate);
        let is_kept = |losses: &Losses| losses.of.iter().sum::<f64>() <= 0.0;
        if !losses.iter().all(is_kept) {
            break;
        }
        seen = losses;
    }
    let fraction = |losses: &Losses| {
        // A case may be of some groups only.
        let share = if losses.of.is_empty() { 1.0 } else { losses.of.len() as f64 / learned.len() as f64 };
        fraction(&losses.of, share * groups as f64, terms.rate, terms.confidence)
    };
    seen.iter().map(fraction).collect()
}

/// Bets on the groups of each case.
pub(super) struct Bets<'s> {
    tested: &'s [Sequence],
    /// Cases that the rate is promised for, and the number of these.
    cases: (Per, usize),
    rate: f64,
    fractions: Vec<f64>,
}

impl<'s> Bets<'s> {
    /// Bets on the groups of `tested`, for a walk from this margin with this number of starts. `learned_on` are sequences of other
    /// groups, which say how to bet; there may be none.
    pub(super) fn new(
        learned_on: &[Sequence],
        tested: &'s [Sequence],
        cases: (Per, usize),
        (strictest, starts): (f64, usize),
        terms: &Terms,
    ) -> Self {
        let groups: BTreeSet<usize> = tested.iter().map(group_of).collect();
        // So that the share of one start is enough.
        let terms_of_start = Terms { confidence: of_share(terms.confidence, starts), ..*terms };
        let fractions = fractions(learned_on, cases, strictest, groups.len(), &terms_of_start);
        Self { tested, cases, rate: terms.rate, fractions }
    }

    /// The bets at thresholds.
    pub(super) fn at(&self, odds: &Odds) -> Vec<Bet> {
        let losses = losses(self.tested, odds, self.cases, self.rate);
        losses.into_iter().zip(&self.fractions).map(|(losses, &fraction)| Bet { losses, fraction }).collect()
    }
}

/// A bet on the groups of a case.
pub(super) struct Bet {
    losses: Losses,
    fraction: f64,
}

impl Test for Bet {
    /// Number of groups that would have as many names if all of their sequences got one.
    fn cases(&self) -> f64 {
        self.losses.named.iter().sum()
    }

    fn could_pass(&self, rate: f64, confidence: f64) -> bool {
        let won = |named: &f64| (self.fraction * rate * named).ln_1p();
        // Slack for the last bits of a sum.
        self.losses.named.iter().map(won).sum::<f64>() >= -(1.0 - confidence).ln() - 1e-9
    }

    fn p_value(&self, _: f64) -> f64 {
        let product: f64 = self.losses.of.iter().map(|loss| (-self.fraction * loss).ln_1p()).sum();
        (-product - 1e-9).exp()
    }

    fn enough(&self, _: f64, _: f64) -> Option<u64> {
        None
    }

    fn tally(&self) -> Tally {
        self.losses.tally
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chosen, Stop, Way, promise};
    use super::*;
    use crate::evidence::Lead;

    /// Groups of sequences, each named at once, with so many wrong ones in each group.
    fn grouped(wrong: &[usize], of: usize) -> Vec<Sequence> {
        let sequence = |name: usize, group: usize| {
            let mut sequence = Sequence::new(0).of_group(Some(group));
            sequence.take(Lead { name, odds: odds_of(9.0), touches: 1, approaches: 1 }, true);
            sequence
        };
        let groups = wrong.iter().enumerate();
        groups.flat_map(|(group, &wrong)| (0..of).map(move |at| sequence(usize::from(at < wrong), group))).collect()
    }

    fn chosen(wrong: &[usize], of: usize, rate: f64) -> Result<Chosen, Stop> {
        let grouped = grouped(wrong, of);
        // As if a fifth as many others had been learned from.
        let learned = &grouped[..grouped.len() / 5 / of * of];
        promise(
            learned,
            &grouped,
            2,
            &Way { starts: &[8.0], loosest: None },
            &Terms { rate, confidence: 0.95, per: Per::Average },
        )
    }

    #[test]
    fn as_many_groups_are_needed_as_independent_sequences_without_an_error() {
        for (rate, least) in [(0.01, 299), (0.05, 59), (0.1, 29)] {
            assert!(chosen(&vec![0; least], 3, rate).is_ok(), "{rate}");
            assert_eq!(
                chosen(&vec![0; least - 1], 3, rate).unwrap_err(),
                Stop::TooFew { position: 0, found: least as u64 - 1, needed: least as u64 }
            );
        }
    }

    #[test]
    fn a_group_counts_once_however_many_sequences_it_has() {
        // 5 % of sequences are wrong: all in one group of twenty, or one in each group.
        let all = |groups: usize| (0..groups).map(|group| if group % 20 == 0 { 20 } else { 0 }).collect::<Vec<_>>();
        assert!(matches!(chosen(&all(400), 20, 0.06), Err(Stop::TooMany { .. })));
        assert!(chosen(&vec![1; 400], 20, 0.06).is_ok());
    }

    #[test]
    fn the_least_number_of_groups_is_enough_whatever_those_learned_from_did() {
        for (rate, least) in [(0.01, 299.0), (0.05, 59.0), (0.1, 29.0)] {
            for losses in [&[0.0; 5][..], &[-rate, 1.0 - rate, -rate], &[]] {
                let bet = fraction(losses, least, rate, 0.95);
                assert!(bet * (1.0 - rate) <= 1.0 + 1e-12, "{rate}: {bet}");
                assert!(least * (bet * rate).ln_1p() >= -(0.05_f64.ln()) - 1e-9, "{rate}: {bet}");
            }
        }
    }

    #[test]
    fn the_bet_depends_on_how_many_errors_there_is_room_for() {
        let most = 1.0 / 0.99;
        assert!((fraction(&[], 299.0, 0.01, 0.95) - most).abs() < 1e-9);
        let many = fraction(&[], 5_000.0, 0.01, 0.95);
        assert!(many > 0.1 && many < 0.7 * most, "{many}");
        // Small losses allow a larger one.
        assert!(fraction(&[0.05; 10], 5_000.0, 0.01, 0.95) > many);
    }
}
