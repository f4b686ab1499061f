use super::Global;
use super::keys::one_of;
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::teach::TeachArguments;
use super::trees::Trees;
use palpate::ensemble::train::{self, Outputs, Settings};
use palpate::ensemble::{self, Ensemble, OverTouches};
use palpate::evaluate::{self, CostOfNoise};
use palpate::mesh::BACKGROUND;
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::teach::{self, Taught};
use palpate::touches::{Dataset, ObjectTouches};
use palpate::with;
use palpate::wording::{count, decimal, percent};
use palpate::{Error, Result};
use palpate_onboard::Refused;
use palpate_shared::format::Counted;
use palpate_shared::{Descriptor, Touch};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Train an ensemble on captured touches, and save it as XGBoost JSON.
#[derive(clap::Args)]
#[command(after_help = "\
The ensemble is XGBoost's JSON. Its features are in microseconds, where data sets have seconds, and cosines in units of 1/32767.

Presets: compact is accurate (leaves hold a value per object; curvature), small takes two fifths of its bytes, tiny a seventh; paper is the published method (one tree per object and round; contact times). Keys of --trees: rounds, depth, eta, min_child_weight, bins, leaves, leaf_bits, trainer; docs/reference/options.md explains them, --teach and --evidence.

Examples:
  palpate train data -o ensemble.json
  palpate train data -o paper.json --preset paper
  palpate train data -o small.json --preset small
  palpate train data -o trees.json --trees rounds=20,depth=5
  palpate train data -o robust.json --real noise=0..10ms,timer=1ms
  palpate train approaches -o all.json --evidence all
  palpate train approaches -o wary.json --background shapes
  palpate train approaches -o taught.json --teach pot.txt
  palpate train --teach recorded -o own.json")]
pub(crate) struct Arguments {
    /// Touches to train on: a directory that `palpate capture` filled
    #[arg(required_unless_present = "teach")]
    directory: Option<PathBuf>,
    #[command(flatten)]
    teach: TeachArguments,
    /// Output; the ensemble
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Touches of many other shapes; they train a column for what the model does not know
    #[arg(long, value_name = "DIR")]
    background: Option<PathBuf>,
    /// Preset that the settings start from: compact, small, tiny or paper [default: compact]
    #[arg(long, value_parser = preset, value_name = "NAME")]
    preset: Option<Preset>,
    /// Features of a touch: times, curvature, gravity or oriented [default: the preset's]
    #[arg(long, value_parser = descriptor, value_name = "NAME")]
    descriptor: Option<Descriptor>,
    /// Approaches that are evidence: full, contacts (at least one) or all [default: as the data set has]
    #[arg(long, value_parser = evidence, value_name = "WHICH")]
    evidence: Option<Counted>,
    /// Outputs for objects on a table: placements (one for each) or objects [default: placements]
    #[arg(long, value_parser = outputs, value_name = "OF")]
    outputs: Option<Outputs>,
    /// Settings of the trees, such as rounds=30,depth=6,eta=0.3 [default: the preset's]
    #[arg(long, value_name = "SETTINGS")]
    trees: Option<Trees>,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    real: RealArguments,
}

#[derive(Clone, Copy)]
enum Preset {
    Compact,
    Small,
    Tiny,
    Paper,
}

#[derive(serde::Serialize)]
struct Trained<'m> {
    descriptor: &'static str,
    objects: usize,
    /// Touches of the data set.
    touches: usize,
    /// Number of these that are evidence to the ensemble.
    used: usize,
    counted: &'static str,
    trees: usize,
    splits: usize,
    leaves: usize,
    seconds: f64,
    /// Cost of [`SWITCH`]; null where the training had noise, or too few touches.
    cost_of_noise: Option<CostOfNoise>,
    /// Results of teaching from recorded touches.
    #[serde(skip_serializing_if = "Option::is_none")]
    taught: Option<&'m Taught>,
}

/// The noise whose cost is given, in microseconds: what a good switch and a timer add.
const SWITCH: f64 = 1_000.0;

/// An ensemble, the touches that it was trained on, and what it was taught.
struct Made {
    ensemble: Ensemble,
    dataset: Dataset,
    taught: Option<Taught>,
    /// True if it was trained here, on simulated touches without noise.
    is_clean: bool,
    settings: Settings,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let read = arguments.directory.iter().flat_map(|directory| super::files_of(directory));
    let read: Vec<PathBuf> = read.chain(arguments.teach.files()).collect();
    output::admit(&arguments.output, &read)?;
    let start = Instant::now();
    let recorded = arguments.teach.recorded.read()?;
    let dataset = arguments.directory.as_deref().map(super::dataset).transpose()?;
    if let (Some(dataset), Some(path)) = (&dataset, &arguments.directory) {
        super::refuse_located(dataset, path)?;
    }
    if let (Some(recorded), Some(path)) = (&recorded, arguments.teach.files().first()) {
        super::refuse_located(recorded, path)?;
    }
    let made = match (dataset.zip(arguments.directory.as_ref()), recorded) {
        (Some((dataset, directory)), recorded) => simulated(&arguments, global, directory, dataset, recorded.as_ref())?,
        (None, recorded) => alone(&arguments, global, recorded.unwrap_or_default())?,
    };
    let seconds = start.elapsed().as_secs_f64();
    made.ensemble.save(&arguments.output)?;
    let trained = Trained::new(&made, seconds)?;
    warn(&made, &trained);
    global.print_about(&arguments.output, &trained, || text(&arguments.output, &trained, &made))
}

/// Says to stderr if nothing was learned, or if noise hides what there is.
fn warn(made: &Made, trained: &Trained<'_>) {
    if trained.splits == 0 {
        super::remark(
            "palpate: warning: no tree has a split: all touches look alike to it. Give thousands of touches of each object.",
        );
    }
    let longest = made.dataset.touches().map(Touch::spread).max().map_or(0.0, f64::from);
    let noise = made.settings.noise.deviation.largest;
    if noise > longest {
        let [noise, longest] = [noise, longest].map(|micros| decimal(micros / 1e6, 3));
        super::remark(&format!(
            "palpate: warning: noise of {noise} s on contact times hides all touches: the longest takes {longest} s. Give \
             it in milliseconds: noise=5ms."
        ));
    }
}

impl<'m> Trained<'m> {
    fn new(made: &'m Made, seconds: f64) -> Result<Self> {
        let Made { ensemble, dataset, taught, is_clean, settings } = made;
        let evidence = ensemble.trained_touches();
        let is_used = |touch: &&Touch| Refused::check(&evidence, touch).is_ok();
        let nodes: usize = ensemble.trees.iter().map(|tree| tree.nodes.len()).sum();
        let trees = ensemble.trees.len();
        // A binary tree has one leaf more than splits.
        let splits = (nodes - trees) / 2;
        Ok(Self {
            descriptor: ensemble.descriptor().map_or("", Descriptor::name),
            objects: ensemble.known_count(),
            touches: dataset.len(),
            used: dataset.touches().filter(is_used).count(),
            counted: evidence.counted.name(),
            trees,
            splits,
            leaves: nodes - splits,
            seconds,
            taught: taught.as_ref(),
            cost_of_noise: match is_clean {
                true => evaluate::cost_of_noise(dataset, settings, &Noise::gaussian(SWITCH))?,
                false => None,
            },
        })
    }
}

/// Summary of the training, as text.
fn text(output: &Path, trained: &Trained<'_>, made: &Made) -> String {
    let text = format!(
        "{}: {} trees, {} splits on {} of {} of {} {} of {} objects ({}), trained in {} s\n",
        output.display(),
        count(trained.trees),
        count(trained.splits),
        trained.descriptor,
        count(trained.used),
        count(trained.touches),
        if made.dataset.holds_approaches() { "approaches" } else { "touches" },
        made.dataset.objects.len(),
        match made.ensemble.trained_touches().counted {
            Counted::Full => "full touches",
            Counted::Contacts => "those with a contact",
            Counted::All => "all of them",
        },
        decimal(trained.seconds, 1)
    );
    // A remark, not a result.
    let cost = if super::is_quiet() { String::new() } else { cost(trained, made.is_clean) };
    text + &cost + &trained.taught.map_or_else(String::new, super::teach::text)
}

/// Trains on simulated touches, or takes the ensemble that was, and teaches it the recorded ones, if there are any.
fn simulated(
    arguments: &Arguments,
    global: &Global,
    directory: &PathBuf,
    dataset: Dataset,
    recorded: Option<&Dataset>,
) -> Result<Made> {
    let file = arguments.probe.read()?;
    let probe = arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let mut settings = with!(arguments.settings(global, &dataset), probe);
    settings.noise = arguments.real.over(arguments.probe.noise(file.as_ref(), &dataset, settings.noise)?)?;
    let background = arguments.background.as_deref().map(Dataset::read_any).transpose()?.map(super::checked);
    let in_directory = |error: Error| match error.exit_code() {
        1 => error.in_file(directory),
        _ => error,
    };
    let ensemble = match (&arguments.teach.extend, &background) {
        (Some(path), _) => ensemble::load(path)?,
        (None, None) => train::train(&dataset, &settings, &Bar::new()).map_err(in_directory)?,
        (None, Some(background)) => {
            train::train_with_background(&dataset, background, &settings, &Bar::new()).map_err(in_directory)?
        }
    };
    // What noise costs is measured with outputs that are objects.
    let is_placed = !dataset.placement_shares().is_empty();
    let is_clean = recorded.is_none() && !is_placed && dataset.real().and(&settings.noise).is_none();
    let Some(recorded) = recorded else {
        return Ok(Made { ensemble, dataset, taught: None, is_clean, settings });
    };
    let mut known = dataset.clone();
    if let Some(background) = background {
        known.objects.push(ObjectTouches::joined(BACKGROUND, &background.objects));
    }
    // An ensemble that is there states what it was trained for.
    let noise = arguments.teach.extend.is_none().then_some(settings.noise);
    let how = with!(teaching(&settings), noise);
    let (ensemble, taught) = teach::teach(&ensemble, &known, recorded, &how, &Bar::new())?;
    Ok(Made { ensemble, dataset, taught: Some(taught), is_clean, settings })
}

/// Trains on recorded touches alone.
fn alone(arguments: &Arguments, global: &Global, recorded: Dataset) -> Result<Made> {
    if arguments.real.is_given() {
        return Err(Error::setting(
            "real",
            "given",
            "it with simulated touches: recorded ones have noise of their own",
        ));
    }
    if let Some(background) = &arguments.background {
        let allowed = "it with simulated touches: recorded ones are trained on alone";
        return Err(Error::setting("background", background.display(), allowed));
    }
    let file = arguments.probe.read()?;
    let probe = arguments.probe.of_dataset(file.as_ref(), &recorded)?;
    let settings = with!(arguments.settings(global, &recorded), probe, noise = Noise::default());
    let (ensemble, taught) = teach::alone(&recorded, &settings, &teaching(&settings), &Bar::new())?;
    Ok(Made { ensemble, dataset: recorded, taught: Some(taught), is_clean: false, settings })
}

/// Settings for teaching objects to an ensemble of such a training.
fn teaching(settings: &Settings) -> teach::Settings {
    let Settings { seed, threads, leaf_bits, .. } = *settings;
    with!(teach::Settings::default(), seed, threads, leaf_bits)
}

/// Cost of noise, as a line; nothing where the training had noise.
fn cost(trained: &Trained<'_>, is_clean: bool) -> String {
    let ms = SWITCH / 1e3;
    match trained.cost_of_noise {
        Some(CostOfNoise { touches, clean, noisy }) => {
            let points = (100.0 * (clean - noisy)).round();
            let cost = match () {
                () if points >= 2.0 => format!("about {} points", decimal(points, 0)),
                () if points >= 1.0 => "about one point".to_owned(),
                () => "less than a point".to_owned(),
            };
            format!(
                "{ms} ms of noise on contact times would cost {cost}: {} correct after {touches} touches instead of {}. --real \
                 noise={ms}ms trains for it.\n",
                percent(noisy, 0),
                percent(clean, 0),
            )
        }
        None if is_clean => format!(
            "What {ms} ms of noise on contact times would cost was not measured: an object has fewer than {} touches.\n",
            evaluate::LEAST_FOR_COST
        ),
        None => String::new(),
    }
}

impl Arguments {
    /// All but the noise and the probe.
    fn settings(&self, global: &Global, dataset: &Dataset) -> Settings {
        let outputs = match self.outputs.unwrap_or(Outputs::Placements) {
            Outputs::Placements => dataset.placement_shares().len().max(dataset.objects.len()),
            Outputs::Objects => dataset.objects.len(),
        };
        let preset = match self.preset.unwrap_or(Preset::Compact) {
            Preset::Compact => Settings::compact_for(self.descriptor.unwrap_or(Descriptor::Curvature), outputs),
            Preset::Small => Settings::small(),
            Preset::Tiny => Settings::tiny(),
            Preset::Paper => Settings::paper(),
        };
        let settings = with!(
            preset.clone(),
            descriptor = self.descriptor.unwrap_or(preset.descriptor),
            counted = self.evidence.or(preset.counted),
            seed = global.seed(),
            threads = global.threads,
            probe = None,
            outputs = self.outputs.unwrap_or(Outputs::Placements)
        );
        self.trees.as_ref().map_or_else(|| settings.clone(), |trees| trees.over(settings.clone()))
    }
}

fn preset(name: &str) -> Result<Preset, String> {
    let [compact, small, tiny, paper] = [Preset::Compact, Preset::Small, Preset::Tiny, Preset::Paper];
    one_of(name, [("compact", compact), ("small", small), ("tiny", tiny), ("paper", paper)])
}

pub(super) fn evidence(name: &str) -> Result<Counted, String> {
    one_of(name, Counted::ALL.iter().map(|counted| (counted.name(), *counted)))
}

fn outputs(name: &str) -> Result<Outputs, String> {
    one_of(name, [("placements", Outputs::Placements), ("objects", Outputs::Objects)])
}

pub(super) fn descriptor(name: &str) -> Result<Descriptor, String> {
    one_of(name, Descriptor::ALL.map(|descriptor| (descriptor.name(), descriptor)))
}
