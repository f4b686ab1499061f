//! Touches as the trees see them: rows of bins, and how many touches of each object have them.

use super::Rows;

/// The most thresholds of a feature.
const MOST: usize = u16::MAX as usize - 2;

/// Different rows of bins.
pub(super) struct Cases {
    /// For each feature the thresholds that trees may choose from, ascending.
    pub(super) thresholds: Vec<Vec<f32>>,
    /// Cases × features: the number of thresholds at or below the value; one more than there are where it is missing.
    pub(super) bins: Vec<u16>,
    /// Cases × objects: touches, weighted so that all objects count alike.
    pub(super) counts: Vec<f64>,
    pub(super) objects: usize,
}

impl Cases {
    /// The rows, each feature in at most `bins` bins that hold equally many of them.
    pub(super) fn new(rows: Rows, objects: usize, bins: usize) -> Self {
        let columns = rows.columns;
        let thresholds: Vec<Vec<f32>> =
            (0..columns).map(|column| quantiles(&rows.features, column, columns, bins)).collect();
        let binned = |row: &[f32]| {
            row.iter().zip(&thresholds).fold(0_u128, |key, (value, thresholds)| {
                let bin = if value.is_nan() {
                    thresholds.len() + 1
                } else {
                    thresholds.partition_point(|threshold| threshold <= value)
                };
                // At most eight features of 16 bits; bins are at most MOST + 1.
                key << 16 | bin as u128
            })
        };
        let mut keys: Vec<(u128, u32)> = rows.features.chunks(columns).map(binned).zip(0..).collect();
        keys.sort_unstable();
        let mut cases = Self { thresholds: Vec::new(), bins: Vec::new(), counts: Vec::new(), objects };
        for same in keys.chunk_by(|(a, _), (b, _)| a == b) {
            let key = same[0].0;
            cases.bins.extend((0..columns).rev().map(|column| (key >> (16 * column)) as u16));
            let start = cases.counts.len();
            cases.counts.resize(start + objects, 0.0);
            for &(_, row) in same {
                let weight = rows.weights.as_ref().map_or(1.0, |weights| f64::from(weights[row as usize]));
                cases.counts[start + rows.labels[row as usize] as usize] += weight;
            }
        }
        cases.thresholds = thresholds;
        cases
    }

    /// Number of cases.
    pub(super) fn len(&self) -> usize {
        self.counts.len() / self.objects
    }

    /// The touches of each object in a case.
    pub(super) fn counts(&self, case: usize) -> &[f64] {
        &self.counts[case * self.objects..(case + 1) * self.objects]
    }

    /// All touches, by their weights.
    pub(super) fn total(&self) -> f64 {
        self.counts.iter().sum()
    }
}

/// Edges of bins that hold equally many values, except the bin of the least value. Missing values are in none.
fn quantiles(features: &[f32], column: usize, columns: usize, bins: usize) -> Vec<f32> {
    let mut values: Vec<f32> =
        features.iter().skip(column).step_by(columns).copied().filter(|value| !value.is_nan()).collect();
    values.sort_unstable_by(f32::total_cmp);
    let bins = bins.min(MOST + 1);
    let mut edges: Vec<f32> = (1..bins).filter_map(|bin| values.get(bin * values.len() / bins)).copied().collect();
    edges.dedup();
    edges.retain(|edge| values.first().is_some_and(|least| edge > least));
    edges
}
