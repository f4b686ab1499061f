//! Counted in approaches: what waiting for full touches costs, what counting misses assumes, and objects at their true
//! size.

use super::context::{Context, compiled};
use super::objects::described;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::capture;
use palpate::compile;
use palpate::ensemble::Ensemble;
use palpate::error::Result;
use palpate::evaluate::{Approaches, Candidate, Margins, SequentialSettings};
use palpate::mesh::Object;
use palpate::probe::approach::Probe;
use palpate::probe::scene::Scene;
use palpate::progress;
use palpate::touches::{Dataset, Origin};
use palpate::tune::probe::{median_length, scaled_probe};
use palpate::with;
use palpate::wording::{self, decimal, list, percent};
use palpate_shared::ContactPattern;
use palpate_shared::format::{Counted, Length};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Numbers of approaches after which accuracy is shown.
const AT: [usize; 9] = [5, 10, 20, 30, 40, 60, 90, 120, 200];
/// Numbers of approaches that tables show.
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
    /// The probes that objects of one size, and of true size, are touched with, where both are.
    probes: Option<[Probe; 2]>,
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
    /// Accuracy for each object.
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
            approaches: (sequential.mean().value, sequential.mean().standard_error),
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
    let recipe = |counted| with!(context.ours(), counted = Some(counted));
    let contacts = context.train(&train, &recipe(Counted::Contacts))?;
    let all = context.train(&train, &recipe(Counted::All))?;
    let models = context.models()?;
    let ways = [&models.paper, &models.ours, &contacts, &all].map(|ensemble| way(context, ensemble, &test));
    let ways: Vec<Way> = ways.into_iter().collect::<Result<_>>()?;
    let aimed = fewer_misses(&test);
    let aimed = [way(context, &contacts, &aimed)?, way(context, &all, &aimed)?];
    let (mut sizes, mut probes) = (None, None);
    if let Some(other) = other_size(context.objects, &settings.capture) {
        let origin = Origin { approaches: true, ..other };
        let objects: Vec<&Object> = context.objects.iter().collect();
        let scenes = capture::scenes(&objects, &origin, context.progress)?;
        let [train, test] = approaches(context, &scenes, &origin)?;
        let there = way(context, &context.train(&train, &recipe(Counted::Contacts))?, &test)?;
        let here = ways[CONTACTS].clone();
        let is_true = origin.unit == Length::Millimeter;
        sizes = Some(if is_true { [here, there] } else { [there, here] });
        let [own, other] = [settings.capture.probe, origin.probe];
        probes = Some(if is_true { [own, other] } else { [other, own] });
    }
    let shares = test.objects.iter().map(|object| shares(object.touches())).collect();
    Ok(ByApproach { shares, ways, aimed, sizes, probes })
}

/// Approaches to train on, and a third as many to test on.
fn approaches(context: &Context, scenes: &[Vec<Scene>], origin: &Origin) -> Result<[Dataset; 2]> {
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
    let sequences = context.settings.sequences;
    let at: Vec<usize> = AT.into_iter().filter(|&at| at <= margins.fewest_approaches()).collect();
    let settings =
        SequentialSettings { error_rate: Some(ERROR_RATE), max_touches: None, sequences, seed: context.settings.seed };
    Ok(Way::new(compiled.bytes.len(), &margins.approaches(&at, &settings)?))
}

/// Approaches without [`AVOIDED`] of those that touched nothing.
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
/// likeness of the report's probe at the median object; or scaled to one size by the published probe.
fn other_size(objects: &[Object], capture: &Origin) -> Option<Origin> {
    if capture.unit == Length::Millimeter {
        return Some(Origin { seed: capture.seed, aim: capture.aim, ..Origin::default() });
    }
    let probe = scaled_probe(&capture.probe, median_length(objects)? / capture.length);
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
        "A robot pays for approaches, and not all end in a full touch: {}. {} approaches to each object were kept whatever \
         they touched, and {} others to test on. Our model that waits for full touches stops after {} approaches on average, \
         the one that uses every contact after {}. Contact times are without noise here.",
        full_touches(&context.names(), &by_approach.shares),
        wording::count(context.settings.approaches),
        wording::count(context.settings.approaches / 3),
        decimal(full, 1),
        decimal(contacts, 1)
    ));
    section.figure(figure(context, by_approach)?);
    section.table(ways_table(context, by_approach)?);
    section.table(objects_table(context, by_approach));
    section.text(format!(
        "A miss is evidence only if the robot aims as the simulation does. The next table tests that assumption with a \
         robot that aims better and avoids {} of the misses. {}",
        wording::rate(AVOIDED),
        aimed_better(by_approach)
    ));
    section.table(misses_table(context, by_approach));
    match &by_approach.sizes {
        Some(sizes) => section.table(sizes_table(context, sizes, by_approach.probes)),
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
        caption: "Before the first usable contact, a group counts as not recognized.".into(),
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

fn ways_table(context: &Context, by_approach: &ByApproach) -> Result<Table> {
    let mut columns = columns("way");
    columns.extend(["share of approaches used".into(), "bytes".into()]);
    let mut data = Records::new(columns);
    for (way, name) in by_approach.ways.iter().zip(WAYS) {
        let mut row = row(name, way);
        row.extend([Cell::Percent(way.used, 1), Cell::count(way.bytes)]);
        data.push(row);
    }
    let captured = context.captured()?;
    let train = &context.first()?.train;
    // Of the approaches that full touches took, those to the touches trained on.
    let taken = train.objects.iter().zip(captured.data.objects.iter().zip(&captured.approaches));
    let taken = taken.map(|(train, (all, &approaches))| {
        (approaches as f64 * train.len() as f64 / all.len().max(1) as f64).round() as u64
    });
    Ok(Table {
        id: "approaches-ways".into(),
        title: "Waiting for full touches, and using every contact".into(),
        caption: format!(
            "The first two were trained on {} full touches of each object. {} Each gives up after its model's limit of \
             touches.",
            wording::count(train.objects.first().map_or(0, |object| object.len())),
            training_cost(&context.names(), &taken.collect::<Vec<_>>(), context.settings.approaches)
        ),
        command: context.settings.command.clone(),
        data,
    })
}

/// The share of approaches that are full touches, from the object with the fewest to the one with the most.
fn full_touches(names: &[String], shares: &[[f64; 6]]) -> String {
    let full = || names.iter().zip(shares.iter().map(|shares| shares[usize::from(ContactPattern::All.code())]));
    let of = |(name, share): (&String, f64)| format!("{} ({name})", percent(share, 1));
    let least = full().min_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(String::new, of);
    let most = full().max_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(String::new, of);
    format!("from {least} to {most} do")
}

/// The approaches that the full touches of a training took, compared with the approaches of the other trainings.
fn training_cost(names: &[String], taken: &[u64], approaches: u64) -> String {
    let (least, most) = (taken.iter().min().copied().unwrap_or(0), taken.iter().max().copied().unwrap_or(0));
    let range = match least == most {
        true => wording::count(most),
        false => format!("{} to {}", wording::count(least), wording::count(most)),
    };
    let fewer: Vec<&String> =
        names.iter().zip(taken).filter(|(_, taken)| **taken <= approaches).map(|own| own.0).collect();
    let than = match fewer.len() {
        0 => "more for each object".to_owned(),
        all if all == taken.len() => "no more for any object".to_owned(),
        _ => format!("more, except for {}", list(&fewer)),
    };
    format!(
        "Capturing these took {range} approaches to an object, where the others were trained on {}: {than}.",
        wording::count(approaches)
    )
}

/// The effect of a robot that aims better on the model that counts misses and on the one that does not.
fn aimed_better(by_approach: &ByApproach) -> String {
    let [contacts, all] = &by_approach.aimed;
    let change = |way: usize, aimed: &Way| {
        let simulated = &by_approach.ways[way];
        format!(
            "{} → {} wrong verdicts, {} → {} approaches",
            percent(simulated.wrong, 2),
            percent(aimed.wrong, 2),
            decimal(simulated.approaches.0, 1),
            decimal(aimed.approaches.0, 1)
        )
    };
    format!(
        "The model that counts misses: {}. The one that does not: {}.",
        change(ALL, all),
        change(CONTACTS, contacts)
    )
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
    let better = format!("{} of misses avoided", wording::rate(AVOIDED));
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

fn sizes_table(context: &Context, sizes: &[Way; 2], probes: Option<[Probe; 2]>) -> Table {
    let mut data = Records::new(columns("size of the objects"));
    let scaled = match context.settings.capture.unit {
        Length::Tenth => context.settings.capture.length,
        Length::Millimeter => Origin::default().length,
    };
    for (name, way) in [format!("scaled to {scaled} units"), "true size".to_owned()].iter().zip(sizes) {
        data.push(row(name, way));
    }
    Table {
        id: "approaches-sizes".into(),
        title: "Scaled to one size, and at true size".into(),
        caption: sizes_caption(&probes.unwrap_or_default()),
        command: context.settings.command.clone(),
        data,
    }
}

/// The probes that touched objects of one size, and of their true sizes.
fn sizes_caption([scaled, true_size]: &[Probe; 2]) -> String {
    format!(
        "Every contact counts. Scaled, {}. At true size {}.",
        described(scaled, Length::Tenth),
        described(true_size, Length::Millimeter)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probes_of_both_sizes_are_those_that_touched() {
        let true_size = with!(Probe::default(), radius = 2.0, spacing = 20.0, speed = 130.0);
        let said = sizes_caption(&[Probe::default(), true_size]);
        assert!(
            said.contains("Scaled, fingers of radius 0.15 units") && said.contains("true size fingers of radius 2 mm"),
            "{said}"
        );
    }

    fn names() -> Vec<String> {
        ["bowl", "fork"].map(String::from).into()
    }

    #[test]
    fn the_approaches_of_full_touches_are_compared_with_those_of_the_others_object_by_object() {
        let said = |taken: [u64; 2]| training_cost(&names(), &taken, 8_000);
        assert!(said([9_000, 90_000]).ends_with("took 9,000 to 90,000 approaches to an object, where the others were trained on 8,000: more for each object."));
        assert!(said([7_000, 90_000]).ends_with("more, except for bowl."), "{}", said([7_000, 90_000]));
        assert!(said([7_000, 8_000]).ends_with("no more for any object."), "{}", said([7_000, 8_000]));
    }

    #[test]
    fn the_share_of_full_touches_and_the_effect_of_aim_are_those_that_were_measured() {
        let shares = |full: f64| [0.0, 0.0, 0.0, 0.0, 1.0 - full, full];
        assert_eq!(full_touches(&names(), &[shares(0.5), shares(0.035)]), "from 3.5 % (fork) to 50.0 % (bowl) do");
        let way = |wrong: f64, approaches: f64| Way {
            bytes: 1,
            used: 1.0,
            accuracy: Vec::new(),
            approaches: (approaches, 0.0),
            per_object: Vec::new(),
            wrong,
            undecided: 0.0,
        };
        let ways = vec![way(0.1, 9.0), way(0.1, 9.0), way(0.01, 60.0), way(0.02, 50.0)];
        let aimed = [way(0.011, 55.0), way(0.09, 44.0)];
        let measured = ByApproach { shares: Vec::new(), ways, aimed, sizes: None, probes: None };
        assert_eq!(
            aimed_better(&measured),
            "The model that counts misses: 2.00 % → 9.00 % wrong verdicts, 50.0 → 44.0 approaches. The one that does not: \
             1.00 % → 1.10 % wrong verdicts, 60.0 → 55.0 approaches."
        );
    }
}
