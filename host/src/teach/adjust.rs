//! A model of simulated touches, adjusted to recorded touches of objects that it knows.

use super::balance::{Groups, Held, Judged};
use super::column::{Part, fit};
use super::held_out::{Division, known_place, places};
use super::rows::{Leaves, Rows, log_sum};
use super::{Settings, balance, by_source, check, known_touches, on_threads, with};
use crate::ensemble::train::round_leaves;
use crate::ensemble::{Ensemble, Node, TouchOrigin};
use crate::error::Result;
use crate::evaluate::{Candidate, OfTouches};
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Descriptor;
use rayon::prelude::*;
use serde::Serialize;

/// Priors that are tried, in touches.
const PRIORS: [f64; 5] = [64.0, 256.0, 1_024.0, 4_096.0, 16_384.0];
/// Standard errors by which a gain has to be above 0 to count: with fewer, what is fitted to a few hundred touches is worse for
/// others as often as better.
const CERTAIN: f64 = 2.0;
/// Shares of the constants that are tried.
const SHARES: [f64; 2] = [0.5, 1.0];
/// Division of the recorded touches.
const DIVISION: Division = Division { parts: 5, used: 4 };
/// Simulated touches of an object that has no recordings.
const SIMULATED: usize = 2_000;
/// Approaches of a group by which errors are balanced. Longer groups are too few, in so many approaches.
const BALANCED: usize = 20;

/// Results of adjusting, on recorded touches that were held out. Shares are between 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Adjusted {
    /// The objects that were recorded.
    pub objects: Vec<AdjustedObject>,
    /// The prior of the additions to a leaf's value, in touches of the object; none where leaves stay as they are.
    pub prior: Option<f64>,
    /// The share of the balancing constants that is added; 0 for none.
    pub share: f64,
    /// Approaches of the groups below.
    pub approaches: usize,
    /// Figures of the given model.
    pub given: Fitness,
    /// Figures of the adjusted one.
    pub adjusted: Fitness,
    /// True if the adjusted model is the result; otherwise the given one is, as it was.
    pub is_better: bool,
}

/// An object that was recorded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdjustedObject {
    /// Its name.
    pub name: String,
    /// Approaches that were recorded.
    pub approaches: usize,
    /// Number of these that are evidence.
    pub touches: usize,
    /// Constant that is added to its margin with every touch, in nats.
    pub constant: f64,
}

/// Figures of a model on held-out touches: recorded ones, and simulated ones of objects that have no recordings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Fitness {
    /// Softmax loss of a touch, in nats.
    pub loss: f64,
    /// The share of groups of approaches that are recognized.
    pub recognized: f64,
}

/// Everything that a model is adjusted to: for each of its objects the recorded touches, or simulated ones.
struct Material {
    leaves: Leaves,
    rows: Vec<Rows>,
    /// For each object the places of its touches in a random order, from 0 to 1; none if they are simulated.
    places: Vec<Option<Vec<f64>>>,
    /// The indices of the objects that were recorded.
    own: Vec<usize>,
}

/// Adjusts `ensemble` to `recorded` touches of objects that it knows: what is added to their leaf values, and constants that
/// balance errors, both only as far as recorded touches that were held out are the better for it. Values of objects without
/// recordings stay as they are; `known` holds their simulated touches, which the recorded ones are compared with. If the
/// adjusted model is no better on touches that were held out, the ensemble is returned as it was given.
///
/// The amounts added minimize the softmax loss of the recorded touches under a prior that draws them towards 0, whose strength
/// is chosen by cross-validation: the largest gain over the given leaves, less two standard errors.
///
/// # Errors
/// Errors of [`teach`](fn@super::teach); [`TeachProblem::NotKnown`](crate::error::TeachProblem::NotKnown) for an
/// object that the ensemble
/// does not know.
pub fn adjust(
    ensemble: &Ensemble,
    known: &Dataset,
    recorded: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Ensemble, Adjusted)> {
    let (known, recorded) = (&*super::by_output(ensemble, known), &*super::by_output(ensemble, recorded));
    let descriptor = check::adjustable(ensemble, known, recorded, settings)?;
    let delivered = Candidate::Full(ensemble).delivered(recorded);
    let recorded = delivered.as_ref();
    let noise = settings.noise.map_or_else(|| check::missing_noise(ensemble, known), Ok)?;
    on_threads(settings.threads, || {
        let simulated = known_touches(ensemble, known, &noise, settings.seed);
        let of = |simulated: &ObjectTouches| {
            let own = recorded.objects.iter().find(|object| object.name == simulated.name);
            own.cloned().unwrap_or_else(|| simulated.thinned(SIMULATED))
        };
        let touches: Vec<ObjectTouches> = simulated.iter().map(of).collect();
        let material = Material::new(ensemble, descriptor, &touches, recorded, settings.seed);
        let evidence: Vec<usize> = material.own.iter().map(|&object| material.rows[object].count()).collect();
        let named = |&object: &usize| touches[object].clone();
        check::enough(&Dataset::new(material.own.iter().map(named).collect()), &evidence)?;
        progress.begin("adjusting to recorded touches", Some(((PRIORS.len() + 1) * DIVISION.parts) as u64));
        let given = material.held_out(None, progress)?;
        let (prior, held) = material.chosen(&given, progress)?;
        let sources: Vec<Vec<Vec<usize>>> = touches.iter().map(by_source).collect();
        let background = ensemble.origin.background.then(|| ensemble.known_count());
        let most = balance::most_approaches(Dataset::new(touches.clone()).fewest_in_sequence());
        let sizes = [settings.groups, BALANCED.min(most)];
        let judged = |held: &[Held]| Judged::new((held, &sources), &material.own, background, sizes, settings.seed);
        let share = share(&judged(&held), &held);
        let constants: Vec<f64> = match share > 0.0 {
            true => Groups::draw((&held, &sources), material.own.clone(), background, sizes, settings.seed).balanced(),
            false => vec![0.0; material.own.len()],
        };
        let constants: Vec<f64> = constants.into_iter().map(|constant| share * constant).collect();
        let fitness = |held: &[Held], share: f64| {
            let judged = judged(held);
            let loss = super::held_out::loss(&judged.with_constants(held, share));
            Fitness { loss, recognized: judged.right(share) }
        };
        let (before, after) = (fitness(&given, 0.0), fitness(&held, share));
        let is_changed = prior.is_some() || share > 0.0;
        let is_better = is_changed && after.recognized >= before.recognized;
        let object = |(&object, (&touches_of, &constant)): (&usize, (&usize, &f64))| AdjustedObject {
            name: touches[object].name.clone(),
            approaches: touches[object].len(),
            touches: touches_of,
            constant,
        };
        let adjusted = Adjusted {
            objects: material.own.iter().zip(evidence.iter().zip(&constants)).map(object).collect(),
            prior,
            share,
            approaches: sizes[1],
            given: before,
            adjusted: after,
            is_better,
        };
        if !is_better {
            return Ok((ensemble.clone(), adjusted));
        }
        let columns = prior.map(|prior| material.columns(prior, |_| true));
        let mut changed = changed(ensemble, recorded, &material.own, columns.as_deref(), &constants);
        if let Some(bits) = settings.leaf_bits {
            round_leaves(&mut changed, bits);
        }
        Ok((changed, adjusted))
    })
}

/// The share of the constants with the largest gain, less two standard errors, on touches that had no part in them; 0 if that
/// is not above 0. Groups do not choose it: a few hundred approaches hold few independent ones.
fn share(judged: &Judged, held: &[Held]) -> f64 {
    let mut best = (0.0, 0.0);
    for share in SHARES {
        let [gain, spread] = gain(held, &judged.with_constants(held, share));
        let certain = gain - CERTAIN * spread;
        if certain > best.0 {
            best = (certain, share);
        }
    }
    best.1
}

impl Material {
    fn new(
        ensemble: &Ensemble,
        descriptor: Descriptor,
        touches: &[ObjectTouches],
        recorded: &Dataset,
        seed: u64,
    ) -> Self {
        let leaves = Leaves::of(ensemble);
        let is_recorded = |object: &ObjectTouches| recorded.objects.iter().any(|own| own.name == object.name);
        let rows = |object: &ObjectTouches| Rows::new(ensemble, &leaves, descriptor, object.touches(), object.len());
        let rows = touches.iter().map(rows).collect();
        let place = |object: &ObjectTouches| is_recorded(object).then(|| places(&object.name, object.len(), seed));
        let places: Vec<_> = touches.iter().map(place).collect();
        let own = (0..touches.len()).filter(|&object| places[object].is_some()).collect();
        Self { leaves, rows, places, own }
    }

    /// The place of a row of an object, from 0 to 1.
    fn place(&self, object: usize, row: usize) -> f64 {
        let source = self.rows[object].sources[row];
        self.places[object].as_ref().map_or_else(|| known_place(source), |places| places[source as usize])
    }

    /// Amounts added to the leaf values of the recorded objects, from touches at these places.
    fn columns(&self, prior: f64, is_used: impl Fn(f64) -> bool) -> Vec<Vec<f64>> {
        let part = |object: usize| {
            let rows = &self.rows[object];
            let chosen = (0..rows.count()).filter(|&row| is_used(self.place(object, row)));
            Part {
                rows,
                chosen: chosen.filter_map(|row| u32::try_from(row).ok()).collect(),
                column: self.own.iter().position(|&own| own == object),
            }
        };
        let parts: Vec<Part<'_>> = (0..self.rows.len()).map(part).collect();
        let own: Vec<Option<usize>> = self.own.iter().copied().map(Some).collect();
        fit(&self.leaves, &parts, &vec![prior; own.len()], &own)
    }

    /// The margins of every touch, from leaves that were not adjusted to it; from those of the given model without a prior.
    fn held_out(&self, prior: Option<f64>, progress: &dyn Progress) -> Result<Vec<Held>> {
        let one = |part: usize| {
            let columns = prior.map(|prior| self.columns(prior, |place| DIVISION.uses(DIVISION.part(place), part)));
            let margins = |rows: &Rows, row: usize| {
                let mut margins: Vec<f64> = rows.margins(row).iter().copied().map(f64::from).collect();
                for (&own, column) in self.own.iter().zip(columns.iter().flatten()) {
                    margins[own] += rows.sum(row, column);
                }
                margins
            };
            let of = |(object, rows): (usize, &Rows)| {
                let is_held = |&row: &usize| DIVISION.part(self.place(object, row)) == part;
                let held = (0..rows.count()).filter(is_held).map(|row| (rows.sources[row], margins(rows, row)));
                held.collect::<Vec<_>>()
            };
            let held: Vec<_> = self.rows.iter().enumerate().map(of).collect();
            progress::advance(progress, 1)?;
            Ok(held)
        };
        let parts: Vec<Vec<Vec<_>>> = in_order((0..DIVISION.parts).into_par_iter().map(one))?;
        let mut all: Vec<Held> = self.rows.iter().map(|rows| vec![None; rows.given]).collect();
        for (object, rows) in parts.into_iter().flat_map(|part| part.into_iter().enumerate()) {
            rows.into_iter().for_each(|(source, margins)| all[object][source as usize] = Some(margins));
        }
        Ok(all)
    }

    /// The prior with the largest gain on held-out touches over the `given` leaves, less two standard errors, if that is above 0;
    /// and the margins with it.
    fn chosen(&self, given: &[Held], progress: &dyn Progress) -> Result<(Option<f64>, Vec<Held>)> {
        let mut best: (f64, Option<f64>, Vec<Held>) = (0.0, None, given.to_vec());
        for prior in PRIORS {
            let held = self.held_out(Some(prior), progress)?;
            let [gain, spread] = gain(given, &held);
            let certain = gain - CERTAIN * spread;
            if certain > best.0 {
                best = (certain, Some(prior), held);
            }
        }
        let (_, prior, held) = best;
        Ok((prior, held))
    }
}

/// Decrease of the loss of a touch in nats, each object weighted equally, and its standard error.
fn gain(given: &[Held], held: &[Held]) -> [f64; 2] {
    let (mut mean, mut variance) = (0.0, 0.0);
    let objects = given.len().max(1) as f64;
    for (object, (given, held)) in given.iter().zip(held).enumerate() {
        let loss = |margins: &Vec<f64>| log_sum(margins.iter().copied()) - margins[object];
        let gains = given.iter().flatten().zip(held.iter().flatten()).map(|(given, held)| loss(given) - loss(held));
        let gains: Vec<f64> = gains.collect();
        let count = gains.len().max(1) as f64;
        let own = gains.iter().sum::<f64>() / count;
        mean += own / objects;
        variance += gains.iter().map(|gain| (gain - own).powi(2)).sum::<f64>() / count / count / objects / objects;
    }
    [mean, variance.sqrt()]
}

/// The ensemble with the additions to the values of the recorded objects.
fn changed(
    ensemble: &Ensemble,
    recorded: &Dataset,
    own: &[usize],
    columns: Option<&[Vec<f64>]>,
    constants: &[f64],
) -> Ensemble {
    let mut changed = ensemble.clone();
    for (&own, constant) in own.iter().zip(constants) {
        changed.base_margins[own] += *constant as f32;
    }
    let mut leaf = 0;
    for node in changed.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
        if let Node::Leaf(values) = node {
            for (&own, column) in own.iter().zip(columns.into_iter().flatten()) {
                values[own] += column[leaf] as f32;
            }
            leaf += 1;
        }
    }
    // What cannot be read was refused before.
    if let Ok(mut stated) = TouchOrigin::of(&changed.origin) {
        stated.adjusted.extend(TouchOrigin::new(recorded, None).touches);
        if let Some(trained) = &mut stated.trained {
            trained.touches = with(ensemble, trained.touches, &recorded.objects);
        }
        stated.state(&mut changed.origin);
    }
    changed
}
