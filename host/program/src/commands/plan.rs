use super::noise::NoiseArguments;
use super::progress::Bar;
use palpate::compile::CompiledModel;
use palpate::evaluate::{self, Planned};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::{Error, Result};
use std::path::PathBuf;

/// Add a plan of approaches to a model: where to touch next.
#[derive(clap::Args)]
#[command(after_help = "\
The plan says, for each of 26 directions and each roll of the row of fingers about it, how well an approach tells each two objects apart. With it a recognizer proposes the next approach: the one that tells the likeliest object best from those that are still in play. The robot has to know how the object is turned, even if the model does not use the probe's pose.

The data set holds approaches with pose to all of the model's objects, also those that missed, and none that the model was trained on. Of each object, 20 approaches are needed in every pose: about 10,000 in all with four rolls, and the more the better. A pose in which nothing is ever touched is left out.

A plan takes one byte for each pose and each two objects: 4.7 KB for ten objects with four rolls, 1.2 KB with one, where only the direction is chosen.

Examples:
  palpate capture meshes/ -o fresh --approaches --pose --touches 60000 --seed 3
  palpate plan model.palpate fresh -o planned.palpate
  palpate plan model.palpate fresh -o planned.palpate --rolls 1
  palpate capture meshes/ -o unseen --approaches --pose --touches 60000 --seed 4
  palpate evaluate planned.palpate unseen --active")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// Directory that `palpate capture --approaches --pose` filled
    directory: PathBuf,
    /// Where to write the model with its plan
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Rolls of the row of fingers that are told apart for each direction: 1, 2 or 4
    #[arg(long, default_value_t = 4)]
    rolls: u8,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print what was planned as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    noise: NoiseArguments,
}

#[derive(serde::Serialize)]
struct Written {
    bytes: usize,
    #[serde(flatten)]
    planned: Planned,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let inputs = super::files_of(&arguments.directory);
    output::refuse_input(&arguments.output, inputs.iter().chain([&arguments.model]))?;
    let compiled = CompiledModel::read(&arguments.model)?;
    let mut dataset = super::dataset(&arguments.directory)?;
    let noise = arguments.noise.over(Noise::default());
    evaluate::add_noise(&mut dataset, &noise, arguments.seed)?;
    let progress = Bar::new();
    progress.begin("planning", None);
    let planned = evaluate::plan(&compiled.model(), &dataset, arguments.rolls).map_err(|error| match error {
        Error::At { .. } if error.exit_code() == 1 => error.in_file(&arguments.directory),
        _ => error,
    })?;
    drop(progress);
    output::write_bytes(&arguments.output, &planned.bytes)?;
    let written = Written { bytes: planned.bytes.len(), planned };
    if arguments.json {
        return output::print_json_about(&arguments.output, &written);
    }
    let Written { bytes, planned: Planned { plan_bytes, poses, rolls, left_out, fewest, hardest, .. } } = &written;
    let [first, second] = &hardest.objects;
    let text = format!(
        "{}: {bytes} bytes, of which {plan_bytes} are a plan of {poses} poses: 26 directions, {rolls} roll{} each; \
         {left_out} never touch\n\
         Hardest to tell apart: {first} and {second}, by {:.3} of 1 in the best pose. Means are of {fewest} approaches or \
         more.\n",
        arguments.output.display(),
        if *rolls == 1 { "" } else { "s" },
        hardest.separation,
    );
    output::print_about(&arguments.output, &text)
}
