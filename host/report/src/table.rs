//! Objects on a table: their placements, how many approaches touch them, and what an output for each placement gains.

use super::context::Context;
use crate::page::document::Section;
use crate::page::table::{Cell, Records, Table};
use palpate::calibrate::{self, calibrate};
use palpate::capture;
use palpate::compile::{self, Leaf, compile};
use palpate::ensemble::StatedProbe;
use palpate::ensemble::train::{self, Outputs};
use palpate::error::{CalibrateProblem, Result};
use palpate::evaluate::{Candidate, Margins, SequentialSettings};
use palpate::mesh::placements;
use palpate::touches::{Dataset, Origin, Surroundings};
use palpate::wording::{self, rate};
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;
use serde::{Deserialize, Serialize};

/// The promise that models are calibrated to.
const RATE: f64 = 0.01;
/// Approaches after which a recognizer gives up.
const MOST: u32 = 200;
/// Models that are compared: outputs and descriptor.
const MODELS: [(Outputs, Descriptor); 3] = [
    (Outputs::Placements, Descriptor::Gravity),
    (Outputs::Placements, Descriptor::Curvature),
    (Outputs::Objects, Descriptor::Curvature),
];

/// Measurements on a table; or why nothing was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Measured {
    OnTable {
        /// Approaches to each object in each of three captures.
        count: u64,
        cone: f64,
        objects: Vec<OfObject>,
        rows: Vec<Row>,
    },
    Not(String),
}

/// An object and its placements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct OfObject {
    name: String,
    /// Placements of its first instance, with their weights and the share of approaches that touch it so.
    placements: Vec<(String, f64, f64)>,
}

/// A model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    is_of_placements: bool,
    descriptor: String,
    bytes: usize,
    /// False where no threshold keeps the promise; then the figures are those of the posterior's own.
    is_calibrated: bool,
    approaches: f64,
    approaches_error: f64,
    /// Share of wrong names among those given; none if there are none.
    wrong: Option<f64>,
    undecided: f64,
    placement: Option<f64>,
}

/// Trains on approaches to objects on a table, calibrates on others, and tests on a third lot.
pub(super) fn measure(context: &Context) -> Result<Measured> {
    for object in context.objects {
        if let Err(error) = placements::of_object(object) {
            return Ok(Measured::Not(error.to_string()));
        }
    }
    let settings = context.settings;
    let cone = Surroundings::CONE;
    let captured = |lot: u64| -> Result<Dataset> {
        let origin = Origin {
            approaches: true,
            pose: true,
            touches: settings.approaches,
            seed: settings.seed.wrapping_add(0x7ab1 + lot),
            scene: Surroundings::Table { cone },
            ..settings.capture.clone()
        };
        Ok(capture::in_memory(context.objects, &capture::Settings { origin, ..Default::default() }, context.progress)?
            .0)
    };
    let (training, fresh, test) = (captured(0)?, captured(1)?, captured(2)?);
    let objects = training.by_placement();
    let touched = |object: &str, placement: &str| {
        let own = objects.objects.iter().find(|own| own.name == format!("{object}/{placement}"));
        own.map_or(0.0, |own| {
            let contacts =
                own.touches().iter().filter(|touch| touch.times().iter().any(|time| time.micros().is_some()));
            contacts.count() as f64 / own.len().max(1) as f64
        })
    };
    let of_object = |object: &palpate::touches::ObjectTouches| OfObject {
        name: object.name.clone(),
        placements: object
            .placement_weights()
            .unwrap_or_default()
            .into_iter()
            .map(|(name, weight)| {
                let touched = touched(&object.name, &name);
                (name, weight, touched)
            })
            .collect(),
    };
    let rows =
        MODELS.into_iter().map(|model| row(context, model, [&training, &fresh, &test])).collect::<Result<_>>()?;
    let objects = training.objects.iter().map(of_object).collect();
    Ok(Measured::OnTable { count: settings.approaches, cone, objects, rows })
}

fn row(
    context: &Context,
    (outputs, descriptor): (Outputs, Descriptor),
    [training, fresh, test]: [&Dataset; 3],
) -> Result<Row> {
    context.check()?;
    let recipe = train::Settings {
        descriptor,
        outputs,
        counted: Some(Counted::All),
        rounds: 25,
        leaf_bits: Some(8),
        probe: StatedProbe::of(training),
        ..context.ours_for_noise()
    };
    let ensemble = context.train(training, &recipe)?;
    let settings = compile::Settings { leaf: Leaf::I8, max_touches: MOST, error_rate: RATE, ..Default::default() };
    let mut bytes = compile(&ensemble, &settings)?.bytes;
    let sequences = if context.settings.quick { 3_000 } else { 20_000 };
    let promise = calibrate::Settings {
        rate: RATE,
        sequences,
        noise: context.settings.noise,
        seed: context.settings.seed,
        ..Default::default()
    };
    let found =
        calibrate(&compile::open(&bytes)?, fresh.clone().matching(&ensemble.objects), &promise, context.progress);
    let is_calibrated = match found {
        Ok(calibrated) => {
            bytes = calibrated.model;
            true
        }
        Err(error) if error.problem::<CalibrateProblem>().is_some() => false,
        Err(error) => return Err(error),
    };
    let mut test = test.clone().matching(&ensemble.objects);
    palpate::evaluate::add_noise(&mut test, &context.settings.noise, context.settings.seed)?;
    let model = compile::open(&bytes)?;
    let sequences = SequentialSettings {
        error_rate: None,
        max_touches: None,
        sequences: if context.settings.quick { 200 } else { 2_000 },
        seed: context.settings.seed,
    };
    let found = Margins::new(Candidate::Compiled(&model), &test)?.sequential(&sequences)?;
    Ok(Row {
        is_of_placements: outputs == Outputs::Placements,
        descriptor: descriptor.name().into(),
        bytes: bytes.len(),
        is_calibrated,
        approaches: found.mean_touches,
        approaches_error: found.mean().standard_error,
        wrong: number(found.error_of_given),
        undecided: found.undecided,
        placement: found.placement.and_then(number),
    })
}

/// A share, which is not a number where it is one of nothing.
fn number(share: f64) -> Option<f64> {
    (!share.is_nan()).then_some(share)
}

/// The tables.
pub(super) fn section(context: &Context, measured: &Measured) -> Section {
    let mut section = Section::new("table", "On a table");
    let (count, cone, objects, rows) = match measured {
        Measured::OnTable { count, cone, objects, rows } => (count, cone, objects, rows),
        Measured::Not(reason) => {
            section.text(format!("Nothing was measured: {reason}"));
            return section;
        }
    };
    section.text(format!(
        "An object on a table lies in one of a few placements, turned by an unknown angle, and approaches come from above, \
         within {cone} degrees of straight down. A robot knows which way is down. The models were trained on {} \
         approaches to each object, calibrated on as many others, and tested on a third set; approaches that touch nothing \
         are evidence too. A sequence of approaches is of one placement, drawn by its weight. Directions and angles about \
         the vertical are random.",
        wording::count(*count)
    ));
    section.table(models(context, rows));
    section.table(placements_of(context, objects));
    section
}

fn models(context: &Context, rows: &[Row]) -> Table {
    let mut data = Records::new([
        "outputs",
        "descriptor",
        "bytes",
        "approaches",
        "wrong of the names given",
        "undecided",
        "placement named",
        "promised",
    ]);
    for row in rows {
        data.push([
            if row.is_of_placements { "placements" } else { "objects" }.into(),
            row.descriptor.as_str().into(),
            Cell::count(row.bytes),
            Cell::Spread(row.approaches, row.approaches_error, 1),
            row.wrong.map_or(Cell::Missing, |share| Cell::Percent(share, 2)),
            Cell::Percent(row.undecided, 1),
            row.placement.map_or(Cell::Missing, |share| Cell::Percent(share, 0)),
            if row.is_calibrated { "yes" } else { "no" }.into(),
        ]);
    }
    Table {
        id: "table-models".into(),
        title: "Approaches to a name on a table".into(),
        caption: format!(
            "At thresholds that promise at most {} wrong names; at most {MOST} approaches, with which sequences without a \
             name are counted. Not promised: no threshold keeps the rate, or names were too few to know; then at the threshold \
             of the posterior. Placement named: the share of right names that are given with the right placement.",
            rate(RATE)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

fn placements_of(context: &Context, objects: &[OfObject]) -> Table {
    let mut data = Records::new(["object", "placement", "weight", "approaches that touch"]);
    for object in objects {
        for (placement, weight, touched) in &object.placements {
            data.push([
                object.name.as_str().into(),
                placement.as_str().into(),
                Cell::Percent(*weight, 1),
                Cell::Percent(*touched, 1),
            ]);
        }
    }
    Table {
        id: "table-placements".into(),
        title: "Placements".into(),
        caption:
            "Stable ways of lying, called after the axis of the mesh that points up. Weights are how often an object \
                  comes to rest so if it is dropped and rolls without momentum, of its first instance."
                .into(),
        command: context.settings.command.clone(),
        data,
    }
}
