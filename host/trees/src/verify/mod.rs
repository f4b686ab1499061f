//! A compiled model over rows compared with its ensemble, and with the library that trained it: on given rows, and on rows
//! made at every threshold.

mod candidate;
mod estimate;
mod isolated;
pub mod predict;
mod reference;
mod score;
pub mod together;

pub use crate::rows::ClassDiffers;
pub use candidate::Candidate;
pub use estimate::Estimate;
pub use reference::{bound, margins, unit};
pub use score::{Classes, Regression, RowsEvaluation, evaluate_rows};

use crate::ensemble::{Ensemble, Threshold};
use crate::error::{Result, RowsProblem};
use crate::progress::{self, Progress};
use crate::rows::{Encoder, Rows, generate};
use isolated::first_different_tree;
use palpate_onboard::Model;
use palpate_shared::format::LeafType;
use predict::class_by;
use rayon::prelude::*;
use reference::Reference;
use together::margins_of_rows;

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
    /// Those of them that the rounding that the model states does not explain: the library's margins of the two classes are
    /// farther apart, or equal where nothing that decides between the two was rounded.
    pub library_class_unexplained: Option<usize>,
    /// The first of these.
    #[serde(skip)]
    pub first_class: Option<ClassDiffers>,
    /// True if the library's margins look like probabilities.
    #[serde(skip)]
    pub are_probabilities: bool,
    /// The first tree of which another leaf is added, where margins differ by more than is stated.
    #[serde(skip)]
    pub first_tree: Option<String>,
    /// Given rows that, measured in whole numbers of the features' units, reach another leaf than with their own values:
    /// the largest difference of a margin, and rows with another class. `None` for a model that compares f32.
    #[serde(skip)]
    pub scaling: Option<(f64, usize)>,
}

impl Verified {
    /// Returns an error if differences are larger than the model states.
    ///
    /// # Errors
    /// [`RowsProblem::Beyond`].
    pub fn check(&self) -> Result<(), RowsProblem> {
        let bound = self.stated_bound;
        let beyond = |whose, error, tree| Err(RowsProblem::Beyond { whose, error, bound, tree });
        if self.max_margin_error > bound {
            return beyond("the ensemble's", self.max_margin_error, self.first_tree.clone());
        }
        match self.library_max_margin_error {
            Some(_) if self.are_probabilities => Err(RowsProblem::Probabilities),
            Some(error) if error > bound => beyond("the library's", error, None),
            _ => match (&self.first_class, self.library_class_unexplained) {
                (Some(first), Some(rows)) => Err(RowsProblem::Class { rows, first: first.clone() }),
                _ => Ok(()),
            },
        }
    }
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

/// Compares a model with its ensemble on `rows` and on rows made at every threshold, and with `library`, the library's own
/// margins of `rows`: one for each output, or one for a binary model, that of its second class.
///
/// # Errors
/// [`RowsProblem`] if model, ensemble, rows and margins do not belong together;
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn verify(
    model: &Model<'_>,
    ensemble: &Ensemble,
    rows: &Rows,
    library: Option<&[Vec<f64>]>,
    progress: &dyn Progress,
) -> Result<Verified> {
    if model.descriptor().is_some() || ensemble.descriptor().is_some() {
        return Err(RowsProblem::Touches.into());
    }
    let trees = usize::try_from(model.header().trees()).unwrap_or(usize::MAX);
    let own = [model.feature_count(), model.object_count(), trees];
    let of_ensemble = [ensemble.inputs.count(), ensemble.objects.len(), ensemble.trees.len()];
    if own != of_ensemble {
        return Err(RowsProblem::OtherModel { model: own, ensemble: of_ensemble }.into());
    }
    let reference = Reference::new(ensemble, model);
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
    let library =
        library.map(|library| compare_library(model, &reference, rows, library)).transpose()?.unwrap_or_default();
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
        first_class: library.first,
        are_probabilities: library.are_probabilities,
        first_tree,
        scaling: scaling(&reference, rows),
    })
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
    let bound = bound(model);
    let prediction = model.prediction();
    let own = margins_of_rows(model, &reference.encoder, values);
    let own = own.par_chunks_exact(model.object_count());
    let rows = values.par_chunks_exact(model.feature_count()).zip(own).enumerate();
    let compared = rows.map(|(index, (row, own))| -> Result<_> {
        progress::advance(progress, 1)?;
        let encoded = reference.encoder.row(row);
        let full: Vec<f64> = reference.margins(row, &encoded).into_iter().map(f64::from).collect();
        let margin_error = largest_difference(own, &full);
        let class_differs = usize::from(class_by(own, &prediction) != class_by(&full, &prediction));
        let example = (margin_error > bound).then(|| (first + index, row.to_vec()));
        Ok(Difference { margin_error, class_differs, example })
    });
    compared.try_reduce(Difference::default, |one, other| Ok(one.with(other)))
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
    are_probabilities: bool,
}

/// Compares the given rows' margins and classes with the library's.
fn compare_library(
    model: &Model<'_>,
    reference: &Reference<'_>,
    rows: &Rows,
    library: &[Vec<f64>],
) -> Result<OfLibrary> {
    if library.len() != rows.len() {
        return Err(RowsProblem::MarginRows { margins: library.len(), rows: rows.len() }.into());
    }
    let outputs = model.object_count();
    let prediction = model.prediction();
    let imported = reference.ensemble.origin.imported.as_ref();
    let of_import = imported.map_or(0.0, |imported| imported.rounding);
    let stated = bound(model);
    // What the model's margins are rounded by, and whether sums of votes are exact, so that ties are ties.
    let rounding = if model.leaf_type() == LeafType::F32 { of_import } else { stated };
    let is_vote = reference.ensemble.prediction().scale != 1.0 && outputs > 1;
    let ties_are_exact = is_vote && (model.leaf_type() == LeafType::F32 || stated <= of_import * (1.0 + 1e-6));
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
                return Err(RowsProblem::MarginColumns { row: number + 1, found, outputs }.into());
            }
        };
        error = error.max(largest_difference(&own, &expected));
        let class = class_by(&expected, &prediction);
        let own = if prediction.targets { 0 } else { model.predict_class(&encoded, &mut scratch).unwrap_or_default() };
        if own == class {
            continue;
        }
        found.class_differs += 1;
        let gap = (expected[class] - expected[own]).abs();
        let is_explained = rounding > 0.0 && gap <= 2.0 * rounding && !(gap == 0.0 && ties_are_exact);
        if !is_explained {
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

/// Effect of measuring in whole numbers on the given rows.
fn scaling(reference: &Reference<'_>, rows: &Rows) -> Option<(f64, usize)> {
    if reference.encoder == Encoder::Real {
        return None;
    }
    let prediction = reference.ensemble.prediction();
    let changes = rows.iter().map(|row| {
        let singles: Vec<f32> = row.iter().map(|&value| value as f32).collect();
        let as_they_are = reference.ensemble.margins_of_features(&singles);
        let measured = reference.margins(row, &reference.encoder.row(row));
        let nats = |margins: &[f32]| margins.iter().copied().map(f64::from).collect::<Vec<_>>();
        let change = largest_difference(&nats(&as_they_are), &nats(&measured));
        (change, usize::from(class_by(&nats(&as_they_are), &prediction) != class_by(&nats(&measured), &prediction)))
    });
    Some(changes.fold((0.0, 0), |(most, classes), (change, class)| (f64::max(most, change), classes + class)))
}
