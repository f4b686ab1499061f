//! A model's thresholds, its promise and its temperature.

#[cfg(feature = "train")]
use super::begin::Begin;
use super::begin::Seen;
use super::calibrated::{Calibrated, OfObject, Stated};
use super::choose::{Chosen, Way, promise, share_tested, spread};
use super::draw::{TouchSupply, follow, follow_plan};
use super::refused::{Supplied, Tested};
use super::temperature::temperature;
use super::terms::Terms;
use super::{Limit, Per};
use crate::compile;
use crate::ensemble::StatedProbe;
use crate::error::{Error, Kind, Result, problem};
use crate::evaluate::{OfTouches, check_approaches, no_plan};
use crate::evidence::{Odds, Sequence, odds_of, totals};
use crate::probe::noise::Noise;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Refused, Stopping};
use palpate_shared::format::{Tag, Temperature};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// One touch in this many serves the pilot alone, which says how strict to begin; its sequences are at most one in this many.
const PILOT: usize = 30;
/// The strictest threshold beyond that of the posterior, in nats: usually, and where a tenth of that is not enough.
pub(super) const STRICTEST: [f64; 2] = [2.5, 10.0];

/// Settings of a promise, and of the touches that it rests on.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// Cases that the rate covers.
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

/// Sets a model's thresholds so that it keeps a promised error rate and uses it up, on touches that nothing was trained
/// on; also its temperature. A data set of approaches is counted in these. If the model has a misfit test, names are held
/// back and sequences end as unknown where the chip's would, and the promise is one of the model with its test.
///
/// # Errors
/// [`Kind::NotKept`] if no threshold keeps the promise; [`Kind::TooFew`] if too few names are given to know; a data set that
/// lacks an object of the model; errors of [`Margins::new`](crate::evaluate::Margins::new) for touches that the model cannot
/// use; [`Kind::Setting`] for settings out of their ranges; [`Kind::Cancelled`].
pub fn calibrate(
    model: &Model<'_>,
    dataset: Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    calibrate_from(model, dataset, settings, None, progress)
}

/// Start of a calibration that other touches say something about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Start {
    /// The threshold at which the walk begins, as a margin in nats.
    pub(crate) margin: f64,
    /// Thresholds that those to be kept must be as strict as.
    pub(crate) loosest: Option<Odds>,
    /// The share of all touches there are that the calibration is on, for advice on how many it takes.
    pub(crate) share: f64,
}

/// Like [`calibrate`], from a given start instead of one that a few sequences suggest.
///
/// # Errors
/// Errors of [`calibrate`].
pub(crate) fn calibrate_from(
    model: &Model<'_>,
    mut dataset: Dataset,
    settings: &Settings,
    start: Option<Start>,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let material = Material::stated(model, &dataset, settings)?;
    if let Cow::Owned(delivered) = model.delivered(&dataset) {
        dataset = delivered;
    }
    add_noise(model, &mut dataset, &settings.noise, material.max_touches, noise_seed(settings));
    let drawn = Drawn {
        dataset: &dataset,
        fewest: dataset.objects.iter().map(|object| object.len() as u64).min().unwrap_or(0),
        supplies: material.supplies(&dataset),
    };
    let temperature = || Ok(temperature(model, &dataset, &material.known));
    calibrate_drawn(&material, drawn, start, temperature, progress)
}

/// The threshold, a margin in nats, at which a walk over `times` as many touches as there are in a part of them best begins: the
/// loosest one at which it passes with nearly the greatest probability, up to where a calibration that knows nothing begins.
///
/// # Errors
/// Errors of [`calibrate`], except for a rate that is not kept.
#[cfg(feature = "train")]
pub(crate) fn begin(
    model: &Model<'_>,
    mut part: Dataset,
    times: f64,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<f64> {
    let material = Material::stated(model, &part, settings)?;
    add_noise(model, &mut part, &settings.noise, material.max_touches, noise_seed(settings));
    let terms = settings.terms();
    let naive = terms.margin();
    let most = ((settings.sequences as f64 / times) as usize).max(1);
    let wanted = material.wanted(most);
    let followed = |beyond: f64| material.sequences(&part, &wanted, naive + beyond, progress);
    let [near, far] = STRICTEST;
    let sequences = followed(near)?;
    let (sequences, beyond) =
        if is_kept_well(&sequences, naive + near, settings.rate) { (sequences, near) } else { (followed(far)?, far) };
    let tested = (times * share_tested(settings.per) * sequences.len() as f64) as usize;
    Ok(Begin::new(&sequences, &(0..sequences.len()).collect::<Vec<_>>(), tested, &terms, naive + beyond).loosest)
}

/// A model, and a data set that it can be calibrated on.
pub(super) struct Material<'m> {
    pub(super) model: &'m Model<'m>,
    pub(super) settings: &'m Settings,
    /// The names that the model gives.
    pub(super) names: Vec<String>,
    /// The data set's objects' indices in the model.
    pub(super) known: Vec<usize>,
    /// Their outputs: several of one whose touches state no placement.
    pub(super) outputs: Vec<Vec<usize>>,
    pub(super) max_touches: u32,
}

impl<'m> Material<'m> {
    /// Refuses settings, models and data sets of which there is no calibration.
    pub(super) fn new(model: &'m Model<'m>, dataset: &Dataset, settings: &'m Settings) -> Result<Self> {
        settings.check()?;
        refuse_names_of_placements(model, settings)?;
        let max_touches = settings.limit(model);
        compile::stopping(settings.rate, max_touches)?;
        let (names, known) = named(model, dataset)?;
        Ok(Self { model, settings, names, known, outputs: outputs(model, dataset), max_touches })
    }

    /// Like [`Material::new`]; also refuses touches without a placement where the rate is one in each.
    pub(super) fn stated(model: &'m Model<'m>, dataset: &Dataset, settings: &'m Settings) -> Result<Self> {
        let material = Self::new(model, dataset, settings)?;
        refuse_unstated(&material.outputs, dataset, settings)?;
        Ok(material)
    }

    /// One supply of each of the data set's objects.
    fn supplies<'d>(&self, dataset: &'d Dataset) -> Vec<TouchSupply<'d>> {
        let touched = dataset.objects.iter().zip(&self.known);
        touched.map(|(touched, &object)| TouchSupply::new(object, touched, self.settings.seed)).collect()
    }

    /// Lets sequences go where the plan of the model says, if settings say so.
    fn follow_plan(&self, dataset: &Dataset, supplies: &mut [TouchSupply<'_>]) -> Result<()> {
        if !self.settings.active {
            return Ok(());
        }
        let plan = self.model.plan().ok_or_else(no_plan)?;
        check_approaches(dataset)?;
        follow_plan(supplies, &self.names, &plan)
    }

    /// Sequences that share no touch, `wanted` of each object, to a margin in nats.
    pub(super) fn sequences(
        &self,
        dataset: &Dataset,
        wanted: &[usize],
        margin: f64,
        progress: &dyn Progress,
    ) -> Result<Vec<Sequence>> {
        let mut supplies = self.supplies(dataset);
        self.follow_plan(dataset, &mut supplies)?;
        follow(self.model, &mut supplies, wanted, Limit { margin, max_touches: self.max_touches }, progress)
    }

    /// The sequences of each object of so many in all: as often as the model's priors say.
    pub(super) fn by_priors(&self, count: usize) -> Vec<usize> {
        let prior = |&output: &usize| (f64::from(self.model.prior(output)) * f64::from(self.model.unit())).exp();
        let weights: Vec<f64> = self.outputs.iter().map(|own| own.iter().map(prior).sum()).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| of_share(weight / sum, count)).collect()
    }

    /// Like [`Material::by_priors`]; equally many for a rate in each placement, since each has a promise of its own, however rare.
    fn wanted(&self, count: usize) -> Vec<usize> {
        match self.model.outputs() {
            Some(_) if self.settings.per == Per::Object => {
                vec![of_share(1.0 / self.outputs.len() as f64, count); self.outputs.len()]
            }
            _ => self.by_priors(count),
        }
    }
}

fn of_share(share: f64, count: usize) -> usize {
    (share * count as f64).round().max(1.0) as usize
}

/// Refuses a rate of each name where names are placements: how often one is wrong depends on their shares.
fn refuse_names_of_placements(model: &Model<'_>, settings: &Settings) -> Result<()> {
    match model.outputs().is_some() && settings.per == Per::Name {
        true => Err(Error::setting("per", "name", "average or object with a model whose objects have several outputs")),
        false => Ok(()),
    }
}

/// Refuses a rate in each placement on touches of which some state none.
fn refuse_unstated(outputs: &[Vec<usize>], dataset: &Dataset, settings: &Settings) -> Result<()> {
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
    material: &Material<'_>,
    Drawn { dataset, fewest, mut supplies }: Drawn<'_>,
    start: Option<Start>,
    temperature: impl FnOnce() -> Result<f64>,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let Material { model, settings, names, max_touches, .. } = material;
    progress.begin("calibrating", Some((settings.sequences + settings.sequences / PILOT) as u64));
    let terms = settings.terms();
    let naive = terms.margin();
    let draw = |supplies: &mut [TouchSupply<'_>], count: usize, margin: f64| {
        let limit = Limit { margin, max_touches: *max_touches };
        follow(model, supplies, &material.wanted(count), limit, progress)
    };
    let mut first: Vec<TouchSupply<'_>> = supplies.iter_mut().map(|supply| supply.take_part(PILOT)).collect();
    material.follow_plan(dataset, &mut first)?;
    material.follow_plan(dataset, &mut supplies)?;
    let share = start.as_ref().map_or(1.0, |start| start.share);
    let (starts, loosest, sequences) = match start {
        Some(Start { margin, loosest, .. }) => {
            (vec![margin], loosest, draw(&mut supplies, settings.sequences, margin)?)
        }
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
    let way = Way { starts: &starts, loosest: loosest.as_ref() };
    let chosen = promise(&[], &sequences, names.len(), &way, &terms).map_err(|stop| {
        let both = [model.noise().unwrap_or_default(), dataset.real().and(&settings.noise).trained()];
        let what = if dataset.holds_approaches() { "approaches" } else { "touches" };
        let are_used_up = sequences.len() < material.wanted(settings.sequences).iter().sum();
        let tested = Tested {
            supplied: are_used_up.then(|| Supplied { what, fewest: (fewest as f64 / share).round() as u64 }),
            sequences: sequences.len(),
            noise: (both[0] != both[1]).then(|| both.map(|noise| Noise::of_training(&noise).to_string())),
        };
        tested.problem(&stop, names, &terms)
    })?;
    finished(material, dataset, settings, &chosen, temperature()?)
}

/// The names that a model gives, and the objects of a data set, which has all of them, by their indices in the model: of an
/// object that may be of several outputs the first.
pub(super) fn named(model: &Model<'_>, dataset: &Dataset) -> Result<(Vec<String>, Vec<usize>)> {
    let (_, known) = model.of(dataset)?;
    let mut names = compile::names(model);
    // A background is not touched, and never named.
    names.truncate(model.known_count());
    if names.len() < 2 {
        let one = problem!("the model knows only one object: there is nothing to mistake it for");
        return Err(one.fix("Give a model of two or more objects."));
    }
    let there: BTreeSet<usize> = dataset.objects.iter().flat_map(|touched| model.outputs_of(&touched.name)).collect();
    let missing: Vec<String> =
        (0..names.len()).filter(|output| !there.contains(output)).map(|output| names[output].clone()).collect();
    let objects = missing.join(", ");
    match (missing.is_empty(), dataset.is_recorded()) {
        (true, _) => Ok((names, known)),
        (false, false) => Err(problem!("the data set has no touches of {objects}")
            .fix("Capture them too, with another seed than the training's.")),
        (false, true) => {
            let remedy = match objects.contains('/') {
                true => {
                    "Record it too: `palpate data record --object OBJECT/PLACEMENT`, or --object OBJECT where the robot does \
                     not know how it lies."
                }
                false => "Record it too: a promise is for all objects of the model.",
            };
            Err(problem!("nothing is recorded of {objects}").fix(remedy).as_kind(Kind::NotRecorded))
        }
    }
}

/// The outputs of each of these objects, which are in the order of [`named`].
fn outputs(model: &Model<'_>, dataset: &Dataset) -> Vec<Vec<usize>> {
    dataset.objects.iter().map(|touched| model.outputs_of(&touched.name)).collect()
}

impl Settings {
    /// Touches after which a sequence ends undecided.
    pub(super) fn limit(&self, model: &Model<'_>) -> u32 {
        self.max_touches.unwrap_or(Stopping::from_model(model).max_touches())
    }

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

/// True if at this margin clearly fewer names are wrong than promised, as far as a few sequences tell.
fn is_kept_well(pilot: &[Sequence], margin: f64, rate: f64) -> bool {
    let totals = totals(pilot, &Odds::All(odds_of(margin)));
    totals.wrong as f64 <= 0.5 * rate * totals.given as f64
}

/// The calibrated model; the promise holds for touches with the noise of these settings.
pub(super) fn finished(
    material: &Material<'_>,
    dataset: &Dataset,
    settings: &Settings,
    chosen: &Chosen,
    temperature: f64,
) -> Result<Calibrated> {
    let &Material { model, ref names, ref outputs, max_touches, .. } = material;
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
    for (touched, outputs) in dataset.objects.iter().zip(outputs) {
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
