//! `palpate view`: a page that shows an object.

use super::Global;
use super::probe::{SizeArguments, refuse_unstated};
use super::scene::{SceneArguments, described};
use super::shape;
use glam::DVec3;
use palpate::Result;
use palpate::error::{Place, problem};
use palpate::output;
use palpate::touches::{Origin, Surroundings};
use palpate_report::view;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Pages work in any browser, without a network. The inside of a surface is orange; a mesh that shows orange from outside is inside out, or has holes.

Examples:
  palpate view bowl -o bowl.html                a built-in object
  palpate view cup.stl -o cup.html              your own mesh
  palpate view cup.obj -o cup.html --true-size mm --probe probe.toml
                                                as large as it is, your probe
  palpate view fork -o fork.html --scene table  as it lies on a table")]
pub(crate) struct Arguments {
    /// A built-in object's name, or a mesh (OBJ, STL, PLY, glTF, COLLADA)
    source: String,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Touches of each object; to show [default: 24]
    #[arg(long, value_name = "N", value_parser = super::numbers::count)]
    touches: Option<u64>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    scene: SceneArguments,
}

/// Output about a page.
#[derive(serde::Serialize)]
struct Shown<'a> {
    page: &'a PathBuf,
    object: &'a str,
    /// Faults of the mesh.
    complaints: Vec<String>,
    /// Verdict on whether it can be touched as it is.
    verdict: String,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { source, output, touches, size, .. } = &arguments;
    let scene = arguments.scene.scene(Surroundings::Floating)?;
    if shape::is_touches(source) {
        let what = problem!("touches, and no mesh").fix("Use `palpate maps view`.");
        return Err(what.at(Place::file(source)));
    }
    output::admit(output, [source])?;
    let origin = size.origin(Origin::default())?;
    refuse_unstated(size)?;
    let mut object = [size.object(source)?];
    arguments.scene.weights.weigh(&mut object)?;
    let [object] = object;
    let length = object.instances().next().map_or(Ok(0.0), |first| origin.length_of(&object, first))?;
    let probe = origin.probe;
    let clearance = origin.clearance([DVec3::ZERO, DVec3::splat(length)]);
    let touches = touches.map_or(view::Settings::default().touches, |touches| touches as usize);
    let page = view::page(
        &object,
        &view::Settings { touches, seed: global.seed(), length, clearance, probe, cone: scene.cone() },
    )?;
    output::write_bytes(output, page.as_bytes())?;
    let facts = object.facts(object.first());
    let complaints = facts.complaints(object.millimeters);
    let verdict = view::verdict(&facts, length, &probe);
    if global.json {
        return output::print_json_about(output, &Shown { page: output, object: &object.name, complaints, verdict });
    }
    let mut text = format!("{}: open it in a browser\n", output.display());
    match complaints.is_empty() {
        true => text += &format!("{}: nothing is wrong with the mesh\n", object.name),
        false => complaints.iter().for_each(|complaint| text += &format!("{}: {complaint}\n", object.name)),
    }
    text += &format!("{}: {}\n", object.name, verdict);
    if !scene.is_floating() {
        text += &described(std::slice::from_ref(&object))?;
    }
    output::print_about(output, &text)
}
