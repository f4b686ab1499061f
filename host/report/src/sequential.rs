//! Sequential recognition: how many touches it takes to be sure, and how often the verdict is wrong.

use super::context::{Context, compiled, compiled_f32};
use super::limit::Large;
use super::run_page::method_style;
use super::statistics::quantile;
use crate::page::axis::{Axis, number};
use crate::page::chart::{Chart, Mark, Stroke};
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::compile;
use palpate::error::Result;
use palpate::evaluate::{Candidate, Margins, SequentialSettings};
use palpate::wording;
use serde::{Deserialize, Serialize};

/// Thresholds: the recognizer stops when the posterior exceeds 1 minus one of these.
const RATES: [f64; 13] = [0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01, 0.005, 0.003, 0.002, 0.001];
/// Touches after which a sequence gives up: enough that hardly any does.
const MOST: usize = 1_000;
/// The threshold whose distributions are drawn.
const DRAWN: f64 = 0.01;

/// The methods, in the order of [`Sequences::methods`].
pub(super) const METHODS: [&str; 2] = ["paper", "ours"];

/// Results of sequences.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Sequences {
    /// Sequences per object.
    pub(super) count: usize,
    /// Touches after which a sequence gave up.
    most: usize,
    /// For each of [`METHODS`], for each threshold.
    pub(super) methods: Vec<Vec<Stopped>>,
    /// For each of [`METHODS`]: the touches used by each sequence of each object at [`DRAWN`].
    pub(super) used: Vec<Vec<Vec<usize>>>,
}

/// The results for one threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Stopped {
    /// The threshold.
    pub(super) rate: f64,
    /// Mean touches used.
    pub(super) touches: f64,
    /// Its standard error.
    pub(super) touches_error: f64,
    /// Share of sequences that were wrong, or gave up.
    pub(super) error: f64,
    /// Share of sequences that gave up.
    pub(super) undecided: f64,
    /// Its standard error.
    pub(super) error_error: f64,
    /// The fixed number of touches that is wrong no more often, if one up to the longest group is.
    pub(super) fixed: Option<usize>,
}

impl Stopped {
    /// Number of touches of a fixed-length sequence, divided by ours.
    pub(super) fn ratio(&self) -> Option<f64> {
        self.fixed.map(|fixed| fixed as f64 / self.touches)
    }
}

/// Tests the first fold's models on the test touches of the large capture.
pub(super) fn measure(context: &Context, large: &Large) -> Result<Sequences> {
    let settings = context.settings;
    let models = context.models()?;
    let bytes = [compiled_f32(&models.paper)?.bytes, compiled(&models.ours)?.bytes];
    let [paper, ours] = [compile::open(&bytes[0])?, compile::open(&bytes[1])?];
    let count = settings.sequences;
    let mut result = Sequences { count, most: MOST, methods: Vec::new(), used: Vec::new() };
    for candidate in [Candidate::Compiled(&paper), Candidate::Compiled(&ours)] {
        let margins = Margins::new(candidate, &large.test)?;
        let most = MOST.min(margins.fewest_touches());
        result.most = most;
        let curve = margins.curve(most, count, settings.seed.wrapping_add(1))?;
        let mut stopped = Vec::new();
        for rate in RATES {
            context.check()?;
            let sequential = margins.sequential(&SequentialSettings {
                error_rate: Some(rate),
                max_touches: u32::try_from(most).ok(),
                sequences: count,
                seed: settings.seed,
            })?;
            let error = sequential.error + sequential.undecided;
            stopped.push(Stopped {
                rate,
                touches: sequential.mean_touches,
                touches_error: sequential.mean().standard_error,
                error,
                undecided: sequential.undecided,
                error_error: sequential.error_standard_error,
                fixed: curve.touches_to_error(error),
            });
            if rate == DRAWN {
                let used = sequential.outcomes.iter().map(|of| of.iter().map(|outcome| outcome.touches).collect());
                result.used.push(used.collect());
            }
        }
        result.methods.push(stopped);
    }
    Ok(result)
}

/// The figures and the table.
pub(super) fn section(context: &Context, sequences: &Sequences) -> Result<Section> {
    let mut section = Section::new("sequential", "Stopping when sure");
    section.text(format!(
        "The recognizer stops as soon as the posterior of an object exceeds 1 − threshold. {} sequences of each \
         object's touches, from the large capture that no model was trained on; a sequence of {} touches without a \
         verdict counts as an error. It is compared with the fixed number of touches that makes no more errors.",
        wording::count(sequences.count),
        wording::count(sequences.most)
    ));
    section.figure(trade(context, sequences)?);
    section.table(table(context, sequences));
    section.figure(distributions(context, sequences)?);
    Ok(section)
}

fn trade(context: &Context, sequences: &Sequences) -> Result<Figure> {
    let points = || sequences.methods.iter().flatten();
    let low = points().map(|stopped| stopped.error).filter(|error| *error > 0.0).fold(0.1, f64::min);
    let far = points().map(|s| s.fixed.map_or(s.touches, |fixed| fixed as f64)).fold(10.0, f64::max);
    let near = points().map(|s| s.touches).fold(far, f64::min);
    let ticks = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001];
    let ticks = ticks.into_iter().filter(|tick| *tick >= low * 0.9);
    let errors = Axis::logarithmic(low * 0.9, 0.5)
        .with_ticks(ticks.map(|tick| (tick, format!("{} %", crate::page::axis::short_number(tick * 100.0)))).collect());
    let mut chart =
        Chart::new("mean touches", Axis::logarithmic(near * 0.9, far * 1.1), "errors", errors).sized(660, 420);
    let mut data =
        Records::new(["method", "threshold", "mean touches", "errors", "fixed number with no more errors", "ratio"]);
    for (index, name) in METHODS.iter().enumerate() {
        let (color, shape) = method_style(index);
        let stopped = &sequences.methods[index];
        let sure: Vec<(f64, f64)> = stopped.iter().filter(|s| s.error > 0.0).map(|s| (s.touches, s.error)).collect();
        let fixed = stopped.iter().filter(|s| s.error > 0.0).filter_map(|s| Some((s.fixed? as f64, s.error)));
        let fixed: Vec<(f64, f64)> = fixed.collect();
        let bars = stopped.iter().filter(|s| s.error > 0.0).map(|s| {
            let (low, high) = super::statistics::wilson(
                s.error * (sequences.count * context.objects.len()) as f64,
                (sequences.count * context.objects.len()) as f64,
            );
            (s.touches, low, high)
        });
        chart.marks.push(Mark::Spread { points: bars.collect(), color });
        chart.marks.push(Mark::Line { points: sure.clone(), color, stroke: Stroke::Solid });
        chart.marks.push(Mark::Dots { points: sure.clone(), color, shape });
        chart.marks.push(Mark::Line { points: fixed.clone(), color, stroke: Stroke::Dashed });
        chart.legend(format!("{name}, when sure"), color, Some(Stroke::Solid), Some(shape));
        if !fixed.is_empty() {
            chart.legend(format!("{name}, fixed number"), color, Some(Stroke::Dashed), None);
        }
        for s in stopped {
            data.push([
                (*name).into(),
                Cell::Number(s.rate, 3),
                Cell::Spread(s.touches, s.touches_error, 1),
                Cell::PercentSpread(s.error, s.error_error, 2),
                s.fixed.map_or(Cell::Missing, Cell::count),
                s.ratio().map_or(Cell::Missing, |ratio| Cell::Number(ratio, 2)),
            ]);
        }
    }
    Ok(Figure {
        id: "sequential-trade".into(),
        title: format!("Errors against touches, for thresholds from {} to {}", RATES[0], RATES[RATES.len() - 1]),
        caption:
            "Both axes are logarithmic. Solid: stopping when sure; dashed: a fixed number. Bars are 95 % intervals \
                  (Wilson)."
                .into(),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}

fn table(context: &Context, sequences: &Sequences) -> Table {
    let mut data = Records::new([
        "threshold",
        "paper: touches",
        "paper: errors",
        "paper: undecided",
        "paper: fixed",
        "paper: fixed ÷ sure",
        "ours: touches",
        "ours: errors",
        "ours: undecided",
        "ours: fixed",
        "ours: fixed ÷ sure",
    ]);
    for (index, rate) in RATES.iter().enumerate() {
        let cells = sequences.methods.iter().flat_map(|method| {
            let s = &method[index];
            [
                Cell::Spread(s.touches, s.touches_error, 1),
                Cell::PercentSpread(s.error, s.error_error, 2),
                Cell::Percent(s.undecided, 2),
                s.fixed.map_or(Cell::Missing, Cell::count),
                s.ratio().map_or(Cell::Missing, |ratio| Cell::Number(ratio, 2)),
            ]
        });
        data.push(std::iter::once(Cell::Number(*rate, 3)).chain(cells));
    }
    Table {
        id: "sequential".into(),
        title: "Thresholds".into(),
        caption: format!(
            "Errors include undecided sequences. {} ± is one standard error; a dash (–) means that no fixed number up to the \
             longest group makes as few errors.",
            above_thresholds(&sequences.methods)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

/// Thresholds at which each method errs more often than they say, as a sentence for each.
fn above_thresholds(methods: &[Vec<Stopped>]) -> String {
    let of = |(name, stopped): (&str, &Vec<Stopped>)| {
        let above: Vec<&Stopped> = stopped.iter().filter(|of| of.error > of.rate).collect();
        let times = |of: &&&Stopped| of.error / of.rate;
        match above.iter().max_by(|a, b| times(a).total_cmp(&times(b))) {
            None => format!("Of {name} they are at most the threshold at all {} of these.", stopped.len()),
            Some(worst) => format!(
                "Of {name} they are above the threshold at {} of {}, at {} by a factor of {}.",
                above.len(),
                stopped.len(),
                worst.rate,
                number(times(&worst), 1)
            ),
        }
    };
    let names = METHODS.map(|name| if name == METHODS[0] { "the paper's method" } else { name });
    names.into_iter().zip(methods).map(of).collect::<Vec<_>>().join(" ")
}

fn distributions(context: &Context, sequences: &Sequences) -> Result<Figure> {
    let names = context.names();
    let mut data = Records::new(["method", "object", "touches used", "share of sequences"]);
    let far = sequences.used.iter().flatten().map(|used| quantile(&floats(used), 0.98)).fold(10.0, f64::max);
    let width = (far / 30.0).ceil().max(1.0) as usize;
    let mut panels = Vec::new();
    let top = {
        let share = |used: &Vec<usize>| binned(used, width, 30).into_iter().fold(0.0, f64::max);
        sequences.used.iter().flatten().map(share).fold(0.05, f64::max)
    };
    for (position, name) in names.iter().enumerate() {
        let mut chart = Chart::new("touches", Axis::linear(0.0, (30 * width) as f64, 4), "", Axis::percent(0.0, top))
            .sized(280, 190)
            .titled(name.as_str());
        for (index, method) in METHODS.iter().enumerate() {
            let (color, _) = method_style(index);
            let used = &sequences.used[index][position];
            let mean = floats(used).iter().sum::<f64>() / used.len().max(1) as f64;
            let mut outline = vec![(0.0, 0.0)];
            for (bin, share) in binned(used, width, 30).into_iter().enumerate() {
                let (from, to) = ((bin * width) as f64, ((bin + 1) * width) as f64);
                outline.extend([(from, share), (to, share)]);
                data.push([(*method).into(), name.as_str().into(), Cell::count(bin * width), Cell::Percent(share, 2)]);
            }
            chart.marks.push(Mark::Area { points: outline.clone(), base: 0.0, color, opacity: 0.15 });
            chart.marks.push(Mark::Line { points: outline, color, stroke: Stroke::Thin });
            chart.legend(format!("{method}: {}", number(mean, 1)), color, Some(Stroke::Thin), None);
        }
        panels.push(chart.svg()?);
    }
    Ok(Figure {
        id: "sequential-objects".into(),
        title: format!("Touches used until sure, threshold {DRAWN}"),
        caption: format!("Share of sequences in bins of {width} touches; beside the method's name, its mean."),
        command: context.settings.command.clone(),
        panels,
        data,
    })
}

fn floats(values: &[usize]) -> Vec<f64> {
    values.iter().map(|&value| value as f64).collect()
}

/// Shares of values in bins of a width; what lies beyond the last bin is left out.
fn binned(values: &[usize], width: usize, bins: usize) -> Vec<f64> {
    let mut shares = vec![0.0; bins];
    for value in values {
        // A sequence uses at least one touch, so the first bin holds 1 to `width`.
        if let Some(share) = shares.get_mut(value.saturating_sub(1) / width.max(1)) {
            *share += 1.0 / values.len() as f64;
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_compared_with_the_thresholds_and_not_supposed_to_be_below() {
        let stopped = |rate: f64, error: f64| Stopped {
            rate,
            touches: 1.0,
            touches_error: 0.0,
            error,
            undecided: 0.0,
            error_error: 0.0,
            fixed: None,
        };
        let said = above_thresholds(&[
            vec![stopped(0.1, 0.09), stopped(0.01, 0.043), stopped(0.001, 0.002)],
            vec![stopped(0.1, 0.02), stopped(0.01, 0.01), stopped(0.001, 0.0)],
        ]);
        assert_eq!(
            said,
            "Of the paper's method they are above the threshold at 2 of 3, at 0.01 by a factor of 4.3. Of ours they are at most the \
             threshold at all 3 of these."
        );
    }

    #[test]
    fn bins_hold_shares_and_start_at_one_touch() {
        assert_eq!(binned(&[1, 2, 3, 4, 99, 1, 2, 3], 2, 3), [0.5, 0.375, 0.0]);
    }
}
