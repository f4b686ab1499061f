//! `palpate plan`.

use super::Global;
use super::kinds::{self, ModelKind};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use palpate::Result;
use palpate::evaluate::{self, Planned};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::wording::{count, counted, decimal};
use palpate_shared::DIRECTIONS;
use std::path::PathBuf;

#[derive(serde::Serialize)]
struct Written {
    bytes: usize,
    #[serde(flatten)]
    planned: Planned,
}

/// Add a plan to a model: which pose to approach in next.
#[derive(clap::Args)]
#[command(after_help = "\
DIR holds approaches with their pose to all of the model's objects, which the model was not trained on: 20 of each object in every pose, about 10,000 in all with four rolls. A plan takes one byte for each pose and pair of objects. docs/guide/plan.md has more.

Examples:
  palpate capture builtin -o posed --approaches 60000 --pose --seed 2
  palpate plan model.palpate posed -o planned.palpate
  palpate plan model.palpate posed -o planned.palpate --rolls 1")]
pub(crate) struct Arguments {
    /// Compiled model
    model: PathBuf,
    /// Approaches with pose: a directory that `palpate capture` filled
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Output; the model with its plan
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Rolls of the row of fingers for each direction: 1, 2 or 4
    #[arg(long, value_name = "N", default_value = "4")]
    rolls: u8,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { model, directory, output: path, rolls, probe, real } = &arguments;
    let inputs = super::files_of(directory);
    output::admit(path, inputs.iter().chain([model]))?;
    let compiled = kinds::compiled(model, ModelKind::Touches, "plan")?;
    let mut dataset = super::dataset(directory)?.matching(&compiled.names());
    let file = probe.read()?;
    probe.of_dataset(file.as_ref(), &dataset)?;
    let noise = real.over(probe.noise(file.as_ref(), &dataset, Noise::default())?)?;
    evaluate::add_noise(&mut dataset, &noise, global.seed())?;
    let progress = Bar::new();
    progress.begin("planning", None);
    let planned = evaluate::plan(&compiled.model(), &dataset, *rolls).map_err(|error| match error {
        error if error.exit_code() == 1 => error.in_file(directory),
        _ => error,
    })?;
    drop(progress);
    output::write_bytes(path, &planned.bytes)?;
    let written = Written { bytes: planned.bytes.len(), planned };
    let Written { bytes, planned: Planned { plan_bytes, poses, rolls, left_out, fewest, hardest, .. } } = &written;
    let [first, second] = &hardest.objects;
    let text = format!(
        "{}: {} bytes; {} of them are a plan of {poses} poses: {DIRECTIONS} directions, {} each; {left_out} never touch\n\
         Hardest to distinguish: {first} and {second}, separated by {} in the best pose (1 = fully). Means are of {} approaches \
         or more.\n",
        path.display(),
        count(*bytes),
        count(*plan_bytes),
        counted(usize::from(*rolls), "roll", "rolls"),
        decimal(hardest.separation, 3),
        count(*fewest),
    );
    global.print_about(path, &written, || text)
}
