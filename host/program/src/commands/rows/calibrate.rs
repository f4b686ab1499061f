//! `palpate rows calibrate`.

use super::{read_sequences, sequences_of};
use crate::commands::Global;
use crate::commands::calibrate::{PromiseArguments, per, text};
use crate::commands::kinds::{self, ModelKind};
use crate::commands::progress::Bar;
use crate::commands::strangers::StrangersArguments;
use palpate::Result;
use palpate::calibrate::Per;
use palpate::output;
use palpate::rows::SequenceColumns;
use palpate::stream::{self, StrangerTest};
use palpate::with;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(
    override_usage = "\
palpate rows calibrate [OPTIONS] --label <COL> --sequence-column <COL>
           --output <PATH> <MODEL> <ROWS>",
    after_help = "\
The promise holds for sequences like those of ROWS, which the model was not trained on. Rows of a sequence may depend on each other, but sequences (with --group-column, groups) must not. A sequence without a name is neither right nor wrong. Calibrate once: where several seeds, rates or models are tried on the same data, the one that looks best keeps its promise less often than stated. docs/guide/streams.md has the method.

Examples:
  palpate rows calibrate a.palpate a.csv -o b.palpate \\
      --label a --sequence-column id
  palpate rows calibrate a.palpate a.csv -o b.palpate \\
      --label a --sequence-column id --group-column person"
)]
pub(super) struct Arguments {
    /// Compiled model
    model: PathBuf,
    /// Sequences of rows of features: CSV with the features' names in the header
    rows: PathBuf,
    /// Column of the classes, or a regression's numbers
    #[arg(long, value_name = "COL")]
    label: String,
    /// Column that says which rows are one sequence
    #[arg(long, value_name = "COL")]
    sequence_column: String,
    /// Column of groups of sequences, such as persons
    #[arg(long, value_name = "COL")]
    group_column: Option<String>,
    /// Output; the calibrated model
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    promise: PromiseArguments,
    /// Cases that it is promised of: average, name or object
    #[arg(long, value_parser = per, default_value = "average", value_name = "OF")]
    per: Per,
    /// Give up after this many rows [default: the model's own limit]
    #[arg(long, value_name = "N")]
    max_rows: Option<u32>,
    /// Refuse rows of dead, stuck or railed sensors
    #[arg(long)]
    guard: bool,
    #[command(flatten)]
    strangers: StrangersArguments,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let Arguments { model: path, rows, output: to, promise, strangers, .. } = &arguments;
    let background = strangers.background();
    output::admit(to, [path, rows].into_iter().chain(background))?;
    let compiled = kinds::compiled(path, ModelKind::Rows, "calibrate")?;
    let model = compiled.model();
    stream::check(&model).map_err(|error| error.in_file(path))?;
    let columns = SequenceColumns {
        label: Some(&arguments.label),
        sequence: &arguments.sequence_column,
        group: arguments.group_column.as_deref(),
    };
    let found = read_sequences(rows, &model, &columns)?;
    let test = || {
        // Any column of labels is as good as another.
        let columns = SequenceColumns { label: None, group: None, ..columns };
        let others = background.map(|path| sequences_of(path, &model, &columns, &[String::new()]));
        StrangerTest::new(promise.stranger_test(global), &model, others.transpose()?.as_ref())
    };
    let settings = with!(
        stream::Settings::default(),
        rate = promise.error_rate,
        per = arguments.per,
        confidence = promise.confidence,
        max_rows = arguments.max_rows,
        guard = arguments.guard,
        strangers = strangers.is_wanted().then(test).transpose()?,
        seed = global.seed()
    );
    let calibrated = stream::calibrate(&model, &found, &settings, &Bar::new()).map_err(|error| error.in_file(rows))?;
    output::write_bytes(to, &calibrated.model)?;
    global.print_about(to, &calibrated, || text(to, &calibrated, ""))
}
