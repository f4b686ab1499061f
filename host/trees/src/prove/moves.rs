//! Distance of a row from another class: how far one feature can move before the class changes.

use super::boxes::{Keys, Step};
use super::format::{self, Plain};
use crate::compile;
use crate::error::{ProofProblem, Result};
use crate::rows::Encoder;
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;

/// The nearest values of a feature at which a row's class is another one, all other features as they are.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Moves {
    /// The feature, counted from 0.
    pub feature: usize,
    /// Its value in the row, in the library's units as the next ones; `None` if it is missing.
    pub value: Option<f64>,
    /// The nearest value below with another class, and that class.
    pub below: Option<(f64, usize)>,
    /// The nearest value above with another class, and that class.
    pub above: Option<(f64, usize)>,
    /// The class without the feature, if it is another one.
    pub missing: Option<usize>,
}

/// For each row, and for each of its features in their order, the nearest values at which the class of a model, given by its
/// bytes, is another one. Exact: between two thresholds of a feature no margin changes, and every threshold of the model is
/// tried, from the row's own value on.
///
/// A row has a value for each feature, NaN where one is missing. Each takes the time of as many rows as the model has
/// thresholds, at most.
///
/// # Errors
/// [`CompileProblem::Model`](crate::error::CompileProblem::Model) if the bytes are no model, [`ProofProblem`] for one without
/// classes or trees.
pub fn moves<'r>(bytes: &[u8], rows: impl IntoIterator<Item = &'r [f64]>) -> Result<Vec<Vec<Moves>>> {
    let model = compile::open(bytes)?;
    let plain = format::read(bytes)?;
    if model.object_count() < 2 || model.prediction().targets {
        return Err(ProofProblem::NoClass.into());
    }
    let encoder = Encoder::of(&model);
    let cuts: Vec<Vec<i32>> = (0..plain.features).map(|feature| cuts(&plain, feature)).collect();
    let of_row = |row: &[f64]| {
        let keys = encoder.row(row);
        let class = class(&model, &keys);
        let of_feature =
            |(feature, cuts): (usize, &Vec<i32>)| of_feature(&model, &plain, &keys, (feature, cuts), class);
        cuts.iter().enumerate().map(of_feature).collect()
    };
    Ok(rows.into_iter().map(of_row).collect())
}

fn class(model: &Model<'_>, keys: &[i32]) -> usize {
    model.predict_class(keys, &mut vec![0; model.object_count()]).unwrap_or(0)
}

fn of_feature(model: &Model<'_>, plain: &Plain, row: &[i32], (feature, cuts): (usize, &[i32]), own: usize) -> Moves {
    let mut row = row.to_vec();
    let key = row.get(feature).copied().unwrap_or(MISSING_FEATURE);
    let mut at = |key: i32| {
        if let Some(place) = row.get_mut(feature) {
            *place = key;
        }
        let class = class(model, &row);
        (class != own).then_some(class)
    };
    let missing = at(MISSING_FEATURE);
    if key == MISSING_FEATURE {
        return Moves { feature, value: None, below: None, above: None, missing };
    }
    let value = |key: i32| plain.keys.value(feature, key.into());
    // The first key of the next interval above, or the last of the one below.
    let above = cuts.iter().filter(|&&cut| cut > key).find_map(|&cut| Some((value(cut), at(cut)?)));
    let below = cuts.iter().rev().filter(|&&cut| cut <= key).find_map(|&cut| {
        let last = cut.saturating_sub(1).max(-i32::MAX);
        Some((value(last), at(last)?))
    });
    Moves { feature, value: Some(value(key)), below, above, missing }
}

/// All thresholds of a feature, ascending, as keys that a row may have.
fn cuts(plain: &Plain, feature: usize) -> Vec<i32> {
    let of_trees = plain.trees.iter().flat_map(|(tree, _)| &tree.nodes).filter_map(|step| match step {
        Step::Split(rule, _) if rule.feature == feature => Some(rule.cut),
        _ => None,
    });
    let of_cells = plain.cells.iter().flatten().filter_map(|(rows, _)| rows.get(feature)).map(|values| values.low);
    let sentinels = plain.sentinel.iter().flat_map(|&[low, high]| [low, high + 1]);
    let most = match plain.keys {
        Keys::Real => palpate_shared::format::f32_key(f32::INFINITY),
        Keys::Whole | Keys::Scaled(_) => i32::MAX,
    };
    let all = of_trees.chain(of_cells).chain(sentinels).filter_map(|cut| i32::try_from(cut).ok());
    let mut cuts: Vec<i32> = all.filter(|&cut| -most < cut && cut <= most).collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}
