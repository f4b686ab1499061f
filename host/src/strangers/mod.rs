//! A test of whether touches fit any object that a model knows, made from touches that its training never saw.
//!
//! ```text
//! touches ──► margins ──┬─ a quarter ──► what touches of each object give: means and covariances (misfit)
//! other shapes ─────────┼──────────────► what touches of strangers give
//!                       │                        └──► the misfit, in integers (fixed)
//!                       └─ the rest ───► sequences (follow) ──► its threshold, by Learn-then-Test
//! ```
//!
//! The misfit of n touches is half of the log-likelihood ratio of two normal distributions of the mean evidence: that of
//! other shapes, N(μ + s, B + C/n), and that of the leading object's touches, N(μ, C/n). The first is learned on shapes of
//! no kind, each weighted by how nearly the object leads it. B + C/n is taken at n = 40 for all n, so that one matrix for
//! each object does; measured, that detects as many strangers as the exact ratio.
//!
//! `calibrate --detect-unknown` says how many known objects a test calls unknown, and `evaluate --unknown` how many strangers it detects.

mod fixed;
mod follow;
mod misfit;
mod promised;
#[cfg(feature = "objects")]
mod shapes;
#[cfg(test)]
mod tests;

pub use promised::calibrate_with_promise;
#[cfg(feature = "objects")]
pub use shapes::captured;

use crate::calibrate::{Found, Stop, Tally, walk};
use crate::compile::{self, Restated, restate};
use crate::error::{Error, Kind, Result, problem};
use crate::evaluate::OfTouches;
use crate::evaluate::together::margins_of_touches;
use crate::evidence::Drawer;
use crate::random::Purpose;
use crate::touches::{Dataset, ObjectTouches, Pool};
use follow::{Ending, Sequence};
use misfit::Moments;
use palpate_onboard::{Model, Refused};
use palpate_shared::Touch;
use palpate_shared::format::{MisfitTerms, Strangers, Tag};
use rayon::prelude::*;

/// Touches from which on a test is made.
const FIRST: u32 = 5;
/// Amount by which the limits of misfit are higher at first, in nats, and the touches after which this has halved.
/// Measured to detect most strangers after 60 and 120 touches.
const EARLY: f64 = 12.0;
const HALVED_AFTER: f64 = 21.0;
/// Touches of sequences that give a first guess of the threshold.
const ROUGH: u32 = 120;
/// Distance below that guess, which was found without any name being given, from which on thresholds are tried, in nats.
const BELOW: f64 = 6.0;
/// Between two thresholds that are tried, in nats, and how many are.
const STEP: f64 = 0.05;
const STEPS: usize = 400;
/// Above the loosest threshold, in nats: the most that is tried.
const MOST_BEYOND: f64 = 1_000.0;
/// 2^-16 nats.
const NAT: f64 = 65_536.0;

/// Requirements on a test.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The share of known objects' sequences that may end as unknown.
    pub alarms: f64,
    /// The confidence that the share is kept.
    pub confidence: f64,
    /// The most sequences that the threshold is tested on, of all objects together.
    pub sequences: usize,
    /// Seed of the order in which touches are used.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { alarms: 0.02, confidence: 0.95, sequences: 100_000, seed: 1 }
    }
}

/// A model with a test, and what the test was calibrated to.
#[derive(Clone, Debug, PartialEq)]
pub struct Tested {
    /// The model's bytes.
    pub bytes: Vec<u8>,
    /// Terms that are the same for all objects.
    pub terms: MisfitTerms,
    /// Sequences that ended as unknown, among those that the threshold was tested on.
    pub alarms: usize,
    /// Touches used on average in these sequences.
    pub mean_touches: f64,
    /// Touches used on average without a test.
    pub mean_touches_without: f64,
}

impl Tested {
    /// Its figures, for the settings that it was calibrated with.
    pub fn found(&self, settings: &Settings) -> Found {
        let terms = &self.terms;
        Found {
            promised: settings.alarms,
            false_alarms: self.alarms as f64 / f64::from(terms.sequences.max(1)),
            sequences: terms.sequences,
            mean_touches: self.mean_touches,
            mean_touches_without: self.mean_touches_without,
        }
    }
}

/// The margins of one object's touches that are evidence, in the order in which they are used.
#[derive(Debug, Default)]
pub(crate) struct Pools {
    /// For each source, such as an instance, and each robot one row after the other, in units.
    pools: Vec<Vec<i32>>,
    /// True if a pool is a robot's, which makes one sequence.
    is_once: bool,
    /// True if pools are short: how far their means are apart says more of their length than of what differs between them.
    is_short: bool,
}

impl Pools {
    /// Pools of sequences of rows: the evidence of each, row after row, in units.
    pub(crate) fn of_rows(pools: Vec<Vec<i32>>) -> Self {
        Self { pools, is_once: true, is_short: true }
    }

    /// A quarter of the touches, or of the robots, to learn from, and the rest to test on.
    fn divided(mut self, objects: usize) -> [Self; 2] {
        let is_once = self.is_once;
        let rest = if is_once {
            self.pools.split_off(self.pools.len() / 4)
        } else {
            self.pools.iter_mut().map(|rows| rows.split_off(rows.len() / objects / 4 * objects)).collect()
        };
        let is_short = self.is_short;
        [self, Self { pools: rest, is_once, is_short }]
    }
}

/// Gives a model a misfit test, or replaces the one that it has. `dataset` holds touches of every object that the model
/// knows, none of them used in training; `shapes` touches of many other shapes, if there are any: every instance of each of
/// these objects is one.
///
/// The share of false alarms is kept under the model's thresholds, and looser ones. A promised error rate was found without
/// this test and does not hold with it: the model states it no more. [`calibrate_with_promise`] finds both.
///
/// # Errors
/// Errors of an evaluation; [`Kind::TooFew`] for too few touches, and [`Kind::NotKept`] for too many alarms;
/// [`Kind::Setting`] for shares that are none.
pub fn calibrate(
    model: &Model<'_>,
    dataset: &Dataset,
    shapes: &[ObjectTouches],
    settings: &Settings,
) -> Result<Tested> {
    check(settings)?;
    calibrate_supplies(model, supplies(model, dataset, settings.seed)?, &of_shapes(model, shapes), settings)
}

/// Like [`calibrate`], from margins: of each known object, and the mean ones of other shapes.
pub(crate) fn calibrate_supplies(
    model: &Model<'_>,
    given: Vec<Pools>,
    shapes: &[Vec<f64>],
    settings: &Settings,
) -> Result<Tested> {
    check(settings)?;
    let objects = model.object_count();
    let unit = f64::from(model.unit());
    let (learn, test) = learned_and_tested(given, objects);
    let known = model.known_count();
    let moments = Moments::new(&learn, shapes, known, objects, unit);
    let misfits = misfit::misfits(&moments).ok_or_else(|| {
        let found = learn_count(&learn, objects);
        problem!("an object has only {found} touches to learn the expected evidence from, or they are all alike")
            .fix(MORE_TOUCHES)
            .as_kind(Kind::TooFew)
    })?;
    let terms = |threshold: f64| terms(settings, &misfits, threshold);
    // Levels of misfit do not depend on any threshold.
    let untested = stated(model, &terms(0.0), &misfits)?;
    let untested = compile::open(&untested)?;
    let follow = |of: &[Pools], ending: Ending| follow::sequences(&untested, of, ending, settings.sequences);

    let is_short = learn.iter().any(|supply| supply.is_short);
    let free = follow(&learn, Ending::Touches(ROUGH.min(model.header().max_touches())));
    let loosest = follow::quantile(&counted(&free, is_short), 1.0 - settings.alarms) - BELOW;
    let to_the_end = Ending::Touches(model.header().max_touches());
    let strictest = strictest(is_short.then(|| follow(&learn, to_the_end)), settings, loosest);
    let sequences = follow(&test, Ending::Named { level: loosest });
    let all = counted(&sequences, is_short);
    let tried = Tried { loosest, strictest };
    let threshold = tried.threshold(&all, settings).map_err(|stop| {
        let fewest = (0..sequences.len()).min_by_key(|&object| sequences[object].len());
        let remedy = match (&stop, fewest) {
            (Stop::TooFew { found, needed, .. }, Some(object)) if *found > 0 => {
                let (times, names) = (*needed as f64 / *found as f64, compile::names(model));
                format!("Capture about {:.1} times as many touches of {}.", (10.0 * times).ceil() / 10.0, names[object])
            }
            _ => MORE_TOUCHES.into(),
        };
        stop.problem(settings.alarms, "sequences of known objects", "called unknown").fix(remedy)
    })?;
    let [alarms, touches] = tried.ends(&all, threshold);
    let terms = MisfitTerms { sequences: u32::try_from(all.len()).unwrap_or(u32::MAX), ..terms(threshold) };
    let bytes = stated(model, &terms, &misfits)?;
    let mean = |touches: u64| touches as f64 / all.len().max(1) as f64;
    Ok(Tested {
        bytes,
        terms,
        alarms: alarms as usize,
        mean_touches: mean(touches),
        mean_touches_without: mean(all.iter().map(|sequence| u64::from(sequence.decided_after())).sum()),
    })
}

/// Remedy for too few touches.
const MORE_TOUCHES: &str = "Capture more touches of every object.";

/// `as` saturates.
fn millionths(share: f64) -> u32 {
    (share * 1e6).round() as u32
}

/// Takes the test out of a model, and what the model promises with it; a background stays.
///
/// # Errors
/// None for a valid model.
pub fn without(model: &Model<'_>) -> Result<Vec<u8>> {
    if model.strangers().is_none_or(|strangers| strangers.test.is_none()) {
        return Ok(model.bytes().to_vec());
    }
    let header = Strangers::header(true, false).to_vec();
    let section = model.background().map(|_| (true, header));
    let sections = vec![(Tag::Strangers, section), (Tag::Promise, None)];
    restate(model, &Restated { sections, ..Restated::default() })
}

fn check(settings: &Settings) -> Result<()> {
    let is_share = |share: f64| share > 0.0 && share < 1.0;
    match settings {
        Settings { alarms, .. } if !is_share(*alarms) => Err(Error::setting("alarms", alarms, "a share, such as 0.02")),
        Settings { confidence, .. } if !is_share(*confidence) => {
            Err(Error::setting("confidence", confidence, "a share, such as 0.95"))
        }
        Settings { sequences: 0, .. } => Err(Error::setting("sequences", 0, "at least 1")),
        _ => Ok(()),
    }
}

/// A quarter of each object's touches, or robots, which says what touches give, and the rest, which the threshold is tested
/// on.
fn learned_and_tested(supplies: Vec<Pools>, objects: usize) -> (Vec<Pools>, Vec<Pools>) {
    supplies.into_iter().map(|supply| supply.divided(objects).into()).unzip()
}

/// The touches that a model with a test uses on average, and would use without it, in sequences of those touches that
/// [`calibrate`] tested the threshold on.
fn tested_means(model: &Model<'_>, dataset: &Dataset, settings: &Settings) -> Result<[f64; 2]> {
    let (_, test) = learned_and_tested(supplies(model, dataset, settings.seed)?, model.object_count());
    let Some(misfit_test) = model.strangers().and_then(|strangers| strangers.test) else { return Ok([0.0; 2]) };
    let threshold = f64::from(misfit_test.terms.threshold) / NAT;
    let sequences = follow::sequences(model, &test, Ending::Named { level: threshold }, settings.sequences);
    let all = equally_many(&sequences);
    let mean = |touches: &dyn Fn(&Sequence) -> u64| {
        all.iter().map(|sequence| touches(sequence)).sum::<u64>() as f64 / all.len().max(1) as f64
    };
    let with = mean(&|sequence| sequence.end(threshold).touches);
    Ok([with, mean(&|sequence| sequence.decided_after().into())])
}

/// The sequences that are counted: equally many of each object, and of rows all, with classes as often as they are there.
fn counted(sequences: &[Vec<Sequence>], is_short: bool) -> Vec<&Sequence> {
    if is_short { sequences.iter().flatten().collect() } else { equally_many(sequences) }
}

/// Equally many sequences of each object.
fn equally_many(sequences: &[Vec<Sequence>]) -> Vec<&Sequence> {
    let fewest = sequences.iter().map(Vec::len).min().unwrap_or(0);
    sequences.iter().flat_map(|of| of.iter().take(fewest)).collect()
}

fn learn_count(learn: &[Pools], objects: usize) -> usize {
    let count = |supply: &Pools| supply.pools.iter().map(Vec::len).sum::<usize>() / objects.max(1);
    learn.iter().map(count).min().unwrap_or(0)
}

/// Touches of every known object, in the model's order: those that may follow each other in a random order.
fn supplies(model: &Model<'_>, dataset: &Dataset, seed: u64) -> Result<Vec<Pools>> {
    model.of(dataset)?;
    let dataset = model.delivered(dataset);
    let names = compile::names(model);
    let known = &names[..model.known_count()];
    let of_name = |name: &String| {
        let missing = || {
            problem!("there are no touches of {name}, which the model knows")
                .fix("Capture touches of every object that the model knows.")
        };
        let touched = dataset.objects.iter().find(|object| object.name == *name).ok_or_else(missing)?;
        Ok(supply(model, touched, seed))
    };
    known.iter().map(of_name).collect()
}

/// The touches of an object that may follow each other in a random order.
fn supply(model: &Model<'_>, touched: &ObjectTouches, seed: u64) -> Pools {
    let is_once = touched.has_robots();
    let pool = |(turn, pool): (u64, &Pool)| {
        let mut touches: Vec<&Touch> = evidence(model, touched.of_pool(pool).iter()).collect();
        if !is_once {
            Drawer { purpose: Purpose::Misfit, name: &touched.name, seed }.shuffle(turn, &mut touches);
        }
        margins_of_touches(model, &touches)
    };
    Pools { pools: (0..).zip(touched.pools()).map(pool).collect(), is_once, is_short: false }
}

/// Touches that the model takes as evidence.
fn evidence<'d>(model: &Model<'_>, touches: impl Iterator<Item = &'d Touch>) -> impl Iterator<Item = &'d Touch> {
    let trained = model.trained_touches();
    touches.filter(move |touch| Refused::check(&trained, touch).is_ok())
}

/// The mean margins of each shape that has evidence, in units.
fn of_shapes(model: &Model<'_>, shapes: &[ObjectTouches]) -> Vec<Vec<f64>> {
    let objects = model.object_count();
    let mean = |touches: Vec<&Touch>| {
        let rows = margins_of_touches(model, &touches);
        let mut mean = vec![0.0; objects];
        for row in rows.chunks(objects) {
            mean.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += f64::from(margin));
        }
        mean.iter_mut().for_each(|sum| *sum /= touches.len() as f64);
        mean
    };
    let of = shapes.iter().flat_map(|object| {
        let of = move |pool| evidence(model, object.of_pool(pool).iter()).collect::<Vec<_>>();
        object.pools().iter().map(of)
    });
    // Fewer say less about a shape than about chance.
    of.filter(|touches| touches.len() >= 20).map(mean).collect()
}

fn terms(settings: &Settings, misfits: &[misfit::Misfit], threshold: f64) -> MisfitTerms {
    MisfitTerms {
        rivals: misfits.first().map_or(0, |misfit| misfit.rivals.len() as u8),
        first: FIRST,
        threshold: (threshold * NAT).round() as i32,
        early: (EARLY * NAT).round() as u32,
        halving: (4_294_967_296.0 / HALVED_AFTER).round() as u32,
        alarms: millionths(settings.alarms),
        sequences: 0,
        confidence: millionths(settings.confidence),
    }
}

/// The model with a test.
fn stated(model: &Model<'_>, terms: &MisfitTerms, misfits: &[misfit::Misfit]) -> Result<Vec<u8>> {
    let mut section = Strangers::header(model.background().is_some(), true).to_vec();
    section.extend(terms.to_bytes());
    misfits.iter().for_each(|misfit| fixed::write(misfit, f64::from(model.unit()), &mut section));
    let sections = vec![(Tag::Strangers, Some((true, section))), (Tag::Promise, None)];
    restate(model, &Restated { sections, ..Restated::default() })
}

/// The threshold from which looser ones are tested. Rows of a sequence that depend on each other make a misfit that goes on
/// growing: then where those that were learned from have half as many false alarms as are allowed, if that is beyond.
fn strictest(learned: Option<Vec<Vec<Sequence>>>, settings: &Settings, loosest: f64) -> f64 {
    let own = loosest + STEP * STEPS as f64;
    let few = learned.map_or(own, |learned| follow::quantile(&counted(&learned, true), 1.0 - 0.5 * settings.alarms));
    few.max(own).min(loosest + MOST_BEYOND)
}

/// Thresholds that are tried, from strict to loose.
struct Tried {
    loosest: f64,
    strictest: f64,
}

impl Tried {
    /// False alarms of sequences at a threshold, and their touches.
    fn ends(&self, sequences: &[&Sequence], threshold: f64) -> [u64; 2] {
        let ends = sequences.par_iter().map(|sequence| sequence.end(threshold));
        ends.map(|end| [u64::from(end.is_alarm), end.touches]).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
    }

    /// The loosest threshold that keeps the promise: walked over from the strictest, as all promises are.
    ///
    /// # Errors
    /// [`Stop`], if there are too few sequences, or too many alarms at the strictest.
    fn threshold(&self, sequences: &[&Sequence], settings: &Settings) -> Result<f64, Stop> {
        let steps = ((self.strictest - self.loosest) / STEP).round() as usize;
        let thresholds = (0..steps).map(|step| self.loosest + STEP * (steps - 1 - step) as f64);
        let alarms = |threshold| {
            let [wrong, _] = self.ends(sequences, threshold);
            (threshold, vec![Tally { wrong, all: sequences.len() as u64 }])
        };
        Ok(walk(thresholds.map(alarms), &[0], settings.alarms, settings.confidence)?.threshold)
    }
}
