//! Models of maps on a simulated table, and what is in such a model.

use super::maps::name;
use super::probe::UnitArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::shape::{self, Touched};
use super::{Global, kinds};
use palpate::Result;
use palpate::calibrate;
use palpate::locate::{self, Aimed, Inspected, MapsFile, POSE, Promised, Real, Standing, Terms, Until};
use palpate::output;
use palpate::probe::Probe;
use palpate::probe::file::ProbeFile;
use palpate::wording::{count, decimal, percent, rate};
use palpate_shared::format::Length;
use std::fmt::Write as _;
use std::path::Path;

/// Approaches on a simulated table.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct TableArguments {
    /// Sequences of touches to draw; of all objects together
    #[arg(long, value_name = "N", value_parser = super::numbers::sequences, default_value = "1000")]
    sequences: usize,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Aim of simulated approaches: chosen, where they tell most, or random [default: the promise's, or chosen]
    #[arg(long, value_name = "HOW", value_parser = aimed)]
    pub(super) aimed: Option<Aimed>,
    /// Go on after the name until the place is as sure: half of its 95 % intervals, such as 3mm/5deg
    #[arg(long, value_name = "LENGTH/ANGLE", value_parser = until)]
    until: Option<Until>,
    /// Keep the middle finger this close to the table's origin, in x and y [default: twice the maps' range]
    #[arg(long, value_name = "MM")]
    workspace: Option<f64>,
    #[command(flatten)]
    units: UnitArguments,
    #[command(flatten)]
    real: RealArguments,
}

fn aimed(name: &str) -> Result<Aimed, String> {
    match name {
        "chosen" => Ok(Aimed::Chosen),
        "random" => Ok(Aimed::Random),
        _ => Err("use chosen or random".to_owned()),
    }
}

fn until(text: &str) -> Result<Until, String> {
    let wrong = || format!("use a length and an angle, such as 3mm/5deg, not {text}");
    let (length, angle) = text.split_once('/').ok_or_else(wrong)?;
    let number = |text: &str, unit| text.strip_suffix(unit).and_then(|number| number.parse::<f64>().ok());
    let (millimeters, degrees) = number(length, "mm").zip(number(angle, "deg")).ok_or_else(wrong)?;
    let is_positive = millimeters > 0.0 && degrees > 0.0;
    if is_positive { Ok(Until { millimeters, degrees }) } else { Err(wrong()) }
}

/// A model, the objects on the table, and the terms of sequences.
pub(super) struct Table {
    pub(super) file: MapsFile,
    pub(super) standing: Vec<Standing>,
    pub(super) probe: Probe,
    pub(super) terms: Terms,
}

impl TableArguments {
    /// The table of a command such as `calibrate`, with objects of these meshes and files of touches.
    pub(super) fn table(
        &self,
        model: &Path,
        objects: &[String],
        promise: calibrate::Terms,
        seed: u64,
        command: &str,
    ) -> Result<Table> {
        let file = kinds::maps(model, command)?;
        let maps = file.maps();
        let probe = locate::hand(&maps).map_err(|error| error.in_file(model))?;
        let stated = locate::stated(&maps);
        let noise = self.real.on_table(stated.noise(probe.speed))?;
        let mut units = self.units.clone();
        units.imply_true_size();
        let (touched, meshes): (Vec<String>, Vec<String>) =
            objects.iter().cloned().partition(|source| shape::is_touches(source));
        let objects = if meshes.is_empty() { Vec::new() } else { units.objects(&meshes, seed)? };
        let mut standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, stated.height, &Bar::new())?;
        let hand = ProbeFile { probe, unit: Length::Millimeter, real: stated.noise(probe.speed) };
        for source in &touched {
            let Touched { name, shape, .. } = shape::read(Path::new(source), &hand)?;
            standing.push(shape.standing(&name)?);
        }
        standing.sort_by(|a, b| a.name.cmp(&b.name));
        let promised = Promised::of(&maps).map(|promised| promised.aimed);
        let terms = Terms {
            promise,
            sequences: self.sequences,
            max_touches: self.max_touches.unwrap_or(maps.stopping().max_touches()),
            aimed: self.aimed.or(promised).unwrap_or(Aimed::Chosen),
            real: Real::of(&noise, probe.speed)?,
            unknown: false,
            until: self.until,
            // Where the pose is to be sure, approaches are chosen for it, too.
            pose: if self.until.is_some() { 4 * POSE } else { POSE },
            within: locate::workspace(&maps, self.workspace)?,
            seed,
            effort: None,
        };
        Ok(Table { file, standing, probe, terms })
    }
}

/// The aim of approaches, in words.
pub(super) fn how(aimed: Aimed) -> &'static str {
    match aimed {
        Aimed::Chosen => "chosen approaches",
        Aimed::Random => "approaches at random",
    }
}

/// Prints what is in a model of maps.
pub(super) fn inspect(file: &MapsFile, global: &Global) -> Result<()> {
    let maps = file.maps();
    let inspected = locate::inspect(&maps)?;
    if global.json { output::print_json(&inspected) } else { output::print(&inspected_text(&inspected)) }
}

fn inspected_text(inspected: &Inspected<'_>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |name: &str, value: String| _ = writeln!(text, "{name:14} {value}");
    line("format version", format!("{} (palpate {})", inspected.version, inspected.tool_version));
    line("objects", format!("{}: {}", inspected.objects.len(), inspected.objects.join(", ")));
    line("maps", format!("cells of {} mm, of {} placements", inspected.cell, inspected.placements.len()));
    let named = |of: &locate::OfPlacement<'_>| name(of.object, of.placement);
    let width = inspected.placements.iter().map(|of| named(of).chars().count()).max().unwrap_or(0);
    for of in &inspected.placements {
        let round = if of.round { ", round" } else { "" };
        let least =
            of.least_fit.map_or_else(String::new, |least| format!(", unknown below {} nats", decimal(least, 2)));
        let (share, bytes) = (percent(of.share, 0), count(of.bytes));
        line("", format!("{:width$} {share:>6} {bytes:>8} bytes{round}{least}", named(of)));
    }
    let has_test = inspected.placements.iter().any(|of| of.least_fit.is_some());
    let test = if has_test { "from the eighth approach on, by the nats for each touch above" } else { "none" };
    line("unknown test", test.into());
    line("range", format!("places within {} mm of the table's origin, along x and y", inspected.range));
    let Probe { radius, spacing, speed, stroke, .. } = inspected.probe;
    let stroke = stroke.map_or("to the table".into(), |stroke| format!("stroke {stroke} mm"));
    line("hand", format!("radius {radius} mm, spacing {spacing} mm, speed {speed} mm per second, {stroke}"));
    line("noise", inspected.noise.clone());
    line(
        "stopping",
        format!(
            "{} nats ahead of all others, at most {} approaches",
            decimal(inspected.margin, 2),
            inspected.max_touches
        ),
    );
    if let Some(promise) = &inspected.promise {
        line(
            "promise",
            format!(
                "at most {} of all names given wrong, {} sure; {} sequences of {} {}, {} names given, {} wrong",
                rate(promise.error_rate),
                rate(promise.confidence),
                count(promise.sequences),
                decimal(promise.mean_approaches, 1),
                how(promise.aimed),
                count(promise.given),
                promise.wrong,
            ),
        );
        line("", format!("for {}", promise.noise));
    }
    let cost = &inspected.approach;
    line(
        "an approach",
        format!(
            "at most {} lookups of heights, about {} million instructions on a Cortex-M4F",
            count(cost.lookups),
            cost.instructions / 1_000_000
        ),
    );
    line("RAM", format!("{} bytes with room for {} cells", count(cost.ram), count(cost.cells)));
    line("bytes", count(inspected.bytes));
    line("checksum", inspected.checksum.clone());
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
