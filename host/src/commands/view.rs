use palpate::Error;
use palpate::Result;
use palpate::mesh::Object;
use palpate::mesh::builtin;
use palpate::mesh::source;
use palpate::output;
use palpate::probe::approach::Probe;
use palpate::report::view;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate view bowl -o bowl.html                      a built-in object
  palpate view cup.obj -o cup.html                    your own mesh: is it right side out, is its scale sensible?
  palpate view fork -o fork.html --touches 60         more touches
  palpate view cup.obj -o cup.html --radius 0.05      with thinner fingers

The page opens in any browser, without a network. The inside of the surface is orange: a mesh that shows it from
outside is inside out, or has holes.")]
pub(crate) struct Arguments {
    /// A built-in object's name, or an OBJ file
    #[arg(value_name = "OBJECT")]
    object: String,
    /// The page to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// How many full touches to show
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().touches)]
    touches: usize,
    /// How many approaches to show that not all fingers touched
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().misses)]
    misses: usize,
    /// The seed of the approaches
    #[arg(long, value_name = "N", default_value_t = view::Settings::default().seed)]
    seed: u64,
    /// The longest side of the object's bounding box, in units
    #[arg(long, value_name = "UNITS", default_value_t = view::Settings::default().length)]
    length: f64,
    /// The fingers' radius, in units
    #[arg(long, value_name = "UNITS", default_value_t = Probe::default().radius)]
    radius: f64,
    /// The distance between neighboring fingers, in units
    #[arg(long, value_name = "UNITS", default_value_t = Probe::default().spacing)]
    spacing: f64,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    output::refuse_input(&arguments.output, [&arguments.object])?;
    let Arguments { touches, misses, seed, length, radius, spacing, .. } = arguments;
    let probe = Probe { radius, spacing, ..Probe::default() };
    let page = view::page(&find(&arguments.object)?, &view::Settings { touches, misses, seed, length, probe })?;
    output::write_bytes(&arguments.output, page.as_bytes())?;
    output::print_about(&arguments.output, &format!("{}: open it in a browser\n", arguments.output.display()))
}

/// A built-in object, or else what the file holds.
fn find(name: &str) -> Result<Object> {
    if builtin::names().contains(&name) {
        return builtin::one(name);
    }
    if !Path::new(name).exists() {
        let what = format!("{name} is neither a file nor a built-in object");
        return Err(Error::argument(what, format!("Give an OBJ file, or one of {}.", builtin::names().join(", "))));
    }
    let mut found = source::objects(&[name.to_owned()])?;
    match (found.pop(), found.is_empty()) {
        (Some(object), true) => Ok(object),
        _ => Err(Error::argument(format!("{name} holds several objects"), "Give one OBJ file.")),
    }
}
