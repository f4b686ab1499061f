//! Problems with rows of features, and with comparing models on them.

use crate::ensemble::Columns;
use crate::error::Variant;

/// Advice on the margins that `verify` compares with.
const RAW_SCORES: &str = "Give the library's raw scores, before the softmax or the logistic function: one column per output, or one for a binary model (its second class), in the order of the classes. XGBoost: `output_margin=True`; LightGBM: `raw_score=True`; CatBoost: `prediction_type=\"RawFormulaVal\"`; scikit-learn: `decision_function`, of forests `predict_proba`; onnxruntime: a model converted with `options={id(model): {\"raw_scores\": True}}`, of forests its probabilities.";

/// Advice on the predictions that `verify` compares with.
const VALUES: &str = "Give what the library's `predict` says of each row: a class, or the value of a regression, a column for each of several targets. Where it gives probabilities (XGBoost's and LightGBM's boosters), give the class with the largest one, of two classes the second one above 0.5.";

/// Problems with rows of features, and with comparing models on them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsProblem {
    /// The file is not a table.
    #[error("not rows of features as CSV: {detail}")]
    NotRows {
        /// The parser's message.
        detail: String,
    },
    /// The file is Parquet.
    #[error("not rows of features as CSV: it is a Parquet file")]
    Parquet,
    /// There is no row.
    #[error("it has no rows")]
    Empty,
    /// There are as many columns without names as neither the model nor the library's rows have.
    #[error("it has {found} columns for {wanted} features{}", all.map(|all| format!(" of the library's {all} columns")).unwrap_or_default())]
    Columns {
        /// Columns.
        found: usize,
        /// Features.
        wanted: usize,
        /// The columns of the library's rows, where the model has only some of them.
        all: Option<usize>,
    },
    /// Features and columns have names, and some feature is not one of the columns.
    #[error("no column is named {}; its columns are {}", some(missing), some(header))]
    Unmatched {
        /// The features that no column is named after.
        missing: Vec<String>,
        /// The columns.
        header: Vec<String>,
    },
    /// Two columns have the same name.
    #[error("two columns are named {name:?}")]
    Repeated {
        /// The name.
        name: String,
    },
    /// The first line is a row, and no header.
    #[error("its columns are named {}: numbers alone", some(cells))]
    NumbersAlone {
        /// The cells of the first line.
        cells: Vec<String>,
    },
    /// Cells are not separated by commas.
    #[error("its cells are separated by {:?}", separator.to_string())]
    Separator {
        /// The character between them.
        separator: char,
    },
    /// A row has another number of cells than the header.
    #[error("it has {found} cell{}, where the header has {wanted}", if *found == 1 { "" } else { "s" })]
    Ragged {
        /// Its cells.
        found: u64,
        /// Cells of the header, or of the first row of a file without one.
        wanted: u64,
    },
    /// There is nothing between two line ends.
    #[error("the line is empty")]
    EmptyLine,
    /// One label cannot be compared with several targets.
    #[error("the model has {targets} targets, and a row has one label")]
    Targets {
        /// Targets.
        targets: usize,
    },
    /// A column that was asked for is not there.
    #[error("it has no column {name:?}")]
    NoColumn {
        /// Its name.
        name: String,
    },
    /// A cell is not a number.
    #[error("{text:?} in the column {column} is not a number")]
    Number {
        /// The column's name, or its number from 1.
        column: String,
        /// The cell.
        text: String,
    },
    /// There are margins of other rows.
    #[error("it has margins of {margins} rows, but there are {rows} rows")]
    MarginRows {
        /// Rows of margins.
        margins: usize,
        /// Rows of features.
        rows: usize,
    },
    /// There are margins of other outputs.
    #[error("row {row} has {found} margins for {outputs} outputs")]
    MarginColumns {
        /// The row, counted from 1.
        row: usize,
        /// Its margins.
        found: usize,
        /// Outputs of the model.
        outputs: usize,
    },
    /// There are the library's predictions of other rows.
    #[error("it has predictions of {values} rows, but there are {rows} rows")]
    ValueRows {
        /// Rows of predictions.
        values: usize,
        /// Rows of features.
        rows: usize,
    },
    /// There are the library's predictions of other outputs.
    #[error("row {row} has {found} predictions, where {wanted} {} needed", if *wanted == 1 { "is" } else { "are" })]
    ValueColumns {
        /// The row, counted from 1.
        row: usize,
        /// Its predictions.
        found: usize,
        /// One class or value, or a value for each target.
        wanted: usize,
    },
    /// A prediction of the library is neither a class of the model nor a number.
    #[error("the prediction {text:?} of row {row} is {}", if known.is_empty() { "no number".into() } else { format!("none of the model's classes: {}", some(known)) })]
    ValueText {
        /// The prediction.
        text: String,
        /// The row, counted from 1.
        row: usize,
        /// The classes; none for a regression.
        known: Vec<String>,
    },
    /// The library predicts another value.
    #[error(
        "the library predicts other values for {rows} rows, farther away than the rounding that the model states, or than a thousandth of what its trees add up to: the first is row {}, of {} instead of {}",
        first.row, first.values[0], first.values[1]
    )]
    Value {
        /// Number of rows.
        rows: usize,
        /// The first of them.
        first: ValueDiffers,
    },
    /// The model computes its features.
    #[error("the model is not over rows of features")]
    ComputesFeatures,
    /// A model and an ensemble do not belong together.
    #[error("the model has {}, the ensemble {}", of(*model), of(*ensemble))]
    OtherModel {
        /// Features, outputs and trees of the model.
        model: [usize; 3],
        /// Numbers of the ensemble.
        ensemble: [usize; 3],
    },
    /// A model and an ensemble take other numbers for missing values.
    #[error("missing values are {model} in the model, {ensemble} in the ensemble")]
    OtherMissing {
        /// The model's.
        model: String,
        /// The ensemble's.
        ensemble: String,
    },
    /// Margins are farther apart than the model states.
    #[error("{whose} margins differ by up to {error:.3e}, more than the {bound:.3e} that the model states{}", tree.as_ref().map(|tree| format!("; {tree}")).unwrap_or_default())]
    Beyond {
        /// Whose margins: "the ensemble's" or "the library's".
        whose: &'static str,
        /// The largest difference.
        error: f64,
        /// Bound that the model states.
        bound: f64,
        /// The first tree that differs.
        tree: Option<String>,
    },
    /// The library's margins look like probabilities.
    #[error("the library's numbers look like probabilities, and margins are needed")]
    Probabilities,
    /// Classes are others than the library's.
    #[error(
        "{rows} rows get another class than the library gives them, and the rounding that the model states does not explain it: the first is row {}, of {:?}, and {:?} by the library, whose margins of the two are {:.3e} apart",
        first.row, first.classes[0], first.classes[1], first.gap
    )]
    Class {
        /// Number of rows.
        rows: usize,
        /// The first of them.
        first: ClassDiffers,
    },
    /// A label is not one of the model's classes.
    #[error("the label {label:?} in row {row} is none of the model's classes: {}", known.join(", "))]
    Label {
        /// The label.
        label: String,
        /// The row, counted from 1.
        row: usize,
        /// The classes.
        known: Vec<String>,
    },
    /// A sequence has two labels.
    #[error("the sequence {sequence:?} has the labels {:?} and {:?}", labels[0], labels[1])]
    TwoLabels {
        /// The sequence.
        sequence: String,
        /// Its labels.
        labels: [String; 2],
    },
    /// A sequence is of two groups.
    #[error("the sequence {sequence:?} belongs to the groups {:?} and {:?}", groups[0], groups[1])]
    TwoGroups {
        /// The sequence.
        sequence: String,
        /// Its groups.
        groups: [String; 2],
    },
    /// A row does not say which sequence or group it belongs to.
    #[error("the {what} is missing")]
    Nameless {
        /// "sequence" or "group".
        what: &'static str,
    },
    /// A sequence's rows do not follow each other.
    #[error("the sequence {sequence:?} comes back after another one")]
    ComesBack {
        /// The sequence.
        sequence: String,
    },
    /// A problem with a row of an array.
    #[error("row {row}: {problem}")]
    InRow {
        /// The row, counted from 1.
        row: usize,
        /// The problem.
        problem: Box<RowsProblem>,
    },
    /// Only a compiled model stops by itself.
    #[error("an ensemble has no thresholds to stop at")]
    NotCompiled,
    /// The model has one output, so there is nothing to decide.
    #[error("the model predicts a value ({output}), and not classes: its rows are no evidence for any")]
    Regression {
        /// The name of its output.
        output: String,
    },
}

/// The first names of many, `?` for those that are not text.
fn some(names: &[String]) -> String {
    let plain = |name: &String| name.chars().map(|own| if own.is_control() { '?' } else { own }).collect::<String>();
    let names: Vec<String> = names.iter().map(plain).collect();
    Columns::first(names.iter().map(String::as_str), 12)
}

fn of([features, outputs, trees]: [usize; 3]) -> String {
    format!("{features} features, {outputs} outputs and {trees} trees")
}

impl RowsProblem {
    /// True if the file of the library's margins is at fault.
    pub fn is_about_margins(&self) -> bool {
        matches!(self, Self::MarginRows { .. } | Self::MarginColumns { .. } | Self::Probabilities)
    }

    /// True if the file of the library's predictions is at fault.
    pub fn is_about_values(&self) -> bool {
        matches!(self, Self::ValueRows { .. } | Self::ValueColumns { .. } | Self::ValueText { .. })
    }
}

impl Variant for RowsProblem {
    fn fix(&self) -> String {
        match self {
            Self::NotRows { .. } => "Give a header line with the features' names, then one row per line.",
            Self::Parquet => return format!("Instead, {}.", palpate_base::gone::instead(".parquet").unwrap_or_default()),
            Self::Empty => "Give at least one row below the header.",
            Self::Columns { .. } => {
                "Name the columns as the features (`palpate inspect` lists them), or give as many columns as features, in their order."
            }
            Self::Unmatched { .. } => {
                "Name the columns as the model's features, in any order; or 0, 1 and so on, to take them by their position."
            }
            Self::Repeated { .. } => "Give each column a name of its own.",
            Self::NumbersAlone { .. } => "Write the features' names into the first line, above the first row.",
            Self::Separator { .. } => "Separate cells by commas, and write decimals with a point.",
            Self::Ragged { .. } => "Give each row as many cells as there are names, with nothing between commas where a value is missing.",
            Self::EmptyLine => "Remove it; or write \"\" for a missing value of the only column.",
            Self::ValueRows { .. } => "Give one line for each row, without a header.",
            Self::ValueColumns { .. } | Self::ValueText { .. } => VALUES,
            Self::Value { .. } => {
                "Export with the leaves that `export` advises, if it notes how far values may be off; and check that the predictions are those of these rows, by the very model of this file. `--link` sets another link at export."
            }
            Self::NoColumn { .. } => "Name one of the columns in the header.",
            Self::Number { .. } => "Give a number, or leave the cell empty where the value is missing.",
            Self::MarginRows { .. } => "Give one line of margins for each row, without a header.",
            Self::MarginColumns { .. } => RAW_SCORES,
            Self::Probabilities => RAW_SCORES,
            Self::Class { .. } => {
                "Export with `--leaf f32`, and check that the margins are the library's raw scores of these rows."
            }
            Self::ComputesFeatures => "Give a model that takes rows of features.",
            Self::OtherModel { .. } => {
                "Give the file that the model was exported from, and --all-trees if it was exported with that."
            }
            Self::OtherMissing { .. } => {
                "Give the file that the model was exported from, and --missing as it was exported with."
            }
            Self::Beyond { .. } => {
                "Check that the model was exported from this file, with the same --missing and --all-trees, and the margins are the library's raw scores of these rows."
            }
            Self::TwoLabels { .. } | Self::TwoGroups { .. } => "A sequence is of one class and one group: give the rows of another one another id.",
            Self::Nameless { what } => return format!("Give each row the {what} that it belongs to."),
            Self::ComesBack { .. } => "Sort the rows by sequence, each in its order, or give each stretch of rows an id of its own.",
            Self::InRow { problem, .. } => return problem.fix(),
            Self::NotCompiled => "Compile it with `palpate export`, and give the model.",
            Self::Targets { .. } => {
                "Compare the values that `palpate recognize --features` prints for each row, or `palpate verify` with the \
                 library's margins."
            }
            Self::Regression { .. } => "Give a model of two or more classes.",
            Self::Label { .. } => "Correct the label, or name the model's classes with `export --names`.",
        }
        .into()
    }
}

/// A row for which the library predicts another value.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueDiffers {
    /// The row, counted from 1.
    pub row: usize,
    /// The model's value and the library's.
    pub values: [f64; 2],
}

/// A row that the library puts into another class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassDiffers {
    /// The row, counted from 1.
    pub row: usize,
    /// The model's class and the library's.
    pub classes: [String; 2],
    /// Distance between their margins in the library.
    pub gap: f64,
}
