use super::probe::{SizeArguments, refuse_unstated};
use glam::DVec3;
use palpate::Result;
use palpate::error::CaptureProblem;
use palpate::mesh::facts::Facts;
use palpate::output;
use palpate::probe::approach::Probe;
use palpate::touches::Origin;
use palpate_report::view;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate view bowl -o bowl.html                  a built-in object
  palpate view cup.stl -o cup.html                is your own mesh right?
  palpate view fork -o fork.html --touches 60     more touches
  palpate view cup.obj -o cup.html --radius 0.05  with thinner fingers
  palpate view cup.obj -o cup.html --true-size --unit mm --probe probe.toml
                                                  as large as it is

The page works in any browser, without a network. The inside of the surface is orange: a mesh that shows orange from
outside is inside out, or has holes.")]
pub(crate) struct Arguments {
    /// A mesh (OBJ, STL, PLY, glTF, GLB or COLLADA), or the name of a built-in object if there is no such file
    #[arg(value_name = "OBJECT")]
    object: String,
    /// The page to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// How many touches with all three fingers to show
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().touches)]
    touches: usize,
    /// How many approaches to show in which a finger missed
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().misses)]
    misses: usize,
    /// The seed of the approaches
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().seed)]
    seed: u64,
    /// The longest side of the object's bounding box, in units
    #[arg(long, value_name = "UNITS", default_value_t = view::Settings::default().length, conflicts_with = "true_size")]
    length: f64,
    /// The fingers' radius, in units [default: the probe file's; 0.15]
    #[arg(long, value_name = "UNITS")]
    radius: Option<f64>,
    /// The distance between neighboring fingers, in units [default: the probe file's; 1.5]
    #[arg(long, value_name = "UNITS")]
    spacing: Option<f64>,
    #[command(flatten)]
    size: SizeArguments,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    output::refuse_input(&arguments.output, [&arguments.object])?;
    let Arguments { touches, misses, seed, length, radius, spacing, size, .. } = &arguments;
    let origin = size.origin(Origin { length: *length, ..Origin::default() })?;
    refuse_unstated(size)?;
    let object = size.object(&arguments.object)?;
    let unknown = || CaptureProblem::NoTrueSize { name: object.name.clone() };
    let length = object.instances().next().and_then(|first| origin.length_of(&object, first)).ok_or_else(unknown)?;
    let probe = Probe {
        radius: radius.unwrap_or(origin.probe.radius),
        spacing: spacing.unwrap_or(origin.probe.spacing),
        ..origin.probe
    };
    let clearance = Origin { probe, ..origin }.clearance([DVec3::ZERO, DVec3::splat(length)]);
    let page = view::page(
        &object,
        &view::Settings { touches: *touches, misses: *misses, seed: *seed, length, clearance, probe },
    )?;
    output::write_bytes(&arguments.output, page.as_bytes())?;
    let mut text = format!("{}: open it in a browser\n", arguments.output.display());
    let facts = Facts::of(object.mesh());
    let complaints = facts.complaints(object.millimeters);
    match complaints.is_empty() {
        true => text += &format!("{}: nothing is wrong with the mesh\n", object.name),
        false => complaints.iter().for_each(|complaint| text += &format!("{}: {complaint}\n", object.name)),
    }
    text += &format!("{}: {}\n", object.name, view::verdict(&facts, length, &probe));
    output::print_about(&arguments.output, &text)
}
