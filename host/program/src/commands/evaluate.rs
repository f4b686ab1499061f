use super::Global;
use super::expected::ExpectedArguments;
use super::figures::{shares_table, text};
use super::numbers::{error_rate, sequences};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::sequences::{self, Evaluation, SequenceArguments};
use super::table::{self, TableArguments};
use palpate::calibrate::{Per, Terms};
use palpate::ensemble::OverTouches;
use palpate::evaluate::model_file::ModelFile;
use palpate::evaluate::over_touches;
use palpate::evaluate::{self, Classes, Evaluated, Regression, RowsEvaluation, Wanted, evaluate_rows};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::rows::{Features, SequenceColumns};
use palpate::stream;
use palpate::touches::Dataset;
use palpate::wording::percent_within;
use palpate::{Error, Result};
use palpate_shared::format::Counted;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Measure how often a model is right, and after how many touches.
#[derive(clap::Args)]
#[command(after_help = "\
Evaluate on touches that the model was not trained on. A compiled model is evaluated by the code that runs on the chip, an ensemble in f32. A compiled model stops by its own thresholds; if it was calibrated, the figures show whether it keeps its promise. Wrong names are shares of all sequences, and of those that got a name. docs/reference/options.md explains every figure.

Examples:
  palpate capture builtin -o unseen --approaches 6000 --seed 2
  palpate evaluate model.palpate unseen
  palpate evaluate ensemble.json unseen --at 10,30 --json
  palpate evaluate model.palpate unseen --real timer=1ms,missed=2%
  palpate evaluate model.palpate unseen --prior fork=0.3,spoon=0.3
  palpate evaluate maps.palpate --objects meshes/ --aimed random
  palpate evaluate model.palpate rows.csv --label kind
  palpate evaluate sure.palpate rows.csv --label kind --sequence-column id")]
pub(crate) struct Arguments {
    /// Compiled model or ensemble
    model: PathBuf,
    /// Touches: a directory, or a robot's log (MCAP); with --label a file of rows
    #[arg(value_name = "DIR", required_unless_present = "objects")]
    directory: Option<PathBuf>,
    /// Meshes of the objects, for a model of maps: approaches to them on a table are simulated
    #[arg(long, value_name = "MESHES", num_args = 1.., conflicts_with_all = TOUCHES)]
    objects: Vec<String>,
    #[command(flatten)]
    table: TableArguments,
    #[command(flatten)]
    sequences_of_rows: SequenceArguments,
    /// Also write a page of the results; for sequences of rows
    #[arg(long, value_name = "FILE", requires = "sequence_column")]
    page: Option<PathBuf>,
    /// Touches of objects that the model does not know: how many are detected
    #[arg(long, value_name = "DIR", conflicts_with = "label")]
    unknown: Option<PathBuf>,
    /// Give the accuracy after these touches [default: 5,10,20,30,60]
    #[arg(long, value_delimiter = ',', value_name = "N,…", conflicts_with = "label")]
    at: Option<Vec<usize>>,
    /// Sequences of touches to draw; of each object, and as many groups [default: 1000, or 500 of all with --objects]
    #[arg(long, value_name = "N", value_parser = sequences, conflicts_with = "label")]
    sequences: Option<usize>,
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

/// The options that approaches on a simulated table have no use for.
const TOUCHES: [&str; 9] = ["directory", "label", "unknown", "at", "error_rate", "active", "probe", "only", "prior"];

impl Arguments {
    /// True if there is an option for sequences of touches or rows.
    fn stops(&self) -> bool {
        self.error_rate.is_some() || self.max_touches.is_some() || self.expected.is_given()
    }
}

/// True if the pattern of touching fingers is evidence to the model.
fn counts_patterns(file: &ModelFile) -> bool {
    let counted = match file {
        ModelFile::Full(ensemble) => ensemble.trained_touches().counted,
        ModelFile::Compiled(compiled) => compiled.model().trained_touches().counted,
    };
    counted != Counted::Full
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Some(directory) = &arguments.directory else {
        let wanted = table::Wanted {
            model: &arguments.model,
            objects: &arguments.objects,
            real: &arguments.real,
            promise: Terms { rate: 0.01, confidence: 0.95, per: Per::Average },
            sequences: arguments.sequences.unwrap_or(500),
            max_touches: arguments.max_touches,
            seed: global.seed(),
        };
        return arguments.table.evaluate(&wanted, global);
    };
    arguments.table.check_unused()?;
    let file = ModelFile::load(&arguments.model)?;
    if let Some(label) = &arguments.sequences_of_rows.label {
        return match arguments.sequences_of_rows.columns() {
            Some(columns) => sequences_of(&arguments, directory, &file, columns, global),
            None if arguments.stops() => {
                Err(Error::setting("label", label, "it with --sequence-column, or without options of sequences"))
            }
            None => rows(directory, &arguments, &file, label, global),
        };
    }
    let mut dataset = super::checked(Dataset::read_any(directory)?).matching(&file.names());
    super::refuse_located(&dataset, directory)?;
    let touches = || dataset.touches();
    if counts_patterns(&file) {
        super::warn_of_full(touches().count(), touches().any(|touch| !touch.is_full()));
    }
    let trained_on: Vec<String> = file.trained_on(&dataset).into_iter().map(String::from).collect();
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
        groups: arguments.sequences.unwrap_or(1_000),
        error_rate: arguments.error_rate,
        max_touches: arguments.max_touches,
        seed: global.seed(),
        noise: stated,
        active: arguments.active,
        unknown: unknown.as_ref().map(|(directory, dataset)| (*directory, dataset)),
    };
    let expecting = |objects: &[String], own: &[f64]| arguments.expected.weights(objects, own);
    let measured = file.with(|candidate| evaluate::measure(candidate, &dataset, &wanted, expecting))?;
    let evaluated = Evaluated { robots, trained_on, ..measured };
    drop(progress);
    global.print(&evaluated, || text(&evaluated))
}

/// Evaluates a model on sequences of rows.
fn sequences_of(
    arguments: &Arguments,
    rows: &Path,
    file: &ModelFile,
    columns: SequenceColumns<'_>,
    global: &Global,
) -> Result<()> {
    let ModelFile::Compiled(compiled) = file else { return Err(sequences::needs_compiled(&arguments.model)) };
    let model = compiled.model();
    let weights = arguments.expected.weights(&compiled.names(), &evaluate::own_weights(&model))?;
    let Arguments { error_rate, max_touches, .. } = *arguments;
    let asked = Evaluation {
        model: &arguments.model,
        rows,
        columns,
        wanted: stream::Wanted { error_rate, max_rows: max_touches, weights },
        page: arguments.page.as_deref(),
    };
    sequences::evaluate(asked, compiled, global)
}

/// Evaluates a model on labeled rows.
fn rows(directory: &Path, arguments: &Arguments, file: &ModelFile, label: &str, global: &Global) -> Result<()> {
    if file.with(|candidate| Ok(!candidate.is_of_rows()))? {
        return Err(over_touches().in_file(&arguments.model));
    }
    let features = match file {
        ModelFile::Full(ensemble) => Features::from(&**ensemble),
        ModelFile::Compiled(compiled) => Features::from(&compiled.model()),
    };
    let rows = super::rows::read_rows(directory, features, Some(label))?;
    let evaluated = file.with(|candidate| evaluate_rows(candidate, &rows)).map_err(|error| error.in_file(directory))?;
    if global.json {
        return output::print_json(&evaluated);
    }
    let RowsEvaluation { rows, classes, regression } = evaluated;
    let mut text = String::new();
    if let Some(Classes { accuracy, accuracy_standard_error, names, confusion, .. }) = classes {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "{rows} rows, each taken alone: {} right (± is a standard error)",
            percent_within(accuracy, accuracy_standard_error, 1)
        );
        text += &shares_table("Taken for", &names, &names, &confusion);
    }
    if let Some(Regression { mean_absolute_error, root_mean_square_error }) = regression {
        text = format!(
            "{rows} rows: values are off by {mean_absolute_error:.4} on average, {root_mean_square_error:.4} in the root mean \
             square\n"
        );
    }
    output::print(&text)
}
