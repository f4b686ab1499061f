use super::Global;
use super::progress::Bar;
use super::unstated::UnstatedArguments;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::{self, OverTouches};
use palpate::error::{Error, Kind, Place};
use palpate::evaluate::over_touches;
use palpate::evaluate::parity::{Parity, parity};
use palpate::evaluate::verify::{Library, Verified, verify};
use palpate::prove::prove;
use palpate::results::Results;
use palpate::row;
use palpate::rows::{read_margins, read_values};
use palpate::wording::{count, scientific};
use std::path::PathBuf;

/// Compare a compiled model with what it was exported from.
#[derive(clap::Args)]
#[command(after_help = "\
For a model of touches, DATA is a directory: every touch goes through the model and the ensemble, and their margins and best objects are compared. Then random sequences of touches, each of one object, go through both until there is a verdict.

For a model of another library, DATA is a CSV file: every row goes through the model and the file's own trees, and so do rows made at every split: at the threshold, one step to each side, missing. Columns are matched by name, or by position where one side has no names. With --library-margins the model is also compared with the library's own raw scores: no header, one row per line, one column per output; with --library-values with what its `predict` says: a class, or a value.

--prove needs no data: an independent reader of the model compares each tree with its trees in ENSEMBLE on every possible row, and a row of each of their leaves goes through the chip's own code. With DATA both are done.

The exit code is 1 if a margin differs by more than the model states, or if the library puts a row into another class, or predicts another value, where the stated rounding does not explain it: for a value, one that is small against what the trees add up to.

Examples:
  palpate verify model.palpate ensemble.json data
  palpate verify model.palpate lightgbm.txt rows.csv --json
  palpate verify model.palpate m.json rows.csv --library-margins margins.csv
  palpate verify model.palpate m.json --prove")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// The file that it was exported from
    ensemble: PathBuf,
    /// Touches (a directory), or rows of features (a CSV file)
    #[arg(value_name = "DATA", required_unless_present = "prove")]
    data: Option<PathBuf>,
    /// Prove that both match on every possible row
    #[arg(long, conflicts_with = "sequences")]
    prove: bool,
    /// Sequences of touches to draw; of all objects together
    #[arg(long, value_name = "N", default_value = "10000", value_parser = super::numbers::sequences)]
    sequences: usize,
    /// The library's own raw scores of the rows
    #[arg(long, value_name = "CSV", requires = "data")]
    library_margins: Option<PathBuf>,
    /// The library's own predictions of the rows: classes or values
    #[arg(long, value_name = "CSV", requires = "data")]
    library_values: Option<PathBuf>,
    #[command(flatten)]
    unstated: UnstatedArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let options = arguments.unstated.options(None);
    let compiled = CompiledModel::read(&arguments.model)?;
    let ensemble = ensemble::load_with(&arguments.ensemble, &options)?;
    let of_model = |error: Error| error.in_file(&arguments.model);
    let proved = || prove(compiled.bytes(), &ensemble).map_err(of_model);
    let Some(data) = &arguments.data else {
        let proof = proved()?;
        return global.print(&proof, || super::prove::text(&proof));
    };
    if ensemble.descriptor().is_some() {
        if arguments.prove {
            return Err(Error::setting("prove", "given", "it without touches: every row is compared"));
        }
        let names = [("library_margins", &arguments.library_margins), ("library_values", &arguments.library_values)];
        if let Some((name, Some(path))) = names.into_iter().find(|(_, path)| path.is_some()) {
            return Err(Error::setting(name, path.display(), "it with a model of another library"));
        }
        // A log is a data set, too.
        if data.is_file() && !palpate::touches::is_log(data) {
            return Err(over_touches().at(Place::file(&arguments.ensemble)));
        }
        let (dataset, sequences) = (super::dataset(data)?.matching(&ensemble.objects), arguments.sequences);
        let parity =
            parity(&ensemble, &compiled.model(), &dataset, sequences, global.seed(), &Bar::new()).map_err(of_model)?;
        return global.print(&parity, || parity_text(&parity));
    }
    let rows = super::rows::read_rows(data, &ensemble, None)?;
    let margins = arguments.library_margins.as_deref().map(read_margins).transpose()?;
    let values = arguments.library_values.as_deref().map(read_values).transpose()?;
    let place = |error: Error| {
        let file = match error.kind() {
            Kind::Margins => arguments.library_margins.as_ref(),
            Kind::Predictions => arguments.library_values.as_ref(),
            _ => None,
        };
        error.in_file(file.unwrap_or(&arguments.model))
    };
    let library = Library { margins: margins.as_deref(), values: values.as_deref() };
    let verified = verify(&compiled.model(), &ensemble, &rows, library, &Bar::new()).map_err(place)?;
    let checked = verified.check().map_err(of_model);
    if arguments.prove && checked.is_ok() {
        let proof = proved()?;
        let both = serde_json::json!({ "proof": proof, "verified": verified });
        return global.print(&both, || text(&verified) + &super::prove::text(&proof));
    }
    global.print(&verified, || text(&verified))?;
    checked
}

/// The model compared with its ensemble, touch by touch and in sequences.
fn parity_text(parity: &Parity) -> String {
    let mut rows = Results::list();
    let stated = format!("nats; the model states {}", scientific(parity.stated_bound));
    rows.push(row!["touches", parity.touches]);
    rows.push(row!["largest difference of a margin", scientific(parity.max_margin_error), stated]);
    rows.push(row!["another best object", parity.best_differs, "touches"]);
    rows.push(row!["sequences", parity.sequences]);
    rows.push(row!["another verdict", parity.verdict_differs, "sequences"]);
    rows.push(row!["the same verdict at another touch", parity.touches_differ, "sequences"]);
    rows.text()
}

/// Rows that differ by more than rounding, as a note.
fn not_explained(rows: usize) -> String {
    format!("rows, {rows} not explained by the rounding that the model states")
}

fn text(verified: &Verified) -> String {
    let mut rows = Results::list();
    let stated = format!("the model states {}", scientific(verified.stated_bound));
    rows.push(row!["rows", verified.rows, format!("and {} made at thresholds", count(verified.generated_rows))]);
    rows.push(row!["largest difference of a margin", scientific(verified.max_margin_error), stated]);
    rows.push(row!["another class", verified.class_differs, "rows"]);
    if let (Some(error), Some(classes)) = (verified.library_max_margin_error, verified.library_class_differs) {
        let unexplained = verified.library_class_unexplained.unwrap_or_default();
        rows.push(row!["largest difference to the library's margins", scientific(error)]);
        rows.push(row!["another class than the library's margins", classes, not_explained(unexplained)]);
    }
    if let (Some(differ), Some(unexplained)) = (verified.library_values_differ, verified.library_values_unexplained) {
        match verified.library_max_value_error {
            Some(error) => {
                let why = "by more than rounding explains, or a thousandth of what the trees add up to";
                rows.push(row!["largest difference to the library's values", scientific(error)]);
                rows.push(row!["another value than the library's", differ, format!("rows, {why}")]);
            }
            None => rows.push(row!["another class than the library's", differ, not_explained(unexplained)]),
        }
    }
    if let Some((change, classes)) = verified.scaling {
        rows.push(row!["change by whole numbers, or by f32", scientific(change), "of a margin, at most"]);
        rows.push(row!["another class by them", classes, "rows"]);
    }
    rows.text()
}
