use super::Global;
use super::progress::Bar;
use super::unstated::UnstatedArguments;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::{self, OverTouches};
use palpate::error::{Error, Kind, Place};
use palpate::evaluate::over_touches;
use palpate::evaluate::verify::{Library, Verified, verify};
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
    let Some(data) = &arguments.data else {
        return super::prove::run(&arguments.model, &arguments.ensemble, None, &options, global);
    };
    let compiled = CompiledModel::read(&arguments.model)?;
    let ensemble = ensemble::load_with(&arguments.ensemble, &options)?;
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
        let data = (data.as_path(), arguments.sequences);
        return super::parity::run((&arguments.model, &compiled), &ensemble, data, global);
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
    let checked = verified.check().map_err(|error| error.in_file(&arguments.model));
    if arguments.prove && checked.is_ok() {
        let verified = Some((&verified, text(&verified)));
        return super::prove::run(&arguments.model, &arguments.ensemble, verified, &options, global);
    }
    global.print(&verified, || text(&verified))?;
    checked
}

fn text(verified: &Verified) -> String {
    let Verified { rows, generated_rows, max_margin_error, stated_bound, class_differs, .. } = verified;
    let mut text = format!(
        "{} rows and {} made at thresholds: margins differ by at most {} (the model states {}); another class for {}\n",
        count(*rows),
        count(*generated_rows),
        scientific(*max_margin_error),
        scientific(*stated_bound),
        count(*class_differs)
    );
    if let (Some(error), Some(classes)) = (verified.library_max_margin_error, verified.library_class_differs) {
        let unexplained = verified.library_class_unexplained.unwrap_or_default();
        text += &format!(
            "The library's own margins differ by at most {}; another class for {} rows; the rounding that the model states does \
             not explain {} of these\n",
            scientific(error),
            count(classes),
            count(unexplained)
        );
    }
    if let (Some(rows), Some(unexplained)) = (verified.library_values_differ, verified.library_values_unexplained) {
        text += &match verified.library_max_value_error {
            Some(error) => format!(
                "The library predicts values that differ by at most {error:.2e}; for {rows} rows by more than the rounding of \
                 margins that the model states explains, or by more than a thousandth of what its trees add up to\n"
            ),
            None => format!(
                "The library predicts another class for {rows} rows; the rounding that the model states does not explain \
                 {unexplained}\n"
            ),
        };
    }
    if let Some((change, classes)) = verified.scaling {
        text += &format!(
            "Measuring in whole numbers, or in f32, changes the rows' margins by at most {}, and the class of {}\n",
            scientific(change),
            count(classes)
        );
    }
    text
}
