//! `palpate probe`, and `palpate probe design`.

use super::numbers::error_rate;
use super::probe::UnitArguments;
use super::progress::Bar;
use palpate::Result;
use palpate::error::Error;
use palpate::mesh::Object;
use palpate::output;
use palpate::probe::approach::Aim;
use palpate::tune::probe::{Design, Settings, Trial, design};
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Find the probe that needs the fewest approaches to recognize your objects
    Design(DesignArguments),
    /// Find out what is crooked about your probe from touches that it made of objects whose meshes you have
    Fit(super::fit::FitArguments),
}

#[derive(clap::Args)]
#[command(after_help = "\
Tries probes in the simulator: spacing and radius of the fingers, tilt, and where approaches aim. For each, a model is trained and tested on other approaches; the best probe needs the fewest approaches at the error rate. Lengths are in units, a tenth of the object's longest side, or with --true-size in millimeters. DIR gets probe.toml, the best probe, and design.html, what another one would cost.

Figures compare probes and promise nothing: thresholds are set, and the best is chosen, on the very touches that are counted, so the best of many looks somewhat better than it is. A model of the chosen probe is calibrated with `palpate calibrate`.

Examples:
  palpate probe design meshes/ -o design
  palpate probe design builtin -o design --spacing 1..2 --radius 0.2
  palpate probe design meshes/ -o design --true-size --unit m --spacing 8..30 --radius 2
  palpate probe design meshes/ -o design --aim box --noise 5ms
  palpate probe design meshes/ -o design --error-rate 0.1% --approaches 20000")]
struct DesignArguments {
    /// What to touch: `builtin` or a built-in object's name, a mesh (OBJ, STL, PLY, glTF, GLB or COLLADA), or a directory that is searched for meshes
    #[arg(value_name = "MESHES", required = true)]
    sources: Vec<String>,
    /// Directory for probe.toml and design.html, such as design; created if it is missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Distances between neighboring fingers to search, in units or millimeters, such as 0.5..3, or one number [default: 0.5 to 3 units; at true size a unit of the median object]
    #[arg(long, value_name = "A..B", value_parser = range)]
    spacing: Option<RangeInclusive<f64>>,
    /// Radii of the fingers to search, in units or millimeters, such as 0.1..0.3, or one number [default: 0.1 to 0.3 units]
    #[arg(long, value_name = "A..B", value_parser = range)]
    radius: Option<RangeInclusive<f64>>,
    /// Largest tilts of the row of fingers to search, in degrees, such as 0..20, or one number
    #[arg(long, value_name = "A..B", value_parser = range, default_value = "0..20")]
    tilt: RangeInclusive<f64>,
    /// Where approaches may aim: anywhere in the bounding box, in its middle, or near the center of mass, such as box,middle
    #[arg(long, value_name = "AIM[,AIM…]", value_delimiter = ',', value_parser = super::capture::aim, default_value = "box,middle,mass")]
    aim: Vec<Aim>,
    /// The probe's speed, in units or millimeters per second, such as 5 [default: 10 units]
    #[arg(long, value_name = "UNITS")]
    speed: Option<f64>,
    /// Standard deviation of the noise on contact times, such as 1ms for a switch polled every few ms; 0ms for none
    #[arg(long, value_name = "DURATION", value_parser = super::noise::duration, default_value = "1ms")]
    noise: f64,
    /// The share of wrong verdicts to reach, such as 0.01 or 1%
    #[arg(long, value_name = "RATE", value_parser = error_rate, default_value = "0.01")]
    error_rate: f64,
    /// Which features a touch is turned into, such as oriented for a robot that knows the object's orientation
    #[arg(long, value_name = "NAME", value_parser = super::train::descriptor, default_value = "curvature")]
    descriptor: Descriptor,
    /// Which approaches are evidence, such as full for those that all three fingers touch: full, contacts or all
    #[arg(long, value_name = "full|contacts|all", value_parser = counted, default_value = "contacts")]
    touches: Counted,
    /// Approaches per object that a model is trained on in the last round, and tested on others, such as 20000
    #[arg(long, value_name = "N", value_parser = super::numbers::count, default_value = "8000")]
    approaches: u64,
    /// Sequences of approaches to draw for each object, such as 1000
    #[arg(long, value_name = "N", default_value_t = Settings::default().sequences)]
    sequences: usize,
    /// Seed of all that is random, such as 2
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print all probes tried, and the best, as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    units: UnitArguments,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    match arguments.command {
        Command::Design(arguments) => run_design(&arguments),
        Command::Fit(arguments) => super::fit::run(&arguments),
    }
}

fn run_design(arguments: &DesignArguments) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let objects = arguments.units.objects(&arguments.sources, arguments.seed)?;
    let settings = arguments.settings(&objects)?;
    let found = design(&objects, &settings, &Bar::new())?;
    let files = [arguments.output.join("probe.toml"), arguments.output.join("design.html")];
    output::write_bytes(&files[0], found.toml().as_bytes())?;
    palpate_report::design::page(&found, &arguments.words(&settings))?.write(&files[1])?;
    if arguments.json {
        return output::print_json(&found);
    }
    let mut text = table(&found);
    for file in files {
        // Writing to a string cannot fail.
        _ = writeln!(text, "Wrote {}", file.display());
    }
    output::print(&text)
}

impl DesignArguments {
    fn settings(&self, objects: &[Object]) -> Result<Settings> {
        let unknown = || Error::setting("true-size", "given", "meshes of a known unit, such as with --unit mm");
        let usual = match self.units.is_true_size() {
            true => Settings::at_true_size(objects).ok_or_else(unknown)?,
            false => Settings::default(),
        };
        Ok(Settings {
            spacing: self.spacing.clone().unwrap_or_else(|| usual.spacing.clone()),
            radius: self.radius.clone().unwrap_or_else(|| usual.radius.clone()),
            tilt: self.tilt.clone(),
            aims: self.aim.clone(),
            speed: self.speed.unwrap_or(usual.speed),
            noise: self.noise,
            descriptor: self.descriptor,
            counted: self.touches,
            error_rate: self.error_rate,
            approaches: self.approaches,
            sequences: self.sequences,
            seed: self.seed,
            ..usual
        })
    }

    /// The command that remakes the page, with every option that changes it.
    fn words(&self, settings: &Settings) -> String {
        let range = |range: &RangeInclusive<f64>| format!("{}..{}", range.start(), range.end());
        let aims: Vec<&str> = self.aim.iter().map(|aim| aim.name()).collect();
        format!(
            "palpate probe design {} -o {} --spacing {} --radius {} --tilt {} --aim {} --speed {} --noise {}us \
             --error-rate {} --descriptor {} --touches {} --approaches {} --sequences {} --seed {}{}",
            self.sources.join(" "),
            self.output.display(),
            range(&settings.spacing),
            range(&settings.radius),
            range(&self.tilt),
            aims.join(","),
            settings.speed,
            self.noise,
            self.error_rate,
            self.descriptor.name(),
            self.touches.name(),
            self.approaches,
            self.sequences,
            self.seed,
            self.units.words().iter().map(|word| format!(" {word}")).collect::<String>(),
        )
    }
}

/// Everything that was tried, round by round, and the best.
fn table(design: &Design) -> String {
    let mut text = String::new();
    let rounds = design.rounds.iter().zip(["Coarse grid", "The best of it and what lies between"]);
    let best = &design.best;
    for (round, title) in rounds {
        head(&mut text, title, round);
        round.iter().for_each(|trial| line(&mut text, "", trial));
    }
    head(&mut text, "Every spacing at the best radius, tilt and aim", &design.by_spacing);
    for trial in &design.by_spacing {
        line(&mut text, if trial == best { "*" } else { "" }, trial);
    }
    head(&mut text, palpate_report::design::published(design), std::slice::from_ref(&design.published));
    line(&mut text, "", &design.published);
    _ = write!(
        text,
        "\n* the best: {}. Approaches are to {} % wrong verdicts; > where more were wrong or missing.\n\
         Assumed: {} {} per second, Gaussian noise of {} ms on contact times; evidence: {}, {}.\n",
        palpate_report::design::described(best).to_lowercase(),
        100.0 * design.error_rate,
        best.probe.speed,
        palpate_report::design::unit(design),
        design.noise / 1e3,
        design.counted,
        design.descriptor,
    );
    text
}

fn head(text: &mut String, title: &str, round: &[Trial]) {
    let approaches = round.first().map_or(0, |trial| trial.trained_on);
    _ = writeln!(text, "\n{title}, {approaches} approaches per object to train on");
    _ = writeln!(
        text,
        "  {:>7} {:>6} {:>5} {:>6} {:>10} {:>6} {:>6}  {:>5} {:>5} {:>6} {:>9} {:>7} {:>5}",
        "spacing",
        "radius",
        "tilt",
        "aim",
        "approaches",
        "±",
        "errors",
        "none",
        "outer",
        "middle",
        "outer+mid",
        "2 outer",
        "all"
    );
}

fn line(text: &mut String, mark: &str, trial: &Trial) {
    let share = |name| 100.0 * trial.patterns.get(name).copied().unwrap_or_default();
    let probe = trial.probe;
    _ = writeln!(
        text,
        "{mark:1} {:>7} {:>6} {:>5} {:>6} {:>10} {:>6.1} {:>5.1}%  {:>4.0}% {:>4.0}% {:>5.0}% {:>8.0}% {:>6.0}% {:>4.0}%",
        probe.spacing,
        probe.radius,
        probe.tilt,
        trial.aim.name(),
        format!("{}{:.1}", if trial.reached { "" } else { ">" }, trial.approaches),
        trial.approaches_standard_error,
        100.0 * trial.error,
        share("none"),
        share("outer"),
        share("middle"),
        share("outer and middle"),
        share("both outer"),
        share("all"),
    );
}

/// A range such as `0.5..3`, or one number for a range of nothing else.
fn range(text: &str) -> Result<RangeInclusive<f64>, String> {
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    match (number(low), number(high)) {
        (Some(low), Some(high)) if low <= high => Ok(low..=high),
        (Some(_), Some(_)) => Err("write the smaller number first, as in 0.5..3".into()),
        _ => Err("give a number, or two as in 0.5..3".into()),
    }
}

fn counted(name: &str) -> Result<Counted, String> {
    let found = Counted::ALL.iter().copied().find(|counted| counted.name() == name);
    found.ok_or_else(|| "use one of full, contacts, all".to_owned())
}
