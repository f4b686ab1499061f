//! `palpate probe`, and `palpate probe fit`.

use super::Global;
use super::numbers::count;
use super::probe::{IN_MILLIMETERS, SizeArguments, refuse_unstated};
use super::progress::Bar;
use super::recognize_lines::{Event, each_of};
use super::scene::SceneArguments;
use palpate::ensemble::StatedProbe;
use palpate::fit::{Fit, FitSettings, GrazingEstimate, NOT_TOLD, between, fit, offset, offset_between};
use palpate::locate::{BareTable, Measured, REACH, bare_table};
use palpate::output;
use palpate::touches::{Origin, read_touches};
use palpate::with;
use palpate::{Error, Result};
use palpate_shared::format::Length;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Measure how your probe differs from the ideal, from its touches
    Fit(Box<FitArguments>),
}

#[derive(clap::Args)]
#[command(after_help = "\
RECORDED is a data set that your probe made, of objects whose meshes you have, matched by their names. The probe that explains the recorded touches best is written: how fast it really is, how late each finger touches, its noise, what it misses, its timer. `palpate capture --probe probe.toml` then gives touches as it would.

A few hundred approaches to three or four objects are enough. Presses on a flat plate, with half a turn of the probe after each, determine offsets better than any object, and nothing else: one line per press, in a file for --plate.

Without SOURCE, RECORDED is a file of presses on the bare table by a hand that states its position: 20 of them beside the object, straight down, with half a turn of the hand after each. The height of the table and the offsets of the outer fingertips are printed, and the probe is written with them. It needs --probe in millimeters.

With --scene table the objects stood on a table and were approached from above; the table itself is a plate. Recordings that state their placement (`palpate data record --object bowl/+z`) determine more.

Examples:
  palpate probe fit recorded meshes/ -o probe.toml
  palpate probe fit recorded meshes/ -o probe.toml --plate plate.txt
  palpate probe fit recorded meshes/ -o fitted.toml --probe probe.toml \\
      --true-size mm
  palpate probe fit presses.txt -o fitted.toml --probe hand.toml
  palpate probe fit recorded meshes/ -o probe.toml --scene table")]
struct FitArguments {
    /// The recorded touches: a directory with a file for each object; or, without SOURCE, a file of presses on a bare table
    #[arg(value_name = "RECORDED")]
    recorded: PathBuf,
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE")]
    sources: Vec<String>,
    /// Output; the probe, such as probe.toml
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Presses on a flat plate, half a turn of the probe after each, one line per press
    #[arg(long, value_name = "FILE", requires = "sources")]
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
    let Command::Fit(arguments) = arguments.command;
    run_fit(&arguments, global)
}

fn run_fit(arguments: &FitArguments, global: &Global) -> Result<()> {
    let inputs = super::files_of(&arguments.recorded).into_iter().chain(arguments.plate.clone());
    output::admit(&arguments.output, inputs)?;
    if arguments.sources.is_empty() {
        return fit_bare(arguments, global);
    }
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
    arguments.scene.weigh(&mut objects)?;
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

/// Measures the table and the fingertips by presses on the bare table.
fn fit_bare(arguments: &FitArguments, global: &Global) -> Result<()> {
    let path = &arguments.recorded;
    if path.is_dir() {
        let allowed = "objects, or instead of the directory a file of presses on the bare table";
        return Err(Error::setting("SOURCE", "not given", allowed));
    }
    let file = arguments.size.probe.read()?.filter(|file| file.unit == Length::Millimeter);
    let probe = file.ok_or_else(|| Error::setting("probe", "not in millimeters", IN_MILLIMETERS))?.probe;
    let mut presses = Vec::new();
    each_of(path, &mut |event| {
        if let Event::Touch { touch, place } = event {
            presses.push((place, *touch));
        }
        Ok(())
    })?;
    let found = bare_table(&presses, &probe).map_err(|error| error.in_file(path))?;
    output::write_bytes(&arguments.output, found.toml(&probe).as_bytes())?;
    global.print_about(&arguments.output, &found, || bare_text(&found, &arguments.output))
}

fn bare_text(found: &BareTable, path: &Path) -> String {
    let BareTable { presses, contacts, lost, left_out, height, tips: [first, third], rise, noise } = found;
    let mut text = format!(
        "{presses} presses on a bare table: {contacts} contacts with it, {lost} missing, {left_out} left out\n\n\
         {:28}{:>9}  standard error\n",
        "", "mm"
    );
    let above = format!("table's rise over {REACH} mm");
    for (name, Measured { value, error }) in [
        ("table's height", height),
        ("first fingertip stands out", first),
        ("third fingertip stands out", third),
        (above.as_str(), rise),
    ] {
        // Writing to a string cannot fail.
        _ = writeln!(text, "{name:28}{value:9.2}  {error:.2}");
    }
    _ = write!(
        text,
        "{:28}{noise:9.2}\n\nSubtract the table's height from z, and a fingertip's offset from the heights that it meets.\n",
        "scatter of a contact"
    );
    if found.is_slanted() {
        text += "The table is not level: it raises objects on one side.\n";
    }
    text + &format!("Wrote {}\n", path.display())
}

/// Estimates, one line for each number.
fn table(found: &Fit) -> String {
    let [full, pairs] = found.contacts;
    let presses = if found.presses > 0 { format!(", {} presses on a plate", found.presses) } else { String::new() };
    let mut text = format!(
        "{} approaches to {}{}: {full} with three contacts, {pairs} with two{presses}\n\n{:22}{:>14}  95 % interval\n",
        found.recorded,
        found.objects.join(", "),
        if found.scene.is_floating() { "" } else { " on a table" },
        "",
        "value"
    );
    let mut line = |name: &str, value: String, interval: String| {
        // Writing to a string cannot fail.
        _ = writeln!(text, "{name:22}{value:>14}  {interval}");
    };
    let speed = &found.speed_factor;
    line("speed over nominal", format!("{:.3}", speed.value), between(speed, 1.0, 3));
    line("first finger", "0.0 ms".into(), "the others are compared with it".into());
    for (name, late) in ["second finger", "third finger"].into_iter().zip(&found.late) {
        line(name, offset(late.value, 1), offset_between(late, 1));
    }
    line("noise", format!("{:.2} ms", found.noise.value), between(&found.noise, 1.0, 2) + " ms");
    for (name, missed) in ["first", "second", "third"].into_iter().zip(found.missed.iter().flatten()) {
        let interval = between(missed, 100.0, 1) + " %";
        line(&format!("{name} finger misses"), format!("{:.1} %", 100.0 * missed.value), interval);
    }
    if let Some(stroke) = &found.stroke {
        let unit = if found.unit == Length::Tenth { "" } else { " mm" };
        line("stroke", format!("{:.3}{unit}", stroke.value), between(stroke, 1.0, 3) + unit);
    }
    if let Some(grazing) = &found.grazing {
        let GrazingEstimate { angle, bend } = grazing;
        let told = between(angle, 1.0, 0);
        line("fingers bend beyond", format!("{:.0}°", angle.value), if told == NOT_TOLD { told } else { told + "°" });
        line("aside by", format!("{:.2} ms", bend.value), between(bend, 1.0, 2) + " ms");
    }
    _ = match found.timer {
        Some(timer) => writeln!(text, "{:22}{:>14}", "timer", format!("{timer} ms")),
        None => writeln!(text, "{:22}{:>14}", "timer", "none found"),
    };
    if found.stroke.is_some() {
        text += "\nThe stroke was not stated: no recorded contact is later, where many would be.";
    }
    let coarse = found.readings.or(found.timer.filter(|timer| *timer >= 5.0));
    if let Some(interval) = coarse {
        // Writing to a string cannot fail.
        _ = write!(
            text,
            "\nContact times cluster about multiples of {interval} ms, as if contacts were read only that often. The probe states \
             that as noise, and as its timer; read them more frequently if you can."
        );
    }
    text += "\nOffsets are relative to the first finger's: only differences of times are recorded.\n";
    for warning in &found.warnings {
        _ = writeln!(text, "Poorly determined: {warning}");
    }
    text
}
