//! Calibration: whether an object with a posterior of 90 % is the right one nine times in ten.

use super::context::{Context, compiled, compiled_f32};
use super::limit::Large;
use super::statistics::wilson;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Stroke, Svg};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::calibrate;
use palpate::compile::{self, Restated, restate};
use palpate::error::Result;
use palpate::evaluate::{Candidate, Confidence, Margins};
use palpate::wording::count;
use palpate_shared::format::{Tag, Temperature};
use plotters::style::RGBColor;
use serde::{Deserialize, Serialize};

/// Numbers of touches looked at.
const AT: [usize; 4] = [1, 5, 10, 20];
const BINS: usize = 10;
const METHODS: [&str; 3] = ["paper's method", "ours", "ours at its temperature"];

/// Calibration of the posteriors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Calibration {
    /// Groups per object.
    pub(super) groups: usize,
    /// Temperature of the last method, fitted on single touches.
    pub(super) temperature: f64,
    /// For each method, for each number of touches: bins.
    pub(super) bins: Vec<Vec<Vec<ReliabilityBin>>>,
    /// For each method, for each number of touches: expected calibration error.
    pub(super) error: Vec<Vec<f64>>,
}

/// A bin of a reliability diagram.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ReliabilityBin {
    /// Mean posterior of the best object.
    pub(super) posterior: f64,
    /// Share of verdicts that were right.
    pub(super) right: f64,
    /// Lower end of its 95 % interval.
    pub(super) low: f64,
    /// Upper end.
    pub(super) high: f64,
    /// Share of all verdicts that are in this bin.
    pub(super) share: f64,
}

/// Tests the first fold's models on the test touches of the large capture.
pub(super) fn measure(context: &Context, large: &Large) -> Result<Calibration> {
    let settings = context.settings;
    let models = context.models()?;
    let bytes = [compiled_f32(&models.paper)?.bytes, compiled(&models.ours)?.bytes];
    let [paper, ours] = [compile::open(&bytes[0])?, compile::open(&bytes[1])?];
    // On touches that neither the model was trained on nor the groups below are drawn from.
    let known: Vec<usize> = (0..ours.object_count()).collect();
    let temperature = calibrate::temperature(&ours, &large.held, &known);
    let stated = Temperature::new(temperature).unwrap_or(Temperature::ONE);
    let sections = vec![(Tag::Temperature, Some((false, stated.to_bytes().to_vec())))];
    let tempered = restate(&ours, &Restated { sections, ..Restated::default() })?;
    let tempered = compile::open(&tempered)?;
    let groups = settings.reliability_groups;
    let mut result = Calibration { groups, temperature, bins: Vec::new(), error: Vec::new() };
    for candidate in [&paper, &ours, &tempered].map(Candidate::Compiled) {
        context.check()?;
        let margins = Margins::new(candidate, &large.test)?;
        let bins = AT.iter().map(|&at| Ok(binned(&margins.confidences(at, groups, settings.seed)?)));
        let bins = bins.collect::<Result<Vec<_>>>()?;
        result.error.push(bins.iter().map(|bins| expected_error(bins)).collect());
        result.bins.push(bins);
    }
    Ok(result)
}

/// Verdicts gathered into bins of equal width; empty bins are left out.
fn binned(confidences: &[Confidence]) -> Vec<ReliabilityBin> {
    let mut sums = [(0.0, 0.0, 0.0); BINS];
    for confidence in confidences {
        let sum = &mut sums[((confidence.posterior * BINS as f64) as usize).min(BINS - 1)];
        sum.0 += 1.0;
        sum.1 += confidence.posterior;
        sum.2 += f64::from(u8::from(confidence.correct));
    }
    let filled = sums.into_iter().filter(|sum| sum.0 > 0.0);
    filled
        .map(|(count, posterior, right)| {
            let (low, high) = wilson(right, count);
            let share = count / confidences.len() as f64;
            ReliabilityBin { posterior: posterior / count, right: right / count, low, high, share }
        })
        .collect()
}

/// Naeini and others (2015): the mean distance between posterior and share right, over verdicts.
fn expected_error(bins: &[ReliabilityBin]) -> f64 {
    bins.iter().map(|bin| bin.share * (bin.posterior - bin.right).abs()).sum()
}

/// A reliability diagram: how often verdicts with about the same posterior are right. `bins` holds for each bin the mean
/// posterior, the share right, its 95 % interval, and the share of all verdicts in it.
///
/// # Errors
/// If the chart cannot be drawn.
fn reliability(title: &str, bins: &[ReliabilityBin], color: RGBColor) -> Result<Svg> {
    let mut chart = Chart::new("posterior of the best object", Axis::share(), "share right", Axis::share())
        .sized(280, 260)
        .titled(title);
    chart.marks.push(Mark::Line { points: vec![(0.0, 0.0), (1.0, 1.0)], color: color::GRAY, stroke: Stroke::Dashed });
    let spread = bins.iter().map(|bin| (bin.posterior, bin.low, bin.high)).collect();
    chart.marks.push(Mark::Spread { points: spread, color });
    let points: Vec<(f64, f64)> = bins.iter().map(|bin| (bin.posterior, bin.right)).collect();
    chart.marks.push(Mark::Line { points: points.clone(), color, stroke: Stroke::Thin });
    chart.marks.push(Mark::Dots { points, color, shape: Shape::Disc });
    for bin in bins {
        let half = 0.008;
        let (from, to) = ((bin.posterior - half, 0.0), (bin.posterior + half, 0.3 * bin.share));
        chart.marks.push(Mark::Box { from, to, color: color::GRAY, opacity: 0.6 });
    }
    chart.svg()
}

/// The figure and the table.
pub(super) fn section(context: &Context, calibration: &Calibration) -> Result<Section> {
    let mut section = Section::new("calibration", "Calibration");
    section.text(format!(
        "Calibration: of the objects with a posterior of 90 %, nine in ten should be right. {} groups per object from \
         the large capture, in {BINS} bins of the best object's posterior. Dividing the evidence by one temperature ({}, \
         fitted on single touches) changes no verdict, only the posterior that is shown; `palpate calibrate` stores it \
         in the model.",
        count(calibration.groups),
        crate::page::axis::number(calibration.temperature, 2)
    ));
    let mut panels = Vec::new();
    let mut data = Records::new(["method", "touches", "posterior", "right", "low", "high", "share of groups"]);
    for (method, name) in METHODS.iter().enumerate() {
        let color = if method == 0 { color::PAPER } else { color::OURS };
        for (index, at) in AT.iter().enumerate() {
            let bins = &calibration.bins[method][index];
            let touches = if *at == 1 { "touch" } else { "touches" };
            let short = ["paper", "ours", "ours, tempered"][method];
            panels.push(reliability(&format!("{short}, {at} {touches}"), bins, color)?);
            for bin in bins {
                let shares =
                    [bin.posterior, bin.right, bin.low, bin.high, bin.share].map(|value| Cell::Percent(value, 2));
                data.push([(*name).into(), Cell::count(*at)].into_iter().chain(shares));
            }
        }
    }
    section.figure(Figure {
        id: "reliability".into(),
        title: "Reliability diagrams".into(),
        caption:
            "On the dashed line the posterior equals the accuracy; above it the model is underconfident, below it \
                  overconfident. Bars are 95 % intervals (Wilson); gray columns show how many of the groups are in \
                  each bin."
                .into(),
        command: context.settings.command.clone(),
        panels,
        data,
    });
    let mut data = Records::new(
        std::iter::once("method".to_string())
            .chain(AT.iter().map(|at| format!("after {at} {}", if *at == 1 { "touch" } else { "touches" }))),
    );
    for (method, name) in METHODS.iter().enumerate() {
        let errors = calibration.error[method].iter().map(|&error| Cell::Percent(error, 2));
        data.push(std::iter::once((*name).into()).chain(errors));
    }
    section.table(Table {
        id: "calibration".into(),
        title: "Expected calibration error".into(),
        caption: format!("The mean distance between posterior and accuracy, over {BINS} bins of equal width."),
        command: context.settings.command.clone(),
        data,
    });
    Ok(section)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn posteriors_equal_to_the_share_right_have_no_error() {
        let confidences: Vec<Confidence> =
            (0..1000).map(|k| Confidence { posterior: 0.75, correct: k % 4 != 0 }).collect();
        let bins = binned(&confidences);
        assert_eq!(bins.len(), 1);
        assert!(expected_error(&bins) < 1e-9 && bins[0].low < 0.75 && bins[0].high > 0.75);
        let sure: Vec<Confidence> = (0..10).map(|k| Confidence { posterior: 1.0, correct: k % 2 == 0 }).collect();
        assert!((expected_error(&binned(&sure)) - 0.5).abs() < 1e-9);
    }
}
