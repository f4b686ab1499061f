//! `palpate view`: a page that shows an object, on which objects are touched, or which watches a chip.

use super::Global;
use super::play;
use super::probe::{SizeArguments, refuse_unstated};
use super::real::RealArguments;
use super::scene::{SceneArguments, described};
use super::shape::{self, Touched};
use super::shell;
use clap::ArgGroup;
use glam::DVec3;
use palpate::compile::CompiledModel;
use palpate::output;
use palpate::touches::{Origin, Surroundings};
use palpate::{Error, Result};
use palpate_report::{shape as view_map, view, watch};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(group(ArgGroup::new("recognizes").args(["play", "port"])), after_help = "\
Pages work in any browser, without a network. The inside of a surface is orange; a mesh that shows orange from outside is inside out, or has holes.

With --play the page lets you touch several objects, and models recognize them; without --model one of the built-in objects, which the program has. With --scene table, too, one of the objects lies hidden on a table, and a hand that knows where it is finds out what it is and where it lies. With --port it shows what a chip at the reader's computer touches and recognizes, where the browser has Web Serial.

Examples:
  palpate view bowl -o bowl.html                a built-in object
  palpate view cup.stl -o cup.html              your own mesh
  palpate view cup.obj -o cup.html --true-size mm --probe probe.toml
                                                as large as it is, your probe
  palpate view fork -o fork.html --scene table  as it lies on a table
  palpate view pot.txt -o pot.html --probe hand.toml
                                                touches on a table
  palpate view mon.txt tue.txt -o pot.html --probe hand.toml
                                                two, compared
  palpate view --play -o play.html              ten objects
  palpate view --play meshes/ --model out/model.palpate -o play.html
                                                your meshes and model
  palpate view --play --scene table -o table.html
                                                ten objects on a table
  palpate view --port -o chip.html              a chip, without a program")]
pub(crate) struct Arguments {
    /// A built-in object's name, a mesh (OBJ, STL, PLY, glTF, COLLADA); touches with a position (TXT), one or two; with --play several, or directories
    #[arg(value_name = "SOURCE", required_unless_present_any = ["play", "port"])]
    sources: Vec<String>,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Touches of each object; to show [default: 24]
    #[arg(long, value_name = "N", value_parser = super::numbers::count, conflicts_with = "play")]
    touches: Option<u64>,
    /// Make a page on which the objects are touched
    #[arg(long)]
    play: bool,
    /// Make a page that watches a chip at a serial port
    #[arg(long, conflicts_with_all = ["play", "sources", "touches"])]
    #[arg(conflicts_with_all = ["ProbeArguments", "UnitArguments", "SceneArguments", "RealArguments"])]
    port: bool,
    /// A compiled model for the page; may be given several times, with --port once
    #[arg(long, value_name = "FILE", requires = "recognizes", conflicts_with = "touches")]
    model: Vec<PathBuf>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    real: RealArguments,
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
    if arguments.port {
        return watches(&arguments, global);
    }
    let scene = arguments.scene.scene(Surroundings::Floating)?;
    if arguments.play {
        let Arguments { sources, model, output, size, real, scene: on, .. } = arguments;
        let wanted = play::Wanted { sources, model, output, size, real };
        return if scene.is_floating() { play::run(wanted, global) } else { play::on_table(wanted, &on, global) };
    }
    let Arguments { sources, output, touches, size, real, .. } = &arguments;
    if (1..=2).contains(&sources.len()) && sources.iter().all(|source| shape::is_touches(source)) {
        return maps(&arguments, global);
    }
    let [source] = &sources[..] else {
        return Err(Error::setting("play", "not given", "it to see several objects on one page"));
    };
    if real.is_given() {
        return Err(Error::setting("real", "given", "it with --play: touches are shown as the simulator makes them"));
    }
    output::admit(output, [source])?;
    let origin = size.origin(Origin::default())?;
    refuse_unstated(size)?;
    let mut object = [size.object(source)?];
    arguments.scene.weigh(&mut object)?;
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

/// Makes a page of the map of an object that was touched where it stands, or of two and their difference.
fn maps(Arguments { sources, output, size, .. }: &Arguments, global: &Global) -> Result<()> {
    output::admit(output, sources)?;
    let file = shape::hand(&size.probe)?;
    let read = |source: &String| shape::read(Path::new(source), &file);
    let touched = sources.iter().map(read).collect::<Result<Vec<_>>>()?;
    let mut maps: Vec<view_map::Map> = Vec::new();
    let mut registered = false;
    for Touched { name, touches, shape } in touched {
        let aligned = maps.first().and_then(|first| first.shape.aligned(&touches));
        registered = aligned.is_some();
        maps.push(view_map::Map { name, shape: aligned.unwrap_or(shape), radius: file.probe.radius });
    }
    output::write_bytes(output, view_map::page(&maps, registered).as_bytes())?;
    let text = || format!("{}: open it in a browser\n", output.display());
    global.print_about(output, &serde_json::json!({ "page": output, "registered": registered }), text)
}

/// Makes a page that watches a chip.
fn watches(Arguments { model, output, .. }: &Arguments, global: &Global) -> Result<()> {
    if model.len() > 1 {
        return Err(Error::setting("model", "given several times", "one with --port: a chip has one"));
    }
    output::admit(output, model)?;
    let shown = output.to_string_lossy();
    let paths = model.iter().flat_map(|path| ["--model".into(), path.to_string_lossy()]);
    let words: Vec<_> = ["palpate", "view", "--port", "-o", &shown].map(Into::into).into_iter().chain(paths).collect();
    let command = shell::command(words.iter().map(AsRef::as_ref));
    let model = model.first().map(CompiledModel::read).transpose()?;
    output::write_bytes(output, watch::page(model.as_ref(), &command)?.as_bytes())?;
    let text = || format!("{}: open it in a browser that has Web Serial\n", output.display());
    global.print_about(output, &serde_json::json!({ "page": output }), text)
}
