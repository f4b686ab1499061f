use super::Global;
use super::chips::{core, features};
use super::numbers::{error_rate, sequences};
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use palpate::Result;
use palpate::compile::{self, Core};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::tune::{self, Row, Settings, Tuned};
use palpate::with;
use palpate_shared::Descriptor;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Find the best model that fits a chip.
#[derive(clap::Args)]
#[command(after_help = "\
Trains a family of ensembles, compiles each in several ways, and keeps the model that needs the fewest touches within the limits. It is chosen on touches held out from training, calibrated to the error rate on others, and measured on others again. For small limits it also trains ensembles of few thresholds, whose trees share their leaves; more touches make these more accurate: capture with --touches 210000.

Examples:
  palpate tune data --max-bytes 16K -o model.palpate
  palpate tune data --max-bytes 16K --max-instructions 600 -o fast.palpate
  palpate tune data --max-instructions 2000 --chip m0+ -o m0.palpate
  palpate tune data --real noise=0..10ms,timer=1ms -o robust.palpate
  palpate tune data --json")]
pub(crate) struct Arguments {
    /// Touches: a directory that `palpate capture` filled
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Output; the best model that fits
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// File for its ensemble
    #[arg(long, value_name = "FILE")]
    ensemble: Option<PathBuf>,
    /// The most bytes of the model, such as 16K
    #[arg(long, value_parser = bytes, value_name = "BYTES")]
    max_bytes: Option<usize>,
    /// The most instructions per touch
    #[arg(long, value_name = "N")]
    max_instructions: Option<u64>,
    /// The processor, m0+ or m4f; instructions are counted for it
    #[arg(long, value_parser = core, default_value = "m4f", value_name = "NAME")]
    chip: Core,
    /// Features of a touch: times, curvature, gravity or oriented
    #[arg(long, value_parser = super::train::descriptor, default_value = "curvature", value_name = "NAME")]
    descriptor: Descriptor,
    /// The share of wrong names to accept, such as 1%; the model promises it
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = error_rate)]
    error_rate: f64,
    /// Sequences of touches to draw; of each object, and as many groups
    #[arg(long, value_name = "N", default_value = "1000", value_parser = sequences)]
    sequences: usize,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    for path in [&arguments.output, &arguments.ensemble].into_iter().flatten() {
        output::admit(path, super::files_of(&arguments.directory))?;
    }
    let dataset = super::dataset(&arguments.directory)?;
    super::refuse_located(&dataset, &arguments.directory)?;
    let file = arguments.probe.read()?;
    let tuned = tune::tune(
        &dataset,
        &with!(
            Settings::default(),
            descriptor = arguments.descriptor,
            max_bytes = arguments.max_bytes,
            max_instructions = arguments.max_instructions,
            core = arguments.chip,
            probe = arguments.probe.of_dataset(file.as_ref(), &dataset)?,
            noise = arguments.real.over(arguments.probe.noise(file.as_ref(), &dataset, Noise::default())?)?,
            error_rate = arguments.error_rate,
            groups = arguments.sequences,
            seed = global.seed()
        ),
        &Bar::new(),
    )?;
    if let Some(path) = &arguments.ensemble {
        tuned.ensemble.save(path)?;
    }
    if let Some(path) = &arguments.output {
        output::write_bytes(path, &tuned.model)?;
    }
    let written = arguments.output.clone().unwrap_or_default();
    if global.json {
        return output::print_json_about(&written, &tuned);
    }
    let mut text = table(&tuned);
    text += &features(&compile::open(&tuned.model)?);
    for (what, path) in [("model", &arguments.output), ("ensemble", &arguments.ensemble)] {
        if let Some(path) = path {
            // Writing to a string cannot fail.
            _ = writeln!(text, "Wrote the {what}: {}", path.display());
        }
    }
    if arguments.output.is_none() {
        text += "The model was not written: name a file with -o.\n";
    }
    output::print_about(&written, &text)
}

/// The frontier, the choice marked, and what it achieves on touches of its own.
fn table(tuned: &Tuned) -> String {
    let mut text = format!(
        "  {:>6} {:>6} {:>4} {:>9} {:>4} {:>6} {:>8} {:>7} {:>7} {:>7} {:>8} {:>8} {:>7} {:>7}\n",
        "trees",
        "depth",
        "eta",
        "bins",
        "leaf",
        "shared",
        "layout",
        "bytes",
        "M4F",
        "M0+",
        "at 10",
        "at 30",
        "touches",
        "wrong"
    );
    let mut line = |mark: &str, row: &Row| {
        let accuracy = |at| row.accuracy.get(&at).map_or("–".into(), |share| format!("{:.1} %", 100.0 * share));
        let number = |number: Option<u64>| number.map_or("–".into(), |number| number.to_string());
        let bins: Vec<String> = row.recipe.bins.iter().map(ToString::to_string).collect();
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "{mark:1} {:>6} {:>6} {:>4} {:>9} {:>4} {:>6} {:>8} {:>7} {:>7} {:>7} {:>8} {:>8} {:>7.1} {:>5.2} %",
            row.recipe.trees,
            row.recipe.depth,
            row.recipe.eta,
            bins.join("×"),
            row.leaf.unwrap_or("full"),
            number(row.recipe.different_leaves.map(|leaves| leaves as u64)),
            row.layout.unwrap_or("–"),
            number(row.bytes.map(|bytes| bytes as u64)),
            number(row.instructions),
            number(row.instructions_m0_plus),
            accuracy(10),
            accuracy(30),
            row.mean_touches,
            100.0 * row.error,
        );
    };
    for (index, row) in tuned.rows.iter().enumerate() {
        if index == tuned.chosen || row.frontier {
            line(if index == tuned.chosen { "*" } else { "" }, row);
        }
    }
    line("", &tuned.unlimited);
    let accuracy: Vec<String> =
        tuned.test.accuracy.iter().map(|(at, share)| format!("{:.1} % at {at}", 100.0 * share)).collect();
    _ = write!(
        text,
        "\n* the best that fits; on touches that did not choose it: {}; stops after {:.1} touches, {:.2} % wrong.\n{}\n\
         Shared: how many different leaves all trees have, for models with a table of leaves. M4F and M0+: instructions per \
         touch, estimated, right to 15 %. The last line is the full model without limits.\n",
        accuracy.join(", "),
        tuned.test.sequential.mean_touches,
        100.0 * tuned.test.sequential.error,
        match (&tuned.calibration, &tuned.uncalibrated) {
            (Some(calibrated), _) => format!(
                "It promises at most {} % wrong, {} % sure, from {} sequences.",
                super::percent(calibrated.promised),
                super::percent(calibrated.confidence),
                calibrated.sequences
            ),
            (None, why) => format!("It promises nothing: {}.", why.as_deref().unwrap_or("it was not calibrated")),
        },
    );
    text
}

/// A number of bytes: `16384`, `16K`, `6.5K`, `1M`; K is 1024.
fn bytes(text: &str) -> Result<usize, String> {
    let number = text.trim_end_matches(['B', 'b']).trim_end_matches('i');
    let (number, unit) = match number.trim_end_matches(['K', 'k']) {
        shorter if shorter.len() < number.len() => (shorter, 1024.0),
        _ => match number.trim_end_matches('M') {
            shorter if shorter.len() < number.len() => (shorter, 1024.0 * 1024.0),
            same => (same, 1.0),
        },
    };
    match number.trim().parse::<f64>() {
        // Saturates for absurd sizes.
        Ok(number) if number > 0.0 && number.is_finite() => Ok((number * unit).floor() as usize),
        _ => Err("give a number of bytes, such as 16384 or 16K".into()),
    }
}
