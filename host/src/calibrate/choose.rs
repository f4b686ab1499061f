//! Thresholds that keep a promise, from sequences.

use super::sequence::{Look, Odds, Sequence, margin_of, odds_of};
use super::walk::{Kept, Stop, Tally, allowed, needed, walk};
use crate::error::{CalibrateProblem, Result};
use palpate_shared::format::Per;
use rayon::prelude::*;

/// Between two thresholds that are tried, in nats.
const STEP: f64 = 0.01;
/// The loosest threshold that is tried, in nats.
const LOOSEST: f64 = 0.05;
/// How far thresholds by name are moved from what was learned, in nats: strict to loose.
const SHIFTS: [f64; 2] = [3.0, -1.5];
/// Rounds of learning thresholds by name, and how far one moves in a round at most, in nats.
const ROUNDS: usize = 6;
const MOST_MOVE: f64 = 0.3;
/// Steps at once on the way to where they begin.
const COARSE: usize = 5;

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
    /// Sequences that were tested on: those that no threshold was learned on.
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
/// threshold is walked from strict to loose on all sequences, for an average as for each object. Thresholds by name are
/// learned on every other sequence of each object; then all of them together are moved from strict to loose, and tested on the rest.
///
/// # Errors
/// [`CalibrateProblem`], if no threshold keeps the promise or too few names are given to know.
pub fn choose(sequences: &[Sequence], objects: &[String], strictest: f64, terms: &Terms) -> Result<Chosen> {
    let Terms { rate, confidence, per } = *terms;
    let count = objects.len();
    let (kept, tested): (Result<Kept<Odds>, Stop>, Vec<&Sequence>) = match per {
        Per::Average | Per::Object => {
            let tested: Vec<&Sequence> = sequences.iter().collect();
            let margins = grid(strictest, LOOSEST).map(|margin| Odds::All(odds_of(margin)));
            let steps = margins.map(|odds| {
                let tallies = tallies(&tested, &odds, if per == Per::Average { By::All } else { By::Touched(count) });
                (odds, tallies)
            });
            (walk(steps, rate, confidence), tested)
        }
        Per::Name => {
            let (learn, tested) = halves(sequences, count);
            let margins = learn_by_name(&learn, count, strictest, terms);
            let shifted = |shift: f64| {
                let odds = margins.iter().map(|margin| stored((margin + shift).clamp(LOOSEST, strictest)));
                Odds::ByObject(odds.collect())
            };
            let steps = grid(SHIFTS[0], SHIFTS[1]).map(shifted).map(|odds| {
                let tallies = tallies(&tested, &odds, By::Named(count));
                (odds, tallies)
            });
            (walk(steps, rate, confidence), tested)
        }
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

/// Every other sequence of each object, and the rest.
fn halves(sequences: &[Sequence], count: usize) -> (Vec<&Sequence>, Vec<&Sequence>) {
    let mut is_odd = vec![false; count];
    sequences.iter().partition(|sequence| {
        is_odd.get_mut(sequence.object).is_some_and(|is_odd| {
            *is_odd = !*is_odd;
            *is_odd
        })
    })
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
    /// The object that was touched, of so many.
    Touched(usize),
    /// The object that was named, of so many.
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

/// Margins by name at which each name is wrong about as often as a test on as many sequences allows.
fn learn_by_name(sequences: &[&Sequence], count: usize, strictest: f64, terms: &Terms) -> Vec<f64> {
    // First with the same threshold for all: where each name's rate passes the promised one. Then each moves a part of the
    // way to where it would be best if the others stayed; all the way they could chase each other.
    let mut margins = vec![strictest; count];
    let mut walks = vec![true; count];
    for margin in grid(strictest, LOOSEST).step_by(COARSE) {
        let tallies = tallies(sequences, &Odds::All(odds_of(margin)), By::Named(count));
        for ((own, walks), tally) in margins.iter_mut().zip(&mut walks).zip(tallies) {
            *walks &= !is_beyond(tally, terms);
            if *walks && is_allowed(tally, terms) {
                *own = margin;
            }
        }
        if !walks.contains(&true) {
            break;
        }
    }
    for _ in 0..ROUNDS {
        let found: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|name| loosest(sequences, &margins, name, terms).map_or(strictest, margin_of))
            .collect();
        for (own, found) in margins.iter_mut().zip(found) {
            *own = (*own + (0.5 * (found - *own)).clamp(-MOST_MOVE, MOST_MOVE)).clamp(LOOSEST, strictest);
        }
    }
    margins
}

/// Whether a rate is above the promised one by more than chance.
fn is_beyond(Tally { wrong, all }: Tally, terms: &Terms) -> bool {
    let expected = terms.rate * all as f64;
    wrong as f64 > expected + 3.0 * expected.sqrt() + 1.0
}

fn is_allowed(tally: Tally, terms: &Terms) -> bool {
    // A rough bound first: the exact one is dear.
    tally.wrong as f64 <= terms.rate * tally.all as f64
        && allowed(tally.all, terms.rate, terms.confidence).is_some_and(|most| tally.wrong <= most)
}

/// The loosest odds of one name, those of the others given, at which it is not wrong too often.
fn loosest(sequences: &[&Sequence], margins: &[f64], name: usize, terms: &Terms) -> Option<u64> {
    let odds: Vec<u64> = margins.iter().map(|&margin| odds_of(margin)).collect();
    // The name leads by most at its last look before another name is given; odds from there on give it.
    let least = |sequence: &&Sequence| {
        let of = |look: &Look| odds.get(look.name).copied().unwrap_or(0);
        let before = sequence.looks().iter().take_while(|look| look.name == name || look.odds > of(look));
        let own = before.filter(|look| look.name == name).last()?;
        Some((own.odds, sequence.object != name))
    };
    let mut cases: Vec<(u64, bool)> = sequences.iter().filter_map(least).collect();
    cases.sort_unstable();
    let (mut tally, mut loosest) = (Tally::default(), None);
    for &(odds, is_wrong) in &cases {
        tally = Tally { wrong: tally.wrong + u64::from(is_wrong), all: tally.all + 1 };
        if is_beyond(tally, terms) {
            break;
        }
        if is_allowed(tally, terms) {
            loosest = Some(odds);
        }
    }
    loosest
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
