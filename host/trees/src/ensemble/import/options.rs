//! Facts that files of other libraries do not state, and the names that they leave out.

use crate::ensemble::Schema;
use crate::error::{Error, Result, problem};

/// Facts that a file of another library does not state, or that a user wants otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options<'a> {
    /// Other names for the objects: one for each class, or for the one output of a regression.
    pub names: Option<&'a [String]>,
    /// True to take all trees even if training stopped early, instead of those up to the best iteration.
    pub all_trees: bool,
    /// The number that stood for a missing value in training, beside NaN: XGBoost's `missing`, which no file holds. NaN if
    /// there was none.
    pub missing: Option<f32>,
    /// Schemas that an ensemble's features may be of.
    pub schemas: &'a [Schema],
}

/// Note about every file of XGBoost.
pub(in crate::ensemble) const MISSING_UNKNOWN: &str = "The model does not state the number that stood for a missing value in \
                                          training (XGBoost's `missing=`): only NaN counts as missing. State the \
                                          number if there was another.";

/// Start of the note about trees that are left out.
pub(in crate::ensemble) const STOPPED_EARLY: &str = "Training stopped early: the ";

/// True for a note after which a user may have to choose an option.
pub(crate) fn asks(note: &str) -> bool {
    note == MISSING_UNKNOWN || note.starts_with(STOPPED_EARLY)
}

/// Note about every model with categories.
pub(in crate::ensemble) const CATEGORIES: &str = "Categories are the numbers that the library saw in training: of a pandas \
                                                  column their codes, from 0 on in the order of its categories.";

/// A classifier of one class is no regression.
pub(in crate::ensemble) fn one_class() -> Error {
    problem!("it has one class, and nothing to distinguish").fix("Train on two classes or more.")
}

/// An objective whose margins have no known meaning; `of` says what features are of, if the model computes them.
pub(in crate::ensemble) fn unknown_objective(found: &str, of: Option<&str>) -> Error {
    let only = of.map_or_else(String::new, |of| format!("; a model of {of} with multi:softprob"));
    problem!("its objective is {found}")
        .fix(format!("Train with multi:softprob, binary:logistic or a regression of one target{only}."))
}

/// The names of outputs that have none: the labels 0, 1 and so on, or the value or targets of a regression.
pub(in crate::ensemble) fn default_names(outputs: usize, are_targets: bool) -> Vec<String> {
    match outputs {
        1 => vec!["value".into()],
        _ if are_targets => (0..outputs).map(|target| format!("target{target}")).collect(),
        _ => (0..outputs).map(|label| label.to_string()).collect(),
    }
}

/// The given names, if there are some, instead of a file's own.
pub(in crate::ensemble) fn named(given: Option<&[String]>, own: Vec<String>) -> Result<Vec<String>> {
    match given {
        None => Ok(own),
        Some(given) if given.len() == own.len() => Ok(given.to_vec()),
        Some(given) => Err(problem!("{} names were given for {} outputs", given.len(), own.len())
            .fix("Give one name for each class, in the order of the labels.")),
    }
}
