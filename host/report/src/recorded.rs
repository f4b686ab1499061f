//! Test of the simulation: recorded touches beside simulated ones.

use super::context::Context;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::capture;
use palpate::compare::{self, Comparison, Cost, ObjectComparison, Share};
use palpate::error::{EvaluateProblem, Result};
use palpate::progress;
use palpate::touches::{Dataset, Origin, checksum, files};
use palpate::with;
use palpate::wording::{decimal, percent};
use std::path::Path;

/// Differences of shares of contact patterns above which these are named.
const DIFFERENT: f64 = 0.02;

/// Compares the recorded touches with as many approaches as other sections make, by the probe of the
/// report with what a real one adds.
pub(super) fn measure(context: &Context, directory: &Path) -> Result<Comparison> {
    let recorded = Dataset::read_any(directory)?;
    let settings = context.settings;
    let origin = Origin { approaches: true, real: settings.real, ..settings.capture.clone() };
    let touched = |(object, scenes): (&palpate::mesh::Object, &Vec<_>)| {
        progress::check(context.progress)?;
        capture::touches(scenes, &object.name, &origin, 0..settings.approaches)
    };
    let simulated = context.objects.iter().zip(context.all_scenes()).map(touched).collect::<Result<_>>()?;
    let simulated = Dataset { origin: Some(origin.clone()), ..Dataset::new(simulated) };
    if let Some(unknown) =
        recorded.objects.iter().find(|own| simulated.objects.iter().all(|other| other.name != own.name))
    {
        let detail = format!("{} was recorded and is none of the report's objects", unknown.name);
        return Err(palpate::Error::from(EvaluateProblem::Incomparable { detail }).in_file(directory));
    }
    let groups = settings.sequences;
    let compared = with!(compare::Settings::default(), groups, seed = settings.seed);
    compare::compare(&recorded, &simulated, &compared, context.progress)
}

/// A checksum of the recorded touches' files: a report that is resumed with others starts again.
pub(super) fn fingerprint(directory: &Path) -> Result<Vec<u32>> {
    files(directory)?.iter().map(|(_, path, _)| checksum(path)).collect()
}

/// The section.
pub(super) fn section(context: &Context, compared: &Comparison) -> Result<Section> {
    let mut section = Section::new("recorded", "Accuracy of the simulation");
    let told = &compared.told_apart;
    section.text(compared.verdict());
    if let Some(cost) = &compared.cost {
        section.text(format!(
            "Cost of the difference: a model of {} objects was trained on simulated touches. {} {} {}",
            cost.known,
            cost.sentence(),
            cost.confusions(),
            cost.promise.map(|promise| promise.sentence()).unwrap_or_default()
        ));
        section.figure(cost_figure(context, cost)?);
    }
    section.text(format!(
        "Recorded touches of {} objects were compared with simulated ones of the same objects{}. A classifier trained \
         to distinguish the two is right {} of the time on touches that it was not trained on; 50 % is chance level.",
        compared.objects.len(),
        if context.settings.real.is_none() { String::new() } else { format!(", made with {}", context.settings.real) },
        with_interval(told),
    ));
    section.figure(told_figure(context, compared)?);
    section.figure(features_figure(context, compared)?);
    section.table(words(context, compared));
    Ok(section)
}

fn with_interval(share: &Share) -> String {
    format!("{} ({} to {})", percent(share.value, 1), decimal(100.0 * share.low, 1), percent(share.high, 1))
}

fn told_figure(context: &Context, compared: &Comparison) -> Result<Figure> {
    let mut rows: Vec<(&str, &Share)> =
        compared.objects.iter().map(|own| (own.name.as_str(), &own.told_apart)).collect();
    rows.push(("all", &compared.told_apart));
    let high = rows.iter().map(|(_, share)| share.high).fold(0.6, f64::max).min(1.0);
    let low = rows.iter().map(|(_, share)| share.low).fold(0.45, f64::min);
    let mut chart = Chart::new(
        "",
        Axis::names(rows.iter().map(|(name, _)| *name)),
        "classifier accuracy",
        Axis::percent(low, high),
    );
    chart.upright_names = true;
    let mut data = Records::new(["object", "classifier accuracy", "low", "high"]);
    let at = |index: usize| index as f64 + 0.5;
    chart.line("guessing", color::GRAY, Stroke::Dashed, &[(0.0, 0.5), (rows.len() as f64, 0.5)]);
    let spread = rows.iter().enumerate().map(|(index, (_, share))| (at(index), share.low, share.high));
    chart.marks.push(Mark::Spread { points: spread.collect(), color: color::OURS });
    let points = rows.iter().enumerate().map(|(index, (_, share))| (at(index), share.value));
    chart.marks.push(Mark::Dots { points: points.collect(), color: color::OURS, shape: Shape::Disc });
    for (name, share) in rows {
        data.push([
            name.into(),
            Cell::Percent(share.value, 1),
            Cell::Percent(share.low, 1),
            Cell::Percent(share.high, 1),
        ]);
    }
    Ok(Figure {
        id: "recorded-told-apart".into(),
        title: "Accuracy of distinguishing recorded from simulated touches".into(),
        caption:
            "With intervals of 95 %. An interval that contains 50 % shows no difference between recorded and simulated \
             touches."
                .into(),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}

/// Percentiles of every feature of every object, recorded beside simulated.
fn features_figure(context: &Context, compared: &Comparison) -> Result<Figure> {
    let names: Vec<&str> = compared
        .objects
        .first()
        .map_or_else(Vec::new, |own| own.features.iter().map(|own| own.feature.as_str()).collect());
    let mut data = Records::new(["object", "feature", "touches", "5 %", "25 %", "50 %", "75 %", "95 %"]);
    let mut panels = Vec::new();
    for name in names {
        let of = |own: &ObjectComparison| own.features.iter().find(|own| own.feature == name).cloned();
        let rows: Vec<_> = compared.objects.iter().filter_map(|own| Some((own.name.as_str(), of(own)?))).collect();
        let ends =
            rows.iter().flat_map(|(_, own)| [own.recorded[0], own.recorded[4], own.simulated[0], own.simulated[4]]);
        let (low, high) = ends.fold((f64::MAX, f64::MIN), |(low, high), end| (low.min(end), high.max(end)));
        let scale = scale(name);
        let axis = Axis::linear(low * scale, high.max(low + 1.0) * scale, 6);
        let mut chart = Chart::new("", Axis::names(rows.iter().map(|(name, _)| *name)), unit(name), axis).titled(name);
        chart.upright_names = true;
        for (index, (object, own)) in rows.iter().enumerate() {
            for (what, values, place, color) in
                [("recorded", &own.recorded, 0.35, color::VERMILION), ("simulated", &own.simulated, 0.65, color::BLUE)]
            {
                let x = index as f64 + place;
                let [least, low, middle, high, most] = values.map(|value| value * scale);
                chart.marks.push(Mark::Line { points: vec![(x, least), (x, most)], color, stroke: Stroke::Thin });
                chart.marks.push(Mark::Box { from: (x - 0.1, low), to: (x + 0.1, high), color, opacity: 0.35 });
                chart.marks.push(Mark::Dots { points: vec![(x, middle)], color, shape: Shape::Disc });
                let numbers = values.map(|value| Cell::Number(value * scale, 2));
                data.push([[(*object).into(), name.into(), what.into()].to_vec(), numbers.to_vec()].concat());
            }
        }
        panels.push(chart.svg()?);
    }
    Ok(Figure {
        id: "recorded-features".into(),
        title: "Features of recorded and of simulated touches".into(),
        caption:
            "Recorded touches are left of each name, simulated ones right of it: the median, the middle half, and all \
                  but the outer tenth."
                .into(),
        command: context.settings.command.clone(),
        panels,
        data,
    })
}

/// Times are shown in milliseconds, cosines as they are.
fn scale(feature: &str) -> f64 {
    if is_time(feature) { 1e-3 } else { 1.0 / f64::from(palpate_shared::Q15_ONE) }
}

fn unit(feature: &str) -> &'static str {
    if is_time(feature) { "ms" } else { "cosine" }
}

fn is_time(feature: &str) -> bool {
    !(feature.starts_with("direction") || feature.starts_with("alignment"))
}

fn words(context: &Context, compared: &Comparison) -> Table {
    let mut data =
        Records::new(["object", "recorded", "simulated", "classifier accuracy", "features", "contact patterns"]);
    for own in &compared.objects {
        let features = own.features.iter().map(|own| format!("{}: {}", own.feature, own.words()));
        let patterns = own
            .patterns
            .iter()
            .filter(|(_, [one, other])| (one - other).abs() > DIFFERENT)
            .map(|(name, [one, other])| format!("{name}: {} instead of {}", percent(*one, 0), percent(*other, 0)));
        let patterns: Vec<String> = patterns.collect();
        data.push([
            own.name.as_str().into(),
            Cell::count(own.touches[0]),
            Cell::count(own.touches[1]),
            with_interval(&own.told_apart).into(),
            features.collect::<Vec<_>>().join("; ").into(),
            if patterns.is_empty() { "alike".into() } else { patterns.join("; ").into() },
        ]);
    }
    Table {
        id: "recorded-words".into(),
        title: "Recorded and simulated touches, object by object".into(),
        caption: format!(
            "Features by themselves, and contact patterns that differ by more than {} points. A classifier sees them \
             together.",
            100.0 * DIFFERENT
        ),
        command: context.settings.command.clone(),
        data,
    }
}

fn cost_figure(context: &Context, cost: &Cost) -> Result<Figure> {
    let most = cost.simulated.keys().last().copied().unwrap_or(2) as f64;
    let mut chart = Chart::new("approaches", Axis::linear(0.0, most, 6), "accuracy", Axis::share());
    let mut data = Records::new(["touches", "approaches", "accuracy", "low", "high"]);
    for (name, accuracy, color, shape) in [
        ("simulated", &cost.simulated, color::BLUE, Shape::Disc),
        ("recorded", &cost.recorded, color::VERMILION, Shape::Triangle),
    ] {
        let points: Vec<(f64, f64)> = accuracy.iter().map(|(at, share)| (*at as f64, share.value)).collect();
        chart.series(name, color, shape, &points);
        for (at, share) in accuracy {
            let shares = [share.value, share.low, share.high].map(|share| Cell::Percent(share, 1));
            data.push([[name.into(), Cell::count(*at)].to_vec(), shares.to_vec()].concat());
        }
    }
    Ok(Figure {
        id: "recorded-cost".into(),
        title: "A model trained on simulated touches, on simulated and on recorded ones".into(),
        caption: "The distance between the curves is the cost of the simulation's errors.".into(),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}
