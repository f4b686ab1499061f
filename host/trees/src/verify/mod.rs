//! A compiled model over rows compared with its ensemble, and with the library that trained it: on given rows, and on rows
//! made at every threshold.

mod different;
mod estimate;
pub mod plain;
pub mod predict;
mod reference;
mod score;
pub mod together;
mod values;

pub use estimate::Estimate;
pub use reference::{bound, margins, unit};
pub use score::{Classes, Regression, RowsEvaluation, evaluate_rows};

use crate::compile::bound_of;
use crate::ensemble::{Ensemble, Threshold};
use crate::error::{Error, Kind, Result, problem};
use crate::rows::{Encoder, Rows, generate, missing_text};
use different::first_different_tree;
use palpate_base::progress::{self, Progress};
use palpate_onboard::Model;
use palpate_shared::format::Sentinel;
use predict::class_by;
use rayon::prelude::*;
use reference::{Reference, Rounding};
use together::margins_of_rows;
use values::OfPredictions;

/// Distance between a model and its source.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Verified {
    /// Rows that were given.
    pub rows: usize,
    /// Rows that were made at the ensemble's thresholds.
    pub generated_rows: usize,
    /// The largest difference of a margin to the ensemble's, in nats, on all rows.
    pub max_margin_error: f64,
    /// The largest difference that the model states, in nats.
    pub stated_bound: f64,
    /// Rows of all for which another class is the best than for the ensemble.
    pub class_differs: usize,
    /// The largest difference of a margin to the library's own, on the given rows; `None` without its margins.
    pub library_max_margin_error: Option<f64>,
    /// Given rows that the library puts into another class by its margins; `None` without these.
    pub library_class_differs: Option<usize>,
    /// Number of these that the model's stated rounding does not explain: the library's margins of the two classes are
    /// farther apart, or equal although nothing that decides between the two was rounded.
    pub library_class_unexplained: Option<usize>,
    /// The largest difference of a value to the library's prediction; `None` without its predictions, or for classes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub library_max_value_error: Option<f64>,
    /// Given rows that the library predicts another class for, or a value farther away than the rounding of margins that the
    /// model states explains; `None` without its predictions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub library_values_differ: Option<usize>,
    /// Rows of these that this rounding does not explain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub library_values_unexplained: Option<usize>,
    /// The first row with another class than by the library's margins or its predictions.
    #[serde(skip)]
    pub first_class: Option<ClassDiffers>,
    /// The first row with another value than the library predicts.
    #[serde(skip)]
    pub first_value: Option<ValueDiffers>,
    /// Rounding of the library's margins as text: half a unit in the last place of the largest, as f32.
    #[serde(skip)]
    pub library_text_error: f64,
    /// True if the library's margins look like probabilities.
    #[serde(skip)]
    pub are_probabilities: bool,
    /// True if a margin differs from the ensemble's, or from the library's, by more than the model states for its output.
    #[serde(skip)]
    pub is_beyond: [bool; 2],
    /// The first tree that adds another leaf, if margins differ by more than is stated.
    #[serde(skip)]
    pub first_tree: Option<String>,
    /// Given rows that reach another leaf as the model measures them, in whole numbers of the features' units or in f32, than
    /// with their own values: the largest difference of a margin, and rows with another class. `None` where the library, too,
    /// compares f32.
    #[serde(skip)]
    pub scaling: Option<(f64, usize)>,
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

/// Advice on margins to compare with.
const RAW_SCORES: &str = "Give the library's raw scores, before the softmax or the logistic function: one column per output, or one for a binary model (its second class), in the order of the classes. XGBoost: `output_margin=True`; LightGBM: `raw_score=True`; CatBoost: `prediction_type=\"RawFormulaVal\"`; scikit-learn: `decision_function`, of forests `predict_proba`; onnxruntime: a model converted with `options={id(model): {\"raw_scores\": True}}`, of forests its probabilities.";

impl Verified {
    /// Returns an error if differences are larger than the model states.
    ///
    /// # Errors
    /// The first difference that is not explained by the rounding that the model states.
    pub fn check(&self) -> Result<()> {
        let bound = self.stated_bound;
        let beyond = |whose: &str, error: f64, tree: Option<&String>| {
            let tree = tree.map_or_else(String::new, |tree| format!("; {tree}"));
            Err(problem!(
                "{whose} margins differ by up to {error:.3e}, more than the {bound:.3e} that the model states{tree}"
            )
            .fix(
                "Check that the model was exported from this file, with the same --missing and --all-trees, and the \
                     margins are the library's raw scores of these rows.",
            ))
        };
        let [is_beyond_ensemble, is_beyond_library] = self.is_beyond;
        if is_beyond_ensemble {
            return beyond("the ensemble's", self.max_margin_error, self.first_tree.as_ref());
        }
        match self.library_max_margin_error {
            Some(_) if self.are_probabilities => {
                return Err(
                    problem!("the library's numbers look like probabilities, and margins are needed").fix(RAW_SCORES)
                );
            }
            Some(error) if is_beyond_library => return beyond("the library's", error, None),
            _ => {}
        }
        let rows = self.library_class_unexplained.filter(|&rows| rows > 0).or(self.library_values_unexplained);
        match (&self.first_class, &self.first_value, rows) {
            (Some(ClassDiffers { row, classes: [own, theirs], gap }), _, Some(rows)) => Err(problem!(
                "{rows} rows get another class than the library gives them, and the rounding that the model states does not \
                 explain it: the first is row {row}, of {own:?}, and {theirs:?} by the library, whose margins of the two are \
                 {gap:.3e} apart"
            )
            .fix("Export with `--leaf f32`, and check that the margins are the library's raw scores of these rows.")),
            (_, Some(ValueDiffers { row, values: [own, theirs] }), Some(rows)) => Err(problem!(
                "the library predicts other values for {rows} rows, farther away than the rounding that the model states, or \
                 than a thousandth of what its trees add up to: the first is row {row}, of {own} instead of {theirs}"
            )
            .fix(
                "Export with the leaves that `export` advises, if it notes how far values may be off; and check that the \
                 predictions are those of these rows, by the very model of this file. `--link` sets another link at export.",
            )),
            _ => Ok(()),
        }
    }
}

/// Answers of the library that trained a model, for the rows that are given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Library<'l> {
    /// Its margins: one for each output, or one for a binary model, that of its second class.
    pub margins: Option<&'l [Vec<f64>]>,
    /// Its predictions: a class by name, or the value of a regression, one for each target.
    pub values: Option<&'l [Vec<String>]>,
}

/// Result of comparing rows.
#[derive(Clone, Default)]
struct Difference {
    margin_error: f64,
    class_differs: usize,
    /// A row whose margins differ by more than the model states, and its number.
    example: Option<(usize, Vec<f64>)>,
}

impl Difference {
    fn with(self, other: Self) -> Self {
        let example = match (self.example, other.example) {
            (Some(one), Some(two)) => Some(if one.0 <= two.0 { one } else { two }),
            (one, two) => one.or(two),
        };
        Self {
            margin_error: self.margin_error.max(other.margin_error),
            class_differs: self.class_differs + other.class_differs,
            example,
        }
    }
}

/// Rows compared at once.
const BATCH: usize = 4096;

/// Compares a model with its ensemble on `rows` and on rows made at every threshold, and with what `library` says of `rows`.
///
/// # Errors
/// If model, ensemble and rows do not belong together; [`Kind::Margins`] and [`Kind::Predictions`] if the library's answers do
/// not belong to them; [`Kind::Cancelled`].
pub fn verify(
    model: &Model<'_>,
    ensemble: &Ensemble,
    rows: &Rows,
    library: Library<'_>,
    progress: &dyn Progress,
) -> Result<Verified> {
    if model.descriptor().is_some() || ensemble.schema().is_some() {
        return Err(computes_features());
    }
    let trees = usize::try_from(model.header().trees()).unwrap_or(usize::MAX);
    let own = [model.feature_count(), model.object_count(), trees];
    let of_ensemble = [ensemble.inputs.count(), ensemble.objects.len(), ensemble.trees.len()];
    if own != of_ensemble {
        let text = |[features, outputs, trees]: [usize; 3]| {
            format!("{features} features, {outputs} outputs and {trees} trees")
        };
        return Err(problem!("the model has {}, the ensemble {}", text(own), text(of_ensemble))
            .fix("Give the file that the model was exported from, and --all-trees if it was exported with that."));
    }
    let reference = Reference::new(ensemble, model);
    same_missing(ensemble, &reference)?;
    progress.begin("comparing", None);
    let mut difference = compare_all(model, &reference, &rows.values, 0, progress)?;
    let mut generated = 0;
    let mut batch: Vec<f64> = Vec::new();
    let mut result = Ok(());
    generate(
        ensemble,
        &rows.values,
        |feature, threshold| around(&reference.encoder, feature, threshold),
        |row| {
            batch.extend(row);
            generated += 1;
            if generated % BATCH == 0 && result.is_ok() {
                let done = compare_all(model, &reference, &batch, rows.len() + generated - BATCH, progress);
                result = done.map(|done| difference = std::mem::take(&mut difference).with(done));
                batch.clear();
            }
        },
    );
    result?;
    let rest = compare_all(model, &reference, &batch, rows.len() + generated - generated % BATCH, progress)?;
    difference = difference.with(rest);
    let predicted = library.values.map(|said| values::compare(model, &reference, rows, said)).transpose()?;
    let library = library.margins.map(|library| compare_library(model, &reference, rows, library)).transpose()?;
    let library = library.unwrap_or_default();
    let (values_differ, values_unexplained) =
        predicted.as_ref().map(|predicted| (predicted.differ, predicted.unexplained)).unzip();
    let OfPredictions { error: max_value_error, first_class, first_value, .. } = predicted.unwrap_or_default();
    let first_tree = difference.example.as_ref().and_then(|(number, row)| {
        let tree = first_different_tree(model, &reference, ensemble, row)?;
        let place = match number.checked_sub(rows.len()) {
            None => format!("row {}", number + 1),
            Some(generated) => format!("generated row {}", generated + 1),
        };
        Some(format!("the first of them is {place}, where tree {tree} is the first that adds another leaf"))
    });
    Ok(Verified {
        rows: rows.len(),
        generated_rows: generated,
        max_margin_error: difference.margin_error,
        stated_bound: bound(model),
        class_differs: difference.class_differs,
        library_max_margin_error: library.margin_error,
        library_class_differs: library.margin_error.map(|_| library.class_differs),
        library_class_unexplained: library.margin_error.map(|_| library.unexplained),
        library_max_value_error: max_value_error,
        library_values_differ: values_differ,
        library_values_unexplained: values_unexplained,
        first_class: library.first.or(first_class),
        first_value,
        library_text_error: library.text_error,
        are_probabilities: library.are_probabilities,
        is_beyond: [difference.example.is_some(), library.is_beyond],
        first_tree,
        scaling: scaling(&reference, rows),
    })
}

/// A model whose features nobody measures.
fn computes_features() -> Error {
    problem!("the model is not over rows of features").fix("Give a model that takes rows of features.")
}

/// Refuses a model that takes other numbers for missing values than the ensemble. The model's trees would go the ensemble's way in
/// each row that is made, since those hold the ensemble's numbers alone.
fn same_missing(ensemble: &Ensemble, reference: &Reference<'_>) -> Result<()> {
    let encoder = reference.encoder.only(0);
    let theirs = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let theirs = theirs.map(|ends| ends.map(|end| encoder.row(&[end])[0]));
    let own = reference.sentinel.map(|Sentinel { low, high }| [low, high]);
    if own == theirs {
        return Ok(());
    }
    let text = |ends: Option<[i32; 2]>| missing_text(ends.map(|ends| ends.map(|end| encoder.value(0, end))));
    Err(problem!("missing values are {} in the model, {} in the ensemble", text(own), text(theirs))
        .fix("Give the file that the model was exported from, and --missing as it was exported with."))
}

/// The values next to a threshold and at it: the nearest f32, or whole numbers of the feature's units.
fn around(encoder: &Encoder, feature: usize, threshold: Threshold) -> [f64; 3] {
    match encoder {
        Encoder::Real => {
            let at = threshold.single().unwrap_or(f32::INFINITY);
            [at.next_down(), at, at.next_up()].map(f64::from)
        }
        Encoder::Scaled(scales) => {
            let scale = f64::from(scales[feature]);
            let cut = threshold.units(scales[feature]);
            [cut - 1.0, cut, cut + 1.0].map(|number| number / scale)
        }
    }
}

fn compare_all(
    model: &Model<'_>,
    reference: &Reference<'_>,
    values: &[f64],
    first: usize,
    progress: &dyn Progress,
) -> Result<Difference> {
    let bounds = bounds(model);
    let prediction = model.prediction();
    let own = margins_of_rows(model, &reference.encoder, values);
    let own = own.par_chunks_exact(model.object_count());
    let rows = values.par_chunks_exact(model.feature_count()).zip(own).enumerate();
    let compared = rows.map(|(index, (row, own))| -> Result<_> {
        progress::advance(progress, 1)?;
        let encoded = reference.encoder.row(row);
        let full = reference.margins(row, &encoded);
        let margin_error = largest_difference(own, &full);
        let class_differs = usize::from(class_by(own, &prediction) != class_by(&full, &prediction));
        let example = is_beyond(own, &full, &bounds).then(|| (first + index, row.to_vec()));
        Ok(Difference { margin_error, class_differs, example })
    });
    compared.try_reduce(Difference::default, |one, other| Ok(one.with(other)))
}

/// The farthest that each output's margin can be from the library's own.
fn bounds(model: &Model<'_>) -> Vec<f64> {
    (0..model.object_count()).map(|output| bound_of(model, output)).collect()
}

/// True if a margin is farther from the other than its bound.
fn is_beyond(one: &[f64], other: &[f64], bounds: &[f64]) -> bool {
    one.iter().zip(other).zip(bounds).any(|((one, other), bound)| (one - other).abs() > *bound)
}

fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
}

/// Distance between a model and the library itself.
#[derive(Default)]
struct OfLibrary {
    margin_error: Option<f64>,
    class_differs: usize,
    unexplained: usize,
    first: Option<ClassDiffers>,
    text_error: f64,
    are_probabilities: bool,
    is_beyond: bool,
}

/// Compares the given rows' margins and classes with the library's.
fn compare_library(
    model: &Model<'_>,
    reference: &Reference<'_>,
    rows: &Rows,
    library: &[Vec<f64>],
) -> Result<OfLibrary> {
    if library.len() != rows.len() {
        return Err(problem!("it has margins of {} rows, but there are {} rows", library.len(), rows.len())
            .fix("Give one line of margins for each row, without a header.")
            .as_kind(Kind::Margins));
    }
    let outputs = model.object_count();
    let prediction = model.prediction();
    let (stated, bounds) = (bound(model), bounds(model));
    let rounding = Rounding::of(model, reference);
    let is_vote = reference.is_vote();
    let mut found =
        OfLibrary { are_probabilities: !is_vote && are_probabilities(library, outputs), ..OfLibrary::default() };
    let mut error = 0.0_f64;
    let mut scratch = vec![0; outputs];
    for (number, (row, expected)) in rows.iter().zip(library).enumerate() {
        let encoded = reference.encoder.row(row);
        let own = margins(model, &encoded);
        let expected = match expected[..] {
            // The first class's margin of a binary model is 0, or in a vote what the second one's leaves of 1.
            [second] if outputs == 2 => {
                vec![if is_vote || reference.is_share() { 1.0 - second } else { 0.0 }, second]
            }
            _ if expected.len() == outputs => expected.clone(),
            _ => {
                let found = expected.len();
                return Err(problem!("row {} has {found} margins for {outputs} outputs", number + 1)
                    .fix(RAW_SCORES)
                    .as_kind(Kind::Margins));
            }
        };
        error = error.max(largest_difference(&own, &expected));
        let half = |margin: &f64| margin.abs() * f64::from(f32::EPSILON) / 2.0;
        found.text_error = expected.iter().map(half).fold(found.text_error, f64::max);
        let slack: Vec<f64> = bounds.iter().zip(&expected).map(|(bound, margin)| bound + half(margin)).collect();
        found.is_beyond |= is_beyond(&own, &expected, &slack);
        let class = class_by(&expected, &prediction);
        let own = if prediction.targets { 0 } else { model.predict_class(&encoded, &mut scratch).unwrap_or_default() };
        if own == class {
            continue;
        }
        found.class_differs += 1;
        let gap = (expected[class] - expected[own]).abs();
        if !rounding.explains(gap) {
            found.unexplained += 1;
            let classes = [own, class].map(|class| model.object_name(class).to_owned());
            found.first.get_or_insert(ClassDiffers { row: number + 1, classes, gap });
        }
    }
    found.margin_error = Some(error);
    found.are_probabilities &= error > stated;
    Ok(found)
}

/// True if numbers look like probabilities: of two classes or more, from 0 to 1, and together 1.
fn are_probabilities(library: &[Vec<f64>], outputs: usize) -> bool {
    let is_share = |value: &f64| (0.0..=1.0).contains(value);
    outputs > 1
        && library
            .iter()
            .all(|row| row.iter().all(is_share) && (row.len() == 1 || (row.iter().sum::<f64>() - 1.0).abs() < 1e-4))
}

/// Effect on the given rows of measuring in whole numbers, or in f32.
fn scaling(reference: &Reference<'_>, rows: &Rows) -> Option<(f64, usize)> {
    if reference.encoder == Encoder::Real && !reference.ensemble.compares_f64() {
        return None;
    }
    let prediction = reference.ensemble.prediction();
    let changes = rows.iter().map(|row| {
        let as_they_are = reference.library_margins(row);
        let measured = reference.measured(row, &reference.encoder.row(row));
        let change = largest_difference(&as_they_are, &measured);
        (change, usize::from(class_by(&as_they_are, &prediction) != class_by(&measured, &prediction)))
    });
    Some(changes.fold((0.0, 0), |(most, classes), (change, class)| (f64::max(most, change), classes + class)))
}
