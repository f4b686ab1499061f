use super::Global;
use super::kinds::{self, ModelKind};
use super::numbers::{self, error_rate, share};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::strangers::StrangersArguments;
use super::thresholds;
use palpate::Result;
use palpate::calibrate::{self, Calibrated, Gain, Guarded, OfRecorded, OfRows, Per, Settings, Used};
use palpate::compile::{self, CompiledModel};
use palpate::ensemble::compiled_trained_on;
use palpate::error::{Kind, Place, problem};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::strangers;
use palpate::touches::Dataset;
use palpate::with;
use palpate::wording::{self, count, decimal};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Set a model's thresholds so that it keeps a promised error rate, and uses it up.
#[derive(clap::Args)]
#[command(after_help = "\
The promise holds for touches like those of DIR, which the model was not trained on, or with --recorded for touches like the recorded ones. A sequence without a name is neither right nor wrong. Calibrate once: where several seeds, rates or models are tried on the same data, the one that looks best keeps its promise less often than stated. docs/reference/options.md has the method.

Examples:
  palpate capture builtin -o fresh --approaches 100000 --seed 3
  palpate calibrate model.palpate fresh -o calibrated.palpate
  palpate calibrate model.palpate fresh -o robot.palpate --recorded recorded
  palpate calibrate planned.palpate posed -o calibrated.palpate --active")]
pub(crate) struct Arguments {
    /// Compiled model
    model: PathBuf,
    /// Touches to calibrate on: a directory that `palpate capture` filled
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Recorded touches of the objects; thresholds are tested on them
    #[arg(long, value_name = "DIR", conflicts_with = "detect_unknown")]
    recorded: Option<PathBuf>,
    /// Output; the calibrated model
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    promise: PromiseArguments,
    /// Cases that it is promised of: average, name or object
    #[arg(long, value_parser = per, default_value = "average", value_name = "OF")]
    per: Per,
    /// Sequences of touches to draw; of all objects together, at most
    #[arg(long, value_name = "N", value_parser = numbers::sequences, default_value = "100000")]
    sequences: usize,
    /// Give up after this many touches [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_touches: Option<u32>,
    /// Follow the model's plan of approaches
    #[arg(long)]
    active: bool,
    #[command(flatten)]
    strangers: StrangersArguments,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    real: RealArguments,
}

/// A promise and how sure it is.
#[derive(clap::Args, Clone, Debug)]
pub(super) struct PromiseArguments {
    /// The share of wrong names to accept, such as 1%; what is promised
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = error_rate)]
    pub(super) error_rate: f64,
    /// Probability that it is kept
    #[arg(long, default_value = "0.95", value_name = "SHARE", value_parser = share)]
    pub(super) confidence: f64,
}

impl PromiseArguments {
    /// The test for what the model does not know, with the confidence of the promise.
    pub(super) fn stranger_test(&self, global: &Global) -> strangers::Settings {
        with!(strangers::Settings::default(), confidence = self.confidence, seed = global.seed())
    }
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { model: path, directory, recorded, output: to, promise, .. } = &arguments;
    output::admit(to, super::files_of(directory))?;
    if let Some(recorded) = recorded {
        output::admit(to, super::files_of(recorded))?;
    }
    let compiled = kinds::compiled(path, ModelKind::Touches, "calibrate")?;
    let dataset = untrained(&compiled, directory)?;
    let recorded = recorded.as_ref().map(|recorded| untrained(&compiled, recorded)).transpose()?;
    let file = arguments.probe.read()?;
    arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let settings = with!(
        Settings::default(),
        rate = promise.error_rate,
        per = arguments.per,
        confidence = promise.confidence,
        sequences = arguments.sequences,
        max_touches = arguments.max_touches,
        noise = arguments.real.over(arguments.probe.noise(file.as_ref(), &dataset, Noise::default())?)?,
        active = arguments.active,
        seed = global.seed()
    );
    // Recorded touches hold the noise of their probe.
    let unlike = calibrate::unlike_training(&compiled.model(), &dataset.real().and(&settings.noise));
    if let Some(unlike) = unlike.filter(|_| !dataset.is_recorded()) {
        super::remark(&format!("palpate: note: {unlike}"));
    }
    let calibrated = calibrated(&arguments, &compiled, dataset, recorded.as_ref(), &settings, global)?;
    output::write_bytes(to, &calibrated.model)?;
    let has_placements = recorded.is_none() && compiled.model().outputs().is_some() && arguments.per == Per::Object;
    let placements = if has_placements { in_each_placement(&calibrated) } else { String::new() };
    global.print_about(to, &calibrated, || text(to, &calibrated, &placements))
}

/// Calibrates on simulated touches, with recorded ones or a test for unknown objects if they are wanted.
fn calibrated(
    arguments: &Arguments,
    compiled: &CompiledModel,
    dataset: Dataset,
    recorded: Option<&Dataset>,
    settings: &Settings,
    global: &Global,
) -> Result<Calibrated> {
    let wrong = |error: palpate::Error| {
        let is_of_recorded = matches!(error.kind(), Kind::NotKept | Kind::NotRecorded | Kind::TooFew);
        error.in_file(arguments.recorded.as_ref().filter(|_| is_of_recorded).unwrap_or(&arguments.directory))
    };
    if !arguments.strangers.is_wanted() {
        let untested = strangers::without(&compiled.model())?;
        let model = compile::open(&untested)?;
        let calibrated = match recorded {
            Some(recorded) => calibrate::calibrate_recorded(&model, dataset, recorded, settings, &Bar::new()),
            None => calibrate::calibrate(&model, dataset, settings, &Bar::new()),
        };
        return calibrated.map_err(wrong);
    }
    let test = with!(arguments.promise.stranger_test(global), sequences = settings.sequences);
    let shapes = arguments.strangers.shapes(&dataset)?;
    let both = strangers::calibrate_with_promise(&compiled.model(), &dataset, &shapes, &test, settings, &Bar::new());
    let (calibrated, tested) = both.map_err(wrong)?;
    Ok(Calibrated { strangers: Some(tested.found(&test)), ..calibrated })
}

/// Touches that the model was not trained on.
fn untrained(compiled: &CompiledModel, directory: &Path) -> Result<Dataset> {
    let dataset = super::dataset(directory)?;
    super::refuse_located(&dataset, directory)?;
    let dataset = dataset.matching(&compiled.names());
    let trained_on = compiled_trained_on(compiled, &dataset);
    if trained_on.is_empty() {
        return Ok(dataset);
    }
    let objects = trained_on.join(", ");
    let what = problem!(
        "the model was trained on these touches of {objects}: a promise calibrated on them would not hold for others"
    );
    let fix = "Calibrate on others: capture them with another seed (--seed), or record more.";
    Err(what.fix(fix).at(Place::file(directory)))
}

/// A calibration as text, followed by `more` about the promise.
pub(super) fn text(path: &Path, calibrated: &Calibrated, more: &str) -> String {
    let percent = |share: f64| wording::percent(share, 2);
    let (promised, per) = (calibrated.promised, calibrated.promise.per);
    let number = |number: usize| if calibrated.rows.is_some() { number.to_string() } else { count(number) };
    let cases = if calibrated.groups.is_some() { " in new groups" } else { "" };
    let mut text = thresholds::promised(promised, per, cases, calibrated.confidence);
    // Writing to a string cannot fail.
    _ = write!(
        text,
        "{} sequences{}: of the names given {} wrong, {} without a name; {} {} each",
        number(calibrated.sequences),
        calibrated.groups.map_or_else(String::new, |groups| format!(" of {groups} groups")),
        percent(calibrated.error),
        percent(calibrated.undecided),
        decimal(calibrated.used.mean(), 1),
        calibrated.counted,
    );
    if let (Used::Rows { max_rows, .. }, Some(learned)) = (calibrated.used, calibrated.learned) {
        _ = write!(text, ", at most {max_rows}. The shape of evidence was learned from {learned} others");
    }
    text += ".\n";
    text += &calibrated.rows.as_ref().map_or_else(String::new, shape);
    if let Some(Guarded { rows, refused }) = calibrated.guard {
        let share = percent(refused as f64 / rows.max(1) as f64);
        _ = writeln!(text, "Guard: refuses {refused} of {rows} rows ({share}) that it was not learned from");
    }
    text += &thresholds::text(&calibrated.margins, &calibrated.errors, calibrated.uncalibrated_margin);
    if let Some(temperature) = calibrated.temperature {
        _ = writeln!(text, "Temperature of the posteriors that are shown: {temperature:.2}");
    }
    text += &calibrated.recorded.as_ref().map_or_else(String::new, |recorded| of_recorded(recorded, calibrated));
    text += &thresholds::worse(&calibrated.worse(), promised, per, calibrated.has_hidden());
    text += more;
    text += &calibrated.strangers.as_ref().map_or_else(String::new, |found| super::strangers::text(found) + "\n");
    text += &calibrated.note.as_ref().map_or_else(String::new, |note| format!("note: {note}\n"));
    text + &format!("{}: {} bytes\n", path.display(), number(calibrated.model.len()))
}

/// The shape of evidence of rows.
fn shape(of: &OfRows) -> String {
    let gain = |gain: Option<Gain>| {
        let Some(Gain { kept, rows_without, rows_with }) = gain else {
            return "not used; too few sequences to learn from".to_owned();
        };
        let rows = |rows: Option<f64>| rows.map_or_else(|| "no threshold".into(), |rows| format!("{rows:.1} rows"));
        let what = if kept { "used" } else { "not used" };
        format!("{what} ({} with them, {} without, on held-back sequences)", rows(rows_with), rows(rows_without))
    };
    let weights = of.weights_by_doubling.as_ref().map_or_else(String::new, |weights| {
        let each = (0..).zip(weights).map(|(doubling, weight)| format!("{} × {weight:.2}", 1_u32 << doubling));
        format!("\n  rows × weight: {}", each.collect::<Vec<_>>().join(", "))
    });
    format!(
        "Learned evidence table: {}\nLearned weights, smaller for later rows: {}{weights}\n",
        gain(of.row_evidence),
        gain(of.weights)
    )
}

/// A promise whatever the placements' shares, and the approaches that one takes at least: as many names of each placement as
/// are needed if none is wrong, each at the cost of those that came before.
fn in_each_placement(calibrated: &Calibrated) -> String {
    let placements = calibrated.objects.len();
    let touches = calibrated.used.mean();
    let named = (1.0 - calibrated.undecided).max(f64::MIN_POSITIVE);
    let least = |rate: f64| {
        let names = calibrate::needed(rate, calibrated.confidence);
        let all = names as f64 * placements as f64 * touches / named;
        format!("{} takes {names} names of each and {} {} in all", wording::rate(rate), round(all), calibrated.counted)
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
    let text = format!(
        "Tested on recorded touches, {} approaches to each object or more. Of the simulated names {} are wrong at this threshold.\n",
        recorded.approaches,
        wording::percent(recorded.simulated_error, 2)
    );
    match recorded.recordings {
        Some(recordings) => format!(
            "{text}note: the {} sequences are of {recordings} recordings. Sequences of one recording are not independent, so that the \
             promise may hold with a lower probability than {}: record on several days.\n",
            calibrated.sequences,
            wording::rate(calibrated.confidence)
        ),
        None => text,
    }
}

/// The cases of a promise, by their name.
pub(super) fn per(name: &str) -> Result<Per, String> {
    Per::ALL.iter().copied().find(|per| per.name() == name).ok_or_else(|| "use one of average, name, object".to_owned())
}
