//! Thresholds that keep a promise about located objects, and their test.

use super::follow::{Pressed, Pressing};
use super::pose::{Equivalents, Off, Until};
use super::refused::{no_hand, refused};
use super::world::{Aimed, Drawn, Real, Standing, World};
use super::write::{Restated, restated};
use super::{Effort, Hand, Maps, Promised, Seen, TESTED, locating};
use crate::calibrate::{self, Begin, Chosen, Stop, Way, margin_of, odds_of, promise};
use crate::error::{Error, Kind, Result, problem};
use crate::evaluate::Finding;
use crate::evidence::{self, Follower, Given, Limit, Outcome, Sequence, Totals};
use crate::probe::approach::Probe;
use crate::probe::noise::Noise;
use crate::progress::{self, Progress};
use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches, Pool};
use palpate_onboard::{Familiarity, Stopping};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use serde::Serialize;

/// Terms of sequences on a simulated table.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// The promise.
    pub promise: calibrate::Terms,
    /// Number of sequences.
    pub sequences: usize,
    /// Limit of approaches.
    pub max_touches: u32,
    /// The aim of approaches; a promise holds for one kind of aim alone.
    pub aimed: Aimed,
    /// Noise of hand and table.
    pub real: Real,
    /// Make a test for unknown objects: no object is named before the eighth touch then.
    pub unknown: bool,
    /// Go on until the pose of the named object is this sure; the promise is about the name.
    pub until: Option<Until>,
    /// Weight of the pose where approaches are chosen, in 64ths.
    pub pose: u16,
    /// Greatest x and y of the middle finger from the table's origin, in micrometers: [`workspace`](super::workspace).
    pub within: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Bounds on the work of an approach; none: a chip's.
    pub effort: Option<Effort>,
}

impl Terms {
    /// Checks the limit of approaches and the noise.
    fn check(&self) -> Result<()> {
        if !(1..=super::TOUCHES as u32).contains(&self.max_touches) {
            return Err(Error::setting("max_touches", self.max_touches, format!("1 to {}", super::TOUCHES)));
        }
        self.real.check()
    }
}

/// A calibrated model of maps.
#[derive(Clone, Debug, Serialize)]
pub struct Calibrated {
    /// Its bytes.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// The promised error rate.
    pub promised: f64,
    /// The probability that it is kept.
    pub confidence: f64,
    /// The aim of approaches.
    pub aimed: Aimed,
    /// Sequences that it rests on.
    pub sequences: usize,
    /// Names given.
    pub given: usize,
    /// Wrong ones.
    pub wrong: usize,
    /// Approaches on average.
    pub mean_approaches: f64,
    /// Margin at which an object is named, in nats.
    pub margin: f64,
    /// Limit of approaches.
    pub max_touches: u32,
    /// Noise that it holds for, in words.
    pub noise: String,
    /// Recordings that it rests on; none if it rests on simulated approaches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<usize>,
    /// Results of going on until the place is sure; none unless that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<ToPlace>,
    /// Results of the test for unknown objects; none unless that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strangers: Option<LeftOut>,
}

/// Results of a test for unknown objects: each object of the model is left out in turn, and then is one that it does not know.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LeftOut {
    /// Sequences.
    pub sequences: usize,
    /// Sequences that ended as unknown.
    pub unknown: usize,
    /// Sequences that got a name, which is wrong.
    pub named: usize,
}

impl LeftOut {
    /// Results of sequences.
    ///
    /// # Errors
    /// If less than half of them ended as unknown.
    fn of(each: &[Played]) -> Result<Self> {
        let (unknown, sequences) = (each.iter().filter(|played| played.outcome.unknown).count(), each.len());
        let named = each.iter().filter(|played| played.outcome.recognized.is_some()).count();
        let found = Self { sequences, unknown, named };
        if 2 * unknown < sequences {
            return Err(problem!(
                "a test for unknown objects is worth little here: of {sequences} sequences of objects that were left out in turn, \
                 {unknown} ended as unknown"
            )
            .fix("Make maps for less noise or of smaller cells, or calibrate without the test."));
        }
        Ok(found)
    }
}

/// Results of going on until the place of a named object is sure.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ToPlace {
    /// Objects that were named rightly.
    pub right: usize,
    /// Objects of these whose place became sure.
    pub placed: usize,
    /// Approaches on average, those to the name included.
    pub mean_approaches: f64,
}

impl ToPlace {
    /// Results of sequences; none unless places were asked for.
    ///
    /// # Errors
    /// If less than half of the objects that were named rightly have a sure place.
    fn of(each: &[Played], terms: &Terms) -> Result<Option<Self>> {
        let Some(until) = terms.until else { return Ok(None) };
        let right = each.iter().filter(|played| played.is_right).count();
        let placed = each.iter().filter(|played| played.in_intervals.is_some()).count();
        if 2 * placed < right {
            return Err(problem!(
                "of {right} objects that were named rightly only {placed} had a place as sure as {} mm and {}° within {} approaches",
                until.millimeters,
                until.degrees,
                terms.max_touches
            )
            .fix("Ask for less, such as 3 mm and 5 degrees, or allow more approaches."));
        }
        let approaches: usize = each.iter().map(|played| played.outcome.approaches).sum();
        Ok(Some(Self { right, placed, mean_approaches: approaches as f64 / each.len().max(1) as f64 }))
    }
}

/// Results of an evaluation on a simulated table.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// Sequences.
    pub sequences: usize,
    /// Names given.
    pub given: usize,
    /// Wrong ones.
    pub wrong: usize,
    /// Sequences without a name.
    pub undecided: usize,
    /// Sequences that ended as unknown.
    pub unknown: usize,
    /// Approaches on average.
    pub mean_approaches: f64,
    /// Median and 95 % quantile of the distance of right names' poses from the truth, in millimeters.
    pub off: [f64; 2],
    /// Right names with a pose: all of them without [`Terms::until`], otherwise those whose pose became as sure.
    pub poses: usize,
    /// Poses whose truth is in their intervals, modulo symmetry; without [`Terms::until`] in those of one of their modes.
    pub poses_in_interval: usize,
    /// Poses within what [`Terms::until`] asks for; all without it.
    pub poses_within: usize,
    /// Results for each object.
    pub objects: Vec<OfObject>,
    /// Heights that an approach looked up on average, and at most.
    pub looked: [u64; 2],
    /// The promise that was tested, and the outcome; none without a promise.
    pub promise: Option<Tested>,
}

/// A promise that was tested on other sequences.
#[derive(Clone, Debug, Serialize)]
pub struct Tested {
    /// The promise.
    #[serde(flatten)]
    pub promised: Promised,
    /// Wrong names of those given.
    pub error: f64,
    /// True if it was kept.
    pub finding: Finding,
}

/// Results for an object.
#[derive(Clone, Debug, Serialize)]
pub struct OfObject {
    /// Its name.
    pub name: String,
    /// Approaches on average.
    pub mean_approaches: f64,
    /// Names given to it.
    pub given: usize,
    /// Wrong ones.
    pub wrong: usize,
    /// Times that it was called unknown.
    pub unknown: usize,
}

/// Finds the loosest threshold that keeps a promise, on sequences of approaches to these objects, each followed by the chip's own
/// code: Learn-then-Test by fixed-sequence testing, as for all models. Chosen approaches depend on the follower, so they are played
/// with it.
///
/// Before, half as many other sequences say at which thresholds to begin; how badly touches may fit each known object, where
/// unknown ones are to be found (1 % of its sequences fit worse at some touch); and with [`Terms::until`] by what factor the intervals of
/// poses must be wider to hold 95 % of the poses at which places are sure (split conformal prediction). In the end they say how many
/// approaches the place takes.
///
/// # Errors
/// When maps have no hand, objects are not theirs, or places never become sure;
/// [`Kind::NotKept`] or [`Kind::TooFew`] if no threshold keeps the
/// promise.
pub fn calibrate(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    terms.check()?;
    check_all(maps, standing.iter().map(|object| &object.name))?;
    let plain = Restated { odds: 0, max_touches: terms.max_touches, least_fits: Vec::new(), stretch: 0, promise: None };
    let bytes = restated(maps, &plain)?;
    let plain_maps = opened(&bytes)?;
    let before = Terms { sequences: terms.sequences.div_ceil(2), seed: terms.seed.wrapping_add(1), ..*terms };
    let followed = follow(plain_maps, standing, probe, &before, strictest(terms), progress)?;
    let units: Vec<usize> = (0..followed.len()).collect();
    let Begin { starts, .. } = Begin::new(&followed, &units, terms.sequences, &terms.promise, strictest(terms));
    // A sequence is at least long enough for the test to decide.
    let min_touches = if terms.unknown { TESTED } else { 1 };
    let goes_on = terms.unknown || terms.until.is_some();
    let odds = odds_of(if terms.unknown { strictest(terms) } else { terms.promise.margin() });
    let each = if goes_on {
        play(plain_maps, standing, probe, &before, (odds, min_touches, false), progress)?
    } else {
        Vec::new()
    };
    ToPlace::of(&each, terms)?;
    let least_fits = if terms.unknown { least_fits(&each, maps.objects()) } else { Vec::new() };
    let stated = Restated { least_fits, stretch: terms.until.map_or(0, |_| stretch(&each)), ..plain };
    let bytes = restated(maps, &stated)?;
    let sequences = follow(opened(&bytes)?, standing, probe, terms, strictest(terms), progress)?;
    let way = Way { starts: &starts, loosest: None };
    let names = super::names(&maps);
    let chosen = promise(&[], &sequences, names.len(), &way, &terms.promise).map_err(|stop| {
        let both = [super::stated(&maps), terms.real].map(|real| real.noise(probe.speed).to_string());
        let noise = (both[0] != both[1]).then_some(both);
        let tested = calibrate::Tested { supplied: None, sequences: sequences.len(), noise };
        tested.problem(&stop, &names, &terms.promise)
    })?;
    let calibrated = promised(maps, &chosen, probe, terms, stated, None)?;
    let again = |leaves_out: bool| {
        let how = (chosen.odds.strictest(), 1, leaves_out);
        play(opened(&calibrated.model)?, standing, probe, &before, how, progress)
    };
    let until = if terms.until.is_some() { ToPlace::of(&again(false)?, terms)? } else { None };
    let is_tested = terms.unknown && maps.objects() > 1;
    let strangers = if is_tested { Some(LeftOut::of(&again(true)?)?) } else { None };
    Ok(Calibrated { until, strangers, ..calibrated })
}

const ALL: &str = "Give the objects that the model was trained on, all of them and no others.";

/// Refuses objects that are not those of the maps.
fn check_all<'o>(maps: Maps<'_>, objects: impl Iterator<Item = &'o String>) -> Result<()> {
    let (names, objects) = (super::names(&maps), objects.collect::<Vec<_>>());
    if let Some(object) = names.iter().find(|name| !objects.contains(name)) {
        return Err(problem!("{object} is not among the objects to calibrate on").fix(ALL));
    }
    match objects.into_iter().find(|object| !names.contains(object)) {
        Some(object) => Err(problem!("the model does not know {object}").fix(ALL)),
        None => Ok(()),
    }
}

/// Finds the loosest threshold that keeps a promise for new recordings, on recorded touches. Those of each recording are of an object
/// that stood still; in a random order they are cut into sequences that share no touch. Sequences of a recording share its pose, so
/// recordings are the groups of the test by betting (Waudby-Smith and Ramdas, 2024): each counts once.
///
/// # Errors
/// The ones of [`calibrate`](fn@calibrate) and [`seen`](super::seen).
pub fn calibrate_recorded(
    maps: Maps<'_>,
    recorded: &Dataset,
    probe: &Probe,
    terms: &Terms,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    terms.check()?;
    check_all(maps, recorded.objects.iter().map(|object| &object.name))?;
    let hand = Hand::of(&maps).ok_or_else(no_hand)?;
    let plain = Restated { odds: 0, max_touches: terms.max_touches, least_fits: Vec::new(), stretch: 0, promise: None };
    let bytes = restated(maps, &plain)?;
    let (plain_maps, names) = (opened(&bytes)?, super::names(&maps));
    // Recorded touches have noise of their own.
    let terms = &Terms { aimed: Aimed::Random, real: Real::like(&Noise::default(), probe.speed), ..*terms };
    let sequences_of = |(index, (touches, pool)): (u64, (&ObjectTouches, &Pool))| -> Result<Vec<Sequence>> {
        progress::advance(progress, 1)?;
        let is_down = |touch| match super::seen(&hand, touch) {
            Err(error) if error.is(&Kind::NotDown) => Ok(None),
            seen => seen.map(Some),
        };
        let mut steps = touches.of_pool(pool).iter().map(is_down).collect::<Result<Vec<_>, _>>()?;
        let mut random = random::generator(terms.seed, Purpose::Calibration, &touches.name, index);
        steps.shuffle(&mut random);
        let class = names.iter().position(|name| *name == touches.name).unwrap_or(usize::MAX);
        let mut replayed = Given::of(class, steps.iter().map(Option::as_ref));
        let mut pressing = pressing(plain_maps, hand, terms, 1);
        let limit = Limit { margin: strictest(terms), max_touches: terms.max_touches };
        let Ok(found) = evidence::sequences(&mut replayed, &mut pressing, usize::MAX, limit);
        let group = usize::try_from(index).ok();
        Ok(found.into_iter().map(|sequence| sequence.of_group(group)).collect())
    };
    let pools = |touches| ObjectTouches::pools(touches).iter().map(move |pool| (touches, pool));
    let pools: Vec<_> = (0..).zip(recorded.objects.iter().flat_map(pools)).collect();
    let count = pools.len();
    progress.begin("recordings", Some(count as u64));
    let sequences = pools.into_par_iter().map(sequences_of).collect::<Result<Vec<_>>>()?.concat();
    let rate = terms.promise.rate;
    let way = Way { starts: &[strictest(terms)], loosest: None };
    let chosen = promise(&[], &sequences, names.len(), &way, &terms.promise).map_err(|stop| match stop {
        Stop::TooFew { .. } => stop.problem(rate, "recordings", "wrong").fix(
            "A recording counts by the share of its sequences that get a name. Record the objects in more places, or promise a \
             higher error rate; more touches in the same places do not help.",
        ),
        _ => stop.problem(rate, "names given", "wrong").fix("Promise a higher error rate, or record more."),
    })?;
    promised(maps, &chosen, probe, terms, plain, Some(count))
}

/// Writes the chosen threshold into the maps, with the number of recordings if it rests on some.
fn promised(
    maps: Maps<'_>,
    chosen: &Chosen,
    probe: &Probe,
    terms: &Terms,
    stated: Restated,
    recordings: Option<usize>,
) -> Result<Calibrated> {
    let calibrate::Terms { rate, confidence, .. } = terms.promise;
    let odds = chosen.odds.strictest();
    let noise = terms.real.noise(probe.speed);
    let stated_terms = calibrate::Stated {
        approaches: true,
        active: terms.aimed == Aimed::Chosen,
        groups: recordings.is_some(),
        max_touches: terms.max_touches,
        noise: noise.promised(),
    };
    let promise = chosen.promise(&terms.promise, stated_terms);
    let model = restated(maps, &Restated { odds, promise: Some(promise), ..stated })?;
    Ok(Calibrated {
        model,
        promised: rate,
        confidence,
        aimed: terms.aimed,
        sequences: chosen.sequences,
        given: chosen.given,
        wrong: chosen.wrong,
        mean_approaches: chosen.mean_approaches,
        margin: margin_of(odds),
        max_touches: terms.max_touches,
        noise: noise.to_string(),
        recordings,
        until: None,
        strangers: None,
    })
}

/// The strictest margin that is tried, in nats: 4 more than the promise's, but at most 6 unless the promise needs more, since a search
/// ends when coarse cells weigh e^-6 of all.
fn strictest(terms: &Terms) -> f64 {
    let margin = terms.promise.margin();
    margin.max((margin + 4.0).min(6.0))
}

/// Share of sequences of known objects that may end as unknown.
const ALARM_RATE: f64 = 0.01;

fn opened(bytes: &[u8]) -> Result<Maps<'_>> {
    Maps::new(bytes).map_err(refused)
}

/// The lowest fit of each object with which it counts as known: from the first touch of the test on, while the object leads, all but
/// a share of its sequences fit at least as well.
fn least_fits(each: &[Played], objects: usize) -> Vec<i16> {
    let least_fit = |object: usize| {
        let lowest =
            |played: &Played| played.fits.iter().filter(|(leader, _)| *leader == object).map(|(_, fit)| *fit).min();
        let mut all: Vec<i32> = each.iter().filter(|played| played.class == object).filter_map(lowest).collect();
        all.sort_unstable();
        let alarms = ((all.len() + 1) as f64 * ALARM_RATE) as usize;
        // 0 stands for no test.
        all.get(alarms).map_or(0, |&fit| i16::try_from(fit).unwrap_or(i16::MIN).min(-1))
    };
    (0..objects).map(least_fit).collect()
}

/// Distance of a pose in another placement from the truth, in units of its intervals.
const ELSEWHERE: f64 = 1e3;

/// The factor in Q8 by which intervals hold 95 % of the poses.
fn stretch(each: &[Played]) -> u16 {
    // Wider intervals do not cure a pose in another placement.
    let mut parts: Vec<f64> =
        each.iter().filter_map(|played| played.in_intervals).filter(|&part| part < ELSEWHERE).collect();
    parts.sort_by(f64::total_cmp);
    let place = ((parts.len() + 1) as f64 * 0.95).ceil() as usize;
    let factor = parts.get(place.saturating_sub(1).min(parts.len().saturating_sub(1))).copied().unwrap_or(1.0);
    ((factor * 256.0).ceil() as u16).max(1)
}

/// Follows sequences to a margin.
fn follow(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    margin: f64,
    progress: &dyn Progress,
) -> Result<Vec<Sequence>> {
    let setup = Setup::new(maps, standing, probe, terms)?;
    progress.begin("sequences", Some(terms.sequences as u64));
    let limit = Limit { margin, max_touches: terms.max_touches };
    let of = |index: usize| -> Result<Vec<Sequence>> {
        progress::advance(progress, 1)?;
        let (mut pressed, mut pressing) = setup.sequence(index as u64);
        let Ok(found) = evidence::sequences(&mut pressed, &mut pressing, 1, limit);
        Ok(found)
    };
    let each = (0..terms.sequences).into_par_iter().map(of).collect::<Result<Vec<_>>>()?;
    Ok(each.concat())
}

/// A sequence that was played to its end.
#[derive(Clone, Debug)]
struct Played {
    outcome: Outcome,
    /// The object's number in the model.
    class: usize,
    /// True if its name is right.
    is_right: bool,
    /// The leader and its fit until there is a name, from where a test decides.
    fits: Vec<(usize, i32)>,
    /// Distance of the pose from the truth; none if the object lies in another way, no name was given, or it has no sure pose.
    off: Option<Off>,
    /// This distance in units of the pose's intervals, of the closest mode where there are several; none unless the name is right
    /// and the pose sure.
    in_intervals: Option<f64>,
    looked: [u64; 2],
}

/// Plays sequences until a name is sure, after a least number of touches, and with [`Terms::until`] until the pose of the named object
/// is. An object that is left out is impossible by its prior.
fn play(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    (odds, least, leaves_out): (u64, usize, bool),
    progress: &dyn Progress,
) -> Result<Vec<Played>> {
    terms.check()?;
    let setup = Setup::new(maps, standing, probe, terms)?;
    let equivalents = Equivalents::new(maps, standing, probe);
    progress.begin("sequences", Some(terms.sequences as u64));
    let of = |index: usize| -> Result<Played> {
        progress::advance(progress, 1)?;
        let (mut pressed, mut pressing) = setup.sequence(index as u64);
        if leaves_out {
            pressing.weights = Some((0..maps.objects()).map(|object| u32::from(object != pressed.class)).collect());
        }
        let (mut outcome, mut fits, mut modes, mut is_placed) = (Outcome::default(), Vec::new(), Vec::new(), false);
        let Ok(_) = evidence::follow(&mut pressed, &mut pressing, |follower, counted| {
            (outcome.touches, outcome.approaches) = (counted.touches as usize, counted.approaches as usize);
            if outcome.recognized.is_none() {
                let familiarity = follower.familiarity();
                outcome.unknown = familiarity == Familiarity::Stranger;
                if counted.touches as usize >= TESTED && follower.locating.may_name() {
                    fits.push((follower.leader(), follower.locating.fit()));
                }
                let may_name = familiarity == Familiarity::Known && counted.touches as usize >= least;
                outcome.recognized = (may_name && follower.rivals() <= odds).then(|| follower.leader());
            }
            if let Some(name) = outcome.recognized {
                modes = follower.locating.poses(name);
                is_placed = terms.until.is_none_or(|until| until.is_met(&modes));
            }
            outcome.unknown || is_placed || counted.touches >= terms.max_touches
        });
        if !is_placed {
            modes.clear();
        }
        let off = modes.first().and_then(|pose| equivalents.off(&pressed.before, pose));
        let is_right = outcome.recognized == Some(pressed.class);
        // Asked for its pose, it states one; else up to four.
        modes.truncate(terms.until.map_or(usize::MAX, |_| 1));
        let parts = modes.iter().filter_map(|pose| Some(equivalents.off(&pressed.before, pose)?.in_intervals(pose)));
        let in_intervals = (is_right && is_placed).then(|| parts.fold(ELSEWHERE, f64::min));
        Ok(Played { outcome, class: pressed.class, is_right, fits, off, in_intervals, looked: pressing.looked })
    };
    (0..terms.sequences).into_par_iter().map(of).collect()
}

/// Plays sequences to the model's own threshold, and with [`Terms::until`] on until the place is sure.
///
/// # Errors
/// Errors of [`calibrate`](fn@calibrate).
pub fn evaluate(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    progress: &dyn Progress,
) -> Result<Evaluation> {
    let each = play(maps, standing, probe, terms, (maps.stopping().odds(), 1, false), progress)?;
    let class_of = classes(maps, standing);
    let number = |index: usize| index % standing.len().max(1);
    let outcome = |(index, played): (usize, &Played)| (class_of[number(index)], played.outcome);
    let totals = Totals::of(each.iter().enumerate().map(outcome));
    let mut offs: Vec<f64> =
        each.iter().filter_map(|played| played.off).map(|Off { millimeters: [x, y], .. }| x.hypot(y)).collect();
    offs.sort_by(f64::total_cmp);
    let quantile = |share: f64| offs.get((offs.len() as f64 * share) as usize).copied().unwrap_or(f64::NAN);
    let right = each.iter().filter(|played| played.in_intervals.is_some()).count();
    let inside = each.iter().filter(|played| played.in_intervals.is_some_and(|part| part <= 1.0)).count();
    let near = |off: &Off| {
        terms.until.is_none_or(|until| {
            off.degrees <= until.degrees && off.millimeters.iter().all(|off| off.abs() <= until.millimeters)
        })
    };
    let within =
        each.iter().filter(|played| played.in_intervals.is_some() && played.off.as_ref().is_some_and(near)).count();
    let approaches: usize = each.iter().map(|played| played.outcome.approaches).sum();
    let looked: u64 = each.iter().map(|played| played.looked[0]).sum();
    let of_object = |(object, stands): (usize, &Standing)| {
        let own = each.iter().enumerate().filter(|(index, _)| number(*index) == object).map(outcome);
        let totals = Totals::of(own);
        OfObject {
            name: stands.name.clone(),
            mean_approaches: totals.mean_approaches(),
            given: totals.given,
            wrong: totals.wrong,
            unknown: totals.unknown,
        }
    };
    let promise = Promised::of(&maps).map(|promised| Tested {
        error: totals.error(),
        finding: Finding::of(totals.wrong, totals.given, promised.error_rate),
        promised,
    });
    Ok(Evaluation {
        promise,
        sequences: totals.sequences,
        given: totals.given,
        wrong: totals.wrong,
        undecided: totals.undecided(),
        unknown: totals.unknown,
        mean_approaches: totals.mean_approaches(),
        off: [quantile(0.5), quantile(0.95)],
        poses: right,
        poses_in_interval: inside,
        poses_within: within,
        objects: standing.iter().enumerate().map(of_object).collect(),
        looked: [looked / (approaches as u64).max(1), each.iter().map(|played| played.looked[1]).max().unwrap_or(0)],
    })
}

/// Each object's number in the model; beyond all for one that it does not know.
fn classes(maps: Maps<'_>, standing: &[Standing]) -> Vec<usize> {
    let class = |object: &Standing| {
        (0..maps.objects()).find(|&known| maps.object_name(known) == object.name).unwrap_or(usize::MAX)
    };
    standing.iter().map(class).collect()
}

/// Everything that sequences share.
struct Setup<'s> {
    maps: Maps<'s>,
    hand: Hand,
    world: World<'s>,
    class_of: Vec<usize>,
    terms: &'s Terms,
}

impl<'s> Setup<'s> {
    fn new(maps: Maps<'s>, standing: &'s [Standing], probe: &'s Probe, terms: &'s Terms) -> Result<Self> {
        let hand = Hand::of(&maps).ok_or_else(no_hand)?;
        let range = f64::from(maps.range()) / 1_000.0;
        // A placement's origin stays within the range, with a cell to spare.
        let world = World { standing, probe, real: terms.real, range: range - 1.0, seed: terms.seed };
        Ok(Self { maps, hand, world, class_of: classes(maps, standing), terms })
    }

    fn sequence(&self, index: u64) -> (Pressed<'_>, Pressing<'_>) {
        let mut drawn: Drawn<'_> = self.world.draw(index);
        let pressing = pressing(self.maps, self.hand, self.terms, drawn.seed());
        let class = self.class_of[drawn.truth.object];
        let before = drawn.truth;
        (Pressed { drawn, class, begun: false, seen: Seen::default(), reach: REACH, before }, pressing)
    }
}

/// A follower of approaches, which does not stop by itself.
fn pressing<'m>(
    maps: Maps<'m>,
    hand: Hand,
    &Terms { aimed, pose, within, effort, .. }: &Terms,
    seed: u32,
) -> Pressing<'m> {
    let locating = locating(maps, Stopping::from_odds(0, u32::MAX), effort);
    Pressing { locating, hand, within, aimed, pose, seed, weights: None, next: None, looked: [0, 0] }
}

/// Half of the square about the believed place in which approaches are aimed at random, in millimeters.
const REACH: f64 = 45.0;
