//! `palpate play`.

use super::kinds::{self, ModelKind};
use super::probe::{SizeArguments, refuse_unstated};
use super::real::RealArguments;
use super::{Global, shell};
use palpate::ensemble::StatedProbe;
use palpate::mesh::builtin;
use palpate::output;
use palpate::probe::Probe;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate::{Error, Result};
use palpate_report::play::{self, Contender, Settings};
use std::path::{Path, PathBuf};

/// Make a page on which objects are touched, and models recognize them.
#[derive(clap::Args)]
#[command(after_help = "\
The page works in any browser, without a network. Without --model it has a model of the built-in objects, which the program has. Touches are disturbed as by a usual switch that is polled every millisecond, unless --real or the probe file says otherwise.

Examples:
  palpate play -o play.html                     ten objects
  palpate play meshes/ --model out/model.palpate -o play.html
                                                your meshes and model")]
pub(crate) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", default_value = "builtin")]
    sources: Vec<String>,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// A compiled model of the objects; may be given several times
    #[arg(long, value_name = "FILE")]
    model: Vec<PathBuf>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { sources, output, model, size, real } = arguments;
    let seed = global.seed();
    output::admit(&output, model.iter().cloned().chain(sources.iter().map(PathBuf::from)))?;
    let file = size.probe.read()?;
    let origin = size.origin(Origin { seed, ..Origin::default() })?;
    refuse_unstated(&size)?;
    let objects = size.touchable(size.objects(&sources, seed)?, &origin)?;
    let stated = file.map(|file| file.real).filter(|real| !real.is_none());
    let noise = real.over(stated.unwrap_or_else(Noise::switch)).map_err(|error| size.probe.named(error))?;
    let mut contenders = model.iter().map(|path| contender(path, &origin)).collect::<Result<Vec<_>>>()?;
    play::distinguish(&mut contenders, &model);
    if contenders.is_empty() {
        let is_builtin = |source: &String| source == "builtin" || builtin::names().contains(&source.as_str());
        if !sources.iter().all(is_builtin) || origin.probe != Probe::default() {
            let allowed = "a model of these objects and this probe: palpate run SOURCE -o out makes out/model.palpate";
            return Err(Error::setting("model", "not given", allowed));
        }
        contenders.push(Contender::household()?);
    }
    let page = play::page(&objects, &contenders, &Settings { origin, noise, command: shell::typed() })?;
    global.write_page(&output, &page)
}

/// A model for approaches of this origin.
fn contender(path: &Path, origin: &Origin) -> Result<Contender> {
    let model = kinds::compiled(path, ModelKind::Touches, "play")?;
    if let Some(stated) = model.model().probe() {
        let own = StatedProbe::from(origin).trained();
        StatedProbe::compare([&path.display().to_string(), "the page"], [stated, own])?;
    }
    Contender::new(model).map_err(|error| error.in_file(path))
}
