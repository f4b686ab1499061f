use super::Global;
use super::numbers::{self, error_rate, share};
use super::plan::{self, Wanted};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::sequences::{self, SequenceArguments};
use super::strangers::StrangersArguments;
use super::table::{self, TableArguments};
use super::thresholds;
use palpate::Result;
use palpate::calibrate::{self, Calibrated, Gain, Guarded, OfRecorded, OfRows, Per, Settings, Terms, Used};
use palpate::compile::{self, CompiledModel};
use palpate::ensemble::compiled_trained_on;
use palpate::error::{Error, Kind, Place, problem};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::strangers;
use palpate::stream::{self, StrangerTest};
use palpate::touches::Dataset;
use palpate::with;
use palpate::wording::{self, count, decimal};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Set a model's thresholds so that it keeps a promised error rate, and uses it up.
#[derive(clap::Args)]
#[command(after_help = "\
The promise holds for touches like those of DIR, which the model was not trained on, or with --recorded for touches like the recorded ones. A sequence without a name is neither right nor wrong. For a model of maps, the promise holds for approaches to the meshes on a simulated table, with the noise of the model and of --real. With --plan, DIR holds approaches with a pose. For a model over rows, DIR is a CSV file: rows of a sequence may depend on each other, but sequences (with --group-column, groups) must not. Calibrate once. Where several seeds, rates or models are tried on the same data, the one that looks best keeps its promise less often than stated. docs/reference/options.md has the method.

Examples:
  palpate capture builtin -o fresh --approaches 100000 --seed 3
  palpate calibrate model.palpate fresh -o calibrated.palpate
  palpate calibrate model.palpate posed -o planned.palpate --plan 4
  palpate calibrate maps.palpate --objects meshes/ -o sure.palpate
  palpate calibrate maps.palpate --recorded stays/ -o sure.palpate
  palpate calibrate a.palpate a.csv --label a --sequence-column id -o b.palpate")]
pub(crate) struct Arguments {
    /// Compiled model
    model: PathBuf,
    /// Touches to calibrate on: a directory that `palpate capture` filled; or a file of sequences of rows
    #[arg(value_name = "DIR", required_unless_present_any = ["objects", "recorded"])]
    directory: Option<PathBuf>,
    /// Meshes of the objects, for a model of maps: approaches to them on a table are simulated
    #[arg(long, value_name = "MESHES", num_args = 1.., conflicts_with_all = TOUCHES)]
    objects: Vec<String>,
    #[command(flatten)]
    table: TableArguments,
    /// Recorded touches of the objects; thresholds are tested on them. Of a model of maps, without DIR: each recording is of an object that stood still
    #[arg(long, value_name = "DIR", conflicts_with_all = ["plan", "label", "strangers"])]
    recorded: Option<PathBuf>,
    /// Output; the calibrated model
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
    /// Sequences of touches to draw; of all objects together, at most [default: 100000, or 1000 with --objects]
    #[arg(long, value_name = "N", value_parser = numbers::count)]
    sequences: Option<u64>,
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
    /// Refuse rows of dead, stuck or railed sensors, of a model over rows
    #[arg(long, requires = "sequence_column")]
    guard: bool,
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

/// The options that approaches on a simulated table have no use for.
const TOUCHES: [&str; 10] =
    ["directory", "recorded", "per", "placement_prior", "active", "plan", "strangers", "background", "label", "probe"];

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
    let Some(directory) = &arguments.directory else {
        let wanted = table::Wanted {
            model: &arguments.model,
            objects: &arguments.objects,
            real: &arguments.real,
            promise: Terms { rate: arguments.error_rate, confidence: arguments.confidence, per: Per::Average },
            sequences: arguments.sequences.map_or(1_000, |count| usize::try_from(count).unwrap_or(usize::MAX)),
            max_touches: arguments.max_touches,
            seed: global.seed(),
        };
        let Arguments { per, active, strangers, real, recorded, table, output, .. } = &arguments;
        let is_of_trees = *per != Per::Average || *active || real.is_given();
        if recorded.is_some() && (is_of_trees || strangers.background().is_some()) {
            let allowed = "it without --per, --active, --background and --real, or with DIR";
            return Err(Error::setting("recorded", "given", allowed));
        }
        return table.calibrate(&wanted, recorded.as_deref(), output, global);
    };
    arguments.table.check_unused()?;
    if let Some(rolls) = arguments.plan {
        let Arguments { model, output, probe, real, .. } = &arguments;
        return plan::run(&Wanted { model, directory, output, rolls, probe, real }, global);
    }
    let calibrated = match arguments.rows.label.is_some() {
        true => on_rows(&arguments, directory, global)?,
        false => on_touches(&arguments, directory, global)?,
    };
    output::write_bytes(&arguments.output, &calibrated.model)?;
    let placements = match arguments.placement_prior {
        PlacementPrior::Stated => String::new(),
        PlacementPrior::Any => in_each_placement(&calibrated),
    };
    global.print_about(&arguments.output, &calibrated, || text(&arguments.output, &calibrated, &placements))
}

impl Arguments {
    /// Sequences of touches or rows to draw.
    fn drawn(&self) -> usize {
        usize::try_from(self.sequences.unwrap_or(100_000)).unwrap_or(usize::MAX)
    }
}

/// Calibrates on touches.
fn on_touches(arguments: &Arguments, directory: &PathBuf, global: &Global) -> Result<Calibrated> {
    output::admit(&arguments.output, super::files_of(directory))?;
    if let Some(recorded) = &arguments.recorded {
        output::admit(&arguments.output, super::files_of(recorded))?;
    }
    let compiled = CompiledModel::read(&arguments.model)?;
    let dataset = untrained(&compiled, directory)?;
    let recorded = arguments.recorded.as_ref().map(|recorded| untrained(&compiled, recorded)).transpose()?;
    let file = arguments.probe.read()?;
    arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let settings = with!(
        Settings::default(),
        rate = arguments.error_rate,
        per = arguments.placement_prior.per(arguments.per, &compiled)?,
        confidence = arguments.confidence,
        sequences = arguments.drawn(),
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
    let wrong = |error: palpate::Error| {
        let is_of_recorded = matches!(error.kind(), Kind::NotKept | Kind::NotRecorded | Kind::TooFew);
        error.in_file(arguments.recorded.as_ref().filter(|_| is_of_recorded).unwrap_or(directory))
    };
    if !arguments.strangers.is_wanted() {
        let untested = strangers::without(&compiled.model())?;
        let model = compile::open(&untested)?;
        let calibrated = match &recorded {
            Some(recorded) => calibrate::calibrate_recorded(&model, dataset, recorded, &settings, &Bar::new()),
            None => calibrate::calibrate(&model, dataset, &settings, &Bar::new()),
        };
        return calibrated.map_err(wrong);
    }
    let sequences = settings.sequences;
    let test = with!(test(arguments, global), sequences);
    let shapes = arguments.strangers.shapes(&dataset)?;
    let both = strangers::calibrate_with_promise(&compiled.model(), &dataset, &shapes, &test, &settings, &Bar::new());
    let (calibrated, tested) = both.map_err(wrong)?;
    Ok(Calibrated { strangers: Some(tested.found(&test)), ..calibrated })
}

/// The test for what the model does not know, with the confidence and the seed of the promise.
fn test(arguments: &Arguments, global: &Global) -> strangers::Settings {
    with!(strangers::Settings::default(), confidence = arguments.confidence, seed = global.seed())
}

/// Calibrates on sequences of rows.
fn on_rows(arguments: &Arguments, rows: &PathBuf, global: &Global) -> Result<Calibrated> {
    let Some(columns) = arguments.rows.columns() else {
        let allowed = "it with --sequence-column, which says which rows are of one sequence";
        return Err(Error::setting("label", arguments.rows.label.as_deref().unwrap_or_default(), allowed));
    };
    let path = &arguments.model;
    let background = arguments.strangers.background();
    output::admit(&arguments.output, [path, rows].into_iter().chain(background))?;
    let compiled = CompiledModel::read(path)?;
    let model = compiled.model();
    stream::check(&model).map_err(|error| error.in_file(path))?;
    let found = sequences::read(rows, &model, &columns)?;
    let strangers = || {
        let others = background.map(|path| sequences::others(path, &model, &columns)).transpose()?;
        StrangerTest::new(test(arguments, global), &model, others.as_ref())
    };
    let settings = with!(
        stream::Settings::default(),
        rate = arguments.error_rate,
        per = arguments.per,
        confidence = arguments.confidence,
        sequences = arguments.drawn(),
        max_rows = arguments.max_touches,
        guard = arguments.guard,
        strangers = arguments.strangers.is_wanted().then(strangers).transpose()?,
        seed = global.seed()
    );
    stream::calibrate(&model, &found, &settings, &Bar::new()).map_err(|error| error.in_file(rows))
}

/// Touches that the model was not trained on.
fn untrained(compiled: &CompiledModel, directory: &PathBuf) -> Result<Dataset> {
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

fn text(path: &Path, calibrated: &Calibrated, placements: &str) -> String {
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
    text += placements;
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
