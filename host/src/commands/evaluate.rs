use super::progress::Bar;
use palpate::Result;
use palpate::evaluate::model_file::ModelFile;
use palpate::evaluate::{self, Evaluation, Margins, Settings};
use palpate::output;
use palpate::progress::Progress;
use palpate::touches::noise;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Measure how often a model is right, and after how many touches.
#[derive(clap::Args)]
#[command(after_help = "\
The model is a compiled one (model.palpate), evaluated by the code that runs on the chip, or an ensemble
(ensemble.json), evaluated in f32. The same seed draws the same groups of touches for both.

Evaluate on touches that the model was not trained on: capture them with another seed.

Examples:
  palpate capture builtin -o unseen --touches 2000 --seed 2
  palpate evaluate model.palpate unseen
  palpate evaluate ensemble.json unseen --at 10,30 --json
  palpate evaluate model.palpate unseen --noise 5ms")]
pub(crate) struct Arguments {
    /// Compiled model or ensemble
    model: PathBuf,
    /// Directory that `palpate capture` filled
    directory: PathBuf,
    /// Numbers of touches after which to give the accuracy [default: 5,10,20,30,60, as far as the touches go]
    #[arg(long, value_delimiter = ',', value_name = "TOUCHES,…")]
    at: Option<Vec<usize>>,
    /// Groups of touches, and sequences, to draw at random for each object
    #[arg(long, default_value_t = 1000)]
    groups: usize,
    /// Stop touching when the posterior passes one less this
    #[arg(long, default_value_t = 0.01, value_parser = super::numbers::share, value_name = "RATE")]
    error_rate: f64,
    /// Give up after so many touches [default: the model's own limit; 200 for an ensemble]
    #[arg(long, value_name = "TOUCHES")]
    max_touches: Option<u32>,
    /// Add Gaussian noise to the contact times first: standard deviation, such as 5ms [default: none]
    #[arg(long, value_parser = super::train::microseconds, value_name = "DURATION")]
    noise: Option<f64>,
    /// Seed of the drawing, and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let file = ModelFile::load(&arguments.model)?;
    let mut dataset = super::dataset(&arguments.directory)?;
    if let Some(deviation) = arguments.noise {
        for object in &mut dataset.objects {
            object.touches = noise::noisy(&object.name, &object.touches, deviation, arguments.seed);
        }
    }
    let progress = Bar::new();
    progress.begin("evaluating", None);
    let evaluation = file.with(|candidate| {
        let margins = Margins::new(candidate, &dataset)?;
        let defaults = Settings::default();
        let feasible = || defaults.at.iter().copied().filter(|&at| at <= margins.fewest_touches()).collect();
        let settings = Settings {
            at: arguments.at.clone().unwrap_or_else(feasible),
            groups: arguments.groups,
            error_rate: arguments.error_rate,
            max_touches: arguments.max_touches,
            seed: arguments.seed,
        };
        evaluate::evaluate(&margins, &settings)
    })?;
    drop(progress);
    if arguments.json { output::print_json(&evaluation) } else { output::print(&table(&evaluation)) }
}

/// Accuracies in percent: a row an object, a column a number of touches; then the sequential figures.
fn table(evaluation: &Evaluation) -> String {
    let width = evaluation.per_object.keys().map(|name| name.chars().count()).max().unwrap_or(0).max("touches".len());
    let mut text = format!("{:width$}", "touches");
    // Writing to a string cannot fail.
    let cells = |text: &mut String, numbers: &mut dyn Iterator<Item = String>| {
        numbers.for_each(|number| _ = write!(text, " {number:>7}"));
    };
    let percent = |share: &f64| format!("{:.1} %", 100.0 * share);
    cells(&mut text, &mut evaluation.accuracy.keys().map(ToString::to_string));
    _ = writeln!(text, " {:>9}", "to stop");
    for (name, accuracy) in &evaluation.per_object {
        _ = write!(text, "{name:width$}");
        cells(&mut text, &mut accuracy.values().map(percent));
        _ = writeln!(text, " {:>9.1}", evaluation.sequential.per_object.get(name).copied().unwrap_or(f64::NAN));
    }
    let sequential = &evaluation.sequential;
    _ = write!(text, "{:width$}", "all");
    cells(&mut text, &mut evaluation.accuracy.values().map(percent));
    _ = writeln!(text, " {:>9.1}", sequential.mean_touches);
    _ = write!(text, "{:width$}", "±");
    cells(&mut text, &mut evaluation.accuracy_standard_error.values().map(percent));
    _ = writeln!(text, " {:>9.1}", sequential.mean_touches_standard_error);
    _ = write!(
        text,
        "\nStopping at an error rate of {}: {:.1} touches on average, {:.2} % wrong (± {:.2}), {:.2} % undecided after \
         {}.\n{} groups an object of {} touches in all; ± is a standard error.\n",
        sequential.error_rate,
        sequential.mean_touches,
        100.0 * sequential.error,
        100.0 * sequential.error_standard_error,
        100.0 * sequential.undecided,
        sequential.max_touches,
        evaluation.groups,
        evaluation.touches,
    );
    text
}
