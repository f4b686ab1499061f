//! Evidence of a row, and weights of rows that resemble each other: found on sequences that no promise rests on.

use super::Rows;
use crate::calibrate::{Gain, Lead, Odds, Sequence, odds_of};
use crate::compile::{Restated, restate};
use crate::error::Result;
use crate::evidence::{best, totals};
#[cfg(feature = "train")]
use crate::strangers;
use palpate_onboard::Model;
use palpate_shared::format::{RowEvidence, Shifts, Tag, Weights};
use palpate_trees::rows::RowSequence;
use rayon::prelude::*;

/// The most rows that a table is fitted to.
const MOST_ROWS: usize = 10_000;
/// A table has more than half as many steps, and at most as many.
const MOST_STEPS: u32 = 64;
/// The share of margins below the first value of a table, and above the last.
const BEYOND: f64 = 1e-3;
/// Steps of the descent that fits a table.
const DESCENT: usize = 150;
/// Sequences that must be as long for a weight of their number of rows.
const LEAST_SEQUENCES: usize = 20;
/// Halvings of the range of the logarithm of a weight.
const HALVINGS: usize = 20;
/// The least weight.
const LEAST_WEIGHT: f64 = 1e-3;
/// Beyond this margin, in nats, a threshold is not stored precisely.
pub(super) const STRICTEST: f64 = 36.0;
/// Beyond this margin a threshold is too near to the strictest: a walk that begins there has no room.
const ROOM: f64 = 24.0;
/// Between two thresholds that are compared, in nats.
const STEP: f64 = 0.05;

/// A table from a margin to evidence, in nats.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// The margin of the first value, in units.
    start: i32,
    /// Between two values, a power of two of units.
    step_shift: u8,
    values: Vec<f64>,
}

/// Changes to margins before they are compared with a threshold.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shape {
    pub(super) table: Option<Table>,
    /// By [`Weights::position`].
    pub(super) weights: Option<Vec<f64>>,
}

/// A fitted shape, and what its parts save.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fitted {
    pub(super) shape: Shape,
    pub(super) table: Option<Gain>,
    pub(super) weights: Option<Gain>,
}

impl Table {
    /// The section that stores it, for margins of a unit in nats.
    pub(super) fn section(&self, unit: f64) -> Vec<u8> {
        let most = self.values.last().copied().unwrap_or(0.0).max(unit) / unit;
        // The bits by which a value is coarser than a unit: as many as can be are those between two values.
        let coarser = (0..Shifts::MOST_SCALE).find(|bits| (most / f64::from(*bits).exp2()).round() <= 255.0);
        let coarser = coarser.unwrap_or(Shifts::MOST_SCALE);
        let between = coarser.min(self.step_shift).min(Shifts::MOST_BETWEEN);
        let shifts = Shifts { dropped: self.step_shift - between, between, scale: coarser - between };
        let stored = |value: &f64| (value / unit / f64::from(coarser).exp2()).round().clamp(0.0, 255.0) as u8;
        let values: Vec<u8> = self.values.iter().map(stored).collect();
        let mut section = Vec::new();
        RowEvidence::write(self.start, shifts, &values, &mut |part| section.extend_from_slice(part));
        section
    }

    /// The position among the values, and how far it is from there to the next one.
    fn place(&self, margin: i32) -> (usize, f64) {
        let beyond = (i64::from(margin) - i64::from(self.start)).max(0);
        let at = (beyond >> self.step_shift) as usize;
        let last = self.values.len() - 1;
        if at >= last {
            return (last - 1, 1.0);
        }
        (at, (beyond & ((1 << self.step_shift) - 1)) as f64 / f64::from(self.step_shift).exp2())
    }

    fn of(&self, margin: i32) -> f64 {
        let (at, rest) = self.place(margin);
        self.values[at] + (self.values[at + 1] - self.values[at]) * rest
    }

    /// The table with which a softmax of a row's evidence explains the classes best: the least mean of −log of the right
    /// class's share, classes and sequences weighing the same. Values rise; where no margin is they stay the same. None if
    /// all margins are equal.
    pub(super) fn fit(rows: &Rows<'_>, sequences: &[&RowSequence]) -> Option<Self> {
        let objects = rows.objects;
        let cases = cases(rows, sequences);
        let mut all: Vec<i32> = cases.iter().flat_map(|case| rows.row(case.row).iter().copied()).collect();
        all.sort_unstable();
        let quantile = |share: f64| all.get((all.len() as f64 * share) as usize).or(all.last()).copied();
        let (low, high) = (quantile(BEYOND)?, quantile(1.0 - BEYOND)?);
        let range = high.checked_sub(low).filter(|range| *range > 0)?.cast_unsigned();
        let step_shift = (0..=Shifts::MOST_STEP).find(|shift| range >> shift < MOST_STEPS)?;
        let steps = (range >> step_shift) as usize + 1;
        let mut table = Self { start: low, step_shift, values: vec![0.0; steps + 1] };
        let places: Vec<(usize, f64)> =
            cases.iter().flat_map(|case| rows.row(case.row)).map(|&margin| table.place(margin)).collect();
        let fit = Descent { places: &places, cases: &cases, objects };
        let rises = fit.run(steps);
        for (at, rise) in rises.iter().enumerate() {
            table.values[at + 1] = table.values[at] + rise;
        }
        (table.values[steps] > 0.0).then_some(table)
    }
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

/// The rises between a table's values, by accelerated projected descent (Beck and Teboulle, 2009), with restarts.
struct Descent<'d> {
    places: &'d [(usize, f64)],
    cases: &'d [Case],
    objects: usize,
}

impl Descent<'_> {
    fn run(&self, steps: usize) -> Vec<f64> {
        let mut rises = vec![4.0 / steps as f64; steps];
        let (mut ahead, mut momentum, mut length) = (rises.clone(), 1.0_f64, 1.0);
        let mut gradient = vec![0.0; steps];
        let mut last = f64::INFINITY;
        for _ in 0..DESCENT {
            let value = self.loss(&ahead, Some(&mut gradient));
            let next = loop {
                let next: Vec<f64> =
                    ahead.iter().zip(&gradient).map(|(at, slope)| (at - length * slope).max(0.0)).collect();
                let moved = next.iter().zip(&ahead).map(|(next, at)| next - at);
                let (mut along, mut squares) = (0.0, 0.0);
                moved.zip(&gradient).for_each(|(moved, slope)| {
                    along += moved * slope;
                    squares += moved * moved;
                });
                if length < 1e-6 || self.loss(&next, None) <= value + along + squares / (2.0 * length) {
                    break next;
                }
                length *= 0.5;
            };
            length *= 1.2;
            let own = self.loss(&next, None);
            let following = (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) / 2.0;
            let factor = if own > last { 0.0 } else { (momentum - 1.0) / following };
            momentum = if own > last { 1.0 } else { following };
            ahead = next.iter().zip(&rises).map(|(next, before)| (next + factor * (next - before)).max(0.0)).collect();
            if (last - own).abs() < 1e-9 {
                return next;
            }
            (rises, last) = (next, own);
        }
        rises
    }

    /// The mean of −log of the right class's share, and a little for each rise, which keeps them finite.
    fn loss(&self, rises: &[f64], gradient: Option<&mut Vec<f64>>) -> f64 {
        let ridge = 0.5 / self.cases.len() as f64;
        let mut below = Vec::with_capacity(rises.len());
        let mut sum = 0.0;
        rises.iter().for_each(|rise| {
            below.push(sum);
            sum += rise;
        });
        // Slopes of the rises that a margin lies within, and of those below it.
        let (mut within, mut whole) = (vec![0.0; rises.len()], vec![0.0; rises.len()]);
        let mut shares = vec![0.0; self.objects];
        let mut loss = 0.0;
        for (case, places) in self.cases.iter().zip(self.places.chunks_exact(self.objects)) {
            let mut most = f64::NEG_INFINITY;
            for (share, (at, rest)) in shares.iter_mut().zip(places) {
                *share = below[*at] + rises[*at] * rest;
                most = most.max(*share);
            }
            let own = shares[case.class];
            let total: f64 = shares.iter_mut().fold(0.0, |total, share| {
                *share = (*share - most).exp();
                total + *share
            });
            loss += case.weight * (total.ln() + most - own);
            if gradient.is_some() {
                for (object, (share, (at, rest))) in shares.iter().zip(places).enumerate() {
                    let slope = case.weight * (share / total - f64::from(u8::from(object == case.class)));
                    within[*at] += slope * rest;
                    whole[*at] += slope;
                }
            }
        }
        if let Some(gradient) = gradient {
            let mut above = 0.0;
            for at in (0..rises.len()).rev() {
                gradient[at] = within[at] + above + 2.0 * ridge * rises[at];
                above += whole[at];
            }
        }
        loss + ridge * rises.iter().map(|rise| rise * rise).sum::<f64>()
    }
}

/// Evidence of a sequence after each row, for each class, in nats.
fn sums(rows: &Rows<'_>, sequence: &RowSequence, table: Option<&Table>, mut see: impl FnMut(u32, &[f64]) -> bool) {
    let mut sums = rows.priors.clone();
    for (count, row) in (1..).zip(sequence.rows.clone()) {
        for (sum, &margin) in sums.iter_mut().zip(rows.row(row)) {
            *sum += table.map_or_else(|| f64::from(margin) * rows.unit, |table| table.of(margin));
        }
        if !see(count, &sums) {
            return;
        }
    }
}

/// The weight at which posteriors after each number of rows explain the classes best, by [`Weights::position`]: falling,
/// as rows that resemble each other add less and less.
fn fit_weights(rows: &Rows<'_>, sequences: &[&RowSequence], table: Option<&Table>, max_rows: u32) -> Vec<f64> {
    let longest = sequences.iter().map(|sequence| sequence.rows.len()).max().unwrap_or(1).min(max_rows as usize);
    let positions = Weights::position(longest as u32) + 1;
    // For each position evidence less that for the right class, one after the other: of the last row at it.
    let seen: Vec<Vec<Vec<f64>>> = sequences
        .par_iter()
        .map(|sequence| {
            let mut of: Vec<Vec<f64>> = vec![Vec::new(); positions];
            sums(rows, sequence, table, |count, sums| {
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
        let cases: Vec<&[f64]> =
            seen.iter().map(|of| of[position].as_slice()).filter(|case| !case.is_empty()).collect();
        if cases.len() >= LEAST_SEQUENCES {
            before = best_weight(&cases).min(before);
        }
        weights.push(before);
    }
    weights
}

/// The weight with the greatest likelihood, up to 1.
fn best_weight(cases: &[&[f64]]) -> f64 {
    // The likelihood is concave in the weight; its slope is minus the mean lead over the right class.
    let slope = |weight: f64| -> f64 {
        let ahead = |case: &&[f64]| {
            let most = case.iter().copied().fold(0.0, f64::max);
            let (sum, total) = case.iter().fold((0.0, 0.0), |(sum, total), ahead| {
                let share = (weight * (ahead - most)).exp();
                (sum + share * ahead, total + share)
            });
            -sum / total
        };
        cases.iter().map(ahead).sum()
    };
    if slope(1.0) >= 0.0 {
        return 1.0;
    }
    let (mut low, mut high) = (LEAST_WEIGHT.ln(), 0.0);
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
        sums(rows, sequence, shape.table.as_ref(), |count, sums| {
            let weight = shape
                .weights
                .as_ref()
                .and_then(|weights| weights.get(Weights::position(count)).or(weights.last()).copied());
            let weight = weight.unwrap_or(1.0);
            let known = sums.get(..rows.known).unwrap_or(sums);
            let best = best(known);
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

/// Fits a table and weights to sequences, and keeps what saves rows: each is compared on the half of them that it was not
/// fitted to.
pub(super) fn fit(rows: &Rows<'_>, sequences: &[&RowSequence], rate: f64, max_rows: u32) -> Fitted {
    let mut fitted = Fitted { shape: Shape::default(), table: None, weights: None };
    if sequences.len() < 2 * LEAST_SEQUENCES {
        return fitted;
    }
    let halves = sequences.split_at(sequences.len() / 2);
    let folds = [(halves.0, halves.1), (halves.1, halves.0)];
    let measured = |shape: &dyn Fn(&[&RowSequence]) -> Shape| {
        let of = folds.iter().flat_map(|(fit, test)| followed(rows, test, &shape(fit), max_rows));
        rows_at(&of.collect::<Vec<_>>(), rate)
    };
    let tables = folds.map(|(fit, _)| Table::fit(rows, fit));
    let table_of = |fit: &[&RowSequence]| tables[usize::from(!std::ptr::eq(fit, halves.0))].clone();
    let weights_of = |fit: &[&RowSequence], table: Option<Table>| {
        let weights = Some(fit_weights(rows, fit, table.as_ref(), max_rows));
        Shape { table, weights }
    };
    let without = measured(&|_| Shape::default());
    let with_weights = measured(&|fit| weights_of(fit, None));
    let table = measured(&|fit| Shape { table: table_of(fit), weights: None });
    let both = measured(&|fit| weights_of(fit, table_of(fit)));
    // Each part has to save by itself what it costs, whatever the other does.
    let best = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
    let of_table = Gain::new(best(without, with_weights), best(table, both));
    let of_weights = if of_table.kept { Gain::new(table, both) } else { Gain::new(without, with_weights) };
    let table = of_table.kept.then(|| Table::fit(rows, sequences)).flatten();
    let weights = of_weights.kept.then(|| fit_weights(rows, sequences, table.as_ref(), max_rows));
    fitted.shape = Shape { table, weights };
    (fitted.table, fitted.weights) = (Some(of_table), Some(of_weights));
    fitted
}

/// The model with what a row adds and how much rows count together, and without what an earlier calibration stated.
pub(super) fn shaped(model: &Model<'_>, fitted: &Fitted, max_rows: u32) -> Result<Vec<u8>> {
    let unit = f64::from(model.unit());
    let shape = &fitted.shape;
    let sections = vec![
        (Tag::Weights, shape.weights.as_ref().map(|weights| (true, weights_section(weights)))),
        (Tag::RowEvidence, shape.table.as_ref().map(|table| (true, table.section(unit)))),
        (Tag::ThresholdsByObject, None),
        (Tag::Promise, None),
        (Tag::Temperature, None),
    ];
    let restated = Restated { max_touches: Some(max_rows), sections, ..Restated::default() };
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
