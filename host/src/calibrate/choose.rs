//! Thresholds that keep a promise, from sequences.

use super::begin::Seen;
use super::groups::Bets;
use super::terms::Terms;
use super::walk::{LOOSEST, STEP, Stop, Tally, grid, walk};
use crate::error::Result;
use crate::evidence::{Odds, Sequence, odds_of, totals};
use palpate_shared::format::Per;
use rayon::prelude::*;

/// Steps at once where names have thresholds of their own.
const NAMES_STEP: usize = 2;
/// Steps at once where sequences are cut anew at each.
const RECORDED_STEP: usize = 5;
/// Thresholds by name are learned on one in this many sequences, and tested on the others.
const LEARNED: usize = 3;
/// From how much stricter than the learned thresholds by name to how much looser the tested ones are, in nats.
const AROUND: [f64; 2] = [2.0, -1.0];

/// From the first start to where the one after the last would be, at least, in nats; otherwise to the posterior's own threshold.
const SPREAD: f64 = 2.5;

/// Range of a walk over thresholds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way<'w> {
    /// Margins, in nats, at which a walk may begin, from strict to loose. Sequences were followed to the first of them or
    /// to the limit of touches. Those that are tested had no part in the choice.
    pub(crate) starts: &'w [f64],
    /// Thresholds that those to be kept must be as strict as.
    pub(crate) loosest: Option<&'w Odds>,
}

impl Way<'_> {
    pub(super) fn strictest(&self) -> f64 {
        self.starts.first().copied().unwrap_or(LOOSEST)
    }
}

/// A number of starts in equal steps from the strictest, for when nothing says which would do best.
pub(super) fn spread(strictest: f64, count: usize, rate: f64) -> Vec<f64> {
    let beyond = strictest - ((1.0 - rate) / rate).ln();
    let step = beyond.max(SPREAD) / count.max(1) as f64;
    (0..count.max(1)).map(|start| (strictest - step * start as f64).max(LOOSEST)).collect()
}

/// Thresholds that keep a promise, and the results of the sequences that they were tested on.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The thresholds.
    pub odds: Odds,
    /// Wrong names of those given: one tally for an average, one for each object otherwise.
    pub tallies: Vec<Tally>,
    /// Wrong names among those given to each object, regardless of what the rate covers.
    pub touched: Vec<Tally>,
    /// Times that each object was named, and how often wrongly, regardless of what the rate covers.
    pub named: Vec<Tally>,
    /// Sequences that were tested on; with thresholds by name, without those that these were learned on.
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
/// threshold is walked from strict to loose for an average as for each object (fixed-sequence testing, with an
/// intersection-union test at each step), so that the rates of all objects are kept at once with the stated probability. The
/// walk has up to seven starts, in equal steps from the strictest threshold to the posterior's own; as many as the number of
/// sequences allows.
///
/// Thresholds by name depend on each other, so there is no one order from strict to loose. One is learned on a third of the
/// sequences of each object: thresholds that seem to keep each rate, and those about them. It is walked on the other two
/// thirds, which had no part in it (split fixed-sequence testing, in the same paper), and ends where any name fails. So
/// the rates of all names are kept at once with the stated probability. Nothing is adjusted to the sequences tested on.
///
/// # Errors
/// [`Kind::NotKept`](crate::error::Kind::NotKept) if no threshold keeps the promise;
/// [`Kind::TooFew`](crate::error::Kind::TooFew) if too few names are given to know.
pub fn choose(sequences: &[Sequence], objects: &[String], strictest: f64, terms: &Terms) -> Result<Chosen> {
    let names = sequences.len() as f64 / By::of(terms.per, objects.len()).count().max(1) as f64;
    let count = Seen::nothing(names * share_tested(terms.per), strictest).most_starts(terms);
    let starts = spread(strictest, count, terms.rate);
    let way = Way { starts: &starts, loosest: None };
    promise(&[], sequences, objects.len(), &way, terms).map_err(|stop| {
        let remedy = match stop.is_too_few(terms.rate) {
            true => "Give more sequences, or promise a higher error rate.",
            false => {
                "Train the model for the noise of these touches, or promise a higher error rate; more touches of the \
                 calibration may also help."
            }
        };
        stop.of_names(objects, terms).fix(remedy)
    })
}

/// The share of sequences that are not learned from.
pub(crate) fn share_tested(per: Per) -> f64 {
    let share = 1.0 / LEARNED as f64;
    if per == Per::Name { 1.0 - share } else { 1.0 }
}

/// Chooses thresholds that keep a promise, as [`choose`], from given starts; `objects` is the number of objects. The promise is
/// for new groups if sequences are of groups: these are tested by bets ([`Bets`]), which sequences of other groups,
/// `learned_on`, help to choose. `learned_on` may be empty, and is not used without groups.
///
/// # Errors
/// [`Stop`], if no threshold can be kept.
pub(crate) fn promise(
    learned_on: &[Sequence],
    sequences: &[Sequence],
    objects: usize,
    way: &Way<'_>,
    terms: &Terms,
) -> Result<Chosen, Stop> {
    let Terms { rate, confidence, per } = *terms;
    let by = By::of(per, objects);
    let has_groups = sequences.iter().any(|sequence| sequence.group.is_some());
    let (learn, tested) = match per {
        Per::Name if !has_groups => learned_and_tested(sequences),
        _ => (learned_on.iter().collect(), sequences.iter().collect()),
    };
    let Steps { odds, starts } = Steps::new(&learn, objects, way, terms)?;
    let kept = if has_groups {
        let bets = Bets::new(learned_on, sequences, (per, by.count()), (way.strictest(), starts.len()), terms);
        let of = |odds: Odds| {
            let bets = bets.at(&odds);
            (odds, bets)
        };
        walk(odds.into_iter().map(of), &starts, rate, confidence)?
    } else {
        let of = |odds: Odds| {
            let tallies = tallies(&tested, &odds, by);
            (odds, tallies)
        };
        walk(odds.into_iter().map(of), &starts, rate, confidence)?
    };
    Ok(summary(kept.threshold, kept.tallies, &tested, objects))
}

/// Thresholds that are walked over, from strict to loose, and the positions of the starts among them.
pub(super) struct Steps {
    pub(super) odds: Vec<Odds>,
    pub(super) starts: Vec<usize>,
}

impl Steps {
    /// One threshold for all names; for a promise per name one for each, about those learned on sequences that are not tested
    /// on: as if a test of strangers had held no name back, which makes a threshold look better than it is.
    ///
    /// # Errors
    /// [`Stop::Looser`], if all are looser than they may be.
    pub(super) fn new(learn: &[&Sequence], objects: usize, way: &Way<'_>, terms: &Terms) -> Result<Self, Stop> {
        let strictest = way.strictest();
        let Self { mut odds, starts } = match terms.per {
            Per::Average | Per::Object => {
                let odds = grid(strictest, LOOSEST).map(|margin| Odds::All(odds_of(margin))).collect();
                let position = |margin: &f64| ((strictest - margin) / STEP).round().max(0.0) as usize;
                Self { odds, starts: way.starts.iter().map(position).collect() }
            }
            Per::Name => {
                let ungated: Vec<Sequence> = learn.iter().map(|sequence| sequence.ungated()).collect();
                around(
                    &learned(&ungated.iter().collect::<Vec<_>>(), objects, strictest, terms.rate),
                    strictest,
                    way.starts.len(),
                )
            }
        };
        if let Some(loosest) = way.loosest {
            odds.truncate(odds.partition_point(|odds| odds.is_as_strict_as(loosest)));
        }
        if odds.is_empty() { Err(Stop::Looser) } else { Ok(Self { odds, starts }) }
    }
}

/// The odds of a margin as a model stores them for one object.
fn stored(margin: f64) -> u64 {
    odds_of(margin) >> 24 << 24
}

/// Thresholds from strict to loose that are walked over on recordings: one for all names, or one for each, learned on
/// `sequences` that are not tested on.
pub(super) fn steps(sequences: &[Sequence], objects: usize, strictest: f64, terms: &Terms) -> Vec<Odds> {
    match terms.per {
        Per::Average | Per::Object => {
            let margins = grid(strictest, LOOSEST).step_by(RECORDED_STEP);
            margins.map(|margin| Odds::All(odds_of(margin))).collect()
        }
        Per::Name => {
            let learn: Vec<&Sequence> = sequences.iter().collect();
            around(&learned(&learn, objects, strictest, terms.rate), strictest, 1).odds
        }
    }
}

/// Cases that names are counted by.
#[derive(Clone, Copy)]
pub(super) enum By {
    All,
    /// The object that was touched, of this number of objects.
    Touched(usize),
    /// The object that was named, of this number of objects.
    Named(usize),
}

impl By {
    /// Number of cases.
    pub(super) const fn count(self) -> usize {
        match self {
            Self::All => 1,
            Self::Touched(objects) | Self::Named(objects) => objects,
        }
    }

    /// The cases that a rate is promised of.
    pub(super) fn of(per: Per, objects: usize) -> Self {
        match per {
            Per::Average => Self::All,
            Per::Object => Self::Touched(objects),
            Per::Name => Self::Named(objects),
        }
    }
}

pub(super) fn tallies(sequences: &[&Sequence], odds: &Odds, by: By) -> Vec<Tally> {
    let count = by.count();
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

/// The sequences that thresholds by name are learned on, the first of each object, and those that they are tested on.
fn learned_and_tested(sequences: &[Sequence]) -> (Vec<&Sequence>, Vec<&Sequence>) {
    let objects = sequences.iter().map(|sequence| sequence.object + 1).max().unwrap_or(0);
    let mut left = vec![0_usize; objects];
    sequences.iter().for_each(|sequence| left[sequence.object] += 1);
    left.iter_mut().for_each(|left| *left /= LEARNED);
    sequences.iter().partition(|sequence| {
        let left = &mut left[sequence.object];
        let is_learned = *left > 0;
        *left -= usize::from(is_learned);
        is_learned
    })
}

/// The margins at which each name seems to be wrong as often as promised. They loosen together; a name that is wrong more
/// often stays where it was, while the others go on. What those take from it later may make it wrong more often, and
/// then it is made stricter. Nothing is promised for them: that takes a test on other sequences.
pub(super) fn learned(sequences: &[&Sequence], count: usize, strictest: f64, rate: f64) -> Vec<f64> {
    // As if one more had been wrong: a name that was hardly ever given is not given freely.
    let seems_kept = |tally: Tally| (tally.wrong + 1) as f64 <= rate * (tally.all + 1) as f64;
    let tells = |tally: Tally| rate * (tally.all + 1) as f64 >= 1.0;
    let at = |margins: &[f64]| {
        tallies(sequences, &Odds::ByObject(margins.iter().copied().map(stored).collect()), By::Named(count))
    };
    let mut margins = vec![strictest; count];
    let mut walks = vec![true; count];
    for margin in grid(strictest, LOOSEST).step_by(NAMES_STEP) {
        let tried: Vec<f64> = (0..count).map(|name| if walks[name] { margin } else { margins[name] }).collect();
        for (name, tally) in at(&tried).into_iter().enumerate().filter(|(_, tally)| tells(*tally)) {
            if walks[name] && seems_kept(tally) {
                margins[name] = margin;
            } else {
                walks[name] = false;
            }
        }
        if !walks.contains(&true) {
            break;
        }
    }
    loop {
        let tallies = at(&margins);
        let is_broken =
            |name: &usize| tells(tallies[*name]) && !seems_kept(tallies[*name]) && margins[*name] < strictest;
        let broken: Vec<usize> = (0..count).filter(is_broken).collect();
        if broken.is_empty() {
            return margins;
        }
        broken.into_iter().for_each(|name| margins[name] = (margins[name] + STEP).min(strictest));
    }
}

/// Thresholds by name about the learned ones, from strict to loose: all names' by the same step. So many starts are in equal
/// steps above the learned ones.
fn around(learned: &[f64], strictest: f64, starts: usize) -> Steps {
    let [strict, loose] = AROUND;
    let step = STEP * NAMES_STEP as f64;
    let steps = ((strict - loose) / step).round() as usize;
    let of_starts = |start: usize| (strict * start as f64 / starts.max(1) as f64 / step).round() as usize;
    let mut all = Steps { odds: Vec::new(), starts: Vec::new() };
    for number in 0..=steps {
        let beyond = strict - step * number as f64;
        let margin = |learned: &f64| stored((learned + beyond).clamp(LOOSEST, strictest.max(LOOSEST)));
        let odds = Odds::ByObject(learned.iter().map(margin).collect());
        // Where all are as strict or as loose as can be, nothing is tested twice.
        if all.odds.last() != Some(&odds) {
            all.odds.push(odds);
        }
        let here = (0..starts.max(1)).filter(|start| of_starts(*start) == number);
        all.starts.extend(here.map(|_| all.odds.len() - 1));
    }
    all
}

pub(super) fn summary(odds: Odds, kept: Vec<Tally>, tested: &[&Sequence], count: usize) -> Chosen {
    let [touched, named] = [By::Touched(count), By::Named(count)].map(|by| tallies(tested, &odds, by));
    let totals = totals(tested.iter().copied(), &odds);
    Chosen {
        odds,
        tallies: kept,
        touched,
        named,
        sequences: totals.sequences,
        given: totals.given,
        wrong: totals.wrong,
        mean_touches: totals.mean_touches(),
        mean_approaches: totals.mean_approaches(),
    }
}
