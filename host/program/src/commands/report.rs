use super::probe::{SizeArguments, refuse_unstated};
use super::progress::Bar;
use super::real::RealArguments;
use super::{Global, shell};
use clap::builder::TypedValueParser as _;
use palpate::Result;
use palpate::output::{print, print_json, refuse_stdout};
use palpate::probe::noise::{Grazing, Noise};
use palpate::touches::Origin;
use palpate::with;
use palpate_report::{self, Part, Settings};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate report                       the built-in objects
  palpate report --quick -o quick      fewer touches, in a minute or less
  palpate report meshes/ -o report     your own meshes
  palpate report meshes/ --true-size mm --probe probe.toml
                                       objects as large as they are, your probe
  palpate report meshes/ --only accuracy,noise
                                       two sections
  palpate report --real noise=0..10ms  our robust model trained for this noise")]
pub(crate) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(default_value = "builtin", value_name = "SOURCE")]
    sources: Vec<String>,
    /// Output; a directory for the page, its figures and tables
    #[arg(short, long, default_value = "report", value_name = "PATH")]
    output: PathBuf,
    /// Fewer folds, levels, touches and trees; the same figures
    #[arg(long)]
    quick: bool,
    /// Only these; other sections are left out
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = part())]
    only: Vec<Part>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { sources, output, quick, only, size, real: given } = arguments;
    let seed = global.seed();
    refuse_stdout(&output)?;
    let parts: Vec<Part> = Part::ALL.into_iter().filter(|part| only.is_empty() || only.contains(part)).collect();
    let settings = if quick { Settings::quick(sources, seed) } else { Settings::full(sources, seed) };
    refuse_unstated(&size)?;
    let capture = size.origin(Origin::default())?;
    let real = size.probe.read()?.map(|file| file.real).filter(|real| !real.is_none());
    let noise = match real {
        // Where noise is added to touches, fingers do not bend aside.
        Some(real) => given.over(with!(real, grazing = Grazing::default()))?,
        None if given.is_given() => given.over(Noise::default())?,
        None => settings.noise,
    };
    noise.check()?;
    let settings = Settings { command: shell::typed(), parts, noise, capture, ..settings };
    let objects = || size.touchable(size.objects(&settings.sources, seed)?, &settings.capture);
    let written = palpate_report::report(&objects, &settings, &output, global.force, &Bar::new())?;
    if global.json {
        return print_json(&written.summary);
    }
    let times = written.stages.iter().map(|(name, seconds)| format!("  {name:<18}{seconds:8.1} s\n"));
    let page = output.join("index.html");
    print(&format!("{}\n\n{}\n{}\n", written.sentence, times.collect::<String>(), page.display()))
}

/// Sections by their names.
fn part() -> impl clap::builder::TypedValueParser<Value = Part> {
    let names = clap::builder::PossibleValuesParser::new(Part::ALL.map(Part::name));
    names.try_map(|name| Part::ALL.into_iter().find(|part| part.name() == name).ok_or("not a section"))
}
