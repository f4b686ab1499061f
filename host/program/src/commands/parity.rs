use super::progress::Bar;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::Ensemble;
use palpate::evaluate::parity;
use palpate::output;
use std::path::PathBuf;

/// Compare a compiled model with its ensemble.
#[derive(clap::Args)]
#[command(after_help = "\
Every touch of the data set goes through both: margins, and the best object. Then random sequences of touches, each of one object, go through both until there is a verdict.

Examples:
  palpate parity ensemble.json model.palpate data
  palpate parity ensemble.json model.palpate data --json")]
pub(crate) struct Arguments {
    /// Ensemble that the model was exported from
    ensemble: PathBuf,
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// Directory that `palpate capture` filled
    directory: PathBuf,
    /// How many random sequences are compared
    #[arg(long, default_value_t = 10_000)]
    sequences: usize,
    /// Seed of the sequences
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let ensemble = Ensemble::load(&arguments.ensemble)?;
    let compiled = CompiledModel::read(&arguments.model)?;
    let dataset = super::dataset(&arguments.directory)?;
    let Arguments { sequences, seed, .. } = arguments;
    let parity = parity::parity(&ensemble, &compiled.model(), &dataset, sequences, seed, &Bar::new())
        .map_err(|error| error.in_file(&arguments.model))?;
    if arguments.json {
        return output::print_json(&parity);
    }
    output::print(&format!(
        "{} touches: margins differ by at most {:.2e} nats (the model states {:.2e}); another best object after {}\n\
         {} sequences: another verdict in {}, the same after another number of touches in {}\n",
        parity.touches,
        parity.max_margin_error,
        parity.stated_bound,
        parity.best_differs,
        parity.sequences,
        parity.verdict_differs,
        parity.touches_differ
    ))
}
