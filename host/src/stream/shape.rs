//! A scale of the evidence, and weights of rows that resemble each other: found on sequences that no promise rests on.

use super::Rows;
use crate::calibrate::{Gain, Lead, Odds, Sequence, odds_of};
use crate::compile::{Restated, restate};
use crate::error::Result;
use crate::evidence::totals;
#[cfg(feature = "train")]
use crate::strangers;
use palpate_onboard::Model;
use palpate_shared::format::{Tag, Weights};
use palpate_trees::rows::RowSequence;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// The most rows that a scale is fitted to.
const MOST_ROWS: usize = 10_000;
/// The greatest scale, and one over the least.
const MOST_SCALE: f64 = 256.0;
/// Nats of evidence in a unit: the least, and the most.
const UNITS: (f64, f64) = (1.0 / 16_777_216.0, 0.5);
/// Sequences that must be as long for a weight of their number of rows.
const LEAST_SEQUENCES: usize = 20;
/// Halvings of the range of the logarithm of a weight or scale.
const HALVINGS: usize = 20;
/// The least weight.
const LEAST_WEIGHT: f64 = 1e-3;
/// Beyond this margin, in nats, a threshold is not stored precisely.
pub(super) const STRICTEST: f64 = 36.0;
/// Beyond this margin a threshold is too near to the strictest: a walk that begins there has no room.
const ROOM: f64 = 24.0;
/// Between two thresholds that are compared, in nats.
const STEP: f64 = 0.05;

/// Changes to margins before they are compared with a threshold.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shape {
    /// Factor from margins to evidence.
    pub(super) scale: Option<f64>,
    /// By [`Weights::position`].
    pub(super) weights: Option<Vec<f64>>,
}

/// A fitted shape, and what its parts save.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fitted {
    pub(super) shape: Shape,
    pub(super) scale: Option<Gain>,
    pub(super) weights: Option<Gain>,
}

/// The factor with which a softmax of the rows' margins explains the classes best: the least mean of −log of the right class's
/// share, classes and sequences weighing the same.
fn fit_scale(rows: &Rows<'_>, sequences: &[&RowSequence]) -> f64 {
    let cases: Vec<(f64, Vec<f64>)> = cases(rows, sequences)
        .iter()
        .map(|case| {
            let margins = rows.row(case.row);
            let own = f64::from(margins[case.class]);
            (case.weight, margins.iter().map(|&margin| (f64::from(margin) - own) * rows.unit).collect())
        })
        .collect();
    let (least, most) = ((UNITS.0 / rows.unit).max(1.0 / MOST_SCALE), (UNITS.1 / rows.unit).min(MOST_SCALE));
    likeliest(least..=most, &cases)
}

/// A row of a known class.
struct Case {
    row: usize,
    class: usize,
    /// All weights are 1 together.
    weight: f64,
}

/// Rows of sequences, classes and sequences weighing the same; at most [`MOST_ROWS`], spread evenly.
fn cases(rows: &Rows<'_>, sequences: &[&RowSequence]) -> Vec<Case> {
    let mut of_class = vec![0_usize; rows.objects];
    sequences.iter().for_each(|sequence| of_class[sequence.class] += 1);
    let all = sequences.iter().flat_map(|sequence| {
        let weight = 1.0 / (of_class[sequence.class] * sequence.rows.len()) as f64;
        sequence.rows.clone().map(move |row| Case { row, class: sequence.class, weight })
    });
    let every = sequences.iter().map(|sequence| sequence.rows.len()).sum::<usize>().div_ceil(MOST_ROWS).max(1);
    let mut cases: Vec<Case> = all.step_by(every).collect();
    let sum: f64 = cases.iter().map(|case| case.weight).sum();
    cases.iter_mut().for_each(|case| case.weight /= sum);
    cases
}

/// Evidence of a sequence after each row, for each class, in nats.
fn sums(rows: &Rows<'_>, sequence: &RowSequence, scale: Option<f64>, mut see: impl FnMut(u32, &[f64]) -> bool) {
    let mut sums = rows.priors.clone();
    let unit = rows.unit * scale.unwrap_or(1.0);
    for (count, row) in (1..).zip(sequence.rows.clone()) {
        for (sum, &margin) in sums.iter_mut().zip(rows.row(row)) {
            *sum += f64::from(margin) * unit;
        }
        if !see(count, &sums) {
            return;
        }
    }
}

/// The weight at which posteriors after each number of rows explain the classes best, by [`Weights::position`]: falling,
/// as rows that resemble each other add less and less.
fn fit_weights(rows: &Rows<'_>, sequences: &[&RowSequence], scale: Option<f64>, max_rows: u32) -> Vec<f64> {
    let longest = sequences.iter().map(|sequence| sequence.rows.len()).max().unwrap_or(1).min(max_rows as usize);
    let positions = Weights::position(longest as u32) + 1;
    // For each position evidence less that for the right class, one after the other: of the last row at it.
    let seen: Vec<Vec<Vec<f64>>> = sequences
        .par_iter()
        .map(|sequence| {
            let mut of: Vec<Vec<f64>> = vec![Vec::new(); positions];
            sums(rows, sequence, scale, |count, sums| {
                let own = sums[sequence.class];
                of[Weights::position(count)] = sums.iter().map(|sum| sum - own).collect();
                (count as usize) < longest
            });
            of
        })
        .collect();
    let mut weights = Vec::with_capacity(positions);
    let mut before = 1.0_f64;
    for position in 0..positions {
        let cases = seen.iter().map(|of| &of[position]).filter(|case| !case.is_empty());
        let cases: Vec<(f64, Vec<f64>)> = cases.map(|case| (1.0, case.clone())).collect();
        if cases.len() >= LEAST_SEQUENCES {
            before = likeliest(LEAST_WEIGHT..=1.0, &cases).min(before);
        }
        weights.push(before);
    }
    weights
}

/// The factor of evidence within a range with the greatest likelihood, for evidence less that for the right class, with the weight
/// of each case.
fn likeliest(range: RangeInclusive<f64>, cases: &[(f64, Vec<f64>)]) -> f64 {
    // The likelihood is concave in the factor; its slope is minus the mean lead over the right class.
    let slope = |factor: f64| -> f64 {
        let ahead = |(weight, case): &(f64, Vec<f64>)| {
            let most = case.iter().copied().fold(0.0, f64::max);
            let (sum, total) = case.iter().fold((0.0, 0.0), |(sum, total), ahead| {
                let share = (factor * (ahead - most)).exp();
                (sum + share * ahead, total + share)
            });
            -weight * sum / total
        };
        cases.iter().map(ahead).sum()
    };
    let (least, most) = range.into_inner();
    if slope(most) >= 0.0 {
        return most;
    }
    let (mut low, mut high) = (least.ln(), most.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle.exp()) > 0.0 { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).exp()
}

/// Sequences under a shape, reduced to what a comparison of thresholds needs.
fn followed(rows: &Rows<'_>, sequences: &[&RowSequence], shape: &Shape, max_rows: u32) -> Vec<Sequence> {
    let of = |sequence: &&RowSequence| {
        let mut followed = Sequence::new(sequence.class);
        sums(rows, sequence, shape.scale, |count, sums| {
            let weight = shape
                .weights
                .as_ref()
                .and_then(|weights| weights.get(Weights::position(count)).or(weights.last()).copied());
            let weight = weight.unwrap_or(1.0);
            let known = sums.get(..rows.known).unwrap_or(sums);
            let best = (1..known.len()).fold(0, |best, other| if known[other] > known[best] { other } else { best });
            let others = sums.iter().enumerate().filter(|(object, _)| *object != best);
            let others: f64 = others.map(|(_, sum)| (weight * (sum - sums[best])).exp()).sum();
            let odds = odds_of(-others.ln());
            followed.take(Lead { name: best, odds, touches: count, approaches: count }, true);
            odds > odds_of(STRICTEST) && count < max_rows
        });
        followed
    };
    sequences.par_iter().map(of).collect()
}

/// The rows to a verdict at the loosest threshold at which no more of the names given are wrong than the rate; none if there
/// is none below [`ROOM`].
fn rows_at(sequences: &[Sequence], rate: f64) -> Option<f64> {
    // With fewer than that, no error rate is seen.
    let margin = margin_at(sequences, rate.max(2.0 / sequences.len().max(1) as f64))?;
    Some(totals(sequences, &Odds::All(odds_of(margin))).mean_touches())
}

/// Loosest threshold at which these sequences keep the rate, in nats; `None` if there is none.
pub(super) fn margin_at(sequences: &[Sequence], rate: f64) -> Option<f64> {
    let mut margins = (1..).map(|step| STEP * f64::from(step)).take_while(|margin| *margin < ROOM);
    margins.find(|margin| {
        let totals = totals(sequences, &Odds::All(odds_of(*margin)));
        totals.given > 0 && totals.wrong as f64 <= rate * totals.given as f64
    })
}

/// Fits a scale and weights to sequences, and keeps what saves rows: each is compared on the half of them that it was not
/// fitted to.
pub(super) fn fit(rows: &Rows<'_>, sequences: &[&RowSequence], rate: f64, max_rows: u32) -> Fitted {
    let mut fitted = Fitted { shape: Shape::default(), scale: None, weights: None };
    if sequences.len() < 2 * LEAST_SEQUENCES {
        return fitted;
    }
    let halves = sequences.split_at(sequences.len() / 2);
    let folds = [(halves.0, halves.1), (halves.1, halves.0)];
    let shape = |fit: &[&RowSequence], is_scaled: bool, is_weighed: bool| {
        let scale = is_scaled.then(|| fit_scale(rows, fit));
        Shape { scale, weights: is_weighed.then(|| fit_weights(rows, fit, scale, max_rows)) }
    };
    let measured = |is_scaled: bool, is_weighed: bool| {
        let of =
            folds.iter().flat_map(|(fit, test)| followed(rows, test, &shape(fit, is_scaled, is_weighed), max_rows));
        rows_at(&of.collect::<Vec<_>>(), rate)
    };
    let (without, with_weights) = (measured(false, false), measured(false, true));
    let (with_scale, with_both) = (measured(true, false), measured(true, true));
    // Each part has to save by itself what it costs, whatever the other does.
    let best = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
    let of_scale = Gain::new(best(without, with_weights), best(with_scale, with_both));
    let of_weights = if of_scale.kept { Gain::new(with_scale, with_both) } else { Gain::new(without, with_weights) };
    fitted.shape = shape(sequences, of_scale.kept, of_weights.kept);
    (fitted.scale, fitted.weights) = (Some(of_scale), Some(of_weights));
    fitted
}

/// The model with the scale of its evidence and how much rows count together, and without what an earlier calibration stated.
pub(super) fn shaped(model: &Model<'_>, fitted: &Fitted, max_rows: u32) -> Result<Vec<u8>> {
    let shape = &fitted.shape;
    let unit = f64::from(model.unit()) * shape.scale.unwrap_or(1.0);
    // Priors stay what they are in nats.
    let prior = |object| (f64::from(model.prior(object)) * model.evidence_unit() / unit).round() as i32;
    let sections = vec![
        (Tag::Weights, shape.weights.as_ref().map(|weights| (true, weights_section(weights)))),
        (Tag::ThresholdsByObject, None),
        (Tag::Promise, None),
        (Tag::Temperature, None),
    ];
    let restated = Restated {
        max_touches: Some(max_rows),
        priors: Some((0..model.object_count()).map(prior).collect()),
        evidence_unit: Some(unit),
        sections,
        ..Restated::default()
    };
    let shaped = restate(model, &restated)?;
    #[cfg(feature = "train")]
    let shaped = strangers::without(&crate::compile::open(&shaped)?)?;
    Ok(shaped)
}

/// The section that stores weights.
pub(super) fn weights_section(weights: &[f64]) -> Vec<u8> {
    let stored = |weight: &f64| ((weight * f64::from(Weights::ONE)).round() as u32).clamp(1, Weights::ONE);
    let mut weights: Vec<u32> = weights.iter().map(stored).take(Weights::MOST).collect();
    // What is the same to the end is stored once.
    while weights.len() > 1 && weights[weights.len() - 1] == weights[weights.len() - 2] {
        weights.pop();
    }
    let mut section = Vec::new();
    Weights::write(&weights, &mut |part| section.extend_from_slice(part));
    section
}

/// The weights of a model that has some, of 1, 2, 4, 8 and so on touches.
pub(super) fn stated(model: &Model<'_>) -> Option<Vec<f64>> {
    let has_weights = model.weight_of(u32::MAX) != Weights::ONE || model.weight_of(2) != Weights::ONE;
    let of = |doubling: u32| f64::from(model.weight_of(1 << doubling)) / f64::from(Weights::ONE);
    has_weights.then(|| (0..10).map(of).collect())
}
