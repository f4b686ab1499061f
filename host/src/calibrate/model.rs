//! A model's thresholds, its promise and its temperature.

use super::begin::{Begin, Seen};
use super::calibrated::{Calibrated, OfObject, Stated};
use super::choose::{Chosen, Terms, Way, chosen, share_tested, spread};
use super::draw::{TouchSupply, follow, follow_plan};
use super::error::Remedy;
use super::temperature::temperature;
use super::{Limit, Per, Tally};
use crate::compile;
use crate::ensemble::StatedProbe;
use crate::error::{CalibrateProblem, Error, EvaluateProblem, Result, Supplied};
use crate::evaluate::{Candidate, OfTouches};
use crate::evidence::{Odds, Sequence, odds_of};
use crate::probe::noise::Noise;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Refused, Stopping};
use palpate_shared::format::{Promise, SECTION_HEADER_LENGTH, Tag, Temperature};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// One touch in this many serves the pilot alone, which says how strict to begin; its sequences are at most one in this many.
const PILOT: usize = 30;
/// The strictest threshold beyond that of the posterior, in nats: usually, and where a tenth of that is not enough.
pub(crate) const STRICTEST: [f64; 2] = [2.5, 10.0];

/// Settings of a promise, and of the touches that it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// Of what the rate is promised.
    pub per: Per,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// The most sequences, of all objects together.
    pub sequences: usize,
    /// Touches after which a sequence ends undecided; `None` takes the model's own limit.
    pub max_touches: Option<u32>,
    /// Noise added to the touches. The promise holds for touches with the same.
    pub noise: Noise,
    /// True if every approach is where the model's plan says. The promise then holds for a robot that goes there.
    pub active: bool,
    /// Seed of the order of the touches, and of the noise.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rate: 0.01,
            per: Per::Average,
            confidence: 0.95,
            sequences: 100_000,
            max_touches: None,
            noise: Noise::default(),
            active: false,
            seed: 1,
        }
    }
}

/// Facts about a promise that was tested on recordings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OfRecorded {
    /// Approaches that were recorded to the object with the fewest.
    pub approaches: usize,
    /// Recordings that the sequences are of, where the data set lists any: sequences of one are not independent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<usize>,
    /// Share of wrong names on simulated sequences at the thresholds that were kept.
    pub simulated_error: f64,
}

/// Sets a model's thresholds so that it keeps a promised error rate and uses it up, on touches that nothing was trained
/// on; also its temperature. A data set of approaches is counted in these. If the model has a misfit test, names are held
/// back and sequences end as unknown where the chip's would, and the promise is one of the model with its test.
///
/// # Errors
/// [`CalibrateProblem`], if no threshold keeps the promise, too few names are given to know, or the data set lacks an
/// object; as [`Margins::new`](crate::evaluate::Margins::new) for touches that the model cannot use;
/// [`Setting`](crate::error::Setting) for settings out of their ranges;
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn calibrate(
    model: &Model<'_>,
    dataset: Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    calibrate_from(model, dataset, settings, None, progress)
}

/// Where a calibration begins that other touches say something of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Start {
    /// The threshold at which the walk begins, as a margin in nats.
    pub(crate) margin: f64,
    /// Thresholds that those to be kept must be as strict as.
    pub(crate) loosest: Option<Odds>,
}

/// Like [`calibrate`], from a given start instead of one that a few sequences suggest.
///
/// # Errors
/// As [`calibrate`].
pub(crate) fn calibrate_from(
    model: &Model<'_>,
    mut dataset: Dataset,
    settings: &Settings,
    start: Option<Start>,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let material = material(model, &dataset, settings)?;
    if let Cow::Owned(delivered) = Candidate::Compiled(model).delivered(&dataset) {
        dataset = delivered;
    }
    add_noise(model, &mut dataset, &settings.noise, material.max_touches, noise_seed(settings));
    let touched = dataset.objects.iter().zip(&material.known);
    let drawn = Drawn {
        dataset: &dataset,
        fewest: dataset.objects.iter().map(|object| object.len() as u64).min().unwrap_or(0),
        supplies: touched.map(|(touched, &object)| TouchSupply::new(object, touched, settings.seed)).collect(),
    };
    let temperature = || Ok(temperature(model, &dataset, &material.known));
    calibrate_drawn(model, &material, drawn, settings, start, temperature, progress)
}

/// The threshold, a margin in nats, at which a walk over `times` as many touches as there are in a part of them best begins: the
/// loosest one at which it passes with nearly the greatest probability, up to where a calibration that knows nothing begins.
///
/// # Errors
/// As [`calibrate`], but for a rate that is not kept.
pub(crate) fn begin(
    model: &Model<'_>,
    mut part: Dataset,
    times: f64,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<f64> {
    let Material { names, known, outputs, max_touches } = material(model, &part, settings)?;
    add_noise(model, &mut part, &settings.noise, max_touches, noise_seed(settings));
    let terms = settings.terms();
    let naive = terms.margin();
    let most = ((settings.sequences as f64 / times) as usize).max(1);
    let wanted = wanted(model, &outputs, settings.per, most);
    let followed = |beyond: f64| {
        let touched = part.objects.iter().zip(&known);
        let mut supplies: Vec<TouchSupply<'_>> =
            touched.map(|(touched, &object)| TouchSupply::new(object, touched, settings.seed)).collect();
        if settings.active {
            follow_plan(&mut supplies, &names, &model.plan().ok_or(EvaluateProblem::NoPlan)?)?;
        }
        let limit = Limit { margin: naive + beyond, max_touches };
        follow(model, &mut supplies, &wanted, limit, progress)
    };
    let [near, far] = STRICTEST;
    let sequences = followed(near)?;
    let (sequences, beyond) =
        if is_kept_well(&sequences, naive + near, settings.rate) { (sequences, near) } else { (followed(far)?, far) };
    let tested = (times * share_tested(settings.per) * sequences.len() as f64) as usize;
    Ok(Begin::new(&sequences, &(0..sequences.len()).collect::<Vec<_>>(), tested, &terms, naive + beyond).loosest)
}

/// The sequences of each object of so many in all: as often as the model's priors say.
fn wanted(model: &Model<'_>, outputs: &[Vec<usize>], per: Per, count: usize) -> Vec<usize> {
    // Each placement has a promise of its own, however rare it is.
    let shares = match model.outputs() {
        Some(_) if per == Per::Object => vec![1.0 / outputs.len() as f64; outputs.len()],
        _ => shares(model, outputs),
    };
    shares.iter().map(|share| (share * count as f64).round().max(1.0) as usize).collect()
}

/// Touches that a model can be calibrated on.
pub(super) struct Material {
    /// The names that it gives.
    names: Vec<String>,
    /// The data set's objects' indices in the model.
    pub(super) known: Vec<usize>,
    /// Their outputs: several of one whose touches state no placement.
    outputs: Vec<Vec<usize>>,
    max_touches: u32,
}

/// Refuses settings, models and data sets of which there is no calibration.
pub(super) fn material(model: &Model<'_>, dataset: &Dataset, settings: &Settings) -> Result<Material> {
    settings.check()?;
    refuse_names_of_placements(model, settings)?;
    let own = Stopping::from_model(model).max_touches();
    let max_touches = settings.max_touches.unwrap_or(own);
    compile::stopping(settings.rate, max_touches)?;
    let (names, known) = named(model, dataset)?;
    let outputs = outputs(model, dataset);
    refuse_unstated(&outputs, dataset, settings)?;
    Ok(Material { names, known, outputs, max_touches })
}

/// Refuses a rate of each name where names are placements: how often one is wrong depends on their shares.
pub(super) fn refuse_names_of_placements(model: &Model<'_>, settings: &Settings) -> Result<()> {
    match model.outputs().is_some() && settings.per == Per::Name {
        true => Err(Error::setting("per", "name", "average or object with a model whose objects have several outputs")),
        false => Ok(()),
    }
}

/// Refuses a rate in each placement on touches of which some state none.
pub(super) fn refuse_unstated(outputs: &[Vec<usize>], dataset: &Dataset, settings: &Settings) -> Result<()> {
    let unstated = dataset.objects.iter().zip(outputs).find(|(_, outputs)| outputs.len() > 1);
    match unstated {
        Some((touched, _)) if settings.per == Per::Object => {
            let name = &touched.name;
            let allowed = format!(
                "average, or recordings that state their placements (--object {name}/PLACEMENT): a rate of each is one in each \
                 placement, and those of {name} state none"
            );
            Err(Error::setting("per", "object", allowed))
        }
        _ => Ok(()),
    }
}

/// Seed of the noise of the touches: another than those of training and tests.
pub(super) fn noise_seed(settings: &Settings) -> u64 {
    settings.seed.wrapping_add(0x9e37_79b9)
}

/// Touches that a model is calibrated on.
pub(super) struct Drawn<'d> {
    /// A data set of touches that were made in the same way, if not of these.
    pub(super) dataset: &'d Dataset,
    /// The fewest touches of an object.
    pub(super) fewest: u64,
    /// One of each object, with noise.
    pub(super) supplies: Vec<TouchSupply<'d>>,
}

/// Calibrates on touches drawn from supplies; `temperature` finds the temperature.
pub(super) fn calibrate_drawn(
    model: &Model<'_>,
    Material { names, outputs, max_touches, .. }: &Material,
    Drawn { dataset, fewest, mut supplies }: Drawn<'_>,
    settings: &Settings,
    start: Option<Start>,
    temperature: impl FnOnce() -> Result<f64>,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    progress.begin("calibrating", Some((settings.sequences + settings.sequences / PILOT) as u64));
    let terms = settings.terms();
    let naive = terms.margin();
    let wanted = |count: usize| wanted(model, outputs, settings.per, count);
    let draw = |supplies: &mut [TouchSupply<'_>], count: usize, margin: f64| {
        let limit = Limit { margin, max_touches: *max_touches };
        follow(model, supplies, &wanted(count), limit, progress)
    };
    let mut first: Vec<TouchSupply<'_>> = supplies.iter_mut().map(|supply| supply.take_part(PILOT)).collect();
    if settings.active {
        let plan = model.plan().ok_or(EvaluateProblem::NoPlan)?;
        if !dataset.holds_approaches() {
            return Err(EvaluateProblem::NoApproaches.into());
        }
        follow_plan(&mut first, names, &plan)?;
        follow_plan(&mut supplies, names, &plan)?;
    }
    let (starts, loosest, sequences) = match start {
        Some(Start { margin, loosest }) => (vec![margin], loosest, draw(&mut supplies, settings.sequences, margin)?),
        None => {
            let pilot = draw(&mut first, (settings.sequences / PILOT).max(1), naive + STRICTEST[1])?;
            let is_enough = is_kept_well(&pilot, naive + STRICTEST[0], settings.rate);
            let strictest = naive + if is_enough { STRICTEST[0] } else { STRICTEST[1] };
            let sequences = draw(&mut supplies, settings.sequences, strictest)?;
            let tested = (share_tested(settings.per) * sequences.len() as f64) as usize;
            let seen = Seen::new(&pilot, &(0..pilot.len()).collect::<Vec<_>>(), tested, &terms, strictest);
            (spread(strictest, seen.most_starts(&terms), settings.rate), None, sequences)
        }
    };
    let supplied = (sequences.len() < wanted(settings.sequences).iter().sum())
        .then(|| Supplied { approaches: dataset.holds_approaches(), fewest });
    let way = Way { starts: &starts, loosest: loosest.as_ref() };
    let chosen = chosen(&sequences, names, &way, &terms, supplied).map_err(|mut problem| {
        if let CalibrateProblem::NotKept { wrong, given, remedy, .. } = &mut problem {
            let both = [model.noise().unwrap_or_default(), dataset.real().and(&settings.noise).trained()];
            let noise = (both[0] != both[1]).then(|| both.map(|noise| Noise::of_training(&noise).to_string()));
            let tally = Tally { wrong: *wrong, all: *given };
            *remedy = Some(Box::new(Remedy::new(tally, &terms, supplied, sequences.len(), noise)));
        }
        problem
    })?;
    finished(model, dataset, settings, *max_touches, names, &chosen, temperature()?)
}

/// The names that a model gives, and the objects of a data set, which has all of them, by their indices in the model: of an
/// object that may be of several outputs the first.
pub(super) fn named(model: &Model<'_>, dataset: &Dataset) -> Result<(Vec<String>, Vec<usize>)> {
    let candidate = Candidate::Compiled(model);
    let (_, known) = candidate.of(dataset)?;
    let mut names = compile::names(model);
    // A background is not touched, and never named.
    names.truncate(model.known_count());
    if names.len() < 2 {
        return Err(CalibrateProblem::OneObject.into());
    }
    let there: BTreeSet<usize> =
        dataset.objects.iter().flat_map(|touched| candidate.outputs_of(&touched.name)).collect();
    let missing: Vec<String> =
        (0..names.len()).filter(|output| !there.contains(output)).map(|output| names[output].clone()).collect();
    match (missing.is_empty(), dataset.is_recorded()) {
        (true, _) => Ok((names, known)),
        (false, false) => Err(CalibrateProblem::Missing { objects: missing }.into()),
        (false, true) => Err(CalibrateProblem::MissingRecordings { objects: missing }.into()),
    }
}

/// The outputs of each of these objects, which are in the order of [`named`].
pub(super) fn outputs(model: &Model<'_>, dataset: &Dataset) -> Vec<Vec<usize>> {
    let candidate = Candidate::Compiled(model);
    dataset.objects.iter().map(|touched| candidate.outputs_of(&touched.name)).collect()
}

impl Settings {
    /// The terms of the promise.
    pub(crate) fn terms(&self) -> Terms {
        Terms { rate: self.rate, confidence: self.confidence, per: self.per }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.terms().check()?;
        if self.sequences == 0 || u32::try_from(self.sequences).is_err() {
            return Err(Error::setting("sequences", self.sequences, "a number from 1 to 4294967295"));
        }
        self.noise.check()
    }
}

/// Adds noise to the touches; the origin does not state it. With a bias every sequence is made by a robot of its own, which
/// has touches enough to reach the limit, of one instance or recording.
pub(crate) fn add_noise(model: &Model<'_>, dataset: &mut Dataset, noise: &Noise, max_touches: u32, seed: u64) {
    if noise.is_none() {
        return;
    }
    let trained = model.trained_touches();
    let robots = |object: &ObjectTouches| {
        let used = object.touches().iter().filter(|touch| Refused::check(&trained, touch).is_ok()).count();
        used / max_touches.max(1) as usize
    };
    let fewest = dataset.objects.iter().map(robots).min().unwrap_or(0);
    for object in &mut dataset.objects {
        let sources = object.sources().len().max(1);
        *object = object.noisy(noise, seed, (fewest / sources * sources).max(sources));
    }
}

/// Share of the touches that each object of a data set gets, by the priors of its outputs.
pub(super) fn shares(model: &Model<'_>, outputs: &[Vec<usize>]) -> Vec<f64> {
    let prior = |&output: &usize| (f64::from(model.prior(output)) * f64::from(model.unit())).exp();
    let weights: Vec<f64> = outputs.iter().map(|own| own.iter().map(prior).sum()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// True if at this margin clearly fewer names are wrong than promised, as far as a few sequences tell.
fn is_kept_well(pilot: &[Sequence], margin: f64, rate: f64) -> bool {
    let odds = Odds::All(odds_of(margin));
    let given = pilot.iter().filter_map(|sequence| Some((sequence, sequence.given(&odds)?)));
    let (wrong, given) = given.fold((0_u32, 0_u32), |(wrong, given), (sequence, look)| {
        (wrong + u32::from(look.name != sequence.object), given + 1)
    });
    f64::from(wrong) <= 0.5 * rate * f64::from(given)
}

/// Bytes that a calibration to an average error rate adds to a model that states neither promise nor temperature.
#[cfg(feature = "train")]
pub(crate) fn added_bytes(noise: &Noise) -> usize {
    let promise = Promise::length(&noise.promised());
    2 * SECTION_HEADER_LENGTH + promise + Temperature::LENGTH
}

pub(super) fn finished(
    model: &Model<'_>,
    dataset: &Dataset,
    settings: &Settings,
    max_touches: u32,
    names: &[String],
    chosen: &Chosen,
    temperature: f64,
) -> Result<Calibrated> {
    let approaches = dataset.holds_approaches();
    let noise = dataset.real().and(&settings.noise).promised();
    let stated = Stated { approaches, active: settings.active, groups: false, max_touches, noise };
    let temperature = Temperature::new(temperature).unwrap_or(Temperature::ONE);
    let mut sections = vec![(Tag::Temperature, Some((false, temperature.to_bytes().to_vec())))];
    if let (None, Some(probe)) = (model.probe(), StatedProbe::of(dataset)) {
        let trained = probe.trained();
        sections.push((Tag::Probe, Some((false, trained.to_bytes().into_iter().take(trained.length()).collect()))));
    }
    let mut calibrated = Calibrated::new(model, names, chosen, &settings.terms(), stated, sections)?;
    // Touches that state no placement are of the object as a whole.
    for (touched, outputs) in dataset.objects.iter().zip(self::outputs(model, dataset)) {
        if outputs.len() > 1 {
            let own = outputs.iter().filter_map(|&output| calibrated.objects.remove(names.get(output)?));
            let sum = own.fold(OfObject::default(), |a, b| OfObject {
                given: a.given + b.given,
                wrong: a.wrong + b.wrong,
                named: a.named + b.named,
                named_wrongly: a.named_wrongly + b.named_wrongly,
            });
            calibrated.objects.insert(touched.name.clone(), sum);
        }
    }
    Ok(Calibrated { temperature: Some(temperature.value()), ..calibrated })
}
