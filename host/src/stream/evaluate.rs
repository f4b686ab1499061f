//! Verdicts on sequences of rows: how often they are wrong, after how many rows, and what a fixed number of rows would give.

use super::settings::check_rows;
use super::{Rows, check, rows_of, taken};
use crate::compile;
use crate::error::Result;
use crate::evaluate::Finding;
use crate::evaluate::promise::at_least;
use crate::evidence::{self, Chip, Given, Outcome, Totals, Unit, best, chip, outcome};
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::format::{Per, Promise};
use palpate_trees::rows::{RowSequence, Sequences};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// The most numbers of rows at which fixed numbers and votes are compared.
const MOST_POINTS: usize = 60;
/// Thresholds between the strictest and the loosest of the curve of early stopping.
const THRESHOLDS: usize = 40;
/// The strictest and the loosest of them, in nats.
const CURVE: [f64; 2] = [14.0, 0.1];
/// The most rows of a sequence whose evidence is shown.
const MOST_SHOWN: usize = 200;

/// Settings of an evaluation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// The posterior at which to stop is 1 less this; `None` takes the model's own thresholds.
    pub error_rate: Option<f64>,
    /// Rows after which a sequence ends; `None` takes the model's own limit.
    pub max_rows: Option<u32>,
    /// A weight for each class, if not the model's priors.
    pub weights: Option<Vec<u32>>,
}

/// Results on sequences of rows; as JSON, `palpate rows evaluate --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluated {
    /// Sequences.
    pub sequences: usize,
    /// Groups that they belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<usize>,
    /// Rows of all sequences.
    pub rows: usize,
    /// Rows beside these that the model's guard refuses, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<usize>,
    /// Share of wrong ones among the names given, which a promise is about.
    pub error: f64,
    /// Share of all sequences that ended with a wrong name.
    pub wrong: f64,
    /// Share of all sequences that ended without a verdict.
    pub undecided: f64,
    /// Share of all sequences that ended as unknown.
    pub unknown: f64,
    /// Rows used on average.
    pub mean_rows: f64,
    /// The rows after which half of the sequences had ended.
    pub median_rows: usize,
    /// Check of the promise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub promise: Option<PromiseOfSequences>,
    /// These sequences with an equal number of rows for each.
    pub comparison: Comparison,
    /// The classes, in the model's order.
    pub names: Vec<String>,
    /// Number of sequences of each class (outer) that were given each name (inner), and last without one.
    pub confusion: Vec<Vec<usize>>,
    /// The evidence of one sequence as it grows.
    #[serde(skip)]
    pub grown: Option<Grown>,
}

/// A promise of a model, held against sequences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PromiseOfSequences {
    /// The promised error rate.
    pub promised: f64,
    /// Cases: "average", "name" or "object".
    pub per: &'static str,
    /// True if it is for new groups.
    pub groups: bool,
    /// The largest error rate that it is about: of all names, or of the worst name or class; each group weighing the same,
    /// if it is for groups.
    pub found: f64,
    /// The name or class with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// Result of a test of significance of that error rate: binomial, or for groups by their standard error.
    pub finding: Finding,
}

/// A number of rows, and the error rate with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Rows used on average.
    pub rows: f64,
    /// Share of wrong ones among the names given.
    pub error: f64,
    /// Share of the sequences that got a name.
    pub named: f64,
}

/// Early stopping against fixed numbers of rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Early stopping at thresholds from strict to loose.
    pub early: Vec<Point>,
    /// The class with the most evidence after a fixed number of rows; a sequence with fewer uses all.
    pub fixed: Vec<Point>,
    /// The class that most rows are recognized as, among as many.
    pub vote: Vec<Point>,
    /// The least fixed number of rows with which no more names are wrong than by the model's verdicts.
    pub fixed_rows: Option<f64>,
    /// The least such number for votes.
    pub vote_rows: Option<f64>,
}

/// A sequence's evidence, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    /// Its class.
    pub class: usize,
    /// The posterior of each class after each row.
    pub posteriors: Vec<Vec<f64>>,
    /// The row after which there was a verdict, and the name if one was given.
    pub ended: Option<(usize, Option<usize>)>,
    /// The share of the sequences with a name that took more rows; none if no name was given.
    pub longer: Option<f64>,
}

/// Measures a model on sequences of rows.
///
/// # Errors
/// For a model without classes of rows, and for rows of another number of features;
/// [`Kind::Setting`](crate::error::Kind::Setting) for settings out of their ranges.
pub fn evaluate(model: &Model<'_>, sequences: &Sequences, wanted: &Wanted) -> Result<Evaluated> {
    let rows = taken(model, sequences)?;
    let evaluated = measured(model, &Rows::new(model, &rows), &rows.sequences, wanted, true)?;
    Ok(Evaluated { refused: model.guard().map(|_| rows_of(sequences) - rows_of(&rows)), ..evaluated })
}

/// Like [`evaluate`], from margins that were computed before; without the comparison and a sequence's evidence unless it
/// `compares`.
pub(super) fn measured(
    model: &Model<'_>,
    rows: &Rows<'_>,
    sequences: &[RowSequence],
    wanted: &Wanted,
    compares: bool,
) -> Result<Evaluated> {
    check(model)?;
    check_rows(wanted.max_rows)?;
    let own = Stopping::from_model(model);
    let max_rows = wanted.max_rows.unwrap_or(own.max_touches());
    let stopping = match wanted.error_rate {
        Some(rate) => compile::stopping(rate, max_rows)?,
        None => own.with_max_touches(max_rows),
    };
    let run = Run { model, rows, weights: wanted.weights.as_deref() };
    let ends = run.ends(sequences, stopping);
    let mut names = compile::names(model);
    names.truncate(model.known_count());
    let mut confusion = vec![vec![0; names.len() + 1]; names.len()];
    for (sequence, end) in sequences.iter().zip(&ends) {
        confusion[sequence.class][end.recognized.unwrap_or(names.len())] += 1;
    }
    let totals = totals(sequences, &ends);
    let mut lengths: Vec<usize> = ends.iter().map(|end| end.touches).collect();
    lengths.sort_unstable();
    let groups: std::collections::BTreeSet<usize> = sequences.iter().filter_map(|sequence| sequence.group).collect();
    let is_own = wanted.error_rate.is_none() && wanted.weights.is_none() && max_rows == own.max_touches();
    Ok(Evaluated {
        sequences: sequences.len(),
        groups: (!groups.is_empty()).then_some(groups.len()),
        rows: sequences.iter().map(|sequence| sequence.rows.len()).sum(),
        refused: None,
        error: totals.error(),
        wrong: totals.share(totals.wrong),
        undecided: totals.share(totals.undecided()),
        unknown: totals.share(totals.unknown),
        mean_rows: totals.mean_touches(),
        median_rows: lengths.get(lengths.len() / 2).copied().unwrap_or(0),
        promise: model.promise().filter(|_| is_own).map(|promise| check_promise(&promise, sequences, &ends, &names)),
        comparison: if compares { run.compared(sequences, max_rows, totals.error()) } else { Comparison::default() },
        confusion,
        grown: if compares { run.grown(sequences, &ends, stopping) } else { None },
        names,
    })
}

fn totals(sequences: &[RowSequence], ends: &[Outcome]) -> Totals {
    Totals::of(sequences.iter().map(|sequence| sequence.class).zip(ends.iter().copied()))
}

/// Names, errors and rows of sequences.
fn point(sequences: &[RowSequence], ends: &[Outcome]) -> Point {
    let totals = totals(sequences, ends);
    Point { rows: totals.mean_touches(), error: totals.error(), named: totals.share(totals.given) }
}

/// Holds a promise against the ends of sequences.
fn check_promise(
    promise: &Promise,
    sequences: &[RowSequence],
    ends: &[Outcome],
    names: &[String],
) -> PromiseOfSequences {
    let outcome = |(number, (sequence, end)): (usize, (&RowSequence, &Outcome))| {
        (sequence.class, sequence.group.filter(|_| promise.groups).unwrap_or(number), *end)
    };
    let mut units = evidence::units(sequences.iter().zip(ends).enumerate().map(outcome), promise.per);
    let cases = if promise.per == Per::Average { 1 } else { names.len() };
    let found = (0..cases).map(|case| error(&units.remove(&case).unwrap_or_default(), promise));
    let found: Vec<(f64, f64)> = found.collect();
    let finding = |&(error, chance): &(f64, f64)| Finding::of_error(error, promise.rate, cases, || chance);
    let finding = Finding::of_each(found.iter().map(finding));
    let given = found.iter().enumerate().filter(|(_, (error, _))| !error.is_nan());
    let worst = given.max_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
    let (own, found) = worst.map_or((0, 0.0), |(own, (error, _))| (own, *error));
    let of = (promise.per != Per::Average).then(|| names.get(own).cloned()).flatten();
    PromiseOfSequences { promised: promise.rate, per: promise.per.name(), groups: promise.groups, found, of, finding }
}

/// The error rate of units that weigh the same, and the probability of one as high if the promise is just kept; not a
/// number if there is no name.
fn error(units: &BTreeMap<usize, Unit>, promise: &Promise) -> (f64, f64) {
    let sum = |of: &dyn Fn(&Unit) -> f64| units.values().map(|unit| of(unit) / unit.all).sum::<f64>();
    let (wrong, named) = (sum(&|unit| unit.wrong), sum(&|unit| unit.named));
    if named == 0.0 {
        return (f64::NAN, 1.0);
    }
    if !promise.groups {
        return (wrong / named, if wrong > 0.0 { at_least(wrong, named, promise.rate) } else { 1.0 });
    }
    // Of a ratio of means: its residuals, at the promised rate.
    let count = units.len() as f64;
    let residual = |unit: &Unit| unit.wrong - promise.rate * unit.named;
    let mean = sum(&residual) / count;
    let variance = units.values().map(|unit| (residual(unit) / unit.all - mean).powi(2)).sum::<f64>() / count;
    let errors = mean / (variance / count).sqrt().max(f64::MIN_POSITIVE);
    (wrong / named, 0.5 * libm::erfc(errors * std::f64::consts::FRAC_1_SQRT_2))
}

/// A model and rows.
struct Run<'r> {
    model: &'r Model<'r>,
    rows: &'r Rows<'r>,
    weights: Option<&'r [u32]>,
}

impl Run<'_> {
    fn chip(&self, stopping: Stopping) -> Box<Chip<'_>> {
        chip(self.model, stopping, self.weights)
    }

    /// Outcome of these rows, as one sequence.
    fn outcome(&self, rows: impl Iterator<Item = usize>, follower: &mut Chip<'_>) -> Outcome {
        let Ok(outcome) = outcome(&mut Given::new(rows.map(|row| Some(self.rows.row(row)))), follower);
        outcome
    }

    /// Verdicts on all sequences, as the chip gives them.
    fn ends(&self, sequences: &[RowSequence], stopping: Stopping) -> Vec<Outcome> {
        let chunk = |sequences: &[RowSequence]| -> Vec<Outcome> {
            let mut follower = self.chip(stopping);
            sequences.iter().map(|sequence| self.outcome(sequence.rows.clone(), &mut *follower)).collect()
        };
        sequences.par_chunks(64).map(chunk).collect::<Vec<_>>().concat()
    }

    /// The curves of early stopping, of fixed numbers of rows, and of votes.
    fn compared(&self, sequences: &[RowSequence], max_rows: u32, own: f64) -> Comparison {
        let [strict, loose] = CURVE;
        let thresholds = (0..THRESHOLDS).map(|step| strict - (strict - loose) * step as f64 / (THRESHOLDS - 1) as f64);
        let early = thresholds.map(|margin| {
            let stopping = Stopping::from_odds(crate::calibrate::odds_of(margin), max_rows);
            point(sequences, &self.ends(sequences, stopping))
        });
        let early = early.collect();
        let numbers = numbers(sequences, max_rows);
        let last = numbers.last().copied().unwrap_or(1);
        // For each number of rows whether the class with the most evidence, and that with the most rows, is wrong.
        let chunk = |sequences: &[RowSequence]| {
            let mut wrong = vec![(0_u64, 0_u64, 0_u64); last];
            let mut follower = self.chip(Stopping::from_odds(0, u32::MAX));
            for sequence in sequences {
                follower.reset();
                let mut votes = vec![0_u32; self.model.known_count()];
                let (mut by_evidence, mut by_vote, mut used) = (0, 0, 0);
                for count in 1..=last {
                    if let Some(row) = sequence.rows.clone().nth(count - 1).map(|row| self.rows.row(row)) {
                        follower.push(row);
                        by_evidence = follower.leader();
                        votes[best(&row[..self.model.known_count()])] += 1;
                        by_vote = best(&votes);
                        used = count;
                    }
                    let of = &mut wrong[count - 1];
                    of.0 += u64::from(by_evidence != sequence.class);
                    of.1 += u64::from(by_vote != sequence.class);
                    of.2 += used as u64;
                }
            }
            wrong
        };
        let add = |mut a: Vec<(u64, u64, u64)>, b: Vec<(u64, u64, u64)>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1, a.2 + b.2));
            a
        };
        let wrong = sequences.par_chunks(64).map(chunk).reduce(|| vec![(0, 0, 0); last], add);
        let all = sequences.len().max(1) as f64;
        let of = |(wrong, rows): (u64, u64)| Point { rows: rows as f64 / all, error: wrong as f64 / all, named: 1.0 };
        let fixed: Vec<Point> = wrong.iter().map(|of| (of.0, of.2)).map(of).collect();
        let vote: Vec<Point> = wrong.iter().map(|of| (of.1, of.2)).map(of).collect();
        let least = |points: &[Point]| points.iter().find(|point| point.error <= own).map(|point| point.rows);
        let (fixed_rows, vote_rows) = (least(&fixed), least(&vote));
        let shown = |points: Vec<Point>| numbers.iter().map(|number| points[number - 1]).collect();
        Comparison { early, fixed: shown(fixed), vote: shown(vote), fixed_rows, vote_rows }
    }

    /// A sequence with a name, if there is one: that at three quarters of these in the order of their rows.
    fn grown(&self, sequences: &[RowSequence], ends: &[Outcome], stopping: Stopping) -> Option<Grown> {
        let mut order: Vec<usize> = (0..ends.len()).filter(|&at| ends[at].recognized.is_some()).collect();
        order.sort_by_key(|&at| (ends[at].touches, at));
        let at = order.get(order.len() * 3 / 4).copied().or((!sequences.is_empty()).then_some(0))?;
        let sequence = &sequences[at];
        // A model has at most 256 classes.
        let mut recognizer = Recognizer::<256>::new(self.model, Stopping::from_odds(0, stopping.max_touches())).ok()?;
        // One of the weights is above 0, which whoever made them saw to; otherwise the priors stay.
        self.weights.iter().for_each(|weights| _ = recognizer.reset_to(weights));
        let mut posteriors = Vec::new();
        for row in sequence.rows.clone().take(MOST_SHOWN) {
            recognizer.push_margins(self.rows.row(row));
            posteriors.push((0..self.model.known_count()).map(|class| recognizer.posterior(class).to_f64()).collect());
        }
        let end = &ends[at];
        let ended = (end.recognized.is_some() || end.unknown).then_some((end.touches, end.recognized));
        let longer =
            order.iter().filter(|&&other| ends[other].touches > end.touches).count() as f64 / order.len() as f64;
        Some(Grown { class: sequence.class, posteriors, ended, longer: Some(longer).filter(|share| share.is_finite()) })
    }
}

/// Numbers of rows to compare: all up to the longest sequence or the limit, or [`MOST_POINTS`] of them.
fn numbers(sequences: &[RowSequence], max_rows: u32) -> Vec<usize> {
    let longest = sequences.iter().map(|sequence| sequence.rows.len()).max().unwrap_or(1).clamp(1, max_rows as usize);
    let mut numbers: Vec<usize> = if longest <= MOST_POINTS {
        (1..=longest).collect()
    } else {
        let of = |step: usize| (longest as f64).powf(step as f64 / (MOST_POINTS - 1) as f64).round() as usize;
        (0..MOST_POINTS).map(of).collect()
    };
    numbers.dedup();
    numbers
}
