//! `palpate view --play`.

use super::probe::{SizeArguments, refuse_unstated};
use super::progress::Bar;
use super::real::RealArguments;
use super::scene::SceneArguments;
use super::{Global, shell};
use palpate::compile::CompiledModel;
use palpate::ensemble::StatedProbe;
use palpate::locate::Real;
use palpate::mesh::builtin;
use palpate::output;
use palpate::probe::Probe;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate::with;
use palpate::{Error, Result};
use palpate_report::play::{self, Contender, Settings};
use std::path::PathBuf;

/// A page to be made on which objects are touched.
pub(super) struct Wanted {
    pub(super) sources: Vec<String>,
    /// Compiled models; that of the built-in objects if there are none.
    pub(super) model: Vec<PathBuf>,
    pub(super) output: PathBuf,
    pub(super) size: SizeArguments,
    pub(super) real: RealArguments,
}

pub(super) fn run(wanted: Wanted, global: &Global) -> Result<()> {
    let Wanted { mut sources, model, output, size, real } = wanted;
    let seed = global.seed();
    if sources.is_empty() {
        sources.push("builtin".into());
    }
    output::admit(&output, model.iter().chain(sources.iter().map(PathBuf::from).collect::<Vec<_>>().iter()))?;
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
    let models = model.iter().flat_map(|path| ["--model".into(), path.to_string_lossy().into_owned()]);
    let own: Vec<String> = models.chain(size.words()).chain(real.words()).collect();
    let command = shell::command(
        ["palpate", "view", "--play"]
            .into_iter()
            .chain(sources.iter().map(String::as_str))
            .chain(["-o", &output.to_string_lossy(), "--seed", &seed.to_string()])
            .chain(own.iter().map(String::as_str)),
    );
    let settings = Settings { origin, noise, command };
    let page = play::page(&objects, &contenders, &settings)?;
    output::write_bytes(&output, page.as_bytes())?;
    let text = || format!("{}: open it in a browser\n", output.display());
    global.print_about(&output, &serde_json::json!({ "page": output }), text)
}

/// A model for approaches of this origin.
fn contender(path: &PathBuf, origin: &Origin) -> Result<Contender> {
    let model = CompiledModel::read(path)?;
    if let Some(stated) = model.model().probe() {
        let own = StatedProbe::from(origin).trained();
        StatedProbe::compare([&path.display().to_string(), "the page"], [stated, own])?;
    }
    Contender::new(model).map_err(|error| error.in_file(path))
}

/// Makes the page of a table.
pub(super) fn on_table(wanted: Wanted, scene: &SceneArguments, global: &Global) -> Result<()> {
    let Wanted { mut sources, model, output, mut size, real } = wanted;
    scene.check_straight_down()?;
    if !model.is_empty() {
        return Err(Error::setting("model", "given", "it without --scene table: the page's maps are made for it"));
    }
    let seed = global.seed();
    if sources.is_empty() {
        sources.push("builtin".into());
    }
    output::admit(&output, sources.iter().map(PathBuf::from).collect::<Vec<_>>().iter())?;
    let words = [size.words(), scene.words(), real.words()].concat();
    size.units.imply_unit();
    // The guide's hand, unless a file states another.
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let origin = size.origin(Origin { seed, probe, ..Origin::default() })?;
    let mut objects = size.objects(&sources, seed)?;
    if !(2..=play::MOST_OBJECTS).contains(&objects.len()) {
        let allowed = format!("2 to {} objects with --scene table", play::MOST_OBJECTS);
        return Err(Error::setting("number of objects", objects.len(), allowed));
    }
    scene.weigh(&mut objects)?;
    let stated = size.probe.read()?.map(|file| file.real).filter(|real| !real.is_none());
    let noise = real.on_table(stated.unwrap_or_else(|| Real::default().noise(origin.probe.speed)))?;
    let command = ["palpate", "view", "--play"].into_iter().chain(sources.iter().map(String::as_str));
    let output_words = ["-o", &output.to_string_lossy(), "--seed", &seed.to_string()].map(str::to_owned);
    let command = shell::command(command.chain(output_words.iter().chain(&words).map(String::as_str)));
    let page = play::table(&objects, &Settings { origin, noise, command }, &Bar::new())?;
    output::write_bytes(&output, page.as_bytes())?;
    let text = || format!("{}: open it in a browser\n", output.display());
    global.print_about(&output, &serde_json::json!({ "page": output }), text)
}
