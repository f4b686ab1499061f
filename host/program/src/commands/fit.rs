//! `palpate probe fit`.

use super::Global;
use super::numbers::count;
use super::probe::{SizeArguments, refuse_unstated};
use super::progress::Bar;
use super::scene::SceneArguments;
use palpate::ensemble::StatedProbe;
use palpate::fit::{Fit, FitSettings, GrazingEstimate, between, fit, offset, offset_between};
use palpate::output;
use palpate::results::{Results, Value};
use palpate::touches::{Origin, read_touches};
use palpate::{Error, Result, row, with};
use palpate_shared::format::Length;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
RECORDED is a data set that your probe made, of objects whose meshes you have, matched by their names. The probe that explains the recorded touches best is written: how fast it really is, how late each finger touches, its noise, what it misses, its timer. `palpate capture --probe probe.toml` then gives touches as it would.

A few hundred approaches to three or four objects are enough. Presses on a flat plate, with half a turn of the probe after each, determine offsets better than any object, and nothing else: one line per press, in a file for --plate.

With --scene table the objects stood on a table and were approached from above; the table itself is a plate. Recordings that state their placement (`palpate data record --object bowl/+z`) determine more.

Examples:
  palpate probe fit recorded meshes/ -o probe.toml
  palpate probe fit recorded meshes/ -o probe.toml --plate plate.txt
  palpate probe fit recorded meshes/ -o fitted.toml --probe probe.toml \\
      --true-size mm
  palpate probe fit recorded meshes/ -o probe.toml --scene table")]
pub(crate) struct Arguments {
    /// The recorded touches: a directory with a file for each object
    #[arg(value_name = "RECORDED")]
    recorded: PathBuf,
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", required = true)]
    sources: Vec<String>,
    /// Output; the probe, such as probe.toml
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Presses on a flat plate, half a turn of the probe after each, one line per press
    #[arg(long, value_name = "FILE")]
    plate: Option<PathBuf>,
    /// Approaches to each object; simulated
    #[arg(long, value_name = "N", value_parser = count, default_value_t = FitSettings::default().approaches)]
    approaches: u64,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    scene: SceneArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let inputs = super::files_of(&arguments.recorded).into_iter().chain(arguments.plate.clone());
    output::admit(&arguments.output, inputs)?;
    let recorded = super::checked(palpate::touches::Dataset::read_any(&arguments.recorded)?);
    let base = recorded.origin.clone().unwrap_or_default();
    if recorded.origin.as_ref().is_none_or(|origin| origin.probe == Origin::default().probe) {
        refuse_unstated(&arguments.size)?;
    }
    let there = base.probe.stroke;
    let mut origin = arguments.size.origin(base)?;
    // The stroke that the recordings state holds where the file states none; one that differs is refused.
    match (there, origin.probe.stroke) {
        (Some(there), Some(given)) if there != given => {
            let differences = format!("stroke {given} and {there}");
            return Err(StatedProbe::differs(["the probe file", "the data set"], &differences));
        }
        (_, given) => origin.probe.stroke = given.or(there),
    }
    origin.scene = arguments.scene.scene(origin.scene)?;
    if let (true, Some((output, _))) = (origin.scene.is_floating(), recorded.placement_shares().first_key_value()) {
        let allowed = format!("table: the recordings state placements on one, such as {output}");
        return Err(Error::setting("scene", "floating", allowed));
    }
    let mut objects = arguments.size.objects(&arguments.sources, global.seed())?;
    arguments.scene.weights.weigh(&mut objects)?;
    let plate = arguments.plate.as_deref().map(read_touches).transpose()?;
    let settings = with!(FitSettings::default(), origin, approaches = arguments.approaches, seed = global.seed());
    let found = fit(&recorded, &objects, plate.as_deref(), &settings, &Bar::new())?;
    output::write_bytes(&arguments.output, found.toml().as_bytes())?;
    global.print_about(&arguments.output, &found, || table(&found))?;
    match global.json {
        true => Ok(()),
        false => output::print_about(&arguments.output, &format!("Wrote {}\n", arguments.output.display())),
    }
}

/// Estimates, one line for each number.
fn table(found: &Fit) -> String {
    let mut rows = Results::new(["", "value", "95 % interval"]);
    let speed = &found.speed_factor;
    rows.push(row!["speed over nominal", Value::Number(speed.value, 3), between(speed, 1.0, 3)]);
    rows.push(row!["first finger", Value::Measure(0.0, 1, "ms"), "the others are compared with it"]);
    for (name, late) in ["second finger", "third finger"].into_iter().zip(&found.late) {
        rows.push(row![name, offset(late.value, 1), offset_between(late, 1)]);
    }
    rows.push(row!["noise", Value::Measure(found.noise.value, 2, "ms"), between(&found.noise, 1.0, 2) + " ms"]);
    for (name, missed) in ["first", "second", "third"].into_iter().zip(found.missed.iter().flatten()) {
        let interval = between(missed, 100.0, 1) + " %";
        rows.push(row![format!("{name} finger misses"), Value::Percent(missed.value, 1), interval]);
    }
    if let Some(stroke) = &found.stroke {
        let unit = if found.unit == Length::Tenth { "units" } else { "mm" };
        rows.push(row!["stroke", Value::Measure(stroke.value, 3, unit), between(stroke, 1.0, 3)]);
    }
    if let Some(GrazingEstimate { angle, bend }) = &found.grazing {
        rows.push(row!["fingers bend beyond", Value::Measure(angle.value, 0, "degrees"), between(angle, 1.0, 0)]);
        rows.push(row!["aside by", Value::Measure(bend.value, 2, "ms"), between(bend, 1.0, 2)]);
    }
    rows.push(row!["timer", found.timer.map_or("none found".into(), |timer| format!("{timer} ms"))]);
    let [full, pairs] = found.contacts;
    let mut text = format!(
        "{} approaches to {}{}: {full} with three contacts, {pairs} with two{}\n\n{}",
        found.recorded,
        found.objects.join(", "),
        if found.scene.is_floating() { "" } else { " on a table" },
        if found.presses > 0 { format!(", {} presses on a plate", found.presses) } else { String::new() },
        rows.text()
    );
    if found.stroke.is_some() {
        text += "\nThe stroke was not stated: no recorded contact is later, where many would be.";
    }
    let coarse = found.readings.or(found.timer.filter(|timer| *timer >= 5.0));
    if let Some(interval) = coarse {
        text += &format!(
            "\nContact times cluster about multiples of {interval} ms, as if contacts were read only that often. The probe states \
             that as noise, and as its timer; read them more frequently if you can."
        );
    }
    text += "\nOffsets are relative to the first finger's: only differences of times are recorded.\n";
    text + &found.warnings.iter().map(|warning| format!("Poorly determined: {warning}\n")).collect::<String>()
}
