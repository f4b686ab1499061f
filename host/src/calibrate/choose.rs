//! Thresholds that keep a promise, from sequences.

use super::sequence::{Odds, Sequence, odds_of};
use super::walk::{Kept, Stop, Tally, binomial_tail, needed, walk};
use crate::error::{CalibrateProblem, Result};
use palpate_shared::format::Per;
use rayon::prelude::*;

/// Between two thresholds that are tried, in nats.
const STEP: f64 = 0.01;
/// The loosest threshold that is tried, in nats.
const LOOSEST: f64 = 0.05;
/// Steps at once where names have thresholds of their own.
const NAMES_STEP: usize = 2;

/// What is promised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// Of what the rate is promised.
    pub per: Per,
}

/// Thresholds that keep a promise, and what the sequences that they were tested on came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The thresholds.
    pub odds: Odds,
    /// Wrong names of those given: one tally for an average, one for each object otherwise.
    pub tallies: Vec<Tally>,
    /// Sequences that were tested on.
    pub sequences: usize,
    /// Names given in these.
    pub given: usize,
    /// Wrong ones of them.
    pub wrong: usize,
    /// Touches that are evidence used on average, also where no name was given.
    pub mean_touches: f64,
    /// Approaches used on average.
    pub mean_approaches: f64,
}

/// Chooses thresholds that keep a promise: Learn-then-Test on `sequences`, each of which must have been followed to
/// `strictest` (a margin in nats) or to the limit of touches. `objects` are the model's.
///
/// A sequence that ends without a name is neither right nor wrong: the error rate is that of names that are given. One
/// threshold is walked from strict to loose for an average as for each object, whose rates are all kept at once with the
/// stated probability. With thresholds by name each name walks; each rate is kept with that probability by itself.
///
/// # Errors
/// [`CalibrateProblem`], if no threshold keeps the promise or too few names are given to know.
pub fn choose(sequences: &[Sequence], objects: &[String], strictest: f64, terms: &Terms) -> Result<Chosen> {
    let Terms { rate, confidence, per } = *terms;
    let count = objects.len();
    let tested: Vec<&Sequence> = sequences.iter().collect();
    let kept: Result<Kept<Odds>, Stop> = match per {
        Per::Average | Per::Object => {
            let margins = grid(strictest, LOOSEST).map(|margin| Odds::All(odds_of(margin)));
            let steps = margins.map(|odds| {
                let tallies = tallies(&tested, &odds, if per == Per::Average { By::All } else { By::Touched(count) });
                (odds, tallies)
            });
            walk(steps, rate, confidence)
        }
        Per::Name => walk_by_name(&tested, count, strictest, terms),
    };
    let of = |position: usize| (per != Per::Average).then(|| objects.get(position).cloned()).flatten();
    let Kept { threshold, tallies } = kept.map_err(|stop| match stop {
        Stop::TooFew { position, found } => {
            CalibrateProblem::TooFew { object: of(position), rate, found, needed: needed(rate, confidence) }
        }
        Stop::TooMany { position, tally: Tally { wrong, all } } => {
            CalibrateProblem::NotKept { object: of(position), rate, wrong, given: all }
        }
    })?;
    Ok(summary(threshold, tallies, &tested))
}

/// Margins from `strict` to `loose`.
fn grid(strict: f64, loose: f64) -> impl Iterator<Item = f64> {
    let steps = ((strict - loose) / STEP).round().max(0.0) as usize;
    (0..=steps).map(move |step| strict - STEP * step as f64)
}

/// The odds of a margin as a model stores them for one object.
fn stored(margin: f64) -> u64 {
    odds_of(margin) >> 24 << 24
}

/// What names are counted by.
#[derive(Clone, Copy)]
enum By {
    All,
    /// The object that was touched, of this number of objects.
    Touched(usize),
    /// The object that was named, of this number of objects.
    Named(usize),
}

fn tallies(sequences: &[&Sequence], odds: &Odds, by: By) -> Vec<Tally> {
    let count = match by {
        By::All => 1,
        By::Touched(objects) | By::Named(objects) => objects,
    };
    let none = || vec![Tally::default(); count];
    let add = |mut tallies: Vec<Tally>, sequence: &&Sequence| {
        if let Some(look) = sequence.given(odds) {
            let position = match by {
                By::All => 0,
                By::Touched(_) => sequence.object,
                By::Named(_) => look.name,
            };
            if let Some(tally) = tallies.get_mut(position) {
                tally.all += 1;
                tally.wrong += u64::from(look.name != sequence.object);
            }
        }
        tallies
    };
    let sum = |mut a: Vec<Tally>, b: Vec<Tally>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a = Tally { wrong: a.wrong + b.wrong, all: a.all + b.all });
        a
    };
    sequences.par_iter().with_min_len(1_000).fold(none, add).reduce(none, sum)
}

/// Walks over the thresholds of all names at once: they loosen together, and a name whose test fails stays where it last
/// passed while the others go on. What those take from it later is mostly theirs, so that it is wrong no more often; if it
/// is, it is made stricter in the end, until every name passes where all of them ended.
fn walk_by_name(sequences: &[&Sequence], count: usize, strictest: f64, terms: &Terms) -> Result<Kept<Odds>, Stop> {
    let Terms { rate, confidence, .. } = *terms;
    let passes = |tally: Tally| binomial_tail(tally, rate) <= 1.0 - confidence;
    let needed = needed(rate, confidence);
    let mut kept: Vec<Option<f64>> = vec![None; count];
    let mut walks = vec![true; count];
    let mut most = vec![0; count];
    for margin in grid(strictest, LOOSEST).step_by(NAMES_STEP) {
        let tried = (0..count).map(|name| stored(kept[name].filter(|_| !walks[name]).unwrap_or(margin)));
        let tallies = tallies(sequences, &Odds::ByObject(tried.collect()), By::Named(count));
        for name in (0..count).filter(|&name| tallies[name].all >= needed) {
            if !walks[name] {
                continue;
            }
            if passes(tallies[name]) {
                kept[name] = Some(margin);
            } else if kept[name].is_none() {
                return Err(Stop::TooMany { position: name, tally: tallies[name] });
            } else {
                walks[name] = false;
            }
        }
        most.iter_mut().zip(&tallies).for_each(|(most, tally)| *most = tally.all.max(*most));
        if !walks.contains(&true) {
            break;
        }
    }
    let too_few = |name: usize| Stop::TooFew { position: name, found: most[name] };
    let kept: Result<Vec<f64>, Stop> = (0..count).map(|name| kept[name].ok_or_else(|| too_few(name))).collect();
    let mut kept = kept?;
    loop {
        let odds = Odds::ByObject(kept.iter().map(|&margin| stored(margin)).collect());
        let tallies = tallies(sequences, &odds, By::Named(count));
        let failed: Vec<usize> = (0..count).filter(|&name| !passes(tallies[name])).collect();
        if failed.is_empty() {
            return Ok(Kept { threshold: odds, tallies });
        }
        for name in failed {
            if kept[name] >= strictest {
                return Err(Stop::TooMany { position: name, tally: tallies[name] });
            }
            kept[name] = (kept[name] + STEP).min(strictest);
        }
    }
}

fn summary(odds: Odds, tallies: Vec<Tally>, tested: &[&Sequence]) -> Chosen {
    let (mut given, mut wrong, mut touches, mut approaches) = (0, 0, 0_u64, 0_u64);
    for sequence in tested {
        let look = sequence.given(&odds);
        given += usize::from(look.is_some());
        wrong += usize::from(look.is_some_and(|look| look.name != sequence.object));
        touches += u64::from(look.map_or(sequence.touches, |look| look.touches));
        approaches += u64::from(look.map_or(sequence.approaches, |look| look.approaches));
    }
    let sequences = tested.len();
    let mean = |sum: u64| sum as f64 / sequences.max(1) as f64;
    let (mean_touches, mean_approaches) = (mean(touches), mean(approaches));
    Chosen { odds, tallies, sequences, given, wrong, mean_touches, mean_approaches }
}
