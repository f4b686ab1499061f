//! A column of leaf values for an object that the trees were not grown on.

use super::rows::{Leaves, Rows};
use crate::ensemble::train::BASE_MARGIN;

/// Rounds over all trees. Values hardly move after three.
const PASSES: usize = 3;
/// The share of each step that is taken.
const STEP: f64 = 0.5;
/// The largest step of a value, in nats.
const LARGEST: f64 = 1.0;

/// Touches of one object to fit on, each weighted equally, and the object as heavily as every other.
pub(super) struct Part<'r> {
    pub(super) rows: &'r Rows,
    /// The rows that are used.
    pub(super) chosen: Vec<u32>,
    /// The column that is the object's; none for one that the trees know.
    pub(super) column: Option<usize>,
}

/// Fits columns of leaf values; the values of the objects that the trees know stay as they are.
///
/// Minimizes the softmax loss over all objects with Σ prior·v²/2 added for each column, which is convex:
/// Newton's steps leaf by leaf, tree after tree, as boosting takes them (Chen and Guestrin, XGBoost, 2016) on trees whose
/// splits are given. `priors` are in touches of the column's object: a leaf that so many of its touches reach is half
/// way to what they say.
///
/// The columns have one value for each leaf of all trees.
pub(super) fn fit(leaves: &Leaves, parts: &[Part<'_>], priors: &[f64]) -> Vec<Vec<f64>> {
    let width = priors.len();
    let ridge = |column: usize| {
        let own = parts.iter().find(|part| part.column == Some(column));
        priors[column] / own.map_or(1, |part| touches(part)).max(1) as f64
    };
    let ridges: Vec<f64> = (0..width).map(ridge).collect();
    let mut columns = vec![vec![0.0; leaves.count()]; width];
    let begun = |part: &Part<'_>| vec![f64::from(BASE_MARGIN); part.chosen.len() * width];
    let mut margins: Vec<Vec<f64>> = parts.iter().map(begun).collect();
    let mut shares = vec![0.0; width];
    for _ in 0..PASSES {
        for (tree, of_tree) in leaves.trees.iter().enumerate() {
            let mut slopes = vec![[0.0_f64; 2]; of_tree.len() * width];
            for (part, margins) in parts.iter().zip(&margins) {
                let weight = 1.0 / part.chosen.len().max(1) as f64;
                for (&row, margins) in part.chosen.iter().zip(margins.chunks(width)) {
                    let row = row as usize;
                    posteriors(part.rows.log_sums[row], margins, &mut shares);
                    let leaf = part.rows.leaf(row, tree) - of_tree.start;
                    for (column, (&share, [first, second])) in
                        shares.iter().zip(&mut slopes[leaf * width..(leaf + 1) * width]).enumerate()
                    {
                        *first += weight * (share - f64::from(u8::from(part.column == Some(column))));
                        *second += weight * share * (1.0 - share);
                    }
                }
            }
            let mut steps = vec![0.0; slopes.len()];
            for (index, (step, [first, second])) in steps.iter_mut().zip(slopes).enumerate() {
                let (leaf, column) = (of_tree.start + index / width, index % width);
                let value = &mut columns[column][leaf];
                let whole = -(first + ridges[column] * *value) / (second + ridges[column]);
                *step = (STEP * whole).clamp(-LARGEST, LARGEST);
                *value += *step;
            }
            for (part, margins) in parts.iter().zip(&mut margins) {
                for (&row, margins) in part.chosen.iter().zip(margins.chunks_mut(width)) {
                    let leaf = part.rows.leaf(row as usize, tree) - of_tree.start;
                    margins.iter_mut().zip(&steps[leaf * width..]).for_each(|(margin, step)| *margin += step);
                }
            }
        }
    }
    columns
}

/// Number of different touches of a part: copies count once.
fn touches(part: &Part<'_>) -> usize {
    let mut sources: Vec<u32> = part.chosen.iter().map(|&row| part.rows.sources[row as usize]).collect();
    sources.sort_unstable();
    sources.dedup();
    sources.len()
}

/// The posterior of each column, where the logarithm of the sum over the other objects is `log_sum`.
fn posteriors(log_sum: f64, margins: &[f64], shares: &mut [f64]) {
    let most = margins.iter().copied().fold(log_sum, f64::max);
    let mut all = (log_sum - most).exp();
    for (share, margin) in shares.iter_mut().zip(margins) {
        *share = (margin - most).exp();
        all += *share;
    }
    shares.iter_mut().for_each(|share| *share /= all);
}
