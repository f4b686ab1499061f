//! `palpate rows recognize`.

use super::read_rows;
use crate::commands::Global;
use crate::commands::expected::ExpectedArguments;
use crate::commands::kinds::{self, ModelKind};
use crate::commands::numbers::error_rate;
use crate::commands::recognize::stopping;
use clap::ArgGroup;
use palpate::Result;
use palpate::evaluate::verify::margins;
use palpate::evaluate::{self, too_many_objects};
use palpate::output;
use palpate::rows::{Encoder, Features, RowOf, SequencesBuilder};
use palpate::stream::refusal;
use palpate::wording::rate;
use palpate_onboard::{Recognizer, RowsSeen, Verdict};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(
    group(
        ArgGroup::new("of_sums")
            .args(["sequence_column", "error_rate", "max_rows", "prior", "only"])
            .multiple(true)
            .requires("add_up")
    ),
    after_help = "\
Each line in is a row of features: CSV with the features' names in the header. Each line out is the class of the row, or a regression's value; with --add-up the verdict so far. With --sequence-column evidence begins where a sequence does, and nothing more is said of one after its verdict; without it the row after a verdict is the first of another object, and a promise is for the first verdict alone.

Examples:
  palpate rows recognize model.palpate rows.csv --json
  palpate rows recognize a.palpate a.csv --add-up --sequence-column id")]
pub(super) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// Rows of features; - is standard input
    #[arg(default_value = "-")]
    rows: PathBuf,
    /// Add up the evidence of rows, until there is a verdict
    #[arg(long)]
    add_up: bool,
    /// Column that says which rows are one sequence
    #[arg(long, value_name = "COL")]
    sequence_column: Option<String>,
    /// The share of wrong names to accept, such as 1%; stops there [default: the model's own thresholds]
    #[arg(long, value_name = "RATE", value_parser = error_rate)]
    error_rate: Option<f64>,
    /// Give up after this many rows [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_rows: Option<u32>,
    #[command(flatten)]
    expected: ExpectedArguments,
}

/// Answer to a row.
#[derive(serde::Serialize)]
struct Line<'a> {
    /// Counted from 1.
    row: usize,
    /// The sequence that the row is of, where the file says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    sequence: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<&'static str>,
    /// The predicted class of the row, or the leading one of the rows so far.
    #[serde(skip_serializing_if = "Option::is_none")]
    class: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior: Option<f64>,
    /// Rows of the same object so far, where their evidence is added.
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<u32>,
    /// Prediction of a regression, after its inverse link.
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f32>,
    /// Prediction of each target, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    values: Option<Vec<f32>>,
    /// The row's own, before any link.
    margins: Vec<f64>,
    /// Reason why the row adds nothing, if it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
}

/// Starts a recognizer again, with these weights if there are any.
pub(in crate::commands) fn reset(recognizer: &mut Recognizer<'_, 256>, weights: Option<&[u32]>) {
    match weights {
        // One of them is above 0.
        Some(weights) => _ = recognizer.reset_to(weights),
        None => recognizer.reset(),
    }
}

/// Prints the class or the value of each row, or the verdict so far.
pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let compiled = kinds::compiled(&arguments.model, ModelKind::Rows, "recognize")?;
    let model = compiled.model();
    let stopping = stopping(&model, arguments.error_rate, arguments.max_rows)?;
    let recognizer = Recognizer::<256>::new(&model, stopping);
    let recognizer = recognizer.map_err(|error| too_many_objects(error).in_file(&arguments.model))?;
    let weights = arguments.expected.weights(&compiled.names(), &evaluate::own_weights(&model))?;
    recognize(recognizer, weights.as_deref(), &arguments, global.json)
}

fn recognize(
    mut recognizer: Recognizer<'_, 256>,
    weights: Option<&[u32]>,
    arguments: &Arguments,
    json: bool,
) -> Result<()> {
    let (adds_up, sequence) = (arguments.add_up, arguments.sequence_column.as_deref());
    let model = *recognizer.model();
    let is_standard_input = arguments.rows.as_os_str() == "-";
    let path = if is_standard_input { Path::new("/dev/stdin") } else { &arguments.rows };
    let features = if adds_up { Features::measured(&model) } else { Features::from(&model) };
    let rows = read_rows(path, features, sequence)?;
    let starts = starts(&rows.labels).map_err(|error| error.in_file(path))?;
    if let Some(promise) = model.promise().filter(|_| adds_up && sequence.is_none()) {
        crate::commands::remark(&format!(
            "palpate: note: {}: nothing says where a sequence ends (--sequence-column), so the promise of {} is for the first \
             verdict alone, and none is made for those after it",
            path.display(),
            rate(promise.rate)
        ));
    }
    let encoder = if adds_up { Encoder::measured(&model) } else { Encoder::of(&model) };
    let mut seen = RowsSeen::<256>::new();
    let has_targets = model.prediction().targets;
    let has_classes = model.object_count() > 1 && !has_targets;
    let mut scratch = vec![0; model.object_count()];
    for (number, row) in (1..).zip(rows.iter()) {
        let encoded = encoder.row(row);
        let is_over = recognizer.verdict() != Verdict::Undecided;
        let is_first = if sequence.is_some() { starts.contains(&(number - 1)) } else { number == 1 || is_over };
        if is_over && !is_first && adds_up {
            // The sequence has its verdict.
            continue;
        }
        if is_first || !adds_up {
            reset(&mut recognizer, weights);
            seen.reset();
        }
        // Of a row by itself all features are given.
        let taken = if adds_up { seen.next(&model, &encoded).map(Vec::from) } else { Ok(encoded.clone()) };
        let refused = taken.as_ref().err().map(|refused| refusal(&model, *refused));
        let encoded = taken.unwrap_or(encoded);
        model.margins_of(&encoded, &mut scratch);
        if refused.is_none() {
            recognizer.push_margins(&scratch);
        }
        let own = model.predict_class(&encoded, &mut scratch).unwrap_or_default();
        let class = if adds_up { recognizer.best() } else { own };
        let line = Line {
            row: number,
            sequence: rows.labels.get(number - 1).map(String::as_str),
            verdict: (has_classes && adds_up).then(|| recognizer.verdict().name()),
            class: has_classes.then(|| model.object_name(class)),
            posterior: has_classes.then(|| recognizer.posterior(class).to_f64()),
            rows: (has_classes && adds_up).then(|| recognizer.touches()),
            value: model.predict_value(&encoded),
            values: has_targets.then(|| {
                let mut values = vec![0.0; model.object_count()];
                model.predict_each(&encoded, &mut scratch, &mut values);
                values
            }),
            margins: if refused.is_none() { margins(&model, &encoded) } else { Vec::new() },
            refused,
        };
        print(&line, json)?;
    }
    Ok(())
}

/// The rows with which sequences begin, of the sequences' names.
fn starts(ids: &[String]) -> Result<BTreeSet<usize>> {
    let mut sequences = SequencesBuilder::new(1, &[String::new()]);
    for (number, id) in ids.iter().enumerate() {
        sequences
            .push(&[0.0], RowOf { label: "", sequence: id, group: None })
            .map_err(|error| error.within(format_args!("row {}: ", number + 1)))?;
    }
    let sequences = sequences.finish().map_or_else(|_| Vec::new(), |built| built.sequences);
    Ok(sequences.into_iter().map(|sequence| sequence.rows.start).collect())
}

fn print(line: &Line<'_>, json: bool) -> Result<()> {
    if json {
        return crate::commands::print_line(line);
    }
    let row = line.row;
    let sequence = line.sequence.map_or_else(String::new, |sequence| format!("  {sequence}"));
    match (line.verdict, line.class, line.posterior) {
        (Some(verdict), Some(class), Some(posterior)) => {
            let refused = line.refused.as_ref().map_or_else(String::new, |refused| format!("  refused: {refused}"));
            output::print(&format!("{row:4}  {verdict:10}  {class} {posterior:.4}{sequence}{refused}\n"))
        }
        (None, Some(class), Some(posterior)) => output::print(&format!("{row:4}  {class} {posterior:.4}\n")),
        _ => {
            let one = [line.value.unwrap_or_default()];
            let values = line.values.as_deref().unwrap_or(&one).iter().map(ToString::to_string).collect::<Vec<_>>();
            output::print(&format!("{row:4}  {}\n", values.join("  ")))
        }
    }
}
