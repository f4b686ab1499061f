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

use super::choose::{By, Steps, Way, grid, summary, tallies};
use super::walk::{Level, Nearest, Stop, needed, of_share};
use super::{Chosen, Terms};
use crate::evidence::{Odds, Sequence, odds_of};
use std::collections::{BTreeMap, BTreeSet};

/// The most fractions that are tried.
const FRACTIONS: u32 = 200;

/// Losses of the groups that have one.
#[derive(Clone, Debug, Default)]
struct Losses {
    /// Mean over the sequences of each group.
    of: Vec<f64>,
    /// Share of the sequences of each group that got a name.
    named: Vec<f64>,
}

impl Losses {
    /// Number of groups that would have as many names if all of their sequences got one.
    fn whole(&self) -> f64 {
        self.named.iter().sum()
    }
}

fn group_of(sequence: &Sequence) -> usize {
    sequence.group.unwrap_or(0)
}

/// The losses of each case.
fn losses(sequences: &[Sequence], odds: &Odds, by: By, rate: f64) -> Vec<Losses> {
    // Wrong names, names, sequences.
    let mut sums: BTreeMap<(usize, usize), (f64, f64, f64)> = BTreeMap::new();
    for sequence in sequences {
        let look = sequence.given(odds);
        let case = match by {
            By::All => Some(0),
            By::Touched(_) => Some(sequence.object),
            By::Named(_) => look.map(|look| look.name),
        };
        let Some(case) = case.filter(|case| *case < by.count()) else { continue };
        let sum = sums.entry((case, group_of(sequence))).or_default();
        sum.0 += f64::from(u8::from(look.is_some_and(|look| look.name != sequence.object)));
        sum.1 += f64::from(u8::from(look.is_some()));
        sum.2 += 1.0;
    }
    let mut losses = vec![Losses::default(); by.count()];
    for ((case, _), (wrong, named, all)) in sums {
        losses[case].of.push((wrong - rate * named) / all);
        losses[case].named.push(named / all);
    }
    losses
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

/// The bets for each case, from groups that are not tested: at the loosest threshold at which they seem to keep the rate.
fn bets(learned_on: &[Sequence], by: By, strictest: f64, groups: usize, terms: &Terms) -> Vec<f64> {
    let learned: BTreeSet<usize> = learned_on.iter().map(group_of).collect();
    let mut seen = vec![Losses::default(); by.count()];
    for margin in grid(strictest, super::choose::LOOSEST).step_by(10) {
        let losses = losses(learned_on, &Odds::All(odds_of(margin)), by, terms.rate);
        let is_kept = |losses: &Losses| losses.of.iter().sum::<f64>() <= 0.0;
        if !losses.iter().all(is_kept) {
            break;
        }
        seen = losses;
    }
    let bet = |losses: &Losses| {
        // A case may be of some groups only.
        let share = if losses.of.is_empty() { 1.0 } else { losses.of.len() as f64 / learned.len() as f64 };
        fraction(&losses.of, share * groups as f64, terms.rate, terms.confidence)
    };
    seen.iter().map(bet).collect()
}

/// Chooses thresholds that keep a promise for new groups, as [`choose`](super::choose()) does for independent sequences.
/// `learned_on` are sequences of other groups than `tested`, which say how to bet; there may be none.
///
/// # Errors
/// [`Stop`], if no threshold keeps the promise or too few groups are there to know.
pub(crate) fn choose_groups(
    learned_on: &[Sequence],
    tested: &[Sequence],
    objects: usize,
    way: &Way<'_>,
    terms: &Terms,
) -> Result<Chosen, Stop> {
    let by = By::of(terms.per, objects);
    let groups: BTreeSet<usize> = tested.iter().map(group_of).collect();
    // So that the share of one start is enough.
    let terms_of_start = Terms { confidence: of_share(terms.confidence, way.starts.len()), ..*terms };
    let bets = bets(learned_on, by, way.strictest(), groups.len(), &terms_of_start);
    let own: Vec<&Sequence> = learned_on.iter().collect();
    let odds = walk(tested, Steps::new(&own, objects, way, terms)?, by, &bets, terms)?;
    let sequences: Vec<&Sequence> = tested.iter().collect();
    let kept = tallies(&sequences, &odds, by);
    Ok(summary(odds, kept, &sequences, objects))
}

/// Fixed-sequence testing, as [`walk`](super::walk()) does for tallies. Thresholds at which no bet could be won with the share
/// of one start even without an error are passed over: how many names there are decides that, not how many are errors.
fn walk(tested: &[Sequence], steps: Steps, by: By, bets: &[f64], terms: &Terms) -> Result<Odds, Stop> {
    let mut level = Level::new(&steps.starts, terms.confidence);
    let share = of_share(terms.confidence, steps.starts.len());
    // Slack for the last bits of a sum.
    let enough = -(1.0 - share).ln() - 1e-9;
    let mut kept = None;
    let mut nearest = Nearest::default();
    let mut most = vec![0.0_f64; by.count()];
    for (position, odds) in steps.odds.into_iter().enumerate() {
        let losses = losses(tested, &odds, by, terms.rate);
        most.iter_mut().zip(&losses).for_each(|(most, losses)| *most = losses.whole().max(*most));
        let own = level.at(position);
        let could_pass = |(losses, bet): (&Losses, &f64)| {
            losses.named.iter().map(|named| (bet * terms.rate * named).ln_1p()).sum::<f64>() >= enough
        };
        if !losses.iter().zip(bets).all(could_pass) {
            continue;
        }
        let Some(own) = own else { continue };
        let p_value = |(losses, bet): (&Losses, &f64)| {
            let product: f64 = losses.of.iter().map(|loss| (-bet * loss).ln_1p()).sum();
            (-product - 1e-9).exp()
        };
        let p_values: Vec<f64> = losses.iter().zip(bets).map(p_value).collect();
        match Nearest::failed(&p_values, own) {
            None => kept = Some(odds),
            Some(position) => {
                nearest.see(p_values[position], || {
                    let sequences: Vec<&Sequence> = tested.iter().collect();
                    let tally = tallies(&sequences, &odds, by).get(position).copied().unwrap_or_default();
                    Stop::TooMany { position, tally, needed: None }
                });
                level.fail();
                if level.is_over() {
                    break;
                }
            }
        }
    }
    kept.ok_or_else(|| {
        nearest.stop().unwrap_or_else(|| {
            let position = (0..most.len()).min_by(|&a, &b| most[a].total_cmp(&most[b])).unwrap_or(0);
            let found = most.get(position).copied().unwrap_or(0.0).round() as u64;
            Stop::TooFew { position, found, needed: needed(terms.rate, share) }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::Per;
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
        choose_groups(
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
