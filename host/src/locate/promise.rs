//! Thresholds that keep a promise about located objects, and their test.

use super::follow::{Pressed, Pressing};
use super::world::{Aimed, Drawn, Real, Standing, World};
use super::{Effort, Hand, LocateProblem, Maps, Promised, Seen, locating};
use crate::calibrate;
use crate::error::Result;
use crate::evaluate::Finding;
use crate::evidence::{self, Follower, Limit, Odds, Sequence};
use crate::probe::approach::Probe;
use crate::progress::{self, Progress};
use palpate_onboard::{Familiarity, Stopping};
use palpate_shared::format::Promise;
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
    /// How approaches are aimed; a promise is of one way alone.
    pub aimed: Aimed,
    /// Noise of hand and table.
    pub real: Real,
    /// How much the pose counts where approaches are chosen, in 64ths.
    pub pose: u16,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Bounds on the work of an approach; none: a chip's.
    pub effort: Option<Effort>,
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
    /// How approaches are aimed.
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
}

/// Results of an evaluation on a simulated table.
#[derive(Clone, Debug, Default, Serialize)]
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
    /// Median and 95 % quantile of the distance of right names' first pose from the truth, in millimeters.
    pub off: [f64; 2],
    /// For each object its name, approaches on average, and wrong names.
    pub objects: Vec<(String, f64, usize)>,
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
    /// Whether it was kept.
    pub finding: Finding,
}

/// Finds the loosest threshold that keeps a promise, on sequences of approaches to these objects, each followed by the chip's own
/// code: Learn-then-Test by fixed-sequence testing, as for all models. Chosen approaches depend on the follower, so they are played
/// with it.
///
/// # Errors
/// [`LocateProblem`] for maps without a hand or objects that they do not know; [`CalibrateProblem`](crate::error::CalibrateProblem)
/// if no threshold keeps the promise.
pub fn calibrate(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let calibrate::Terms { rate, confidence, .. } = terms.promise;
    let strictest = ((1.0 - rate) / rate).ln() + STRICTER;
    let sequences = follow(maps, standing, probe, terms, strictest, progress)?;
    let names = super::names(&maps);
    let missing = names.iter().find(|name| !standing.iter().any(|object| object.name == **name));
    let unknown = standing.iter().find(|object| !names.contains(&object.name));
    match (missing, unknown) {
        (Some(object), _) => return Err(LocateProblem::Missing { object: object.clone() }.into()),
        (_, Some(object)) => return Err(LocateProblem::Unknown { object: object.name.clone() }.into()),
        _ => {}
    }
    let chosen = calibrate::choose(&sequences, &names, strictest, &terms.promise)?;
    let odds = chosen.odds.of(0);
    let noise = terms.real.noise(probe.speed);
    let whole = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    let promise = Promise {
        rate,
        confidence,
        per: terms.promise.per,
        approaches: true,
        active: terms.aimed == Aimed::Chosen,
        groups: false,
        sequences: whole(chosen.sequences),
        given: whole(chosen.given),
        wrong: whole(chosen.wrong),
        mean_thousandths: (chosen.mean_approaches * 1e3).round() as u32,
        max_touches: terms.max_touches,
        noise: noise.promised(),
    };
    let model = super::write::restated(maps, odds, &promise)?;
    Ok(Calibrated {
        model,
        promised: rate,
        confidence,
        aimed: terms.aimed,
        sequences: chosen.sequences,
        given: chosen.given,
        wrong: chosen.wrong,
        mean_approaches: chosen.mean_approaches,
        margin: calibrate::margin_of(odds),
        max_touches: terms.max_touches,
        noise: noise.to_string(),
    })
}

/// Nats beyond the posterior's own threshold at which the strictest is.
const STRICTER: f64 = 4.0;

/// Follows sequences to a margin.
pub(super) fn follow(
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

/// Plays sequences to the model's own threshold.
///
/// # Errors
/// As [`calibrate`].
pub fn evaluate(
    maps: Maps<'_>,
    standing: &[Standing],
    probe: &Probe,
    terms: &Terms,
    progress: &dyn Progress,
) -> Result<Evaluation> {
    let setup = Setup::new(maps, standing, probe, terms)?;
    progress.begin("sequences", Some(terms.sequences as u64));
    let odds = Odds::All(maps.stopping().odds());
    let margin = calibrate::margin_of(odds.of(0));
    let limit = Limit { margin, max_touches: terms.max_touches };
    let of = |index: usize| -> Result<_> {
        progress::advance(progress, 1)?;
        let (mut pressed, mut pressing) = setup.sequence(index as u64);
        let Ok(found) = evidence::sequences(&mut pressed, &mut pressing, 1, limit);
        let unknown = pressing.locating.familiarity() == Familiarity::Stranger;
        let pose = pressing.locating.poses(pressing.leader()).first().copied();
        let truth = pressed.before;
        let off = pose.map(|pose| {
            let [x, y] = pose.position.map(|micrometers| f64::from(micrometers) / 1_000.0);
            (x - truth.place[0]).hypot(y - truth.place[1])
        });
        Ok((found, unknown, off, pressing.looked))
    };
    let each = (0..terms.sequences).into_par_iter().map(of).collect::<Result<Vec<_>>>()?;
    let mut evaluation = Evaluation { sequences: terms.sequences, ..Evaluation::default() };
    let mut objects: Vec<(String, f64, usize, usize)> =
        standing.iter().map(|object| (object.name.clone(), 0.0, 0, 0)).collect();
    let (mut offs, mut approaches, mut looked) = (Vec::new(), 0, [0, 0]);
    for (index, (found, unknown, off, work)) in each.into_iter().enumerate() {
        let Some(sequence) = found.first() else { continue };
        let outcome = sequence.outcome(&odds);
        let (_, sum, wrong, count) = &mut objects[index % standing.len()];
        *sum += outcome.approaches as f64;
        *count += 1;
        approaches += outcome.approaches;
        looked = [looked[0] + work[0], looked[1].max(work[1])];
        match outcome.recognized {
            Some(_) if outcome.is_wrong(sequence.object) => {
                evaluation.wrong += 1;
                *wrong += 1;
                evaluation.given += 1;
            }
            Some(_) => {
                evaluation.given += 1;
                offs.extend(off);
            }
            None if unknown => evaluation.unknown += 1,
            None => evaluation.undecided += 1,
        }
    }
    offs.sort_by(f64::total_cmp);
    let quantile = |share: f64| offs.get((offs.len() as f64 * share) as usize).copied().unwrap_or(f64::NAN);
    evaluation.off = [quantile(0.5), quantile(0.95)];
    evaluation.mean_approaches = approaches as f64 / terms.sequences.max(1) as f64;
    evaluation.looked = [looked[0] / (approaches as u64).max(1), looked[1]];
    let Evaluation { wrong, given, .. } = evaluation;
    evaluation.promise = Promised::of(&maps).map(|promised| Tested {
        error: wrong as f64 / given.max(1) as f64,
        finding: Finding::of(wrong, given, promised.error_rate),
        promised,
    });
    evaluation.objects =
        objects.into_iter().map(|(name, sum, wrong, count)| (name, sum / count.max(1) as f64, wrong)).collect();
    Ok(evaluation)
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
        let hand = Hand::of(&maps).ok_or(LocateProblem::NoHand)?;
        let range = f64::from(maps.range()) / 1_000.0;
        let class = |object: &Standing| {
            (0..maps.objects()).find(|&known| maps.object_name(known) == object.name).unwrap_or(usize::MAX)
        };
        // A placement's origin stays within the range, with a cell to spare.
        let world = World { standing, probe, real: terms.real, range: range - 1.0, seed: terms.seed };
        Ok(Self { maps, hand, world, class_of: standing.iter().map(class).collect(), terms })
    }

    fn sequence(&self, index: u64) -> (Pressed<'_>, Pressing<'_>) {
        let mut drawn: Drawn<'_> = self.world.draw(index);
        // It must not stop by itself.
        let stopping = Stopping::from_odds(0, u32::MAX);
        let mut locating = locating(self.maps, stopping, self.terms.effort);
        locating.begin(drawn.seed());
        let within = self.maps.range().unsigned_abs() * 2;
        let Terms { aimed, pose, .. } = *self.terms;
        let class = self.class_of[drawn.truth.object];
        let pressing = Pressing { locating, hand: self.hand, within, aimed, pose, next: None, looked: [0, 0] };
        let before = drawn.truth;
        (Pressed { drawn, class, begun: false, seen: Seen::default(), reach: REACH, before }, pressing)
    }
}

/// Half of the square about the believed place in which approaches are aimed at random, in millimeters.
const REACH: f64 = 45.0;
