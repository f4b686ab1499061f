use super::Global;
use super::numbers::{self, error_rate, share};
use super::plan::{self, Wanted};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::sequences::{self, Calibration, SequenceArguments};
use super::strangers::StrangersArguments;
use super::thresholds;
use palpate::Result;
use palpate::calibrate::{self, Calibrated, OfRecorded, Per, Settings};
use palpate::compile::{self, CompiledModel};
use palpate::ensemble::compiled_trained_on;
use palpate::error::{CalibrateProblem, Error, EvaluateProblem, Place};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::strangers::{self, Found};
use palpate::touches::Dataset;
use palpate::wording::{self, count, decimal};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Set a model's thresholds so that it keeps a promised error rate, and uses it up.
#[derive(clap::Args)]
#[command(after_help = "\
The promise holds for touches like those of DIR, which the model was not trained on, or with --recorded for touches like the recorded ones. A sequence without a name is neither right nor wrong. With --plan DIR holds approaches with pose. Of a model over rows DIR is a CSV or Parquet file: rows of a sequence may depend on each other; sequences, or with --group-column groups, must not. Calibrate once. Where several seeds, rates or models are tried on the same data, the one that looks best keeps its promise less often than stated. docs/reference/options.md has the method.

Examples:
  palpate capture builtin -o fresh --approaches 100000 --seed 3
  palpate calibrate model.palpate fresh -o calibrated.palpate
  palpate calibrate model.palpate posed -o planned.palpate --plan 4
  palpate calibrate a.palpate a.csv --label a --sequence-column id -o b.palpate")]
pub(crate) struct Arguments {
    /// Compiled model
    model: PathBuf,
    /// Touches to calibrate on: a directory that `palpate capture` filled; or a file of sequences of rows
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Recorded touches of the objects; thresholds, or --strangers, are tested on them
    #[arg(long, value_name = "DIR", conflicts_with_all = ["plan", "label"])]
    recorded: Option<PathBuf>,
    /// Where to write; the calibrated model
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// The share of wrong names to accept, such as 1%; what is promised
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = error_rate)]
    error_rate: f64,
    /// Cases that it is promised of: average, name or object
    #[arg(long, value_parser = per, default_value = "average", value_name = "OF")]
    per: Per,
    /// Shares of placements it holds for: stated or any
    #[arg(long, value_parser = prior, default_value = "stated", value_name = "OF", conflicts_with_all = ["recorded", "label"])]
    placement_prior: PlacementPrior,
    /// Probability that it is kept
    #[arg(long, default_value = "0.95", value_name = "SHARE", value_parser = share)]
    confidence: f64,
    /// Sequences of touches to draw; of all objects together, at most
    #[arg(long, default_value = "100000", value_name = "N", value_parser = numbers::count)]
    sequences: u64,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Follow the model's plan of approaches
    #[arg(long)]
    active: bool,
    /// Add a plan of approaches instead, with 1, 2 or 4 rolls per direction
    #[arg(long, value_name = "ROLLS", conflicts_with_all = PROMISE)]
    plan: Option<u8>,
    #[command(flatten)]
    rows: SequenceArguments,
    #[command(flatten)]
    strangers: StrangersArguments,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    real: RealArguments,
}

/// The options that a plan has no use for.
const PROMISE: [&str; 10] = [
    "error_rate",
    "per",
    "placement_prior",
    "confidence",
    "sequences",
    "max_touches",
    "active",
    "strangers",
    "background",
    "label",
];

/// Shares of the placements of objects for which a promise holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlacementPrior {
    Stated,
    Any,
}

impl PlacementPrior {
    /// The cases of a promise: with any shares those of each output, which are placements.
    ///
    /// # Errors
    /// For any shares with a promise per name, and of a model without placements.
    fn per(self, per: Per, compiled: &CompiledModel) -> Result<Per> {
        match self {
            Self::Stated => Ok(per),
            Self::Any if per == Per::Name => Err(Error::setting(
                "placement_prior",
                "any",
                "stated with --per name: a name's errors depend on the shares",
            )),
            Self::Any if compiled.model().outputs().is_none() => {
                Err(Error::setting("placement_prior", "any", "it with a model that has an output for each placement"))
            }
            Self::Any => Ok(Per::Object),
        }
    }
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    if let Some(rolls) = arguments.plan {
        let Arguments { model, directory, output, probe, real, .. } = &arguments;
        return plan::run(&Wanted { model, directory, output, rolls, probe, real }, global);
    }
    if arguments.rows.label.is_some() {
        return rows(&arguments, global);
    }
    output::admit(&arguments.output, super::files_of(&arguments.directory))?;
    if let Some(recorded) = &arguments.recorded {
        output::refuse_input(&arguments.output, super::files_of(recorded))?;
    }
    let compiled = CompiledModel::read(&arguments.model)?;
    let dataset = untrained(&compiled, &arguments.directory)?;
    let recorded = arguments.recorded.as_ref().map(|recorded| untrained(&compiled, recorded)).transpose()?;
    let file = arguments.probe.read()?;
    arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let settings = Settings {
        rate: arguments.error_rate,
        per: arguments.placement_prior.per(arguments.per, &compiled)?,
        confidence: arguments.confidence,
        sequences: usize::try_from(arguments.sequences).unwrap_or(usize::MAX),
        max_touches: arguments.max_touches,
        noise: arguments.real.over(arguments.probe.noise(file.as_ref(), &dataset, Noise::default())?)?,
        active: arguments.active,
        seed: global.seed(),
    };
    // Recorded touches hold the noise of their probe.
    let unlike = calibrate::unlike_training(&compiled.model(), &dataset.real().and(&settings.noise));
    if let Some(unlike) = unlike.filter(|_| !dataset.is_recorded()) {
        super::remark(&format!("palpate: note: {unlike}"));
    }
    let wrong = |error: palpate::Error| {
        use CalibrateProblem::{MissingRecordings, NotSupported};
        use EvaluateProblem::{RecordedUnknown, TooFewRecorded};
        let is_of_recorded = matches!(error.problem(), Some(NotSupported { .. } | MissingRecordings { .. }))
            || matches!(error.problem(), Some(TooFewRecorded { .. } | RecordedUnknown { .. }));
        error.in_file(arguments.recorded.as_ref().filter(|_| is_of_recorded).unwrap_or(&arguments.directory))
    };
    let (calibrated, found) = match arguments.strangers.held() {
        None => {
            let untested = strangers::without(&compiled.model())?;
            let model = compile::open(&untested)?;
            let calibrated = match &recorded {
                Some(recorded) => calibrate::calibrate_recorded(&model, dataset, recorded, &settings, &Bar::new()),
                None => calibrate::calibrate(&model, dataset, &settings, &Bar::new()),
            };
            (calibrated.map_err(wrong)?, None)
        }
        Some(held) => {
            let test = strangers::Settings {
                held,
                sequences: settings.sequences,
                confidence: settings.confidence,
                seed: settings.seed,
                ..Default::default()
            };
            let shapes = arguments.strangers.shapes(&dataset)?;
            let (model, recorded) = (compiled.model(), recorded.as_ref());
            let both =
                strangers::calibrate_with_promise(&model, &dataset, recorded, &shapes, &test, &settings, &Bar::new());
            let (calibrated, tested) = both.map_err(wrong)?;
            (calibrated, Some(Found::new(&test, &tested)))
        }
    };
    output::write_bytes(&arguments.output, &calibrated.model)?;
    if global.json {
        return output::print_json_about(&arguments.output, &Both { calibrated: &calibrated, strangers: &found });
    }
    let strangers = found.map_or_else(String::new, |found| super::strangers::text(&found) + "\n");
    let placements = match arguments.placement_prior {
        PlacementPrior::Stated => String::new(),
        PlacementPrior::Any => in_each_placement(&calibrated),
    };
    let text = format!("{}{placements}{strangers}{}\n", text(&calibrated), written(&arguments.output, &calibrated));
    output::print_about(&arguments.output, &text)
}

/// Calibrates on sequences of rows.
fn rows(arguments: &Arguments, global: &Global) -> Result<()> {
    let Some(columns) = arguments.rows.columns() else {
        let allowed = "it with --sequence-column, which says which rows are of one sequence";
        return Err(Error::setting("label", arguments.rows.label.as_deref().unwrap_or_default(), allowed));
    };
    let Arguments { error_rate, per, confidence, sequences, max_touches, .. } = *arguments;
    let settings = sequences::settings(error_rate, per, confidence, sequences, max_touches, global.seed());
    let asked = Calibration {
        model: &arguments.model,
        rows: &arguments.directory,
        output: &arguments.output,
        columns,
        settings,
        held: arguments.strangers.held(),
        background: arguments.strangers.background(),
    };
    sequences::calibrate(asked, global)
}

/// Touches that the model was not trained on.
fn untrained(compiled: &CompiledModel, directory: &PathBuf) -> Result<Dataset> {
    let dataset = super::dataset(directory)?.matching(&compiled.names());
    let trained_on = compiled_trained_on(compiled, &dataset);
    if trained_on.is_empty() {
        return Ok(dataset);
    }
    let objects = trained_on.into_iter().map(String::from).collect();
    Err(Error::at(Place::file(directory), CalibrateProblem::TrainedOn { objects }))
}

/// Results of both calibrations.
#[derive(serde::Serialize)]
struct Both<'c> {
    #[serde(flatten)]
    calibrated: &'c Calibrated,
    /// About strangers.
    #[serde(skip_serializing_if = "Option::is_none")]
    strangers: &'c Option<Found>,
}

fn written(path: &std::path::Path, calibrated: &Calibrated) -> String {
    format!("{}: {} bytes", path.display(), count(calibrated.model.len()))
}

fn text(calibrated: &Calibrated) -> String {
    let percent = |share: f64| wording::percent(share, 2);
    let mut text = thresholds::promised(calibrated.promised, calibrated.promise.per, "", calibrated.confidence);
    // Writing to a string cannot fail.
    _ = writeln!(
        text,
        "{} sequences: of the names given {} wrong, {} without a name; {} {} each.",
        count(calibrated.sequences),
        percent(calibrated.error),
        percent(calibrated.undecided),
        decimal(calibrated.mean_approaches.unwrap_or(calibrated.mean_touches), 1),
        calibrated.counted,
    );
    text += &thresholds::text(&calibrated.margins, &calibrated.errors, calibrated.uncalibrated_margin);
    _ = writeln!(text, "Temperature of the posteriors that are shown: {:.2}", calibrated.temperature);
    let hidden = calibrated
        .objects
        .values()
        .any(|of| 2 * of.given < calibrated.sequences as u64 / calibrated.objects.len() as u64);
    text + &calibrated.recorded.as_ref().map_or_else(String::new, |recorded| of_recorded(recorded, calibrated))
        + &thresholds::worse(&calibrated.worse(), calibrated.promised, calibrated.promise.per, hidden)
}

/// A promise whatever the placements' shares, and the approaches that one takes at least: as many names of each placement as
/// are needed if none is wrong, each at the cost of those that came before.
fn in_each_placement(calibrated: &Calibrated) -> String {
    let placements = calibrated.objects.len();
    let touches = calibrated.mean_approaches.unwrap_or(calibrated.mean_touches);
    let named = (1.0 - calibrated.undecided).max(f64::MIN_POSITIVE);
    let least = |rate: f64| {
        let names = calibrate::needed(rate, calibrated.confidence);
        let all = names as f64 * placements as f64 * touches / named;
        format!(
            "{} % takes {names} names of each and {} {} in all",
            super::percent(rate),
            round(all),
            calibrated.counted
        )
    };
    let rates = [calibrated.promised, calibrated.promised / 2.0, 2.0 * calibrated.promised];
    let rates: Vec<String> = rates.into_iter().filter(|rate| *rate < 1.0).map(least).collect();
    format!(
        "The rate holds in each of {placements} placements, and so whatever their shares are; not for placements that were left out. \
         At least, with no name wrong: {}.\n",
        rates.join("; ")
    )
}

/// A number to two digits.
fn round(number: f64) -> String {
    let unit = 10_f64.powf((number.max(10.0).log10() - 1.0).floor());
    format!("{:.0}", (number / unit).round() * unit)
}

/// Statements about a promise that was tested on recordings.
fn of_recorded(recorded: &OfRecorded, calibrated: &Calibrated) -> String {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let text = format!(
        "Tested on recorded touches, {} approaches to each object or more. Of the simulated names {} are wrong at this threshold.\n",
        recorded.approaches,
        percent(recorded.simulated_error)
    );
    match recorded.recordings {
        Some(recordings) => format!(
            "{text}note: the {} sequences are of {recordings} recordings. Sequences of one recording are not independent, so that the \
             promise may hold with a lower probability than {} %: record on several days.\n",
            calibrated.sequences,
            super::percent(calibrated.confidence)
        ),
        None => text,
    }
}

fn prior(name: &str) -> Result<PlacementPrior, String> {
    match name {
        "stated" => Ok(PlacementPrior::Stated),
        "any" => Ok(PlacementPrior::Any),
        _ => Err("use one of stated, any".to_owned()),
    }
}

fn per(name: &str) -> Result<Per, String> {
    Per::ALL.iter().copied().find(|per| per.name() == name).ok_or_else(|| "use one of average, name, object".to_owned())
}
