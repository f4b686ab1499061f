//! `palpate maps level`.

use crate::commands::Global;
use crate::commands::probe::ProbeArguments;
use crate::commands::recognize_lines::{Event, each_of};
use crate::commands::shape;
use palpate::Result;
use palpate::locate::{BareTable, Measured, REACH, bare_table};
use palpate::output;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
PRESSES has 20 presses on the bare table beside the object, straight down, with half a turn of the hand after each: twelve columns. The height of the table and the offsets of the outer fingertips are printed, and the probe is written with them. It needs --probe in millimeters.

Examples:
  palpate maps level presses.txt -o fitted.toml --probe hand.toml")]
pub(super) struct Arguments {
    /// Presses on the bare table: touches with a position
    presses: PathBuf,
    /// Output; the probe, such as probe.toml
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    probe: ProbeArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { presses: path, output: to, probe } = &arguments;
    output::admit(to, [path])?;
    let probe = shape::hand(probe)?.probe;
    let mut presses = Vec::new();
    each_of(path, &mut |event| {
        if let Event::Touch { touch, place } = event {
            presses.push((place, *touch));
        }
        Ok(())
    })?;
    let found = bare_table(&presses, &probe).map_err(|error| error.in_file(path))?;
    output::write_bytes(to, found.toml(&probe).as_bytes())?;
    global.print_about(to, &found, || bare_text(&found, to))
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
