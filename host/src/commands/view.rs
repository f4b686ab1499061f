use crate::Result;
use crate::mesh::source;
use crate::output;
use crate::probe::approach::Probe;
use crate::report::view;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate view bowl -o bowl.html                  a built-in object
  palpate view cup.obj -o cup.html                your own mesh: right side out?
  palpate view fork -o fork.html --touches 60     more touches
  palpate view cup.obj -o cup.html --radius 0.05  with thinner fingers

The page works in any browser, without a network. The inside of the surface is orange: a mesh that shows orange from
outside is inside out, or has holes.")]
pub(crate) struct Arguments {
    /// An OBJ file, or the name of a built-in object if there is no such file
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
    let object = source::object(&arguments.object)?;
    let page = view::page(&object, &view::Settings { touches, misses, seed, length, probe })?;
    output::write_bytes(&arguments.output, page.as_bytes())?;
    output::print_about(&arguments.output, &format!("{}: open it in a browser\n", arguments.output.display()))
}
