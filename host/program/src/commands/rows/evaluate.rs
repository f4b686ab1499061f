//! `palpate rows evaluate`.

use super::{read_rows, read_sequences};
use crate::commands::expected::ExpectedArguments;
use crate::commands::figures::shares_table;
use crate::commands::kinds::{self, ModelKind};
use crate::commands::numbers::error_rate;
use crate::commands::{Global, shell};
use clap::ArgGroup;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::evaluate::{self, Classes, Finding, Regression, RowsEvaluation, evaluate_rows};
use palpate::output;
use palpate::rows::{Features, SequenceColumns};
use palpate::stream::{self, Evaluated};
use palpate::wording::{self, percent, percent_within, rate};
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(
    group(
        ArgGroup::new("of_sequences")
            .args(["group_column", "error_rate", "max_rows", "page", "prior", "only"])
            .multiple(true)
            .requires("sequence_column")
    ),
    after_help = "\
Each row is taken alone, and compared with its label: a class by name or number from 0, or a number for a regression. With --sequence-column the rows of a sequence are followed to a verdict; the model stops by its own thresholds, and shows whether it keeps its promise. docs/guide/streams.md explains the figures.

Examples:
  palpate rows evaluate model.palpate rows.csv --label kind
  palpate rows evaluate sure.palpate rows.csv --label kind --sequence-column id \\
      --page page.html")]
pub(super) struct Arguments {
    /// Compiled model or ensemble
    model: PathBuf,
    /// Rows of features: CSV with the features' names in the header
    rows: PathBuf,
    /// Column of the classes, or a regression's numbers
    #[arg(long, value_name = "COL")]
    label: String,
    /// Column that says which rows are one sequence
    #[arg(long, value_name = "COL")]
    sequence_column: Option<String>,
    /// Column of groups of sequences, such as persons
    #[arg(long, value_name = "COL")]
    group_column: Option<String>,
    /// The share of wrong names to accept, such as 1%; stops there [default: the model's own thresholds]
    #[arg(long, value_name = "RATE", value_parser = error_rate)]
    error_rate: Option<f64>,
    /// Give up after this many rows [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_rows: Option<u32>,
    #[command(flatten)]
    expected: ExpectedArguments,
    /// Also write a page of the results
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let compiled = kinds::file(&arguments.model, ModelKind::Rows, "evaluate")?;
    match &arguments.sequence_column {
        Some(sequence) => on_sequences(&arguments, sequence, &compiled, global),
        None => on_rows(&arguments, &compiled, global),
    }
}

/// Evaluates a compiled model on sequences of rows.
fn on_sequences(arguments: &Arguments, sequence: &str, compiled: &CompiledModel, global: &Global) -> Result<()> {
    let Arguments { model: path, rows, label, group_column, error_rate, max_rows, .. } = arguments;
    let model = compiled.model();
    let weights = arguments.expected.weights(&compiled.names(), &evaluate::own_weights(&model))?;
    stream::check(&model).map_err(|error| error.in_file(path))?;
    if let Some(page) = &arguments.page {
        output::admit(page, [rows, path])?;
    }
    let columns = SequenceColumns { label: Some(label), sequence, group: group_column.as_deref() };
    let sequences = read_sequences(rows, &model, &columns)?;
    let wanted = stream::Wanted { error_rate: *error_rate, max_rows: *max_rows, weights };
    let evaluated = stream::evaluate(&model, &sequences, &wanted).map_err(|error| error.in_file(rows))?;
    if let Some(page) = &arguments.page {
        palpate_report::stream::page(&evaluated, &shell::typed())?.write(page)?;
    }
    if global.json {
        return output::print_json(&evaluated);
    }
    let text = evaluated_text(&evaluated);
    match &arguments.page {
        Some(page) => output::print_about(page, &text),
        None => output::print(&text),
    }
}

/// Evaluates a model on labeled rows, each taken alone.
fn on_rows(arguments: &Arguments, compiled: &CompiledModel, global: &Global) -> Result<()> {
    let path = &arguments.rows;
    let model = compiled.model();
    let rows = read_rows(path, Features::from(&model), Some(&arguments.label))?;
    let evaluated = evaluate_rows(&model, &rows).map_err(|error| error.in_file(path))?;
    if global.json {
        return output::print_json(&evaluated);
    }
    let RowsEvaluation { rows, classes, regression } = evaluated;
    let mut text = String::new();
    if let Some(Classes { accuracy, accuracy_standard_error, names, confusion, .. }) = classes {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "{rows} rows, each taken alone: {} right (± is a standard error)",
            percent_within(accuracy, accuracy_standard_error, 1)
        );
        text += &shares_table("Taken for", &names, &names, &confusion);
    }
    if let Some(Regression { mean_absolute_error, root_mean_square_error }) = regression {
        text = format!(
            "{rows} rows: values are off by {mean_absolute_error:.4} on average, {root_mean_square_error:.4} in the root mean \
             square\n"
        );
    }
    output::print(&text)
}

fn found(finding: Finding, untested: &'static str) -> &'static str {
    match finding {
        Finding::Broken => "BROKEN, by more than chance explains",
        Finding::Unclear => "above it, but no more than chance explains",
        Finding::Kept => "kept",
        Finding::Untested => untested,
    }
}

fn evaluated_text(evaluated: &Evaluated) -> String {
    let Evaluated { sequences, rows, error, wrong, undecided, unknown, mean_rows, median_rows, .. } = evaluated;
    let groups = evaluated.groups.map_or_else(String::new, |groups| format!(" of {groups} groups"));
    let refused = evaluated.refused.map_or_else(String::new, |refused| format!(", {refused} others refused"));
    let mut text = format!(
        "{sequences} sequences{groups}, {rows} rows{refused}\n\
         of the names given {} wrong; of all sequences {} wrong, {} undecided, {} unknown\n\
         {mean_rows:.1} rows to the end on average, half of the sequences within {median_rows}\n",
        percent(*error, 2),
        percent(*wrong, 2),
        percent(*undecided, 2),
        percent(*unknown, 2),
    );
    if let Some(promise) = &evaluated.promise {
        let of = promise.of.as_ref().map_or_else(String::new, |of| format!(" ({of})"));
        let groups = match (promise.groups, evaluated.groups) {
            (false, _) => "",
            (true, Some(_)) => ", each group weighing the same",
            (true, None) => ", each sequence as a group of its own, as none are given (--group-column)",
        };
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "promised: at most {} wrong; {} were{of}{groups}: {}",
            rate(promise.promised),
            percent(promise.found, 2),
            found(promise.finding, "no name was given"),
        );
    }
    let fixed = |rows: Option<f64>, what: &str| match rows {
        Some(rows) => format!("{} rows ({})", wording::decimal(rows, 1), wording::compared(*mean_rows, rows)),
        None => format!("no number of rows ({what})"),
    };
    let comparison = &evaluated.comparison;
    _ = writeln!(
        text,
        "as few wrong with a fixed number of rows: {}",
        fixed(comparison.fixed_rows, "all of each sequence are not enough")
    );
    _ = writeln!(
        text,
        "as few wrong by a majority of rows: {}",
        fixed(comparison.vote_rows, "all of each sequence are not enough")
    );
    let mut recognized = evaluated.names.clone();
    recognized.push("no name".into());
    text + &shares_table("Confusion matrix", &evaluated.names, &recognized, &evaluated.confusion)
}
