//! Sequences of rows of features: reading them, and evaluating on them.

use super::Global;
use super::figures::shares_table;
use palpate::Result;
use palpate::compile::{self, CompiledModel};
use palpate::error::{Error, Place, problem};
use palpate::evaluate::Finding;
use palpate::output;
use palpate::rows::{Features, SequenceColumns, Sequences};
use palpate::stream::{self, Evaluated};
use palpate::wording::{self, percent, rate};
use palpate_onboard::Model;
use std::fmt::Write as _;
use std::path::Path;

/// Columns of a file of rows that are no features.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct SequenceArguments {
    /// Column of the classes, or a regression's numbers
    #[arg(long, value_name = "COL", conflicts_with_all = ["active", "probe", "real"])]
    pub(crate) label: Option<String>,
    /// Column that says which rows are one sequence
    #[arg(long, value_name = "COL", requires = "label")]
    pub(crate) sequence_column: Option<String>,
    /// Column of groups of sequences, such as persons
    #[arg(long, value_name = "COL", requires = "sequence_column")]
    pub(crate) group_column: Option<String>,
}

impl SequenceArguments {
    /// The columns, if the file has sequences.
    pub(crate) fn columns(&self) -> Option<SequenceColumns<'_>> {
        let (label, sequence) = (self.label.as_deref(), self.sequence_column.as_deref()?);
        Some(SequenceColumns { label, sequence, group: self.group_column.as_deref() })
    }
}

fn found(finding: Finding, untested: &'static str) -> &'static str {
    match finding {
        Finding::Broken => "BROKEN, by more than chance explains",
        Finding::Unclear => "above it, but no more than chance explains",
        Finding::Kept => "kept",
        Finding::Untested => untested,
    }
}

fn known(model: &Model<'_>) -> Vec<String> {
    let mut names = compile::names(model);
    names.truncate(model.known_count());
    names
}

/// Reads sequences for a model; says on stderr if columns are taken by their position.
pub(crate) fn read(path: &Path, model: &Model<'_>, columns: &SequenceColumns<'_>) -> Result<Sequences> {
    read_of(path, model, columns, &known(model))
}

/// Reads sequences of these classes.
fn read_of(path: &Path, model: &Model<'_>, columns: &SequenceColumns<'_>, classes: &[String]) -> Result<Sequences> {
    let sequences = Sequences::read(path, Features::measured(model), columns, classes)?;
    super::rows::say_by_position(path, sequences.by_position);
    Ok(sequences)
}

/// Sequences of what the model does not know: any column of labels is as good as another.
pub(crate) fn others(path: &Path, model: &Model<'_>, columns: &SequenceColumns<'_>) -> Result<Sequences> {
    let columns = SequenceColumns { label: None, group: None, ..*columns };
    read_of(path, model, &columns, &[String::new()])
}

/// An evaluation on sequences of rows.
pub(crate) struct Evaluation<'a> {
    pub(crate) model: &'a Path,
    pub(crate) rows: &'a Path,
    pub(crate) columns: SequenceColumns<'a>,
    pub(crate) wanted: stream::Wanted,
    /// Path of a page to write.
    pub(crate) page: Option<&'a Path>,
}

/// Evaluates a compiled model on sequences of rows.
pub(crate) fn evaluate(asked: Evaluation<'_>, compiled: &CompiledModel, global: &Global) -> Result<()> {
    let model = compiled.model();
    stream::check(&model).map_err(|error| error.in_file(asked.model))?;
    if let Some(page) = asked.page {
        output::admit(page, [asked.rows, asked.model])?;
    }
    let sequences = read(asked.rows, &model, &asked.columns)?;
    let evaluated = stream::evaluate(&model, &sequences, &asked.wanted).map_err(|error| error.in_file(asked.rows))?;
    if let Some(page) = asked.page {
        let SequenceColumns { label, sequence, group, .. } = asked.columns;
        let group = group.map_or_else(String::new, |group| format!(" --group-column {group}"));
        let command = format!(
            "palpate evaluate {} {} --label {} --sequence-column {sequence}{group} --page {}",
            asked.model.display(),
            asked.rows.display(),
            label.unwrap_or_default(),
            page.display()
        );
        palpate_report::stream::page(&evaluated, &command)?.write(page)?;
    }
    if global.json {
        return output::print_json(&evaluated);
    }
    let text = evaluated_text(&evaluated);
    match asked.page {
        Some(page) => output::print_about(page, &text),
        None => output::print(&text),
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

/// Refuses sequences of an ensemble: only a compiled model stops.
pub(crate) fn needs_compiled(path: &Path) -> Error {
    problem!("an ensemble has no thresholds to stop at")
        .fix("Compile it with `palpate export`, and give the model.")
        .at(Place::file(path))
}
