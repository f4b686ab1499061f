//! A promise that is made on simulated touches, and kept or broken on recorded ones.

use super::entry::Entry;
use crate::calibrate::{self, Limit, Odds, Sequence, Tally, TouchSupply, binomial_tail, calibrate, follow, odds_of};
use crate::compile::{self, compile};
use crate::ensemble::Ensemble;
use crate::error::{CalibrateProblem, Result};
use crate::evaluate::Finding;
use crate::evidence::totals;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::Stopping;
use serde::{Deserialize, Serialize};

/// Rates that are promised, as the simulated touches allow: the first one.
const RATES: [f64; 4] = [0.01, 0.02, 0.05, 0.1];
/// Orders in which recorded touches make sequences.
const ORDERS: usize = 20;
/// The probability of errors that a promise just kept is taken to be able to make, as `palpate evaluate` takes it.
const BY_CHANCE: f64 = 0.01;

/// A promised rate of wrong names, of a model and thresholds that know simulated touches only, on recorded ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Promised {
    /// The promised rate, with 95 % confidence: at most this share of the names given are wrong.
    pub rate: f64,
    /// Share of the names given to the same objects that are wrong on simulated touches; none if no name was given.
    pub simulated: Option<f64>,
    /// Share on recorded touches, of the names given in several orders of them.
    pub recorded: Option<f64>,
    /// Names given on recorded touches in sequences that share no touch, on average over the same orders.
    pub names: f64,
    /// Comparison of the recorded share with the promised rate, or with the simulated share if that is larger, since these
    /// objects may be harder than the average for which the rate is promised.
    pub finding: Finding,
}

impl Promised {
    /// The finding, as a sentence.
    pub fn sentence(&self) -> String {
        let Self { rate, simulated, recorded, names, .. } = *self;
        let told =
            format!("A promise of at most {:.0} % wrong names, calibrated on the simulated touches,", 100.0 * rate);
        let percent = |share: Option<f64>| share.map_or("–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        let measured = format!(
            "{} of the names given are wrong, on simulated ones {}; about {names:.0} names of sequences that share no touch",
            percent(recorded),
            percent(simulated)
        );
        match self.finding {
            Finding::Kept => format!("{told} is kept on recorded ones: {measured}."),
            Finding::Unclear => {
                format!("{told} may be broken on recorded ones, or not: {measured}, too few to tell.")
            }
            Finding::Broken => format!("{told} is broken on recorded ones: {measured}."),
            Finding::Untested => format!("{told} is untested: no name was given on recorded ones."),
        }
    }
}

/// Makes a promise on simulated touches that the model was not trained on, and tests it on recorded touches; none if they
/// are too few for any of [`RATES`], or the recorded ones too few for a sequence of each object.
///
/// Sequences share no touch. More wrong names than [`BY_CHANCE`] allows break the promise, by the upper tail of the
/// binomial distribution: with equally many sequences of each object it is no lighter than that of errors which are more
/// frequent for some of them (Hoeffding, On the distribution of the number of successes in independent trials, 1956).
pub(super) fn promised(
    model: &Ensemble,
    [simulated, recorded]: [&Dataset; 2],
    entries: &[Entry],
    seed: u64,
    progress: &dyn Progress,
) -> Result<Option<Promised>> {
    let compiled = compile(model, &compile::Settings::default())?;
    let model = compile::open(&compiled.bytes)?;
    let mut made = None;
    for rate in RATES {
        let settings = calibrate::Settings { rate, seed, ..Default::default() };
        match calibrate(&model, simulated.clone(), &settings, progress) {
            Ok(calibrated) => {
                made = calibrated.margins.values().next().map(|margin| (rate, *margin));
                break;
            }
            Err(error) => match error.problem() {
                Some(CalibrateProblem::TooFew { .. } | CalibrateProblem::NotKept { .. }) => {}
                _ => return Err(error),
            },
        }
    }
    let Some((rate, margin)) = made else { return Ok(None) };
    let names = compile::names(&model);
    let limit = Limit { margin, max_touches: Stopping::from_model(&model).max_touches() };
    let follow = |dataset: &Dataset, seed: u64| -> Result<Vec<Sequence>> {
        let touched = |name: &String| dataset.objects.iter().find(|touched| touched.name == *name);
        let output = |name: &String| names.iter().position(|own| own == name);
        // The object itself, as any of its outputs, or its placements.
        let of = |entry: &Entry| -> Vec<(usize, &ObjectTouches, f64)> {
            let whole = touched(&entry.name).and_then(|own| Some((output(&entry.outputs.first()?.0)?, own, 1.0)));
            let placed = |(name, share): &(String, f64)| Some((output(name)?, touched(name)?, *share));
            whole.map_or_else(|| entry.outputs.iter().filter_map(placed).collect(), |whole| vec![whole])
        };
        let objects: Vec<Vec<_>> = entries.iter().map(of).collect();
        let all = || objects.iter().flatten();
        let mut supplies: Vec<TouchSupply<'_>> =
            all().map(|&(output, touched, _)| TouchSupply::new(output, touched, seed)).collect();
        // Each object has equally many, as many as the one with the fewest.
        let lengths = objects.iter().map(|of| of.iter().map(|(_, touched, _)| touched.len()).sum::<usize>());
        let fewest = lengths.min().unwrap_or(0) as f64;
        let wanted: Vec<usize> = all().map(|(.., share)| (share * fewest).round().max(1.0) as usize).collect();
        follow(&model, &mut supplies, &wanted, limit, &())
    };
    let own = tally(&follow(simulated, seed)?, margin);
    let (mut all, mut sequences) = (Tally::default(), 0);
    for order in 0..ORDERS as u64 {
        let followed = follow(recorded, seed.wrapping_add(order))?;
        let Tally { wrong, all: given } = tally(&followed, margin);
        all = Tally { wrong: all.wrong + wrong, all: all.all + given };
        sequences += followed.len();
    }
    if sequences == 0 {
        return Ok(None);
    }
    let share = |Tally { wrong, all }: Tally| (all > 0).then(|| wrong as f64 / all as f64);
    let names = all.all as f64 / ORDERS as f64;
    let (simulated, recorded) = (share(own), share(all));
    let finding = finding(recorded, names, rate.max(simulated.unwrap_or(0.0)));
    Ok(Some(Promised { rate, simulated, recorded, names, finding }))
}

/// Names given at this margin, and the wrong ones.
fn tally(sequences: &[Sequence], margin: f64) -> Tally {
    let totals = totals(sequences, &Odds::All(odds_of(margin)));
    Tally { wrong: totals.wrong as u64, all: totals.given as u64 }
}

/// The finding on a share of wrong names among about that many independent ones.
fn finding(share: Option<f64>, names: f64, rate: f64) -> Finding {
    let Some(share) = share else { return Finding::Untested };
    if share <= rate {
        return Finding::Kept;
    }
    let all = names.round().max(1.0);
    let wrong = (share * all).round().max(1.0) as u64;
    let fewer = binomial_tail(Tally { wrong: wrong - 1, all: all as u64 }, rate);
    if 1.0 - fewer < BY_CHANCE { Finding::Broken } else { Finding::Unclear }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_is_broken_by_more_wrong_names_than_chance_makes() {
        for (share, names, expected) in [
            (None, 0.0, Finding::Untested),
            (Some(0.0), 12.0, Finding::Kept),
            (Some(0.01), 180.0, Finding::Kept),
            // 4 of 180 or more have a probability of 11 % at a rate of 1 %, 7 of .3 %.
            (Some(0.022), 180.0, Finding::Unclear),
            (Some(0.04), 180.0, Finding::Broken),
            (Some(0.5), 2.0, Finding::Unclear),
            (Some(0.5), 20.0, Finding::Broken),
        ] {
            assert_eq!(finding(share, names, 0.01), expected, "{share:?} of {names}");
        }
    }

    #[test]
    fn the_sentence_says_what_was_promised_and_what_was_found() {
        let (simulated, recorded) = (Some(0.008), Some(0.031));
        let of = |finding| Promised { rate: 0.01, simulated, recorded, names: 179.6, finding }.sentence();
        assert_eq!(
            of(Finding::Broken),
            "A promise of at most 1 % wrong names, calibrated on the simulated touches, is broken on recorded ones: 3.1 % \
             of the names given are wrong, on simulated ones 0.8 %; about 180 names of sequences that share no touch."
        );
        assert!(of(Finding::Kept).contains("is kept on recorded ones"));
        assert!(of(Finding::Unclear).ends_with("too few to tell."));
        assert!(of(Finding::Untested).ends_with("no name was given on recorded ones."));
    }
}
