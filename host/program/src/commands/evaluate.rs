use super::Global;
use super::expected::ExpectedArguments;
use super::figures::text;
use super::kinds::{self, ModelKind};
use super::numbers::{error_rate, sequences};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::compiled_trained_on;
use palpate::evaluate::{self, Evaluated, Wanted};
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::touches::Dataset;
use palpate_shared::format::Counted;
use std::path::PathBuf;

/// Measure how often a model is right, and after how many touches.
#[derive(clap::Args)]
#[command(after_help = "\
Evaluate on touches that the model was not trained on. Models are evaluated by the code that runs on the chip; an ensemble is compiled first, with its own leaves. A model stops by its own thresholds, an ensemble at a posterior of 99 %; if it was calibrated, the figures show whether it keeps its promise. Wrong names are shares of all sequences, and of those that got a name. docs/reference/options.md explains every figure.

Examples:
  palpate capture builtin -o unseen --approaches 6000 --seed 2
  palpate evaluate model.palpate unseen
  palpate evaluate ensemble.json unseen --at 10,30 --json
  palpate evaluate model.palpate unseen --real timer=1ms,missed=2%
  palpate evaluate model.palpate unseen --prior fork=0.3,spoon=0.3")]
pub(crate) struct Arguments {
    /// Compiled model or ensemble
    model: PathBuf,
    /// Touches: a directory, or a robot's log (MCAP)
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Touches of objects that the model does not know: how many are detected
    #[arg(long, value_name = "DIR")]
    unknown: Option<PathBuf>,
    /// Give the accuracy after these touches [default: 5,10,20,30,60]
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    at: Option<Vec<usize>>,
    /// Sequences of touches to draw; of each object, and as many groups
    #[arg(long, value_name = "N", value_parser = sequences, default_value = "1000")]
    sequences: usize,
    /// The share of wrong names to accept, such as 1%; stops there [default: the model's own thresholds]
    #[arg(long, value_name = "RATE", value_parser = error_rate)]
    error_rate: Option<f64>,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Follow the model's plan of approaches
    #[arg(long)]
    active: bool,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    expected: ExpectedArguments,
    #[command(flatten)]
    real: RealArguments,
}

/// True if the pattern of touching fingers is evidence to the model.
fn counts_patterns(compiled: &CompiledModel) -> bool {
    compiled.model().trained_touches().counted != Counted::Full
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let directory = &arguments.directory;
    let compiled = kinds::file(&arguments.model, ModelKind::Touches, "evaluate")?;
    let mut dataset = super::checked(Dataset::read_any(directory)?).matching(&compiled.names());
    super::refuse_located(&dataset, directory)?;
    let touches = || dataset.touches();
    if counts_patterns(&compiled) {
        super::warn_of_full(touches().count(), touches().any(|touch| !touch.is_full()));
    }
    let trained_on: Vec<String> = compiled_trained_on(&compiled, &dataset).into_iter().map(String::from).collect();
    let probe = arguments.probe.read()?;
    arguments.probe.of_dataset(probe.as_ref(), &dataset)?;
    let noise = arguments.real.over(arguments.probe.noise(probe.as_ref(), &dataset, Noise::default())?)?;
    // What the touches have in the end.
    let stated = dataset.real().and(&noise);
    let robots = evaluate::add_noise(&mut dataset, &noise, global.seed())?;
    let progress = Bar::new();
    progress.begin("evaluating", None);
    let unknown = arguments.unknown.as_deref().map(|directory| -> Result<_> {
        let mut dataset = super::checked(Dataset::read_any(directory)?);
        evaluate::add_noise(&mut dataset, &noise, global.seed())?;
        Ok((directory, dataset))
    });
    let unknown = unknown.transpose()?;
    let wanted = Wanted {
        at: arguments.at.clone(),
        groups: arguments.sequences,
        error_rate: arguments.error_rate,
        max_touches: arguments.max_touches,
        seed: global.seed(),
        noise: stated,
        active: arguments.active,
        unknown: unknown.as_ref().map(|(directory, dataset)| (*directory, dataset)),
    };
    let expecting = |objects: &[String], own: &[f64]| arguments.expected.weights(objects, own);
    let measured = evaluate::measure(&compiled.model(), &dataset, &wanted, expecting)?;
    let evaluated = Evaluated { robots, trained_on, ..measured };
    drop(progress);
    global.print(&evaluated, || text(&evaluated))
}
