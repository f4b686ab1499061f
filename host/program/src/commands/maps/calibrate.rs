//! `palpate maps calibrate`.

use crate::commands::calibrate::PromiseArguments;
use crate::commands::progress::Bar;
use crate::commands::table::{Table, TableArguments, how};
use crate::commands::{Global, dataset, files_of, thresholds};
use clap::ArgGroup;
use palpate::Result;
use palpate::calibrate;
use palpate::ensemble::StatedProbe;
use palpate::locate::{self, Aimed, Calibrated, LeftOut, Terms, ToPlace};
use palpate::output;
use palpate::wording::{count, decimal, percent};
use palpate_shared::format::Per;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(
    group(
        ArgGroup::new("simulated")
            .args(["sources", "sequences", "aimed", "until", "detect_unknown", "workspace", "true_size", "instances", "skip_bad", "real"])
            .multiple(true)
            .conflicts_with("recorded")
    ),
    after_help = "\
The promise holds for approaches to the meshes on a simulated table, with the noise of the model and of --real; with --recorded for approaches like the recorded ones. Names are promised, on average; a sequence without a name is neither right nor wrong. docs/guide/locate.md has more.

Examples:
  palpate maps calibrate maps.palpate meshes/ -o sure.palpate
  palpate maps calibrate maps.palpate --recorded stays/ -o sure.palpate")]
pub(super) struct Arguments {
    /// Model of maps
    model: PathBuf,
    /// Meshes of the objects, and files of touches with a position: approaches to them on a table are simulated
    #[arg(value_name = "SOURCE", required_unless_present = "recorded")]
    sources: Vec<String>,
    /// Recorded touches of the objects; thresholds are tested on them. Each recording is of an object that stood still
    #[arg(long, value_name = "DIR")]
    recorded: Option<PathBuf>,
    /// Output; the calibrated model
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    promise: PromiseArguments,
    /// Make a test for objects that the model does not know; names then take eight approaches or more
    #[arg(long)]
    detect_unknown: bool,
    #[command(flatten)]
    table: TableArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { model, sources, recorded, output: to, promise, table, .. } = &arguments;
    output::admit(to, recorded.as_deref().map(files_of).into_iter().flatten().chain([model.clone()]))?;
    let promise = calibrate::Terms { rate: promise.error_rate, confidence: promise.confidence, per: Per::Average };
    let Table { file, standing, probe, terms } = table.table(model, sources, promise, global.seed(), "calibrate")?;
    let maps = file.maps();
    let calibrated = if let Some(directory) = recorded {
        let recorded = dataset(directory)?;
        StatedProbe::compare_with(["the maps", "the recordings"], maps.probe(), u32::MAX, &recorded)?;
        locate::calibrate_recorded(maps, &recorded, &probe, &terms, &Bar::new())
            .map_err(|error| error.in_file(directory))?
    } else {
        // The sequences of an evaluation with the same seed are others.
        let (seed, aimed) = (terms.seed.wrapping_mul(2), table.aimed.unwrap_or(Aimed::Chosen));
        let terms = Terms { seed, aimed, unknown: arguments.detect_unknown, ..terms };
        locate::calibrate(maps, &standing, &probe, &terms, &Bar::new()).map_err(|error| error.in_file(model))?
    };
    output::write_bytes(to, &calibrated.model)?;
    global.print_about(to, &calibrated, || calibrated_text(to, &calibrated, maps.stopping().odds()))
}

fn calibrated_text(path: &Path, calibrated: &Calibrated, before: u64) -> String {
    let Calibrated { promised, confidence, aimed, sequences, given, wrong, .. } = *calibrated;
    let margins = [("all".to_owned(), calibrated.margin)].into_iter().collect();
    let terms = match calibrated.recordings {
        None => format!("{}, for {}", how(aimed), calibrated.noise),
        Some(recordings) => {
            format!("approaches like those of {recordings} recordings, in any order and in new recordings")
        }
    };
    let note = "note: sequences of one recording share its pose, so each recording counts once.\n";
    thresholds::promised(promised, Per::Average, "", confidence)
        + &format!(
            "It holds for {terms}, and for at most {} of them.\n\
             {} sequences: {} names given, {wrong} wrong, {} without a name; {} approaches each.\n",
            calibrated.max_touches,
            count(sequences),
            count(given),
            percent(1.0 - given as f64 / sequences.max(1) as f64, 2),
            decimal(calibrated.mean_approaches, 1),
        )
        + &calibrated.until.map_or_else(String::new, |ToPlace { right, placed, mean_approaches }| {
            let approaches = decimal(mean_approaches, 1);
            format!("Until the place is sure: {approaches} approaches each; {placed} of {right} objects named rightly had a sure place.\n")
        })
        + &calibrated.strangers.map_or_else(String::new, |LeftOut { sequences, unknown, named }| {
            format!(
                "Test for unknown objects, with each object left out in turn: {unknown} of {sequences} sequences ended as unknown, \
                 {named} with a name.\n"
            )
        })
        + calibrated.recordings.map_or("", |_| note)
        + &thresholds::text(&margins, &Default::default(), calibrate::margin_of(before))
        + &format!("{}: {} bytes\n", path.display(), count(calibrated.model.len()))
}
