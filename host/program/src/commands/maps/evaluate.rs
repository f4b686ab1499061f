//! `palpate maps evaluate`.

use crate::commands::Global;
use crate::commands::progress::Bar;
use crate::commands::table::{Table, TableArguments, how};
use palpate::Result;
use palpate::calibrate;
use palpate::evaluate::Finding;
use palpate::locate::{self, Aimed, Evaluation, Terms};
use palpate::output;
use palpate::wording::{count, decimal, percent, rate};
use palpate_shared::format::Per;
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Approaches to the meshes are simulated as in `palpate maps calibrate`, on other sequences of the same seed. A calibrated model shows whether it keeps its promise.

Examples:
  palpate maps evaluate sure.palpate meshes/
  palpate maps evaluate sure.palpate meshes/ --aimed random --real noise=5ms")]
pub(super) struct Arguments {
    /// Model of maps
    model: PathBuf,
    /// Meshes of the objects, and files of touches with a position: approaches to them on a table are simulated
    #[arg(value_name = "SOURCE", required = true)]
    sources: Vec<String>,
    #[command(flatten)]
    table: TableArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { model, sources, table } = &arguments;
    // An evaluation promises nothing.
    let promise = calibrate::Terms { rate: 0.01, confidence: 0.95, per: Per::Average };
    let Table { file, standing, probe, terms } = table.table(model, sources, promise, global.seed(), "evaluate")?;
    let terms = Terms { seed: terms.seed.wrapping_mul(2).wrapping_add(1), ..terms };
    let evaluated =
        locate::evaluate(file.maps(), &standing, &probe, &terms, &Bar::new()).map_err(|error| error.in_file(model))?;
    let noise = terms.real.noise(probe.speed).to_string();
    let is_here = |name: &String| standing.iter().any(|object| object.name == *name);
    let names = locate::names(&file.maps());
    let are_others = names.len() != standing.len() || !names.iter().all(is_here);
    match global.json {
        true => output::print_json(&Evaluated { aimed: terms.aimed, noise, evaluation: &evaluated }),
        false => output::print(&evaluated_text(&evaluated, &terms, &noise, are_others)),
    }
}

#[derive(serde::Serialize)]
struct Evaluated<'e> {
    aimed: Aimed,
    noise: String,
    #[serde(flatten)]
    evaluation: &'e Evaluation,
}

fn evaluated_text(evaluated: &Evaluation, terms: &Terms, noise: &str, are_others: bool) -> String {
    let Evaluation { sequences, given, wrong, undecided, unknown, off: [half, most], .. } = *evaluated;
    let mut text = format!(
        "{} sequences of {}, for {noise}\n\
         {} names given, {} of them wrong ({wrong}); {undecided} sequences undecided, {unknown} unknown; {} approaches each\n\
         places of right names: half within {} mm, 95 % within {} mm; {} of {} in the intervals of {}\n",
        count(sequences),
        how(terms.aimed),
        count(given),
        percent(wrong as f64 / given.max(1) as f64, 2),
        decimal(evaluated.mean_approaches, 2),
        decimal(half, 1),
        decimal(most, 1),
        count(evaluated.poses_in_interval),
        count(evaluated.poses),
        if terms.until.is_some() { "their pose" } else { "one of the modes of their pose" },
    );
    let lost = given - wrong - evaluated.poses;
    if lost > 0 {
        // Writing to a string cannot fail.
        _ = writeln!(text, "{} right names had no sure place in the end", count(lost));
    }
    if let Some(tested) = &evaluated.promise {
        let promised = &tested.promised;
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "Promised: at most {} wrong, with {} ({} sure, from {} sequences). Measured: {}: {}.",
            rate(promised.error_rate),
            how(promised.aimed),
            rate(promised.confidence),
            count(promised.sequences),
            percent(tested.error, 2),
            match tested.finding {
                Finding::Kept => "the promise is kept",
                Finding::Unclear => "above it, but no more than chance explains",
                Finding::Broken => "BROKEN, by more than chance explains",
                Finding::Untested => "no name was given",
            },
        );
        for (is_other, what) in [
            (promised.aimed != terms.aimed, how(promised.aimed)),
            (promised.noise != noise, promised.noise.as_str()),
            (are_others, "the objects of the model, all of them"),
        ] {
            if is_other {
                _ = writeln!(text, "Void here: it was made for {what}.");
            }
        }
    }
    let width = evaluated.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).max(6);
    _ = writeln!(text, "\n{:width$} {:>10} {:>6} {:>8}", "object", "approaches", "wrong", "unknown");
    for object in &evaluated.objects {
        let approaches = decimal(object.mean_approaches, 1);
        _ = writeln!(text, "{:width$} {approaches:>10} {:>6} {:>8}", object.name, object.wrong, object.unknown);
    }
    text
}
