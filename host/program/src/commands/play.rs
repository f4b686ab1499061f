use super::noise::NoiseArguments;
use super::probe::{SizeArguments, refuse_unstated};
use super::progress::Bar;
use super::shell;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate_report::play::{self, Settings, Training};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
The page works in any browser with WebGL and WebAssembly, without a network. Objects and models are in it. What touches the ones and reads the others is this program's own code. `palpate run` writes such a page beside its report.

Without --model four are trained for the page, which takes about a minute: the published method (times of full touches), curvature of full touches, curvature of every contact, and oriented with a plan, which also knows where the probe came from. With --model several times, the page compares those.

Examples:
  palpate play -o play.html                          ten objects, four models
  palpate play bowl mouse fork -o play.html          three of them
  palpate play meshes/ -o play.html                  your own meshes
  palpate play --model models/household.palpate -o play.html
  palpate play --model curvature.palpate --model planned.palpate -o play.html")]
pub(crate) struct Arguments {
    /// What to touch: `builtin` or built-in objects' names, mesh files, directories of them
    #[arg(value_name = "SOURCE", default_value = "builtin")]
    sources: Vec<String>,
    /// A model that `palpate export` wrote; may be given several times [default: four are trained]
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// The page to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Full touches of each object to train on, and three times as many approaches
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = touches, conflicts_with = "model")]
    touches: u64,
    /// Seed of the training and of the expected numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also write what the page has to compute, as this program computes it: 1,000 approaches to each object, one line each, with the evidence of every model
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    noise: NoiseArguments,
}

/// Rounds of 100 approaches in a trace.
const ROUNDS: u64 = 10;

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { sources, model, output, touches, seed, trace, size, noise } = arguments;
    output::refuse_input(&output, model.iter().chain(sources.iter().map(PathBuf::from).collect::<Vec<_>>().iter()))?;
    let file = size.probe.read()?;
    let origin = size.origin(Origin { touches, seed, ..Origin::default() })?;
    refuse_unstated(&size)?;
    let objects = size.objects(&sources, seed)?;
    let noise = noise.over(file.map(|file| file.real).filter(|real| !real.is_none()).unwrap_or_else(Noise::switch));
    let progress = Bar::new();
    let surfaces = play::surfaces(&objects, &origin)?;
    let contenders = if model.is_empty() {
        play::train(&objects, &Training { origin: origin.clone(), noise }, &progress)?
    } else {
        let models = model.iter().map(CompiledModel::read).collect::<Result<_>>()?;
        let origin = Origin { seed: seed.wrapping_add(5), ..origin.clone() };
        let mut contenders = play::expect(models, &surfaces, &origin, &noise, &progress)?;
        play::distinguish(&mut contenders, &model);
        contenders
    };
    drop(progress);
    let models = model.iter().flat_map(|path| ["--model".into(), path.to_string_lossy().into_owned()]);
    let own: Vec<String> = models.chain(size.words()).collect();
    let command = shell::command(
        ["palpate", "play"]
            .into_iter()
            .chain(sources.iter().map(String::as_str))
            .chain(["-o", &output.to_string_lossy(), "--seed", &seed.to_string()])
            .chain(own.iter().map(String::as_str)),
    );
    let settings = Settings { origin, noise, command };
    let page = play::page(&objects, &contenders, &settings)?;
    output::write_bytes(&output, page.as_bytes())?;
    if let Some(trace) = trace {
        output::write_bytes(&trace, play::trace(&surfaces, &contenders, &settings, ROUNDS)?.as_bytes())?;
    }
    output::print_about(&output, &format!("{}: open it in a browser\n", output.display()))
}

/// As many touches as can be trained on.
fn touches(text: &str) -> Result<u64, String> {
    match super::numbers::count(text)? {
        count if count < 100 => Err("give 100 or more".to_owned()),
        count => Ok(count),
    }
}
