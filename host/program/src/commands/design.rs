//! `palpate probe`, and `palpate probe design`.

use super::Global;
use super::numbers::error_rate;
use super::probe::UnitArguments;
use super::progress::Bar;
use super::real::RealArguments;
use palpate::Result;
use palpate::error::Error;
use palpate::mesh::Object;
use palpate::output;
use palpate::probe::approach::Aim;
use palpate::probe::noise::Noise;
use palpate::tune::probe::{Design, Settings, Trial, design};
use palpate::with;
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Find the probe that needs the fewest approaches to your objects
    Design(Box<DesignArguments>),
    /// Measure how your probe differs from the ideal, from its touches
    Fit(Box<super::fit::FitArguments>),
}

#[derive(clap::Args)]
#[command(after_help = "\
Tries probes in the simulator. For each, a model is trained and tested on other approaches; the best probe needs the fewest approaches at the error rate. DIR gets probe.toml, the best probe, and design.html, which says what another one would cost. Lengths are in units, a tenth of the object's longest side, or with --true-size in millimeters. Figures compare probes and promise nothing.

Keys of --search: spacing, radius, tilt and stroke, each a range such as 1..2 or one number; aim, such as box+middle+mass; speed, one number.

Examples:
  palpate probe design meshes/ -o design
  palpate probe design builtin -o design --search spacing=1..2,radius=0.2
  palpate probe design meshes/ -o design --true-size m --search spacing=8..30
  palpate probe design meshes/ -o design --search aim=box --real noise=5ms
  palpate probe design meshes/ -o design --error-rate 0.1% --approaches 20000")]
struct DesignArguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), scans (PLY, PCD, XYZ), directories of them
    #[arg(value_name = "SOURCE", required = true)]
    sources: Vec<String>,
    /// Output; a directory for probe.toml and design.html
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Trials instead of the usual: distances, radii and tilts of fingers, where approaches aim, the speed
    #[arg(long, value_name = "SETTINGS", default_value = "", hide_default_value = true)]
    search: Search,
    /// The share of wrong names to accept, such as 1%; approaches are counted up to it
    #[arg(long, value_name = "RATE", value_parser = error_rate, default_value = "0.01")]
    error_rate: f64,
    /// Features of a touch: times, curvature, gravity or oriented
    #[arg(long, value_name = "NAME", value_parser = super::train::descriptor, default_value = "curvature")]
    descriptor: Descriptor,
    /// Approaches that are evidence: full, contacts (at least one) or all
    #[arg(long, value_name = "WHICH", value_parser = super::train::evidence, default_value = "contacts")]
    evidence: Counted,
    /// Approaches to each object; to train on in the last round, and others to test on
    #[arg(long, value_name = "N", value_parser = super::numbers::count, default_value = "8000")]
    approaches: u64,
    /// Sequences of touches to draw; of each object
    #[arg(long, value_name = "N", value_parser = super::numbers::sequences, default_value_t = Settings::default().sequences)]
    sequences: usize,
    #[command(flatten)]
    units: UnitArguments,
    #[command(flatten)]
    real: RealArguments,
}

/// Probes to try.
#[derive(Clone, Debug, Default)]
struct Search {
    spacing: Option<RangeInclusive<f64>>,
    radius: Option<RangeInclusive<f64>>,
    tilt: Option<RangeInclusive<f64>>,
    stroke: Option<RangeInclusive<f64>>,
    aims: Option<Vec<Aim>>,
    speed: Option<f64>,
}

/// Keys of the option.
pub(super) const KEYS: [&str; 6] = ["spacing", "radius", "tilt", "stroke", "aim", "speed"];

impl FromStr for Search {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut search = Self::default();
        if text.is_empty() {
            return Ok(search);
        }
        for (key, value) in super::keys::pairs(text, &KEYS, "a setting of the search", "spacing=1..2,radius=0.2")? {
            let said = |wanted: String| format!("{key} is {value:?}; {wanted}");
            match key {
                "spacing" => search.spacing = Some(range(value).map_err(said)?),
                "radius" => search.radius = Some(range(value).map_err(said)?),
                "tilt" => search.tilt = Some(range(value).map_err(said)?),
                "stroke" => search.stroke = Some(range(value).map_err(said)?),
                "aim" => {
                    let aims = value.split('+').map(|aim| super::capture::aim(aim.trim())).collect::<Result<_, _>>();
                    search.aims = Some(aims.map_err(said)?);
                }
                _ => {
                    let speed = value.parse::<f64>().ok().filter(|speed| speed.is_finite());
                    search.speed = Some(speed.ok_or_else(|| said("give a number".into()))?);
                }
            }
        }
        Ok(search)
    }
}

/// Tilts that are tried without a range, in degrees.
const TILT: RangeInclusive<f64> = 0.0..=20.0;

/// The standard deviation of the noise without another, in microseconds: that of a switch polled every few milliseconds.
const NOISE: f64 = 1_000.0;

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    match arguments.command {
        Command::Design(arguments) => run_design(&arguments, global),
        Command::Fit(arguments) => super::fit::run(&arguments, global),
    }
}

fn run_design(arguments: &DesignArguments, global: &Global) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let files = [arguments.output.join("probe.toml"), arguments.output.join("design.html")];
    files.iter().try_for_each(|file| output::refuse_foreign(file))?;
    let objects = arguments.units.objects(&arguments.sources, global.seed())?;
    let settings = arguments.settings(&objects, global.seed())?;
    let found = design(&objects, &settings, &Bar::new())?;
    output::write_bytes(&files[0], found.toml().as_bytes())?;
    palpate_report::design::page(&found, &arguments.words(&settings))?.write(&files[1])?;
    if global.json {
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
    /// The standard deviation of the noise on contact times, which is all that a design can disturb.
    fn noise(&self) -> Result<f64> {
        let real = self.real.over(Noise::gaussian(NOISE))?;
        match real == Noise::gaussian(real.deviation.largest) {
            true => Ok(real.deviation.largest),
            false => Err(Error::setting("real", real, "one level of noise on contact times, such as noise=5ms")),
        }
    }

    fn settings(&self, objects: &[Object], seed: u64) -> Result<Settings> {
        let unknown = || Error::setting("true-size", "stated", "a unit such as mm for meshes that state none");
        let usual = match self.units.is_true_size() {
            true => Settings::at_true_size(objects).ok_or_else(unknown)?,
            false => Settings::default(),
        };
        let Search { spacing, radius, tilt, stroke, aims, speed } = self.search.clone();
        Ok(with!(
            usual.clone(),
            spacing = spacing.unwrap_or_else(|| usual.spacing.clone()),
            radius = radius.unwrap_or_else(|| usual.radius.clone()),
            tilt = tilt.unwrap_or(TILT),
            stroke,
            aims = aims.unwrap_or_else(|| Aim::ALL.into()),
            speed = speed.unwrap_or(usual.speed),
            noise = self.noise()?,
            descriptor = self.descriptor,
            counted = self.evidence,
            error_rate = self.error_rate,
            approaches = self.approaches,
            sequences = self.sequences,
            seed
        ))
    }

    /// The command that remakes the page, with every option that changes it.
    fn words(&self, settings: &Settings) -> String {
        let range = |range: &RangeInclusive<f64>| format!("{}..{}", range.start(), range.end());
        let aims: Vec<&str> = settings.aims.iter().map(|aim| aim.name()).collect();
        format!(
            "palpate probe design {} -o {} --search spacing={},radius={},tilt={}{},aim={},speed={} --real noise={}us \
             --error-rate {} --descriptor {} --evidence {} --approaches {} --sequences {} --seed {}{}",
            self.sources.join(" "),
            self.output.display(),
            range(&settings.spacing),
            range(&settings.radius),
            range(&settings.tilt),
            settings.stroke.as_ref().map_or_else(String::new, |stroke| format!(",stroke={}", range(stroke))),
            aims.join("+"),
            settings.speed,
            settings.noise,
            self.error_rate,
            self.descriptor.name(),
            self.evidence.name(),
            self.approaches,
            self.sequences,
            settings.seed,
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
    _ = writeln!(text, "\nThe best probe with other strokes, {} approaches per object to train on", best.trained_on);
    _ = writeln!(text, "  {:>12} {:>10} {:>6} {:>6}", "stroke", "approaches", "±", "errors");
    for trial in &design.by_stroke {
        let stroke = trial.probe.stroke.map_or("past it".into(), |stroke| stroke.to_string());
        let approaches = format!("{}{:.1}", if trial.reached { "" } else { ">" }, trial.approaches);
        let (error, mark) = (100.0 * trial.error, if trial == best { "*" } else { "" });
        _ = writeln!(
            text,
            "{mark:1} {stroke:>12} {approaches:>10} {:>6.1} {error:>5.1}%",
            trial.approaches_standard_error
        );
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
