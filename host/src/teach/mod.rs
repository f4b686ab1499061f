//! Objects that are learned from recorded touches, because they have no mesh.
//!
//! [`teach`] adds such objects to an ensemble that knows others: its trees stay the same, and each leaf gets another value.
//! A few hundred touches suffice where new trees would need thousands, and the values of the other objects do not change.
//! [`alone`](fn@alone) trains an ensemble on recorded touches only.
//!
//! Few touches do not show every way to touch an object. So they are repeated under jitter, and a prior draws the values
//! of leaves towards 0; the strength of both is chosen for each object by cross-validation. Then a constant is added to the
//! object's margin with every touch, so that errors balance: it is missed as often as others are mistaken for it. No touch
//! is fitted on while it or a copy of it is held out.

mod alone;
mod balance;
mod check;
mod column;
mod held_out;
mod rows;
#[cfg(test)]
mod tests;

pub use alone::alone;
pub use held_out::jitter;

use crate::ensemble::train::{BASE_MARGIN, round_leaves};
use crate::ensemble::{Ensemble, Node, OverTouches, TouchOrigin, train};
use crate::error::Result;
use crate::evaluate::ROBOTS;
use crate::in_order::in_order;
use crate::probe::noise::Noise;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches, Source};
use balance::{Groups, Judged};
use held_out::{Division, Material};
use palpate_shared::Touch;
use palpate_shared::format::TrainedTouches;
use rayon::prelude::*;
use serde::Serialize;
use std::borrow::Cow;

/// Jitters that are tried, in multiples of 30 % and 10 ms on times, 8° on the pose.
const JITTERS: [f64; 3] = [0.5, 1.0, 2.0];
/// Priors that are tried, in touches.
const PRIORS: [f64; 3] = [4.0, 16.0, 64.0];
/// Division by which smoothings are compared: with few parts, on a share of the known objects' touches.
const COMPARED: (Division, usize) = (Division { parts: 5, used: 4 }, 4);
/// Division by which the constants are found.
const BALANCED: Division = Division { parts: 10, used: 9 };
/// Touches of a known object that columns are fitted on at most, and of all of them together.
const KNOWN: [usize; 2] = [12_000, 240_000];
/// Touches of a known object that columns are fitted on where there are many objects.
const LEAST_KNOWN: usize = 500;
/// Touches that each of the robots makes of a known object at least, where there are enough.
const TOUCHES_OF_A_ROBOT: usize = 250;
/// Touches of a recorded object that are needed at least, for a part of them to say something.
pub const LEAST: usize = 20;

/// Settings of teaching.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Approaches after which errors are balanced and counted; fewer where fewer were recorded.
    pub approaches: usize,
    /// Groups of approaches that are drawn for each object.
    pub groups: usize,
    /// Seed of the jitter, of the parts and of the groups.
    pub seed: u64,
    /// Threads, or all of the machine's; the ensemble is the same for any number.
    pub threads: Option<usize>,
    /// See [`crate::ensemble::train::Settings::leaf_bits`].
    pub leaf_bits: Option<u32>,
    /// Noise added to the touches of the known objects; `None` takes what the ensemble states, less what they have
    /// already.
    pub noise: Option<Noise>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { approaches: 60, groups: 500, seed: 1, threads: None, leaf_bits: Some(16), noise: None }
    }
}

/// Smoothing of the touches of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Smoothing {
    /// In multiples of 30 % and 10 ms on times, 8° on the pose.
    pub jitter: f64,
    /// The prior of a leaf's value, in touches of the object.
    pub prior: f64,
}

impl Smoothing {
    /// The position of the jitter among those that are tried.
    fn jitter_index(self) -> usize {
        JITTERS.iter().position(|&jitter| jitter >= self.jitter).unwrap_or(JITTERS.len() - 1)
    }
}

/// Results for objects that were taught, on recorded touches that were held out: from columns as from constants. Only
/// the smoothing, one of nine, was chosen on all of them. Shares are between 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Taught {
    /// Approaches of a group.
    pub approaches: usize,
    /// The objects, in the order of the recorded data set.
    pub objects: Vec<TaughtObject>,
    /// The share of groups of the other objects that are recognized; none if there are none.
    pub others: Option<f64>,
}

/// Results for one of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaughtObject {
    /// Its name.
    pub name: String,
    /// Approaches that were recorded.
    pub approaches: usize,
    /// Number of these that are evidence.
    pub touches: usize,
    /// Their smoothing.
    pub smoothing: Smoothing,
    /// Constant added to its margin with every touch, in nats.
    pub constant: f64,
    /// The share of its groups that are recognized.
    pub recognized: f64,
    /// The share of the others' groups that are mistaken for it, summed over the other objects.
    pub taken_for_it: f64,
}

/// Adds the objects of `recorded` to `ensemble`, without changing its trees' splits or the values of the objects that it
/// knows. `known` holds touches of these objects, such as those that the ensemble was trained on. The same touches and settings give the same ensemble on any number of threads.
///
/// Beside outputs that are placements, an object has one output, or one for each placement that its recordings name.
///
/// # Errors
/// An ensemble with leaves of one value, or one that is not over touches; a name that is known already; touches that are
/// missing or too few, have no pose, or are not every approach; probes that differ;
/// [`Kind::Setting`](crate::error::Kind::Setting); [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn teach(
    ensemble: &Ensemble,
    known: &Dataset,
    recorded: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Ensemble, Taught)> {
    let (known, placed) = (&by_output(ensemble, known), &by_output(ensemble, recorded));
    let shares = recorded.placement_shares();
    let recorded = &**placed;
    let descriptor = check::check(ensemble, known, recorded, settings)?;
    let (stated, window) = (TouchOrigin::of(&ensemble.origin)?.probe, ensemble.trained_touches().largest_spread);
    let delivered = recorded.within(stated.and_then(|stated| stated.probe.stroke).map(|_| window));
    let recorded = delivered.as_ref();
    let noise = settings.noise.map_or_else(|| check::missing_noise(ensemble, known), Ok)?;
    on_threads(settings.threads, || {
        let known = known_touches(ensemble, known, &noise, settings.seed);
        let sources: Vec<Vec<Vec<usize>>> = known.iter().chain(&recorded.objects).map(by_source).collect();
        let known: Vec<Vec<Touch>> = known.iter().map(|object| object.touches().to_vec()).collect();
        let touches: Vec<(&str, &[Touch])> =
            recorded.objects.iter().map(|object| (object.name.as_str(), object.touches())).collect();
        let material = Material::new(ensemble, descriptor, &known, &touches, settings.seed);
        let evidence: Vec<usize> = (0..touches.len()).map(|index| material.evidence(index)).collect();
        check::enough(recorded, &evidence)?;
        let smoothings = smoothings(&material, touches.len(), progress)?;
        let all: Vec<usize> = (0..touches.len()).collect();
        progress.begin("cross-validating", Some(BALANCED.parts as u64));
        let held = material.held_out(&all, &smoothings, 1, BALANCED, progress)?;
        let approaches = settings.approaches.min(balance::most_approaches(recorded.fewest_in_sequence()));
        let background = ensemble.origin.background.then(|| ensemble.known_count());
        let sizes = [settings.groups, approaches];
        let taught: Vec<usize> = (material.known_count()..held.len()).collect();
        let drawn = Judged::new((&held, &sources), &taught, background, sizes, settings.seed);
        let constants = Groups::draw((&held, &sources), taught, background, sizes, settings.seed).balanced();
        let objects = recorded.objects.iter().zip(&evidence).enumerate().map(|(index, (object, &touches))| {
            let named = drawn.named(index);
            TaughtObject {
                name: object.name.clone(),
                approaches: object.len(),
                touches,
                smoothing: smoothings[index],
                constant: constants[index],
                recognized: named.right,
                taken_for_it: named.wrong,
            }
        });
        let found = Taught { approaches, objects: objects.collect(), others: Some(drawn.others()) };
        let columns = material.fitted(&smoothings);
        let mut extended = extended(ensemble, recorded, &columns, &constants);
        let stated = TouchOrigin::of(&extended.origin)?.placements;
        if !stated.is_empty() {
            train::state_placements(&mut extended, &stated.into_iter().chain(shares).collect())?;
        }
        if let Some(bits) = settings.leaf_bits {
            round_leaves(&mut extended, bits);
        }
        Ok((extended, found))
    })
}

/// Touches as an ensemble's outputs are: of placements, where those are and the touches name theirs.
fn by_output<'d>(ensemble: &Ensemble, dataset: &'d Dataset) -> Cow<'d, Dataset> {
    let is_of_placements = TouchOrigin::of(&ensemble.origin).is_ok_and(|stated| !stated.placements.is_empty());
    if is_of_placements { Cow::Owned(dataset.by_placement()) } else { Cow::Borrowed(dataset) }
}

/// Runs on this many threads.
fn on_threads<T: Send>(threads: Option<usize>, run: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    let Some(threads) = threads else { return run() };
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(run),
        // No threads to be had: the result is the same on any number.
        Err(_) => run(),
    }
}

/// The touches of each object that the ensemble knows, in its order, with this noise.
fn known_touches(ensemble: &Ensemble, known: &Dataset, noise: &Noise, seed: u64) -> Vec<ObjectTouches> {
    let most = (KNOWN[1] / ensemble.objects.len().max(1)).clamp(LEAST_KNOWN, KNOWN[0]);
    let of = |name: &String| {
        let none = || ObjectTouches::new(name, Vec::new(), Source::Object);
        let object = known.objects.iter().find(|object| object.name == *name).cloned().unwrap_or_else(none);
        // Evenly from all of them, and from each instance and each of a background's shapes.
        let some = object.thinned(most);
        // A group is of one robot's touches, where robots differ.
        let robots = (some.len() / TOUCHES_OF_A_ROBOT).clamp(1, ROBOTS);
        if noise.is_none() { some } else { some.noisy(noise, seed, robots) }
    };
    ensemble.objects.iter().map(of).collect()
}

/// For each source of an object its touches' positions; a group is of touches of one.
fn by_source(object: &ObjectTouches) -> Vec<Vec<usize>> {
    object.pools().iter().map(|pool| pool.range.clone().collect()).collect()
}

/// For each recorded object the smoothing with the least loss on held-out touches, beside the objects that the trees know.
fn smoothings(material: &Material, objects: usize, progress: &dyn Progress) -> Result<Vec<Smoothing>> {
    let candidates: Vec<Smoothing> =
        JITTERS.iter().flat_map(|&jitter| PRIORS.map(|prior| Smoothing { jitter, prior })).collect();
    let (division, thin) = COMPARED;
    progress.begin("choosing how much to smooth", Some((objects * candidates.len() * division.parts) as u64));
    let best = |object: usize| {
        let loss = |&smoothing: &Smoothing| -> Result<(f64, Smoothing)> {
            let held = material.held_out(&[object], &[smoothing], thin, division, progress)?;
            Ok((held_out::loss(&held), smoothing))
        };
        let losses = in_order(candidates.par_iter().map(loss))?;
        // There are candidates; the first of equal ones.
        let least = losses.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        Ok(least.map_or(Smoothing { jitter: 1.0, prior: 1.0 }, |(_, smoothing)| smoothing))
    };
    (0..objects).map(best).collect()
}

/// The ensemble with a column more for each recorded object, before the background if there is one.
fn extended(ensemble: &Ensemble, recorded: &Dataset, columns: &[Vec<f64>], constants: &[f64]) -> Ensemble {
    let mut extended = ensemble.clone();
    let at = ensemble.known_count();
    for (index, (object, constant)) in recorded.objects.iter().zip(constants).enumerate() {
        extended.objects.insert(at + index, object.name.clone());
        extended.base_margins.insert(at + index, BASE_MARGIN + *constant as f32);
    }
    let mut leaf = 0;
    for node in extended.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
        if let Node::Leaf(values) = node {
            values.splice(at..at, columns.iter().map(|column| column[leaf] as f32));
            leaf += 1;
        }
    }
    // What cannot be read was refused before.
    if let Ok(mut stated) = TouchOrigin::of(&extended.origin) {
        stated.touches.extend(TouchOrigin::new(recorded, None).touches);
        if let Some(trained) = &mut stated.trained {
            let objects = (at, recorded.objects.len());
            trained.touches = with(ensemble, trained.touches, &recorded.objects);
            trained.shares = trained.shares.map(|shares| mean(shares, recorded.shares(), objects));
        }
        stated.state(&mut extended.origin);
    }
    extended
}

/// Touches that are evidence to a model that was also taught these recordings.
fn with(ensemble: &Ensemble, mut trained: TrainedTouches, recorded: &[ObjectTouches]) -> TrainedTouches {
    let (patterns, largest_spread) = (trained.counted.patterns(), trained.largest_spread);
    for touch in recorded.iter().flat_map(ObjectTouches::touches) {
        if patterns.contains(touch.pattern()) && (touch.pose().is_some() || !trained.needs_pose) {
            trained.patterns = trained.patterns.with(touch.pattern());
            trained.largest_spread = trained.largest_spread.max(touch.spread());
        }
    }
    let has_stroke = TouchOrigin::of(&ensemble.origin)
        .is_ok_and(|stated| stated.probe.is_some_and(|stated| stated.probe.stroke.is_some()));
    // With a stroke it is that of the hand, regardless of a recording's clock.
    if has_stroke {
        trained.largest_spread = largest_spread;
    }
    trained
}

/// The mean of two means, each of this many objects.
fn mean(known: [f64; 6], recorded: [f64; 6], (first, second): (usize, usize)) -> [f64; 6] {
    let all = (first + second).max(1) as f64;
    std::array::from_fn(|index| (known[index] * first as f64 + recorded[index] * second as f64) / all)
}
