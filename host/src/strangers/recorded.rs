//! A test that is calibrated on recordings too.

use super::follow::{self, Policy, Sequence};
use super::{Pools, Settings, Tried, equally_many, supply};
use crate::calibrate::{Alarms, OnRecordings, Tally, allowed, binomial_tail, needed};
use crate::error::{CalibrateProblem, EnoughRecorded, EvaluateProblem, Result};
use crate::evaluate::{Candidate, OfTouches};
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::Model;

/// The probability of more false alarms than the simulation's share allows, below which recordings are said to differ.
const BY_CHANCE: f64 = 0.01;

/// The touches of a recorded object.
pub(crate) struct OfRecorded {
    name: String,
    /// Number of approaches that were recorded.
    approaches: usize,
    /// Touches that are evidence, of the half that tests the threshold.
    touches: usize,
    /// The outputs that they may be of: several where they state no placement.
    outputs: Vec<usize>,
    pub(super) supply: Pools,
}

/// The recorded touches of every object that the model knows, as an effector would report them.
pub(super) fn supplies(model: &Model<'_>, recorded: &Dataset, seed: u64) -> Result<Vec<OfRecorded>> {
    let candidate = Candidate::Compiled(model);
    candidate.of(recorded)?;
    let recorded = candidate.delivered(recorded);
    let one = |touched: &ObjectTouches| OfRecorded {
        name: touched.name.clone(),
        approaches: touched.len(),
        touches: 0,
        outputs: candidate.outputs_of(&touched.name),
        supply: supply(model, touched, seed),
    };
    let all: Vec<OfRecorded> = recorded.objects.iter().map(one).collect();
    let names = crate::compile::names(model);
    let is_missing = |output: &usize| !all.iter().any(|own| own.outputs.contains(output));
    let missing: Vec<String> =
        (0..model.known_count()).filter(is_missing).filter_map(|output| names.get(output).cloned()).collect();
    match missing.is_empty() {
        true => Ok(all),
        false => Err(CalibrateProblem::MissingRecordings { objects: missing }.into()),
    }
}

/// Half of the touches of each pool to learn from, and half to test on.
pub(super) fn halves(supplies: Vec<OfRecorded>, objects: usize) -> (Vec<OfRecorded>, Vec<OfRecorded>) {
    let of = |mut own: OfRecorded| {
        let half = |rows: &mut Vec<i32>| rows.split_off(rows.len() / objects / 2 * objects);
        let pools: Vec<Vec<i32>> = own.supply.pools.iter_mut().map(half).collect();
        let touches = pools.iter().map(Vec::len).sum::<usize>() / objects.max(1);
        let supply = Pools { pools, is_once: own.supply.is_once, is_short: own.supply.is_short };
        let (name, outputs) = (own.name.clone(), own.outputs.clone());
        let test = OfRecorded { name, approaches: own.approaches, touches, outputs, supply };
        (own, test)
    };
    supplies.into_iter().map(of).unzip()
}

/// The touches of each of the model's known outputs. A recording that states no placement is of the one that has the most
/// evidence.
pub(super) fn by_output(supplies: Vec<OfRecorded>, known: usize, objects: usize) -> Vec<Pools> {
    let mut by_output: Vec<Pools> = (0..known).map(|_| Pools::default()).collect();
    for OfRecorded { outputs, supply, .. } in supplies {
        for rows in supply.pools {
            let sum = |&output: &usize| -> i64 {
                rows.chunks_exact(objects).filter_map(|row| row.get(output)).map(|&margin| i64::from(margin)).sum()
            };
            let likeliest = outputs.iter().copied().max_by_key(sum);
            likeliest
                .and_then(|output| by_output.get_mut(output))
                .into_iter()
                .for_each(|of| of.pools.push(rows.clone()));
        }
    }
    by_output
}

/// The threshold that recorded sequences keep as simulated ones do, and what came of it: no looser than `simulated`. The
/// sequences are of each recorded object in turn; `of_outputs` are the simulated ones of each of the model's.
pub(super) fn tested(
    (recorded, sequences): (&[OfRecorded], &[Vec<Sequence>]),
    of_outputs: &[Vec<Sequence>],
    (tried, simulated): (&Tried, f64),
    settings: &Settings,
) -> Result<(f64, OnRecordings)> {
    let all = equally_many(sequences);
    let Settings { alarms, confidence, .. } = *settings;
    if all.is_empty() {
        return Err(no_sequence((recorded, sequences), of_outputs, settings).into());
    }
    // With none of them an alarm, so many sequences support this share.
    let supported = match needed(alarms, confidence) <= all.len() as u64 {
        true => alarms,
        false => supported(all.len() as u64, confidence),
    };
    let Some(own) = tried.threshold(&all, supported, confidence) else {
        let of_each = all.len() / sequences.len().max(1);
        let unknown = |of: &Vec<Sequence>| {
            let of: Vec<&Sequence> = of.iter().take(of_each).collect();
            usize::try_from(tried.ends(&of, tried.strictest)[0]).unwrap_or(usize::MAX)
        };
        let mut unknown: Vec<(String, usize)> =
            recorded.iter().map(|own| own.name.clone()).zip(sequences.iter().map(unknown)).collect();
        unknown.retain(|(_, count)| *count > 0);
        unknown.sort_by_key(|own| std::cmp::Reverse(own.1));
        let allowed = allowed(all.len() as u64, supported, confidence).unwrap_or(0);
        return Err(EvaluateProblem::RecordedUnknown { of_each, unknown, share: supported, allowed }.into());
    };
    let threshold = own.max(simulated);
    let alarms = usize::try_from(tried.ends(&all, threshold)[0]).unwrap_or(usize::MAX);
    Ok((threshold, OnRecordings { sequences: all.len(), alarms, supported, before: Alarms::default() }))
}

/// The share that so many sequences support if none of them is an alarm, in millionths.
fn supported(sequences: u64, confidence: f64) -> f64 {
    ((1.0 - (1.0 - confidence).powf(1.0 / sequences.max(1) as f64)) * 1e6).ceil() / 1e6
}

/// The refusal of recordings of which an object makes no sequence: what it has, and what would do, by the lengths of simulated
/// sequences.
fn no_sequence(
    (recorded, sequences): (&[OfRecorded], &[Vec<Sequence>]),
    of_outputs: &[Vec<Sequence>],
    settings: &Settings,
) -> EvaluateProblem {
    let Settings { alarms, confidence, .. } = *settings;
    let objects = recorded.len().max(1) as u64;
    let mean = |own: &OfRecorded| {
        let lengths = own.outputs.iter().filter_map(|&output| of_outputs.get(output)).flatten().map(Sequence::touches);
        let (sum, count) = lengths.fold((0, 0_u32), |(sum, count), touches| (sum + touches, count + 1));
        (count > 0).then(|| sum as f64 / f64::from(count))
    };
    let of = |(own, sequences): (&OfRecorded, &Vec<Sequence>)| {
        let tested = own.touches;
        let enough = mean(own).filter(|_| sequences.is_empty() && tested > 0).map(|mean| {
            // Of so many approaches one touch is evidence that is tested.
            let one = mean * own.approaches as f64 / tested as f64;
            let promised = one * needed(alarms, confidence).div_ceil(objects) as f64;
            EnoughRecorded { touches: mean, one, share_of_one: supported(objects, confidence), promised, share: alarms }
        });
        (own.name.clone(), own.approaches, tested, enough)
    };
    // The one of which the most is missing.
    let without = recorded.iter().zip(sequences).filter(|(_, of)| of.is_empty()).map(of);
    let missing = |enough: &Option<EnoughRecorded>| enough.map_or(0.0, |enough| enough.one);
    let worst = without.max_by(|a, b| missing(&a.3).total_cmp(&missing(&b.3)));
    let (object, approaches, tested, enough) = worst.unwrap_or_default();
    EvaluateProblem::TooFewRecorded { object, approaches, tested, enough }
}

/// The false alarms of a model's test on recorded touches.
pub(super) fn alarms(model: &Model<'_>, recorded: &Dataset, settings: &Settings) -> Result<Alarms> {
    let supplies = supplies(model, recorded, settings.seed)?;
    let Some(test) = model.strangers().and_then(|strangers| strangers.test) else { return Ok(Alarms::default()) };
    let (policy, end) = Policy::of(&test.terms);
    let follow = |own: &OfRecorded| {
        follow::sequences(model, std::slice::from_ref(&own.supply), &policy, settings.sequences).into_iter().flatten()
    };
    let sequences: Vec<Vec<Sequence>> = supplies.iter().map(|own| follow(own).collect()).collect();
    let fewest = sequences.iter().map(Vec::len).min().unwrap_or(0);
    let is_alarm = |sequence: &&Sequence| end(sequence).is_alarm;
    let count = |of: &Vec<Sequence>| of.iter().take(fewest).filter(is_alarm).count();
    let mut found = Alarms { sequences: fewest * sequences.len(), ..Alarms::default() };
    found.objects = supplies.into_iter().map(|own| own.name).zip(sequences.iter().map(count)).collect();
    let tally = |wrong: usize| Tally { wrong: wrong as u64, all: found.sequences as u64 };
    let fewer = found.all().checked_sub(1).map_or(0.0, |wrong| binomial_tail(tally(wrong), settings.alarms));
    found.differs = found.sequences > 0 && fewer > 1.0 - BY_CHANCE;
    Ok(found)
}
