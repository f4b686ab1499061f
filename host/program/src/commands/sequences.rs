//! Sequences of rows of features: reading them, and evaluating on them.

use super::Global;
use super::figures::shares_table;
use palpate::Result;
use palpate::compile::{self, CompiledModel};
use palpate::error::{Error, Place, RowsProblem};
use palpate::evaluate::Finding;
use palpate::output;
use palpate::rows::{Features, SequenceColumns, Sequences};
use palpate::stream::{self, Evaluated, EventCounts, EventSettings, EventsCalibrated, EventsEvaluated, RowRule};
use palpate::with;
use palpate::wording;
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
        Some(SequenceColumns { label, sequence, group: self.group_column.as_deref(), by_run: false })
    }
}

/// Events in recordings without stated ends.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct EventArguments {
    /// Verdicts go on through each sequence, a recording; CLASS is the one between events, if there is one
    #[arg(long, value_name = "CLASS", num_args = 0..=1, default_missing_value = "", conflicts_with_all = NOT_OF_EVENTS,
        requires_all = ["sequence_column", "rows_per_second"])]
    events: Option<String>,
    /// Rows in a second
    #[arg(long, value_name = "N", requires = "events")]
    rows_per_second: Option<f64>,
    /// False or repeated verdicts to accept per hour; what is promised
    #[arg(long, value_name = "N", default_value_t = 1.0, requires = "events")]
    false_per_hour: f64,
    /// Seconds from a verdict to the next, at least
    #[arg(long, value_name = "S", default_value_t = 2.0, requires = "events")]
    hold_off: f64,
    /// Seconds after the end of an event in which its verdict counts
    #[arg(long, value_name = "S", default_value_t = 1.0, requires = "events")]
    grace: f64,
}

/// The options that recordings of events have no use for.
const NOT_OF_EVENTS: [&str; 8] =
    ["group_column", "guard", "strangers", "background", "per", "error_rate", "max_touches", "sequences"];

impl EventArguments {
    /// True if recordings of events are asked for.
    pub(crate) fn is_given(&self) -> bool {
        self.events.is_some()
    }

    /// Settings of a promise about events, if there are any.
    pub(crate) fn settings(&self, model: &Model<'_>, confidence: f64, seed: u64) -> Result<Option<EventSettings>> {
        let (Some(class), Some(rows_per_second)) = (self.events.as_deref(), self.rows_per_second) else {
            return Ok(None);
        };
        let names = known(model);
        let background = if class.is_empty() { None } else { names.iter().position(|name| name == class) };
        if background.is_none() && !class.is_empty() {
            return Err(Error::setting("events", class, format!("a class of the model: {}", names.join(", "))));
        }
        let &Self { false_per_hour, hold_off, grace, .. } = self;
        let settings = EventSettings::default();
        Ok(Some(with!(settings, background, rows_per_second, false_per_hour, hold_off, grace, confidence, seed)))
    }
}

/// Statement of how events were calibrated.
pub(crate) fn calibrated_events_text(calibrated: &EventsCalibrated) -> String {
    let EventsCalibrated { promised, confidence, learned, longest, threshold, memory, row_evidence, counts, .. } =
        calibrated;
    format!(
        "Promised: at most {promised} false or repeated verdicts per hour, with a probability of {} %, in the first {} of a recording.\n\
         {}; learned from {learned} others.\n\
         A verdict takes a lead of {} nats over a memory of {}{}.\n",
        super::percent(*confidence),
        seconds(*longest),
        counts_text(counts),
        wording::decimal(*threshold, 1),
        wording::decimal(*memory, 1),
        if *row_evidence { ", with evidence by a table of margins" } else { "" },
    )
}

fn seconds(seconds: f64) -> String {
    format!("{} s", wording::decimal(seconds, if seconds < 100.0 { 1 } else { 0 }))
}

fn counts_text(counts: &EventCounts) -> String {
    let EventCounts { recordings, hours, events, named, wrong, repeated, false_per_hour, mean_delay, median_delay } =
        counts;
    format!(
        "{recordings} recordings, {} h: {named} of {events} events named, {} after their onset on average, a median of {}; \
         {wrong} false and {repeated} repeated verdicts, {} per hour",
        wording::decimal(*hours, 2),
        seconds(*mean_delay),
        seconds(*median_delay),
        wording::decimal(*false_per_hour, 2),
    )
}

/// Evaluates a model with events on recordings.
fn evaluate_events(asked: &Evaluation<'_>, model: &Model<'_>, global: &Global) -> Result<()> {
    let other = [
        ("page", asked.page.is_some()),
        ("group_column", asked.columns.group.is_some()),
        ("error_rate", asked.wanted.error_rate.is_some()),
        ("max_touches", asked.wanted.max_rows.is_some()),
        ("prior", asked.wanted.weights.is_some()),
    ];
    if let Some((option, _)) = other.iter().find(|(_, is_given)| *is_given) {
        return Err(Error::setting(option, "given", "it with a model without events"));
    }
    let recordings = read(asked.rows, model, &SequenceColumns { by_run: true, ..asked.columns })?;
    let evaluated = stream::evaluate_events(model, &recordings).map_err(|error| error.in_file(asked.rows))?;
    if global.json {
        return output::print_json(&evaluated);
    }
    output::print(&evaluated_events_text(&evaluated))
}

fn evaluated_events_text(evaluated: &EventsEvaluated) -> String {
    let EventsEvaluated { counts, promised, finding, too_long, majority, debounced } = evaluated;
    let mut text = format!("{}\n", counts_text(counts));
    if let (Some(promised), Some(finding)) = (promised, finding) {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "promised: at most {promised} per hour; {} were: {}",
            wording::decimal(counts.false_per_hour, 2),
            found(*finding, "no verdict was given"),
        );
    }
    if *too_long > 0 {
        _ = writeln!(text, "{too_long} recordings are longer than the promise covers");
    }
    for (name, rule) in [("a majority", majority), ("debouncing", debounced)] {
        _ = match rule {
            Some(RowRule { rows, counts }) => {
                let EventCounts { events, named, mean_delay, .. } = counts;
                let after = seconds(*mean_delay);
                writeln!(
                    text,
                    "as few false by {name} of {rows} rows: {named} of {events} events named, {after} after their onset"
                )
            }
            None => writeln!(text, "as few false by {name} of rows: no number of rows"),
        };
    }
    text
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
    let sequences = stream::read(path, Features::measured(model), columns, classes)?;
    super::rows::say_by_position(path, sequences.by_position);
    Ok(sequences)
}

/// Sequences of what the model does not know: any column of labels is as good as another.
pub(crate) fn others(path: &Path, model: &Model<'_>, columns: &SequenceColumns<'_>) -> Result<Sequences> {
    let columns = SequenceColumns { label: None, group: None, ..*columns };
    read_of(path, model, &columns, &[String::new()])
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
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
    if model.events().is_some() {
        return evaluate_events(&asked, &model, global);
    }
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
        percent(*error),
        percent(*wrong),
        percent(*undecided),
        percent(*unknown),
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
            "promised: at most {} % wrong; {} were{of}{groups}: {}",
            super::percent(promise.promised),
            percent(promise.found),
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
    Error::at(Place::file(path), RowsProblem::NotCompiled)
}
