//! `palpate maps play`.

use crate::commands::probe::SizeArguments;
use crate::commands::progress::Bar;
use crate::commands::real::RealArguments;
use crate::commands::scene::PlacementArguments;
use crate::commands::{Global, shell};
use palpate::locate::Real;
use palpate::output;
use palpate::probe::Probe;
use palpate::touches::Origin;
use palpate::with;
use palpate::{Error, Result};
use palpate_report::play::{self, Settings};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
One of the objects lies hidden on a table, and a hand that knows where it is finds out what it is and where it lies. The page works in any browser, without a network. Objects keep their size, by default in centimeters where a mesh states no unit; the hand is that of docs/guide/locate.md unless --probe states another in millimeters.

Examples:
  palpate maps play -o table.html               ten objects
  palpate maps play meshes/ -o table.html --true-size mm")]
pub(super) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", default_value = "builtin")]
    sources: Vec<String>,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    placements: PlacementArguments,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { sources, output, placements, mut size, real } = arguments;
    let seed = global.seed();
    output::admit(&output, sources.iter().map(PathBuf::from))?;
    size.units.imply_unit();
    // The guide's hand, unless a file states another.
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let origin = size.origin(Origin { seed, probe, ..Origin::default() })?;
    let mut objects = size.objects(&sources, seed)?;
    if !(2..=play::MOST_OBJECTS).contains(&objects.len()) {
        let allowed = format!("2 to {} objects", play::MOST_OBJECTS);
        return Err(Error::setting("number of objects", objects.len(), allowed));
    }
    placements.weigh(&mut objects)?;
    let stated = size.probe.read()?.map(|file| file.real).filter(|real| !real.is_none());
    let noise = real.on_table(stated.unwrap_or_else(|| Real::default().noise(origin.probe.speed)))?;
    let page = play::table(&objects, &Settings { origin, noise, command: shell::typed() }, &Bar::new())?;
    global.write_page(&output, &page)
}
