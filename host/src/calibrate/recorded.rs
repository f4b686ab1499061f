//! A promise for a real robot: thresholds that are found on simulated sequences, and tested on recorded ones.
//!
//! Recordings are few. Followed as far as a calibration from nothing follows its sequences, they make too few for a
//! promise. So simulated sequences say where to begin:
//!
//! - the thresholds and their order, from strict to loose, come from the simulated sequences, and so does the first one
//!   that is tested: the one at which so many recordings are likeliest to pass. It depends on how many approaches were
//!   recorded, and on nothing that they say;
//! - at each threshold the recordings, in an order that is drawn once, are cut into sequences that share no touch and end
//!   where a name is given. A looser threshold has more of them;
//! - the thresholds are walked over on these ([`walk`]); the loosest before the first that fails is kept.
//!
//! Fixed-sequence testing needs no more: an order that the tested sequences had no part in, and at each threshold a test
//! that is valid by itself. If the simulation is wrong, a promise that could have been made is missed, and none is broken.

use super::calibrated::Calibrated;
use super::calibrated::OfRecorded;
use super::choose::{By, steps, summary, tallies};
use super::model::{Material, STRICTEST, Settings, add_noise, finished, noise_seed};
use super::refused::{GROWN, GROWTH, LIKELY, percent};
use super::temperature::temperature;
use super::terms::Terms;
use super::walk::{Kept, Stop, Tally, allowed, binomial_tail, needed, walk};
use crate::error::{Error, Result};
use crate::evaluate::OfTouches;
use crate::evidence::{Odds, Sequence, margin_of};
use crate::probe::noise::Noise;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, Source};
use palpate_base::wording::two_digits;
use palpate_onboard::Model;

/// Share of the greatest probability of passing from which on the strictest first threshold is taken.
const AS_LIKELY: f64 = 0.95;
/// A probability below which recordings that make too few names are not tested at all.
const HOPELESS: f64 = 0.01;
/// Error rates that a forecast tries.
const RATES: [f64; 17] =
    [0.001, 0.002, 0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4];

/// Sets a model's thresholds, as [`calibrate`](fn@super::calibrate) does, for touches like the `recorded` ones: thresholds are
/// found on `simulated` sequences, to which the noise of `settings` is added, and tested on the recorded ones, which have
/// their own. The model was trained on neither.
///
/// # Errors
/// Errors of [`calibrate`](fn@super::calibrate), for the recordings if they do not support the rate.
pub fn calibrate_recorded(
    model: &Model<'_>,
    mut simulated: Dataset,
    recorded: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let of_simulated = Material::new(model, &simulated, settings)?;
    let material = Material::stated(model, recorded, settings)?;
    let names = &material.names;
    let delivered = model.delivered(recorded);
    let recorded = delivered.as_ref();
    add_noise(model, &mut simulated, &settings.noise, material.max_touches, noise_seed(settings));
    let terms = settings.terms();
    let strictest = terms.margin() + STRICTEST[0];
    let by = By::of(settings.per, names.len());
    progress.begin("calibrating", Some(settings.sequences as u64));
    let wanted = of_simulated.by_priors(settings.sequences);
    let sequences = of_simulated.sequences(&simulated, &wanted, strictest, progress)?;
    let steps = steps(&sequences, names.len(), strictest, &terms);
    let foreseen = Foreseen::new(&sequences, &steps, by, recorded, &material.outputs);
    let of_step = |odds: &Odds| -> Result<(Vec<Sequence>, Vec<Tally>)> {
        progress::check(progress)?;
        let wanted = material.by_priors(recorded.len());
        let sequences = material.sequences(recorded, &wanted, margin_of(odds.strictest()), &())?;
        let tallies = tallies(&sequences.iter().collect::<Vec<_>>(), odds, by);
        Ok((sequences, tallies))
    };
    if let Some(step) = foreseen.too_few(&terms) {
        let (_, tallies) = of_step(&steps[step])?;
        let fewest = (0..tallies.len()).min_by_key(|&position| tallies[position].all).unwrap_or(0);
        let found = tallies.get(fewest).map_or(0, |tally| tally.all);
        if found < needed(terms.rate, terms.confidence) {
            let needed = needed(terms.rate, terms.confidence);
            return Err(foreseen.problem(&Stop::TooFew { position: fewest, found, needed }, names, &terms));
        }
    }
    let mut failed = None;
    let tested = (foreseen.first(&terms)..steps.len()).map_while(|step| match of_step(&steps[step]) {
        Ok((_, tallies)) => Some((step, tallies)),
        Err(error) => {
            failed = Some(error);
            None
        }
    });
    // Recordings are few: the walk has one start.
    let kept = walk(tested, &[0], settings.rate, settings.confidence);
    if let Some(error) = failed {
        return Err(error);
    }
    let Kept { threshold: step, tallies } = kept.map_err(|stop| foreseen.problem(&stop, names, &terms))?;
    let (sequences, _) = of_step(&steps[step])?;
    let chosen = summary(steps[step].clone(), tallies, &sequences.iter().collect::<Vec<_>>(), names.len());
    let temperature = temperature(model, recorded, &material.known);
    let plain = Settings { noise: Noise::default(), ..settings.clone() };
    let calibrated = finished(&material, recorded, &plain, &chosen, temperature)?;
    let simulated_error = foreseen.steps[step].error();
    let facts = OfRecorded { approaches: foreseen.fewest, recordings: recordings(recorded), simulated_error };
    Ok(Calibrated { recorded: Some(facts), ..calibrated })
}

/// Recordings or logs that a data set's touches are of; none where it does not say.
fn recordings(dataset: &Dataset) -> Option<usize> {
    let of = |source: &&&Source| matches!(source, Source::Recording(_) | Source::Log(_));
    let count = dataset.objects.iter().map(|object| object.sources().iter().filter(of).count()).sum();
    (count > 0).then_some(count)
}

/// A threshold on simulated sequences.
struct Step {
    tallies: Vec<Tally>,
    /// Sequences that the recordings make, for each simulated one.
    scale: f64,
    /// Approaches to each recorded object that all simulated sequences took.
    used: Vec<u64>,
}

impl Step {
    fn error(&self) -> f64 {
        let sum = |of: fn(&Tally) -> u64| self.tallies.iter().map(of).sum::<u64>() as f64;
        sum(|tally| tally.wrong) / sum(|tally| tally.all).max(1.0)
    }

    /// The probability that so many times the recordings pass, if they are like the simulation.
    fn passes(&self, times: f64, rate: f64, confidence: f64) -> f64 {
        let of = |tally: &Tally| {
            let all = (tally.all as f64 * self.scale * times).floor() as u64;
            // No rate is 0 because none was wrong.
            let error = (tally.wrong as f64 + 0.5) / (tally.all as f64 + 1.0);
            allowed(all, rate, confidence).map_or(0.0, |wrong| binomial_tail(Tally { wrong, all }, error))
        };
        self.tallies.iter().map(of).product()
    }
}

/// Every threshold on simulated sequences.
struct Foreseen {
    steps: Vec<Step>,
    /// The recorded objects' names.
    names: Vec<String>,
    /// Approaches that were recorded to the object with the fewest.
    fewest: usize,
}

impl Foreseen {
    /// Every threshold, for recorded objects with these outputs.
    fn new(sequences: &[Sequence], steps: &[Odds], by: By, recorded: &Dataset, outputs: &[Vec<usize>]) -> Self {
        let all: Vec<&Sequence> = sequences.iter().collect();
        let object = |output: usize| outputs.iter().position(|own| own.contains(&output));
        let step = |odds: &Odds| {
            let mut used = vec![0_u64; outputs.len()];
            for sequence in sequences {
                let approaches = sequence.given(odds).map_or(sequence.approaches, |look| look.approaches);
                let used = object(sequence.object).and_then(|object| used.get_mut(object));
                used.into_iter().for_each(|used| *used += u64::from(approaches));
            }
            let of = recorded.objects.iter().zip(&used);
            let scale = of.map(|(object, &used)| object.len() as f64 / used.max(1) as f64);
            let scale = scale.fold(f64::INFINITY, f64::min);
            Step { tallies: tallies(&all, odds, by), scale, used }
        };
        let fewest = recorded.objects.iter().map(crate::touches::ObjectTouches::len).min().unwrap_or(0);
        Self { steps: steps.iter().map(step).collect(), names: recorded.names(), fewest }
    }

    /// The probability that some threshold passes as the first one, and the strictest that passes about as likely.
    fn best(&self, times: f64, rate: f64, confidence: f64) -> (f64, usize) {
        let passes: Vec<f64> = self.steps.iter().map(|step| step.passes(times, rate, confidence)).collect();
        let best = passes.iter().copied().fold(0.0, f64::max);
        (best, passes.iter().position(|&passes| passes >= AS_LIKELY * best).unwrap_or(0))
    }

    /// The first threshold that is tested.
    fn first(&self, terms: &Terms) -> usize {
        self.best(1.0, terms.rate, terms.confidence).1
    }

    /// The threshold that the simulation would choose, if hardly any can pass because the recordings make too few names.
    fn too_few(&self, terms: &Terms) -> Option<usize> {
        let chosen = self.steps.iter().rposition(|step| step.error() <= terms.rate).unwrap_or(0);
        let step = self.steps.get(chosen)?;
        let names = step.tallies.iter().map(|tally| tally.all as f64 * step.scale).fold(f64::INFINITY, f64::min);
        let is_hopeless = self.best(1.0, terms.rate, terms.confidence).0 < HOPELESS;
        (is_hopeless && names < needed(terms.rate, terms.confidence) as f64).then_some(chosen)
    }

    /// The approaches that a multiple of the recordings' sequences takes at a threshold, in words. Objects that are hard to
    /// distinguish take more approaches, and as many sequences.
    fn enough(&self, times: f64, step: usize) -> Option<String> {
        let Step { scale, used, .. } = self.steps.get(step)?;
        let approaches = |used: u64| two_digits(used as f64 * scale * times);
        let mut each: Vec<_> = used.iter().zip(&self.names).map(|(&used, name)| (approaches(used), name)).collect();
        each.sort();
        let ((least, easy), (most, hard)) = (each.first()?, each.last()?);
        let all = approaches(used.iter().sum());
        Some(format!("{all} in all, from {least} to {easy} to {most} to {hard}"))
    }

    /// The reason why no threshold was kept, with the rate that the recordings support and how many support this one, as far as
    /// the simulation is right.
    fn problem(&self, stop: &Stop, names: &[String], terms: &Terms) -> Error {
        let Terms { rate, confidence, per } = *terms;
        let is_likely = |times: f64, rate: f64| self.best(times, rate, confidence).0 >= LIKELY;
        let mut higher = RATES.iter().copied().filter(|&higher| higher > rate);
        let supported = match *stop {
            // What was found says more than what was foreseen.
            Stop::TooMany { tally, .. } => higher.find(|&rate| binomial_tail(tally, rate) <= 1.0 - confidence),
            _ => higher.find(|&rate| is_likely(1.0, rate)),
        };
        let supported = supported.map(|rate| {
            format!("{} recorded approaches to each object support about {} %. ", self.fewest, percent(rate))
        });
        let times = (0..GROWN).map(|step| GROWTH.powi(step)).find(|&times| is_likely(times, rate));
        let enough = times.and_then(|times| self.enough(times, self.best(times, rate, confidence).1));
        let enough =
            enough.map(|enough| format!("{} % takes about {enough}, if the simulation is right. ", percent(rate)));
        let remedy = match stop.is_too_few(rate) {
            true => "Record more, or promise a higher error rate.",
            false => {
                "Promise a higher error rate, record more, or bring the simulation nearer to the recordings: fit the probe \
                 (`palpate probe fit`), or adjust the model to other recordings (`palpate train --teach`)."
            }
        };
        let cases = stop.cases("names given", names, per) + " on the recordings";
        stop.problem(rate, &cases, "wrong").fix(supported.unwrap_or_default() + &enough.unwrap_or_default() + remedy)
    }
}

/// The position of the first threshold that is tested on recordings.
#[cfg(all(test, feature = "train"))]
pub(super) fn first_of(
    model: &Model<'_>,
    simulated: Dataset,
    recorded: &Dataset,
    settings: &Settings,
) -> Result<usize> {
    let of_simulated = Material::new(model, &simulated, settings)?;
    let material = Material::new(model, recorded, settings)?;
    let (names, terms) = (&material.names, settings.terms());
    let strictest = terms.margin() + STRICTEST[0];
    let wanted = of_simulated.by_priors(settings.sequences);
    let sequences = of_simulated.sequences(&simulated, &wanted, strictest, &())?;
    let steps = steps(&sequences, names.len(), strictest, &terms);
    let by = By::of(settings.per, names.len());
    Ok(Foreseen::new(&sequences, &steps, by, recorded, &material.outputs).first(&terms))
}
