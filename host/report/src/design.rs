//! The page of a search for a probe: what it costs in approaches to build another one.

use crate::page::axis::{Axis, number};
use crate::page::chart::{Chart, Mark, Shape, Stroke, Svg};
use crate::page::color;
use crate::page::document::{Figure, Page, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::error::Result;
use palpate::probe::approach::Aim;
use palpate::tune::probe::{Design, Trial};
use palpate::wording::{count, rate};
use palpate_shared::format::Length;

/// The page. `command` is what remakes it.
///
/// # Errors
/// If a chart cannot be drawn.
pub fn page(design: &Design, command: &str) -> Result<Page> {
    let mut result = Section::new("result", "The result");
    result.text(assumed(design)).table(compared(design, command)).table(by_aim(design, command));
    let mut trade = Section::new("spacing", "Cost of another spacing");
    trade.figure(by_spacing(design, command)?);
    let mut strokes = Section::new("stroke", "Cost of a shorter stroke");
    strokes.figure(by_stroke(design, command)?);
    let mut tried = Section::new("tried", "What was tried");
    tried.table(rounds(design, command));
    Ok(Page {
        title: "The best probe to build".into(),
        summary: format!(
            "{}: {} approaches to {} errors, compared with {} with {}. {}",
            described(&design.best),
            approaches(&design.best),
            rate(design.error_rate),
            approaches(&design.published),
            published(design).to_lowercase(),
            match design.unit {
                Length::Tenth => "Lengths are in units: tenths of the object's longest side.",
                Length::Millimeter => "Lengths are in millimeters: objects have their true sizes.",
            }
        ),
        sections: vec![result, trade, strokes, tried],
        facts: vec![("Command".into(), command.into()), ("palpate".into(), env!("CARGO_PKG_VERSION").into())],
        files: false,
    })
}

/// Unit of lengths.
pub fn unit(design: &Design) -> &'static str {
    match design.unit {
        Length::Tenth => "units",
        Length::Millimeter => "millimeters",
    }
}

/// The probe that the best one is compared with.
pub fn published(design: &Design) -> &'static str {
    match design.unit {
        Length::Tenth => "The published probe",
        Length::Millimeter => "The published probe in millimeters, scaled to the median object",
    }
}

/// A probe in a few words.
pub fn described(trial: &Trial) -> String {
    let probe = trial.probe;
    format!(
        "Spacing {}, radius {}, tilt ±{}°, aimed at the {}",
        probe.spacing,
        probe.radius,
        probe.tilt,
        match trial.aim.name() {
            "mass" => "center of mass",
            other => other,
        }
    )
}

/// The approaches, and whether they were enough.
fn approaches(trial: &Trial) -> String {
    if trial.reached {
        number(trial.approaches, 1)
    } else {
        let [error, undecided] = [trial.error, trial.undecided].map(|share| number(100.0 * share, 1));
        format!("more than {} ({error} % wrong, {undecided} % undecided)", number(trial.approaches, 0))
    }
}

/// Assumptions behind the figures.
fn assumed(design: &Design) -> String {
    format!(
        "Every probe touched the objects {} times each in the simulator at {} {} per second, with Gaussian noise of {} \
         ms on every contact time. A model of the descriptor {} was trained on these approaches and tested on as many \
         others; {} count as evidence. The stopping rule was varied until {} of the verdicts on the test approaches \
         were wrong.",
        count(design.best.trained_on),
        design.best.probe.speed,
        unit(design),
        design.noise / 1e3,
        design.descriptor,
        match design.counted {
            "full" => "touches with all three fingers",
            "contacts" => "approaches with at least one contact",
            _ => "all approaches, also those that touched nothing",
        },
        rate(design.error_rate),
    )
}

/// Names of the rounds of the search.
const ROUNDS: [&str; 3] = ["coarse", "finer", "last"];

/// Columns of a table of trials.
const COLUMNS: [&str; 14] = [
    "round",
    "spacing",
    "radius",
    "tilt (°)",
    "aim",
    "approaches",
    "errors",
    "undecided",
    "none",
    "outer",
    "middle",
    "outer and middle",
    "both outer",
    "all",
];

/// A trial as a row of such a table.
fn row(name: &str, trial: &Trial) -> Vec<Cell> {
    let probe = trial.probe;
    let approaches = Cell::Spread(trial.approaches, trial.approaches_standard_error, 1);
    let mut row = vec![name.into(), Cell::Number(probe.spacing, 2), Cell::Number(probe.radius, 2)];
    row.extend([Cell::Number(probe.tilt, 0), trial.aim.name().into(), approaches, Cell::Percent(trial.error, 2)]);
    row.push(Cell::Percent(trial.undecided, 2));
    row.extend(COLUMNS[8..].iter().map(|pattern| match trial.patterns.get(pattern) {
        Some(&share) => Cell::Percent(share, 1),
        None => Cell::Missing,
    }));
    row
}

fn compared(design: &Design, command: &str) -> Table {
    let mut data = Records::new(std::iter::once("probe").chain(COLUMNS.into_iter().skip(1)));
    data.push(row("best", &design.best));
    data.push(row("published", &design.published));
    Table {
        id: "best".into(),
        title: "The best probe and the published one".into(),
        caption:
            "Mean number of approaches to a verdict, with its standard error over the drawn sequences; the shares of \
                  wrong verdicts and of sequences without one; the share of approaches with each contact pattern."
                .into(),
        command: command.into(),
        data,
    }
}

/// The best of the first round for each aim: what it is worth to know where the object's middle is.
fn by_aim(design: &Design, command: &str) -> Table {
    let mut data = Records::new(COLUMNS);
    let round = design.rounds.first().map_or(&[][..], Vec::as_slice);
    let of = |aim: Aim| round.iter().find(|trial| trial.aim == aim);
    Aim::ALL.into_iter().filter_map(of).for_each(|trial| data.push(row("coarse", trial)));
    Table {
        id: "aims".into(),
        title: "Benefit of aiming".into(),
        caption: format!(
            "The best probe of the coarse round for each aim that was tried: {}. A robot that cannot aim well should search \
             with --search aim=box.",
            aims(round)
        ),
        command: command.into(),
        data,
    }
}

/// The aims that were tried, in words.
fn aims(round: &[Trial]) -> String {
    let about = |aim: &Aim| match aim {
        Aim::Box => "box is anywhere in the bounding box",
        Aim::Middle => "middle is in the box of half its sides",
        Aim::Mass => "mass is in a box of a quarter of them about the surface's center of mass",
    };
    let tried: Vec<Aim> = Aim::ALL.into_iter().filter(|aim| round.iter().any(|trial| trial.aim == *aim)).collect();
    tried.iter().map(about).collect::<Vec<_>>().join(", ")
}

fn rounds(design: &Design, command: &str) -> Table {
    let mut data = Records::new(COLUMNS);
    let all = design.rounds.iter().chain([&design.by_spacing]);
    for (name, round) in ROUNDS.into_iter().zip(all) {
        round.iter().for_each(|trial| data.push(row(name, trial)));
    }
    Table {
        id: "trials".into(),
        title: "All probes tried".into(),
        caption: format!(
            "Approaches to each object that a model was trained on: {}. Fewer approaches make weaker models, so compare \
             within a round only.",
            trained_on(design)
        ),
        command: command.into(),
        data,
    }
}

/// The rounds, and the approaches that a model of each was trained on.
fn trained_on(design: &Design) -> String {
    let rounds = design.rounds.iter().map(Vec::as_slice).chain([design.by_spacing.as_slice()]);
    let of = |(name, round): (&str, &[Trial])| Some(format!("{name} {}", count(round.first()?.trained_on)));
    ROUNDS.into_iter().zip(rounds).filter_map(of).collect::<Vec<_>>().join(", ")
}

/// A curve of all objects together, and of each.
struct Curve {
    /// Column of the data, and a caption of the axis.
    column: &'static str,
    axis: (String, Axis),
    /// The best probe's place on it.
    best: f64,
}

/// The trials' approaches against a number of theirs, for each object: a chart, and its data.
fn curve(design: &Design, trials: &[Trial], of: impl Fn(&Trial) -> f64, curve: Curve) -> Result<(Records, Svg)> {
    let mut data = Records::new(["object", curve.column, "approaches"]);
    let mut lines: Vec<(&str, Vec<(f64, f64)>)> =
        vec![("all", trials.iter().map(|trial| (of(trial), trial.approaches)).collect())];
    for name in design.best.per_object.keys() {
        let point = |trial: &Trial| (of(trial), trial.per_object.get(name).copied().unwrap_or(f64::NAN));
        lines.push((name, trials.iter().map(point).collect()));
    }
    for (name, points) in &lines {
        points.iter().for_each(|&(x, y)| data.push([(*name).into(), Cell::Number(x, 2), Cell::Number(y, 2)]));
    }
    let all = || lines.iter().flat_map(|line| &line.1).map(|point| point.1).filter(|y| y.is_finite());
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(1.0, f64::max));
    let (label, axis) = curve.axis;
    let mut chart =
        Chart::new(label, axis, "approaches to a verdict", Axis::logarithmic(0.9 * low, 1.1 * high)).sized(760, 480);
    for (index, (name, points)) in lines.iter().enumerate().skip(1) {
        let stroke = if index % 2 == 0 { Stroke::Dashed } else { Stroke::Thin };
        chart.line(name, color::series(index), stroke, points);
    }
    let (name, points) = &lines[0];
    chart.series(name, color::INK, Shape::Disc, points);
    chart.marks.push(Mark::Vertical(curve.best));
    Ok((data, chart.svg()?))
}

/// A note on trials that did not reach the error rate.
fn unreached(trials: &[Trial]) -> String {
    match trials.iter().filter(|trial| !trial.reached).count() {
        0 => String::new(),
        missed => format!(" {missed} of these probes did not reach the error rate, whatever the stopping rule."),
    }
}

/// Place of a hand that goes on past the object on the axis of strokes: twice the longest stroke that was tried.
fn far(design: &Design) -> f64 {
    2.0 * design.by_stroke.iter().filter_map(|trial| trial.probe.stroke).fold(0.5, f64::max)
}

fn by_stroke(design: &Design, command: &str) -> Result<Figure> {
    let line = &design.by_stroke;
    let far = far(design);
    let place = |trial: &Trial| trial.probe.stroke.unwrap_or(far);
    let shortest = line.iter().map(place).fold(f64::INFINITY, f64::min);
    let longest = line.iter().map(place).fold(shortest * 1.01, f64::max);
    let axis = Axis::logarithmic(shortest, longest);
    let label = format!("stroke of the hand after the first contact ({})", unit(design));
    let (data, panel) =
        curve(design, line, place, Curve { column: "stroke", axis: (label, axis), best: place(&design.best) })?;
    let past = match design.best.probe.stroke {
        None => format!(" A hand that goes on past the object is drawn at {}.", number(far, 1)),
        Some(_) => String::new(),
    };
    Ok(Figure {
        id: "strokes".into(),
        title: "Approaches against stroke, for each object".into(),
        caption: format!(
            "The best probe with hands that stop earlier: a contact that would come later than the stroke is missing.{past}{}",
            unreached(line)
        ),
        command: command.into(),
        panels: vec![panel],
        data,
    })
}

fn by_spacing(design: &Design, command: &str) -> Result<Figure> {
    let line = &design.by_spacing;
    let spacings = || line.iter().map(|trial| trial.probe.spacing);
    let axis = Axis::linear(spacings().fold(f64::INFINITY, f64::min), spacings().fold(0.0, f64::max), 6);
    let label = format!("distance between neighboring fingers ({})", unit(design));
    let best = design.best.probe.spacing;
    let (data, panel) =
        curve(design, line, |trial| trial.probe.spacing, Curve { column: "spacing", axis: (label, axis), best })?;
    Ok(Figure {
        id: "approaches".into(),
        title: "Approaches against spacing, for each object".into(),
        caption: format!(
            "Radius, tilt and aim are those of the best probe, whose spacing the vertical line marks. One stopping rule \
             for all objects: the error rate is that of all together.{}",
            unreached(line)
        ),
        command: command.into(),
        panels: vec![panel],
        data,
    })
}
