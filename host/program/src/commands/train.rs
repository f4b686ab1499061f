use super::noise::NoiseArguments;
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::teach::TeachArguments;
use palpate::ensemble::Ensemble;
use palpate::ensemble::train::{self, Engine, Settings, Small};
use palpate::evaluate::{self, CostOfNoise};
use palpate::mesh::BACKGROUND;
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::teach::{self, Taught};
use palpate::touches::{Dataset, ObjectTouches};
use palpate::{Error, Result};
use palpate_onboard::Refused;
use palpate_shared::format::Counted;
use palpate_shared::{Descriptor, Touch};
use std::path::PathBuf;
use std::time::Instant;

/// Train an ensemble on captured touches, and save it as XGBoost JSON.
#[derive(clap::Args)]
#[command(after_help = "\
Presets:
  compact  small and accurate: leaves hold a value per object; uses curvature
  paper    the published method: one tree per object and round, on contact times

A data set of approaches also holds touches with one or two contacts, and approaches that touched nothing. Partial touches say which fingers touched and, where two did, how long one came after the other; a robot that uses them needs a fraction of the approaches. An approach that touched nothing is evidence only with --touches all: what it says depends on where the robot aims.

The ensemble states the probe that the data set was captured with; models exported from it do as well. With --probe, \
the data set must have been captured with the probe of the file, and what the file says under [real] is added to the \
touches, unless they were captured with it and have it already.

With --teach, objects are learned from recorded touches, which are not disturbed further. The trees are those of the simulated objects, or of the ensemble that --extend names; every leaf gets a value more. How much the touches are smoothed is found by cross-validation, and so is a constant that is added with every touch, so that the object is missed as often as others are taken for it. What is printed comes from recorded touches that were held out; of the simulated ones, trees have seen all.

Examples:
  palpate train data -o ensemble.json
  palpate train data -o paper.json --preset paper
  palpate train data -o small.json --rounds 20 --depth 5
  palpate capture builtin -o approaches --approaches --touches 60000
  palpate train approaches -o contacts.json
  palpate train approaches -o all.json --touches all
  palpate capture background -o shapes --approaches --touches 60000
  palpate train approaches -o wary.json --background shapes
  palpate train data -o table.json --bins 64,16  for a small, very fast table
  palpate train data -o tiny.json --different-leaves 128 --leaf-bits 8
  palpate train data -o robust.json --noise 0..10ms --timer 1ms
  palpate train data -o real.json --probe probe.toml
  palpate train approaches -o taught.json --teach pot.txt
  palpate train approaches -o taught.json --teach pot.txt --page pot.html
  palpate train approaches -o more.json --extend taught.json --teach real
  palpate train --teach real -o own.json  no simulation at all
  palpate train data -o turned.json --descriptor oriented --pose-noise 5deg")]
pub(crate) struct Arguments {
    /// Directory that `palpate capture` filled
    #[arg(required_unless_present = "teach")]
    directory: Option<PathBuf>,
    #[command(flatten)]
    teach: TeachArguments,
    /// Where to save the ensemble
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Touches of many other shapes: trains a column more, for what the model does not know, which is never named
    #[arg(long, value_name = "DIR2")]
    background: Option<PathBuf>,
    /// Where the settings below start from
    #[arg(long, value_enum, default_value = "compact")]
    preset: Preset,
    /// Which features a touch is turned into [default: the preset's]
    #[arg(long, value_parser = descriptor, value_name = "times|curvature|gravity|oriented")]
    descriptor: Option<Descriptor>,
    /// Which touches are trained on, and so evidence: full ones, those with at least one contact, or every approach, also those that touched nothing [default: contacts where the data set holds approaches, else full; full for the paper's preset]
    #[arg(long, value_enum)]
    touches: Option<Touches>,
    /// What a leaf holds: a value for each object, or one value (and each object has its own trees) [default: the preset's]
    #[arg(long, value_enum)]
    leaves: Option<Leaves>,
    /// Boosting rounds [default: the preset's; compact 30, paper 100]
    #[arg(long)]
    rounds: Option<usize>,
    /// The most splits between root and leaf [default: the preset's; 6]
    #[arg(long)]
    depth: Option<usize>,
    /// The share of each tree that is added [default: the preset's; 0.3]
    #[arg(long)]
    eta: Option<f64>,
    /// The least sum of second derivatives in a leaf [default: the preset's; compact 30, paper 1]
    #[arg(long, value_name = "WEIGHT")]
    min_child_weight: Option<f64>,
    /// The most bins of a feature's histogram, for all features or for each [default: the preset's; 256]
    #[arg(long, value_delimiter = ',', value_name = "BINS[,BINS…]")]
    bins: Vec<usize>,
    /// Round leaves to multiples of a power of two that fit this many bits, so that a compiled model with leaves of that width is exact; 0 leaves them as they are [default: the preset's; compact 16, paper 0]
    #[arg(long, value_name = "BITS")]
    leaf_bits: Option<u32>,
    /// Grow trees for little flash: the leaves of all trees share at most this many lists of values, and thresholds cost. Up to 256 a leaf takes one byte of the exported model; with --leaf-bits 8 models with i8 leaves are exact
    #[arg(long, value_name = "COUNT")]
    different_leaves: Option<usize>,
    /// With --different-leaves: what a threshold that no tree had before has to save, as loss of a touch in nats [default: 2e-5]
    #[arg(long, value_name = "NATS", requires = "different_leaves")]
    threshold_cost: Option<f64>,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    noise: NoiseArguments,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads; the ensemble is the same for any number [default: all]
    #[arg(long)]
    threads: Option<usize>,
    /// The trainer: palpate, or xgboost (version 1.6.2, only with --leaves one), which needs the cargo feature of that name
    #[arg(long, value_parser = trainer, value_name = "palpate|xgboost", default_value = "palpate")]
    trainer: Engine,
    /// Print what was trained as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Preset {
    Compact,
    Paper,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Touches {
    Full,
    Contacts,
    All,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Leaves {
    Each,
    One,
}

#[derive(serde::Serialize)]
struct Trained {
    descriptor: &'static str,
    objects: usize,
    /// Touches of the data set.
    touches: usize,
    /// Those of them that are evidence to the ensemble.
    used: usize,
    counted: &'static str,
    trees: usize,
    splits: usize,
    leaves: usize,
    seconds: f64,
    /// What [`SWITCH`] would cost; null where the training had noise, or too few touches.
    cost_of_noise: Option<CostOfNoise>,
    /// What was learned from recorded touches.
    #[serde(skip_serializing_if = "Option::is_none")]
    taught: Option<Taught>,
}

/// The noise whose cost is given, in microseconds: what a good switch and a timer add.
const SWITCH: f64 = 1_000.0;

/// An ensemble, the touches that it was trained on, and what it was taught.
struct Made {
    ensemble: Ensemble,
    dataset: Dataset,
    taught: Option<Taught>,
    /// Whether it was trained here, on simulated touches without noise.
    is_clean: bool,
    settings: Settings,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let read = arguments.directory.iter().flat_map(|directory| super::files_of(directory));
    let read: Vec<PathBuf> = read.chain(arguments.teach.files()).collect();
    output::refuse_input(&arguments.output, &read)?;
    arguments.teach.page.iter().try_for_each(|page| output::refuse_input(page, &read))?;
    let start = Instant::now();
    let recorded = arguments.teach.read()?;
    let Made { ensemble, dataset, taught, is_clean, settings } = match (&arguments.directory, recorded) {
        (Some(directory), recorded) => simulated(&arguments, directory, recorded.as_ref())?,
        (None, recorded) => alone(&arguments, recorded.unwrap_or_default())?,
    };
    let seconds = start.elapsed().as_secs_f64();
    ensemble.save(&arguments.output)?;
    arguments.teach.write_page(taught.as_ref())?;
    let evidence = ensemble.trained_touches();
    let is_used = |touch: &&Touch| Refused::check(&evidence, touch).is_ok();
    let nodes: usize = ensemble.trees.iter().map(|tree| tree.nodes.len()).sum();
    let trees = ensemble.trees.len();
    // A binary tree has one leaf more than splits.
    let splits = (nodes - trees) / 2;
    let trained = Trained {
        descriptor: ensemble.descriptor().map_or("", Descriptor::name),
        objects: ensemble.known_count(),
        touches: dataset.len(),
        used: dataset.touches().filter(is_used).count(),
        counted: evidence.counted.name(),
        trees,
        splits,
        leaves: nodes - splits,
        seconds,
        taught,
        cost_of_noise: match is_clean {
            true => evaluate::cost_of_noise(&dataset, &settings, &Noise::gaussian(SWITCH))?,
            false => None,
        },
    };
    if arguments.json {
        return output::print_json_about(&arguments.output, &trained);
    }
    let text = format!(
        "{}: {} trees, {} splits on {} of {} of {} {} of {} objects ({}), trained in {:.1} s\n",
        arguments.output.display(),
        trained.trees,
        trained.splits,
        trained.descriptor,
        trained.used,
        trained.touches,
        if dataset.holds_approaches() { "approaches" } else { "touches" },
        dataset.objects.len(),
        match evidence.counted {
            Counted::Full => "full touches",
            Counted::Contacts => "those with a contact",
            Counted::All => "all of them",
        },
        trained.seconds
    );
    let text = text + &cost(&trained, is_clean) + &trained.taught.as_ref().map_or_else(String::new, super::teach::text);
    output::print_about(&arguments.output, &text)
}

/// Trains on simulated touches, or takes the ensemble that was, and teaches it the recorded ones, if there are any.
fn simulated(arguments: &Arguments, directory: &PathBuf, recorded: Option<&Dataset>) -> Result<Made> {
    let dataset = super::dataset(directory)?;
    let file = arguments.probe.read()?;
    let probe = arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let mut settings = Settings { probe, ..arguments.settings() };
    settings.noise = arguments.noise.over(arguments.probe.noise(file.as_ref(), &dataset, settings.noise)?);
    let background = arguments.background.as_deref().map(Dataset::read_any).transpose()?.map(super::checked);
    let in_directory = |error: Error| match error.exit_code() {
        1 => error.in_file(directory),
        _ => error,
    };
    let ensemble = match (&arguments.teach.extend, &background) {
        (Some(path), _) => Ensemble::load(path)?,
        (None, None) => train::train(&dataset, &settings, &Bar::new()).map_err(in_directory)?,
        (None, Some(background)) => {
            train::train_with_background(&dataset, background, &settings, &Bar::new()).map_err(in_directory)?
        }
    };
    let is_clean = recorded.is_none() && dataset.real().and(&settings.noise).is_none();
    let Some(recorded) = recorded else {
        return Ok(Made { ensemble, dataset, taught: None, is_clean, settings });
    };
    let mut known = dataset.clone();
    if let Some(background) = background {
        known.objects.push(ObjectTouches::joined(BACKGROUND, &background.objects));
    }
    // An ensemble that is there states what it was trained for.
    let noise = arguments.teach.extend.is_none().then_some(settings.noise);
    let how = teach::Settings { noise, ..teaching(&settings) };
    let (ensemble, taught) = teach::teach(&ensemble, &known, recorded, &how, &Bar::new())?;
    Ok(Made { ensemble, dataset, taught: Some(taught), is_clean, settings })
}

/// Trains on recorded touches alone.
fn alone(arguments: &Arguments, recorded: Dataset) -> Result<Made> {
    if arguments.noise.is_given() {
        return Err(Error::setting(
            "noise",
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
    let settings = Settings { probe, noise: Noise::default(), ..arguments.settings() };
    let (ensemble, taught) = teach::alone(&recorded, &settings, &teaching(&settings), &Bar::new())?;
    Ok(Made { ensemble, dataset: recorded, taught: Some(taught), is_clean: false, settings })
}

/// How objects are taught to an ensemble of such a training.
fn teaching(settings: &Settings) -> teach::Settings {
    let Settings { seed, threads, leaf_bits, .. } = *settings;
    teach::Settings { seed, threads, leaf_bits, ..teach::Settings::default() }
}

/// What noise would cost, as a line; nothing where the training had noise.
fn cost(trained: &Trained, is_clean: bool) -> String {
    let ms = SWITCH / 1e3;
    match trained.cost_of_noise {
        Some(CostOfNoise { touches, clean, noisy }) => format!(
            "{ms} ms of noise on contact times would cost about {:.0} points: {:.0} instead of {:.0} % correct after {touches} \
             touches. --noise {ms}ms trains for it.\n",
            100.0 * (clean - noisy),
            100.0 * noisy,
            100.0 * clean,
        ),
        None if is_clean => format!(
            "What {ms} ms of noise on contact times would cost was not measured: an object has fewer than {} touches.\n",
            evaluate::LEAST_FOR_COST
        ),
        None => String::new(),
    }
}

impl Arguments {
    /// All but the noise and the probe.
    fn settings(&self) -> Settings {
        let preset = match self.preset {
            Preset::Compact => Settings::compact(),
            Preset::Paper => Settings::paper(),
        };
        Settings {
            descriptor: self.descriptor.unwrap_or(preset.descriptor),
            counted: match self.touches {
                None => preset.counted,
                Some(Touches::Full) => Some(Counted::Full),
                Some(Touches::Contacts) => Some(Counted::Contacts),
                Some(Touches::All) => Some(Counted::All),
            },
            multi_output: self.leaves.map_or(preset.multi_output, |leaves| matches!(leaves, Leaves::Each)),
            rounds: self.rounds.unwrap_or(preset.rounds),
            depth: self.depth.unwrap_or(preset.depth),
            eta: self.eta.unwrap_or(preset.eta),
            min_child_weight: self.min_child_weight.unwrap_or(preset.min_child_weight),
            bins: if let [bins] = self.bins[..] { bins } else { preset.bins },
            feature_bins: (self.bins.len() > 1).then(|| self.bins.clone()),
            leaf_bits: self.leaf_bits.map_or(preset.leaf_bits, |bits| (bits > 0).then_some(bits)),
            small: self.different_leaves.map(|leaves| {
                let threshold_cost = self.threshold_cost.unwrap_or(Small::default().threshold_cost);
                Small { leaves, threshold_cost }
            }),
            noise: preset.noise,
            seed: self.seed,
            threads: self.threads,
            probe: None,
            trainer: self.trainer,
        }
    }
}

fn trainer(name: &str) -> Result<Engine, String> {
    match name {
        "palpate" => Ok(Engine::Palpate),
        "xgboost" => Ok(Engine::Xgboost),
        "hessboost" => Err("the trainer is called palpate now; its trees are the same".into()),
        _ => Err("use palpate or xgboost".into()),
    }
}

pub(super) fn descriptor(name: &str) -> Result<Descriptor, String> {
    let known = Descriptor::ALL.map(Descriptor::name).join(", ");
    Descriptor::from_name(name).ok_or_else(|| format!("use one of {known}"))
}
