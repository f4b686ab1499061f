//! A test that is calibrated on recordings too.

use super::follow::{self, Policy, Sequence, Until};
use super::{NAT, Settings, Supply, Tried, equally_many, supplies};
use crate::calibrate::{Tally, binomial_tail, needed};
use crate::error::{EvaluateProblem, Result};
use crate::touches::Dataset;
use palpate_onboard::Model;
use serde::Serialize;
use std::collections::BTreeMap;

/// The probability of more false alarms than the simulation's share allows, below which recordings are said to differ.
const BY_CHANCE: f64 = 0.01;

/// Results of recorded sequences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OnRecordings {
    /// Sequences that the threshold was tested on: of half of the recordings.
    pub sequences: usize,
    /// Those of them that ended as unknown.
    pub alarms: usize,
    /// The share of false alarms that so many sequences support: the promised one, or a higher one.
    pub supported: f64,
    /// Sequences of all recordings under a test that was calibrated on simulated touches alone.
    pub before: Alarms,
}

/// Recorded sequences under a test.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Alarms {
    /// All sequences: equally many of each object.
    pub sequences: usize,
    /// Those that ended as unknown, by object.
    pub objects: BTreeMap<String, usize>,
    /// True if they are more than the test's share allows but by chance: recorded and simulated misfit differ.
    pub differs: bool,
}

impl Alarms {
    /// Sequences that ended as unknown.
    pub fn all(&self) -> usize {
        self.objects.values().sum()
    }
}

/// Half of the touches of each pool to learn from, and half to test on.
pub(super) fn halves(supplies: Vec<Supply>, objects: usize) -> (Vec<Supply>, Vec<Supply>) {
    let of = |mut supply: Supply| {
        let half = |rows: &mut Vec<i32>| rows.split_off(rows.len() / objects / 2 * objects);
        let pools = supply.pools.iter_mut().map(half).collect();
        let test = Supply { pools, is_once: supply.is_once, is_short: supply.is_short };
        (supply, test)
    };
    supplies.into_iter().map(of).unzip()
}

/// The threshold that recorded sequences keep as simulated ones do, and what came of it: no looser than `simulated`.
pub(super) fn tested(
    sequences: &[Vec<Sequence>],
    tried: &Tried,
    simulated: f64,
    settings: &Settings,
) -> Result<(f64, OnRecordings)> {
    let all = equally_many(sequences);
    let Settings { alarms, confidence, .. } = *settings;
    // Sequences of each object; with some of them, too many are alarms.
    let of_each = all.len() / sequences.len().max(1);
    let few = EvaluateProblem::TooFewRecorded { object_sequences: of_each };
    if all.is_empty() {
        return Err(few.into());
    }
    // With none of them an alarm, so many sequences support this share.
    let supported = match needed(alarms, confidence) <= all.len() as u64 {
        true => alarms,
        false => ((1.0 - (1.0 - confidence).powf(1.0 / all.len() as f64)) * 1e6).ceil() / 1e6,
    };
    let own = tried.threshold(&all, supported, confidence);
    let threshold = own.ok_or(few)?.max(simulated);
    let alarms = usize::try_from(tried.ends(&all, threshold)[0]).unwrap_or(usize::MAX);
    Ok((threshold, OnRecordings { sequences: all.len(), alarms, supported, before: Alarms::default() }))
}

/// The false alarms of a model's test on recorded touches.
pub(super) fn alarms(model: &Model<'_>, recorded: &Dataset, settings: &Settings) -> Result<Alarms> {
    let supplies = supplies(model, recorded, settings.seed)?;
    let Some(test) = model.strangers().and_then(|strangers| strangers.test) else { return Ok(Alarms::default()) };
    let [threshold, doubt] = [test.terms.threshold, test.terms.doubt].map(|limit| f64::from(limit) / NAT);
    let least = test.terms.least;
    let policy = Policy { until: Until::Named { level: doubt }, least };
    let sequences = follow::sequences(model, &supplies, &policy, settings.sequences);
    let fewest = sequences.iter().map(Vec::len).min().unwrap_or(0);
    let is_alarm = |sequence: &&Sequence| sequence.end(threshold, doubt, least).is_alarm;
    let count = |of: &Vec<Sequence>| of.iter().take(fewest).filter(is_alarm).count();
    let names = crate::compile::names(model);
    let mut found = Alarms { sequences: fewest * sequences.len(), ..Alarms::default() };
    found.objects = names.into_iter().zip(sequences.iter().map(count)).collect();
    let tally = |wrong: usize| Tally { wrong: wrong as u64, all: found.sequences as u64 };
    let fewer = found.all().checked_sub(1).map_or(0.0, |wrong| binomial_tail(tally(wrong), settings.alarms));
    found.differs = found.sequences > 0 && fewer > 1.0 - BY_CHANCE;
    Ok(found)
}
