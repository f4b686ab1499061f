//! Counted in approaches: what waiting for full touches costs, what counting misses assumes, and objects at their true
//! size.

use super::context::{Context, compiled};
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::capture;
use palpate::compile;
use palpate::ensemble::{Ensemble, train};
use palpate::error::Result;
use palpate::evaluate::{Approaches, Candidate, Margins, SequentialSettings};
use palpate::mesh::Object;
use palpate::probe::approach::Probe;
use palpate::probe::scene::Scene;
use palpate::progress;
use palpate::touches::{Dataset, Origin};
use palpate::tune::probe::{median_length, scaled_probe};
use palpate_shared::ContactPattern;
use palpate_shared::format::{Counted, Length};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Numbers of approaches after which accuracy is shown.
const AT: [usize; 9] = [5, 10, 20, 30, 40, 60, 90, 120, 200];
/// Those of them that tables show.
const TABLE_AT: [usize; 3] = [10, 20, 60];
/// The posterior that a recognizer waits for is 1 minus this.
const ERROR_RATE: f64 = 0.01;
/// The share of misses that a robot avoids which aims better than the simulation.
const AVOIDED: f64 = 0.7;

/// The ways to use approaches, in the order of [`ByApproach::ways`].
const WAYS: [&str; 4] =
    ["paper, waits for full touches", "ours, waits for full touches", "ours, every contact", "ours, misses as well"];
/// Every contact counts; an approach that touched nothing does not.
const CONTACTS: usize = 2;
/// An approach that touched nothing counts as well.
const ALL: usize = 3;

/// Results of approaches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ByApproach {
    /// The share of each contact pattern among each object's approaches.
    shares: Vec<[f64; 6]>,
    /// For each of [`WAYS`].
    ways: Vec<Way>,
    /// Every contact, and misses as well, for a robot that avoids [`AVOIDED`] of the misses.
    aimed: [Way; 2],
    /// Every contact with objects scaled to one size and at their true sizes, where those are known.
    sizes: Option<[Way; 2]>,
    /// The probe at true size.
    true_probe: Option<Probe>,
}

/// Results of one way to use approaches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Way {
    bytes: usize,
    /// The share of approaches that are evidence.
    used: f64,
    /// Accuracy after each of [`AT`] approaches, and its standard error; none where an object has fewer.
    accuracy: Vec<Option<(f64, f64)>>,
    /// Approaches to a verdict, and their standard error.
    approaches: (f64, f64),
    /// The same for each object.
    per_object: Vec<f64>,
    wrong: f64,
    undecided: f64,
}

impl Way {
    fn new(bytes: usize, measured: &Approaches) -> Self {
        let accuracy = |at| measured.accuracy.get(at).copied().zip(measured.accuracy_standard_error.get(at).copied());
        let sequential = &measured.sequential;
        Self {
            bytes,
            used: measured.used,
            accuracy: AT.iter().map(accuracy).collect(),
            approaches: (sequential.mean_approaches, sequential.mean_approaches_standard_error),
            per_object: sequential.per_object.values().copied().collect(),
            wrong: sequential.error,
            undecided: sequential.undecided,
        }
    }

    fn at(&self, approaches: usize) -> Cell {
        let at = AT.iter().position(|&at| at == approaches).and_then(|index| *self.accuracy.get(index)?);
        at.map_or(Cell::Missing, |(value, error)| Cell::PercentSpread(value, error, 1))
    }

    fn stopping(&self) -> [Cell; 3] {
        let (mean, error) = self.approaches;
        [Cell::Spread(mean, error, 1), Cell::Percent(self.wrong, 2), Cell::Percent(self.undecided, 2)]
    }
}

/// Approaches the objects, trains on some of the approaches and tests every way on the others.
pub(super) fn measure(context: &Context) -> Result<ByApproach> {
    let settings = context.settings;
    let origin = Origin { approaches: true, ..settings.capture.clone() };
    let [train, test] = approaches(context, context.all_scenes(), &origin)?;
    let recipe = |counted| train::Settings { counted: Some(counted), ..context.ours() };
    let contacts = context.train(&train, &recipe(Counted::Contacts))?;
    let all = context.train(&train, &recipe(Counted::All))?;
    let models = context.models()?;
    let ways = [&models.paper, &models.ours, &contacts, &all].map(|ensemble| way(context, ensemble, &test));
    let ways: Vec<Way> = ways.into_iter().collect::<Result<_>>()?;
    let aimed = fewer_misses(&test);
    let aimed = [way(context, &contacts, &aimed)?, way(context, &all, &aimed)?];
    let (mut sizes, mut true_probe) = (None, None);
    if let Some(other) = other_size(context.objects, &settings.capture) {
        let origin = Origin { approaches: true, ..other };
        let objects: Vec<&Object> = context.objects.iter().collect();
        let scenes = capture::scenes(&objects, &origin, context.progress)?;
        let [train, test] = approaches(context, &scenes, &origin)?;
        let there = way(context, &context.train(&train, &recipe(Counted::Contacts))?, &test)?;
        let here = ways[CONTACTS].clone();
        let is_true = origin.unit == Length::Millimeter;
        sizes = Some(if is_true { [here, there] } else { [there, here] });
        true_probe = Some(if is_true { origin.probe } else { settings.capture.probe });
    }
    let shares = test.objects.iter().map(|object| shares(object.touches())).collect();
    Ok(ByApproach { shares, ways, aimed, sizes, true_probe })
}

/// Approaches to train on, and a third as many to test on.
pub(super) fn approaches(context: &Context, scenes: &[Vec<Scene>], origin: &Origin) -> Result<[Dataset; 2]> {
    let count = context.settings.approaches;
    let touched = |samples: Range<u64>| -> Result<Dataset> {
        let of = |(object, scenes): (&Object, &Vec<Scene>)| {
            progress::check(context.progress)?;
            capture::touches(scenes, &object.name, origin, samples.clone())
        };
        let objects = context.objects.iter().zip(scenes).map(of).collect::<Result<_>>()?;
        Ok(Dataset { origin: Some(origin.clone()), ..Dataset::new(objects) })
    };
    Ok([touched(0..count)?, touched(count..count + count / 3)?])
}

fn way(context: &Context, ensemble: &Ensemble, test: &Dataset) -> Result<Way> {
    context.check()?;
    let compiled = compiled(ensemble)?;
    let model = compile::open(&compiled.bytes)?;
    let margins = Margins::new(Candidate::Compiled(&model), test)?;
    let sequences = if context.settings.quick { 300 } else { 1_000 };
    let at: Vec<usize> = AT.into_iter().filter(|&at| at <= margins.fewest_approaches()).collect();
    let settings =
        SequentialSettings { error_rate: Some(ERROR_RATE), max_touches: None, sequences, seed: context.settings.seed };
    Ok(Way::new(compiled.bytes.len(), &margins.approaches(&at, &settings)?))
}

/// The same approaches, without [`AVOIDED`] of those that touched nothing.
fn fewer_misses(test: &Dataset) -> Dataset {
    test.each(|object| {
        // Of each instance alike.
        let mut misses = vec![0u32; object.sources().len()];
        let mut is_kept = |touch: &usize| {
            let is_miss = object.touches()[*touch].pattern() == ContactPattern::None;
            let misses = &mut misses[object.source_of(*touch)];
            *misses += u32::from(is_miss);
            // Every tenth part of the misses, in turn.
            !is_miss || f64::from(*misses % 10) >= 10.0 * AVOIDED
        };
        object.select((0..object.len()).filter(|touch| is_kept(touch)))
    })
}

/// The way to touch objects that the report does not use otherwise: at their true size, where it is known, by the
/// published probe's likeness at the median object; or scaled to one size by the published probe.
fn other_size(objects: &[Object], capture: &Origin) -> Option<Origin> {
    if capture.unit == Length::Millimeter {
        return Some(Origin { seed: capture.seed, aim: capture.aim, ..Origin::default() });
    }
    let probe = scaled_probe(&Probe::default(), median_length(objects)? / Origin::default().length);
    Some(Origin { unit: Length::Millimeter, probe, seed: capture.seed, aim: capture.aim, ..Origin::default() })
}

fn shares(touches: &[palpate_shared::Touch]) -> [f64; 6] {
    let mut shares = [0.0; 6];
    for touch in touches {
        shares[usize::from(touch.pattern().code())] += 1.0 / touches.len().max(1) as f64;
    }
    shares
}

/// The figure and the tables.
pub(super) fn section(context: &Context, by_approach: &ByApproach) -> Result<Section> {
    let mut section = Section::new("approaches", "What an approach is worth");
    let [full, contacts] = [1, CONTACTS].map(|way| by_approach.ways[way].approaches.0);
    section.text(format!(
        "A robot pays for approaches, and most do not end in a full touch. {} approaches to each object were kept \
         whatever they touched, and {} others to test on. Our model that waits for full touches stops after {} approaches on \
         average, the one that uses every contact after {}. Contact times are without noise here.",
        context.settings.approaches,
        context.settings.approaches / 3,
        crate::page::axis::number(full, 1),
        crate::page::axis::number(contacts, 1)
    ));
    section.figure(figure(context, by_approach)?);
    section.table(ways_table(context, by_approach));
    section.table(objects_table(context, by_approach));
    section.text(format!(
        "A miss is evidence only if the robot aims as the simulation does. The next table tests that assumption: with \
         a robot that aims better and avoids {} % of the misses, the model that counts misses makes more errors, and \
         the one that does not becomes faster.",
        100.0 * AVOIDED
    ));
    section.table(misses_table(context, by_approach));
    match &by_approach.sizes {
        Some(sizes) => section.table(sizes_table(context, sizes, by_approach.true_probe)),
        None => section.text(
            "How objects compare at their true sizes was not measured: the unit of these meshes is not known. \
             `--true-size mm --probe probe.toml` states it.",
        ),
    };
    Ok(section)
}

fn figure(context: &Context, by_approach: &ByApproach) -> Result<Figure> {
    let most = *AT.last().unwrap_or(&1) as f64;
    let mut chart =
        Chart::new("approaches", Axis::logarithmic(AT[0] as f64, most), "accuracy", Axis::share()).sized(660, 420);
    let mut data = Records::new(["way", "approaches", "accuracy"]);
    let styles = [
        ("paper, full", color::PAPER, Shape::Ring),
        ("ours, full", color::PURPLE, Shape::Triangle),
        ("every contact", color::OURS, Shape::Disc),
        ("misses too", color::GREEN, Shape::Square),
    ];
    for ((way, name), (label, color, shape)) in by_approach.ways.iter().zip(WAYS).zip(styles) {
        let known = AT.iter().zip(&way.accuracy).filter_map(|(&at, accuracy)| Some((at as f64, (*accuracy)?.0)));
        let points: Vec<(f64, f64)> = known.collect();
        chart.series(label, color, shape, &points);
        for at in AT {
            data.push([name.into(), Cell::count(at), way.at(at)]);
        }
    }
    Ok(Figure {
        id: "approaches-accuracy".into(),
        title: "Accuracy against approaches".into(),
        caption: "Without any evidence, no object counts as recognized.".into(),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}

fn columns(first: &str) -> Vec<String> {
    let mut columns = vec![first.to_owned()];
    columns.extend(TABLE_AT.iter().map(|at| format!("at {at}")));
    let stopping = format!("approaches to a posterior of {}", 1.0 - ERROR_RATE);
    columns.extend([stopping, "wrong".into(), "undecided".into()]);
    columns
}

fn row(name: &str, way: &Way) -> Vec<Cell> {
    std::iter::once(name.into()).chain(TABLE_AT.iter().map(|&at| way.at(at))).chain(way.stopping()).collect()
}

fn ways_table(context: &Context, by_approach: &ByApproach) -> Table {
    let mut columns = columns("way");
    columns.extend(["share of approaches used".into(), "bytes".into()]);
    let mut data = Records::new(columns);
    for (way, name) in by_approach.ways.iter().zip(WAYS) {
        let mut row = row(name, way);
        row.extend([Cell::Percent(way.used, 1), Cell::count(way.bytes)]);
        data.push(row);
    }
    Table {
        id: "approaches-ways".into(),
        title: "Waiting for full touches, and using every contact".into(),
        caption: format!(
            "The first two were trained on {} full touches of each object, which took more approaches than the {} that \
             the others were trained on. Each gives up after its model's limit of touches.",
            context.first().map_or(0, |split| split.train.objects.first().map_or(0, |object| object.len())),
            context.settings.approaches
        ),
        command: context.settings.command.clone(),
        data,
    }
}

fn objects_table(context: &Context, by_approach: &ByApproach) -> Table {
    let patterns = ContactPattern::ALL.iter().map(|pattern| pattern.name().to_owned());
    let more = ["approaches, full touches", "approaches, every contact", "approaches, misses too"];
    let columns = std::iter::once("object".to_owned()).chain(patterns).chain(more.map(String::from));
    let mut data = Records::new(columns);
    for (index, name) in context.names().into_iter().enumerate() {
        let shares = by_approach.shares.get(index).copied().unwrap_or_default();
        let approaches = [1, CONTACTS, ALL].map(|way| {
            by_approach.ways[way].per_object.get(index).map_or(Cell::Missing, |&mean| Cell::Number(mean, 1))
        });
        data.push(std::iter::once(name.into()).chain(shares.map(|share| Cell::Percent(share, 1))).chain(approaches));
    }
    Table {
        id: "approaches-objects".into(),
        title: "Contact patterns, and approaches to a verdict".into(),
        caption:
            "The share of each contact pattern among an object's approaches, and the number of approaches for each way."
                .into(),
        command: context.settings.command.clone(),
        data,
    }
}

fn misses_table(context: &Context, by_approach: &ByApproach) -> Table {
    let mut data = Records::new(columns("way and aim"));
    let better = format!("{} % of misses avoided", 100.0 * AVOIDED);
    for (way, aimed) in [CONTACTS, ALL].into_iter().zip(&by_approach.aimed) {
        data.push(row(&format!("{}, as simulated", WAYS[way]), &by_approach.ways[way]));
        data.push(row(&format!("{}, {better}", WAYS[way]), aimed));
    }
    Table {
        id: "approaches-misses".into(),
        title: "Misses as evidence".into(),
        caption:
            "The same models, tested on approaches of a robot that aims as in training and of one that aims better."
                .into(),
        command: context.settings.command.clone(),
        data,
    }
}

fn sizes_table(context: &Context, sizes: &[Way; 2], probe: Option<Probe>) -> Table {
    let mut data = Records::new(columns("size of the objects"));
    for (name, way) in ["scaled to 10 units", "true size"].into_iter().zip(sizes) {
        data.push(row(name, way));
    }
    let Probe { radius, spacing, speed, .. } = probe.unwrap_or_default();
    let millimeters = |length: f64| crate::page::axis::number(length, 1);
    Table {
        id: "approaches-sizes".into(),
        title: "Scaled to one size, and at true size".into(),
        caption: format!(
            "Every contact counts. At true size the probe has a radius of {} mm, a spacing of {} mm and a speed of {} mm \
             per second; scaled, it is the published one.",
            millimeters(radius),
            millimeters(spacing),
            millimeters(speed)
        ),
        command: context.settings.command.clone(),
        data,
    }
}
