use super::progress::Bar;
use palpate::Result;
use palpate::capture::{self, Settings, Shard, Summary};
use palpate::mesh::facts::Facts;
use palpate::mesh::source;
use palpate::output;
use palpate::probe::approach::Probe;
use palpate::touches::Format;
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
The touches go to DIR/<object>.txt: a line a touch, three contact times in seconds after the first contact, `-` for a
finger that never touched. DIR/dataset.json says how they were made.

Examples:
  palpate capture builtin -o data                 21,000 touches per object
  palpate capture cup.obj bowls/ builtin -o data  your own meshes beside them
  palpate capture meshes/ -o data --pose          with the probe's direction
  palpate capture meshes/ -o data --approaches    every approach, also misses
  palpate capture meshes/ -o part2 --shard 2/8    the second of eight parts
  palpate capture meshes/ -o data --resume        continue an interrupted one")]
pub(crate) struct Arguments {
    /// What to touch: `builtin` or a built-in object's name, an OBJ file, or a directory that is searched for OBJ files
    #[arg(value_name = "SOURCE", required = true)]
    sources: Vec<String>,
    /// The directory for the touches
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// How many touches of each object (with --approaches: how many approaches)
    #[arg(long, value_name = "N", default_value_t = Settings::default().touches)]
    touches: u64,
    /// The seed of all that is random
    #[arg(long, value_name = "N", default_value_t = Settings::default().seed)]
    seed: u64,
    /// The longest side of each object's bounding box, in units
    #[arg(long, value_name = "UNITS", default_value_t = Settings::default().length)]
    length: f64,
    /// The fingers' radius, in units
    #[arg(long, value_name = "UNITS", default_value_t = Probe::default().radius)]
    radius: f64,
    /// The distance between neighboring fingers, in units
    #[arg(long, value_name = "UNITS", default_value_t = Probe::default().spacing)]
    spacing: f64,
    /// How fast the probe moves, in units a second
    #[arg(long, value_name = "UNITS", default_value_t = Probe::default().speed)]
    speed: f64,
    /// How far the row of fingers may be tilted to either side, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = Probe::default().tilt)]
    tilt: f64,
    /// Append the probe's direction and alignment to each line (six numbers)
    #[arg(long)]
    pose: bool,
    /// Keep every approach, also those that not all fingers touch
    #[arg(long)]
    approaches: bool,
    /// How to keep the touches: text, or parquet (columns t1, t2, t3, direction, alignment, object)
    #[arg(long, value_enum, default_value = "text")]
    format: TouchFormat,
    /// Capture only the K-th of N parts; the parts, one after the other, are the whole
    #[arg(long, value_name = "K/N", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// Go on with an interrupted capture
    #[arg(long)]
    resume: bool,
    /// How many threads to use [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum TouchFormat {
    Text,
    Parquet,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { radius, spacing, speed, tilt, .. } = arguments;
    let settings = Settings {
        touches: arguments.touches,
        seed: arguments.seed,
        length: arguments.length,
        probe: Probe { radius, spacing, speed, tilt },
        pose: arguments.pose,
        approaches: arguments.approaches,
        format: match arguments.format {
            TouchFormat::Text => Format::Text,
            TouchFormat::Parquet => Format::Parquet,
        },
        shard: arguments.shard,
        resume: arguments.resume,
        threads: arguments.threads,
    };
    settings.check()?;
    let objects = source::objects(&arguments.sources)?;
    for (object, complaint) in objects.iter().filter_map(|object| Some((object, Facts::of(&object.mesh).complaint()?)))
    {
        eprintln!("{}: {complaint}", object.name);
    }
    let summary = capture::capture(&objects, &settings, &arguments.output, &Bar::new())?;
    if arguments.json { output::print_json(&summary) } else { output::print(&table(&summary)) }
}

fn table(summary: &Summary) -> String {
    let width = summary.objects.iter().map(|object| object.name.len()).max().unwrap_or(0).max(6);
    let mut text = format!(
        "{:width$}  {:>10}  {:>12}  {:>7}  {:>14}\n",
        "object", "touches", "approaches", "share", "approaches/s"
    );
    let mut row = |name: &str, touches: u64, approaches: u64, now: u64, seconds: f64| {
        let share = 100.0 * touches as f64 / approaches.max(1) as f64;
        let rate = now as f64 / seconds;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:width$}  {touches:>10}  {approaches:>12}  {share:>6.1}%  {rate:>14.0}");
    };
    for object in &summary.objects {
        row(&object.name, object.touches, object.approaches, object.approaches_now, object.seconds);
    }
    let now = summary.objects.iter().map(|object| object.approaches_now).sum();
    row("all", summary.touches(), summary.approaches(), now, summary.seconds);
    text
}
