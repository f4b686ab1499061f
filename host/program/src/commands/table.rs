//! Models of maps on a simulated table: thresholds, their test, and what is in a model.

use super::Global;
use super::maps::name;
use super::probe::UnitArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::shape::{self, Touched};
use palpate::calibrate;
use palpate::ensemble::StatedProbe;
use palpate::evaluate::Finding;
use palpate::locate::{
    self, Aimed, Calibrated, Evaluation, Inspected, LeftOut, MapsFile, POSE, Promised, Real, Standing, Terms, ToPlace,
    Until,
};
use palpate::output;
use palpate::probe::Probe;
use palpate::probe::file::ProbeFile;
use palpate::wording::{count, decimal, percent, rate};
use palpate::{Error, Result};
use palpate_shared::format::{Length, Per};
use std::fmt::Write as _;
use std::path::Path;

/// Approaches on a simulated table.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct TableArguments {
    /// Aim of simulated approaches: chosen, where they tell most, or random [default: the promise's, or chosen]
    #[arg(long, value_name = "HOW", value_parser = aimed, requires = "objects")]
    aimed: Option<Aimed>,
    /// Go on after the name until the place is as sure: half of its 95 % intervals, such as 3mm/5deg
    #[arg(long, value_name = "LENGTH/ANGLE", value_parser = until, requires = "objects")]
    until: Option<Until>,
    /// Make a test for objects that the model does not know; names then take eight approaches or more
    #[arg(long, requires = "objects")]
    detect_unknown: bool,
    /// Proposed approaches send the middle finger at most so far from the table's origin in x and y; random ones, too [default:
    /// twice the maps' range]
    #[arg(long, value_name = "MM", requires = "objects")]
    workspace: Option<f64>,
    #[command(flatten)]
    units: UnitArguments,
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

/// Terms from a command's other options.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    pub(crate) model: &'a Path,
    pub(crate) objects: &'a [String],
    pub(crate) real: &'a RealArguments,
    pub(crate) promise: calibrate::Terms,
    pub(crate) sequences: usize,
    pub(crate) max_touches: Option<u32>,
    pub(crate) seed: u64,
}

/// A model, the objects on the table, and the terms of sequences.
struct Table {
    file: MapsFile,
    standing: Vec<Standing>,
    probe: Probe,
    terms: Terms,
}

impl TableArguments {
    /// Refuses sizes of meshes where there are none.
    pub(crate) fn check_unused(&self) -> Result<()> {
        match self.units.words().first() {
            Some(word) => Err(Error::setting("objects", "not given", format!("it with {word}"))),
            None => Ok(()),
        }
    }

    fn table(&self, wanted: &Wanted<'_>) -> Result<Table> {
        let Some(file) = MapsFile::read(wanted.model)? else {
            // If the file holds no trees either, its own error says why.
            palpate::compile::CompiledModel::read(wanted.model)?;
            return Err(locate::not_maps().in_file(wanted.model));
        };
        let maps = file.maps();
        let probe = locate::hand(&maps).map_err(|error| error.in_file(wanted.model))?;
        let stated = locate::stated(&maps);
        let noise = wanted.real.on_table(stated.noise(probe.speed))?;
        let mut units = self.units.clone();
        units.imply_true_size();
        let (touched, meshes): (Vec<String>, Vec<String>) =
            wanted.objects.iter().cloned().partition(|source| shape::is_touches(source));
        let objects = if meshes.is_empty() { Vec::new() } else { units.objects(&meshes, wanted.seed)? };
        let mut standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, stated.height, &Bar::new())?;
        let hand = ProbeFile { probe, unit: Length::Millimeter, real: stated.noise(probe.speed) };
        for source in &touched {
            let Touched { name, shape, .. } = shape::read(Path::new(source), &hand)?;
            standing.push(shape.standing(&name)?);
        }
        standing.sort_by(|a, b| a.name.cmp(&b.name));
        let promised = Promised::of(&maps).map(|promised| promised.aimed);
        let terms = Terms {
            promise: wanted.promise,
            sequences: wanted.sequences,
            max_touches: wanted.max_touches.unwrap_or(maps.stopping().max_touches()),
            aimed: self.aimed.or(promised).unwrap_or(Aimed::Chosen),
            real: Real::of(&noise, probe.speed)?,
            unknown: self.detect_unknown,
            until: self.until,
            // Where the pose is to be sure, approaches are chosen for it, too.
            pose: if self.until.is_some() { 4 * POSE } else { POSE },
            within: locate::workspace(&maps, self.workspace)?,
            seed: wanted.seed,
            effort: None,
        };
        Ok(Table { file, standing, probe, terms })
    }

    /// Calibrates a model of maps, on recordings if there are some, and writes it.
    pub(crate) fn calibrate(
        &self,
        wanted: &Wanted<'_>,
        recorded: Option<&Path>,
        output: &Path,
        global: &Global,
    ) -> Result<()> {
        output::admit(output, recorded.map(super::files_of).into_iter().flatten().chain([wanted.model.into()]))?;
        let Table { file, standing, probe, terms } = self.table(wanted)?;
        let maps = file.maps();
        let calibrated = if let Some(directory) = recorded {
            self.check_unused()?;
            let recorded = super::dataset(directory)?;
            StatedProbe::compare_with(["the maps", "the recordings"], maps.probe(), u32::MAX, &recorded)?;
            locate::calibrate_recorded(maps, &recorded, &probe, &terms, &Bar::new())
                .map_err(|error| error.in_file(directory))?
        } else {
            // The sequences of an evaluation with the same seed are others.
            let terms = Terms { seed: terms.seed.wrapping_mul(2), aimed: self.aimed.unwrap_or(Aimed::Chosen), ..terms };
            locate::calibrate(maps, &standing, &probe, &terms, &Bar::new())
                .map_err(|error| error.in_file(wanted.model))?
        };
        output::write_bytes(output, &calibrated.model)?;
        global.print_about(output, &calibrated, || calibrated_text(output, &calibrated, maps.stopping().odds()))
    }

    /// Evaluates a model of maps.
    pub(crate) fn evaluate(&self, wanted: &Wanted<'_>, global: &Global) -> Result<()> {
        let Table { file, standing, probe, terms } = self.table(wanted)?;
        let terms = Terms { seed: terms.seed.wrapping_mul(2).wrapping_add(1), ..terms };
        let evaluated = locate::evaluate(file.maps(), &standing, &probe, &terms, &Bar::new())
            .map_err(|error| error.in_file(wanted.model))?;
        let noise = terms.real.noise(probe.speed).to_string();
        let is_here = |name: &String| standing.iter().any(|object| object.name == *name);
        let names = locate::names(&file.maps());
        let are_others = names.len() != standing.len() || !names.iter().all(is_here);
        match global.json {
            true => output::print_json(&Evaluated { aimed: terms.aimed, noise, evaluation: &evaluated }),
            false => output::print(&evaluated_text(&evaluated, &terms, &noise, are_others)),
        }
    }
}

#[derive(serde::Serialize)]
struct Evaluated<'e> {
    aimed: Aimed,
    noise: String,
    #[serde(flatten)]
    evaluation: &'e Evaluation,
}

/// The aim of approaches, in words.
fn how(aimed: Aimed) -> &'static str {
    match aimed {
        Aimed::Chosen => "chosen approaches",
        Aimed::Random => "approaches at random",
    }
}

fn calibrated_text(path: &Path, calibrated: &Calibrated, before: u64) -> String {
    let Calibrated { promised, confidence, aimed, sequences, given, wrong, .. } = *calibrated;
    let margins = [("all".to_owned(), calibrated.margin)].into_iter().collect();
    let terms = match calibrated.recordings {
        None => format!("{}, for {}", how(aimed), calibrated.noise),
        Some(recordings) => {
            format!("approaches like those of {recordings} recordings, in any order and in new recordings")
        }
    };
    let note = "note: sequences of one recording share its pose, so each recording counts once.\n";
    super::thresholds::promised(promised, Per::Average, "", confidence)
        + &format!(
            "It holds for {terms}, and for at most {} of them.\n\
             {} sequences: {} names given, {wrong} wrong, {} without a name; {} approaches each.\n",
            calibrated.max_touches,
            count(sequences),
            count(given),
            percent(1.0 - given as f64 / sequences.max(1) as f64, 2),
            decimal(calibrated.mean_approaches, 1),
        )
        + &calibrated.until.map_or_else(String::new, |ToPlace { right, placed, mean_approaches }| {
            let approaches = decimal(mean_approaches, 1);
            format!("Until the place is sure: {approaches} approaches each; {placed} of {right} objects named rightly had a sure place.\n")
        })
        + &calibrated.strangers.map_or_else(String::new, |LeftOut { sequences, unknown, named }| {
            format!(
                "Test for unknown objects, with each object left out in turn: {unknown} of {sequences} sequences ended as unknown, \
                 {named} with a name.\n"
            )
        })
        + calibrated.recordings.map_or("", |_| note)
        + &super::thresholds::text(&margins, &Default::default(), calibrate::margin_of(before))
        + &format!("{}: {} bytes\n", path.display(), count(calibrated.model.len()))
}

fn evaluated_text(evaluated: &Evaluation, terms: &Terms, noise: &str, are_others: bool) -> String {
    let Evaluation { sequences, given, wrong, undecided, unknown, off: [half, most], .. } = *evaluated;
    let mut text = format!(
        "{} sequences of {}, for {noise}\n\
         {} names given, {} of them wrong ({wrong}); {undecided} sequences undecided, {unknown} unknown; {} approaches each\n\
         places of right names: half within {} mm, 95 % within {} mm; {} of {} in the intervals of {}\n",
        count(sequences),
        how(terms.aimed),
        count(given),
        percent(wrong as f64 / given.max(1) as f64, 2),
        decimal(evaluated.mean_approaches, 2),
        decimal(half, 1),
        decimal(most, 1),
        count(evaluated.poses_in_interval),
        count(evaluated.poses),
        if terms.until.is_some() { "their pose" } else { "one of the modes of their pose" },
    );
    let lost = given - wrong - evaluated.poses;
    if lost > 0 {
        // Writing to a string cannot fail.
        _ = writeln!(text, "{} right names had no sure place in the end", count(lost));
    }
    if let Some(tested) = &evaluated.promise {
        let promised = &tested.promised;
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "Promised: at most {} wrong, with {} ({} sure, from {} sequences). Measured: {}: {}.",
            rate(promised.error_rate),
            how(promised.aimed),
            rate(promised.confidence),
            count(promised.sequences),
            percent(tested.error, 2),
            match tested.finding {
                Finding::Kept => "the promise is kept",
                Finding::Unclear => "above it, but no more than chance explains",
                Finding::Broken => "BROKEN, by more than chance explains",
                Finding::Untested => "no name was given",
            },
        );
        for (is_other, what) in [
            (promised.aimed != terms.aimed, how(promised.aimed)),
            (promised.noise != noise, promised.noise.as_str()),
            (are_others, "the objects of the model, all of them"),
        ] {
            if is_other {
                _ = writeln!(text, "Void here: it was made for {what}.");
            }
        }
    }
    let width = evaluated.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).max(6);
    _ = writeln!(text, "\n{:width$} {:>10} {:>6} {:>8}", "object", "approaches", "wrong", "unknown");
    for object in &evaluated.objects {
        let approaches = decimal(object.mean_approaches, 1);
        _ = writeln!(text, "{:width$} {approaches:>10} {:>6} {:>8}", object.name, object.wrong, object.unknown);
    }
    text
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
