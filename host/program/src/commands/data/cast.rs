//! `palpate data cast`: for those who compare the simulator with another engine.

use crate::commands::Global;
use crate::commands::probe::reading;
use glam::DVec3;
use palpate::Error;
use palpate::Result;
use palpate::mesh::file::{self, Contents};
use palpate::output;
use palpate::probe::cast::{self, Agreement, Line};
use palpate::probe::scene::Scene;
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
CASTS is a text file with one cast per line: `set,ox,oy,oz,dx,dy,dz` or `set,ox,oy,oz,dx,dy,dz,t`, where t is the time
that another engine found, or `miss`. The output has the same lines with our time appended. Times are in lengths of the
direction, which is not renormalized; all numbers are rounded to the nearest f32.

Examples:
  palpate data cast cup.obj casts.csv              print the lines
  palpate data cast cup.obj casts.csv -o ours.csv  write them, compare the times
  palpate data cast cup.obj casts.csv --as-is      a mesh in units of the probe")]
pub(super) struct Arguments {
    /// The mesh (OBJ, STL, PLY, glTF, COLLADA)
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The casts
    #[arg(value_name = "CASTS.csv")]
    casts: PathBuf,
    /// Output; the lines [default: standard output]
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// The longest side of the bounding box that the mesh is scaled to, centered at the origin
    #[arg(long, value_name = "UNITS", default_value_t = 10.0)]
    length: f64,
    /// Neither scale nor center the mesh
    #[arg(long, conflicts_with = "length")]
    as_is: bool,
    /// The sphere's radius, in units
    #[arg(long, value_name = "UNITS", default_value_t = 0.15)]
    radius: f32,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> Result<()> {
    for (name, value) in [("length", arguments.length), ("radius", f64::from(arguments.radius))] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::setting(name, value, "a number greater than 0"));
        }
    }
    let Contents { mesh, moved, notes, .. } = reading(|| file::read(&arguments.mesh))?;
    notes.iter().for_each(|note| crate::commands::remark(&format!("palpate: {note}")));
    let scene = if arguments.as_is { Scene::as_is(&mesh) } else { Scene::new(&mesh, arguments.length) }?;
    let mut lines = cast::read(&arguments.casts)?;
    if arguments.as_is {
        // Where the mesh is: far from the origin, its coordinates count from its center.
        for line in &mut lines {
            if let Line::Cast(cast) = line {
                cast.origin -= DVec3::from(moved);
            }
        }
    }
    let times = cast::times(&scene, &lines, f64::from(arguments.radius));
    let text = cast::annotate(&lines, &times);
    let Some(path) = &arguments.output else {
        return match global.json {
            true => Err(Error::setting("json", "given", "it with --output: it says how the times agree")),
            false => output::print(&text),
        };
    };
    output::refuse_input(path, [&arguments.mesh, &arguments.casts])?;
    output::write_unmarked(path, text.as_bytes())?;
    let agreement = cast::agreement(&lines, &times);
    global.print_about(path, &agreement, || table(&agreement))
}

fn table(sets: &[Agreement]) -> String {
    let mut text = format!("{:12} {:>8} {:>8} {:>8}  {:>13}\n", "set", "casts", "missed", "false", "largest error");
    for set in sets {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:12} {:>8} {:>8} {:>8}  {:>13.1e}",
            set.set, set.casts, set.missed, set.false_contacts, set.largest_error
        );
    }
    text
}
