//! Confusion matrices: which object is recognized as which.

use crate::page::chart::Svg;
use crate::page::heat_map::heat_map;
use crate::page::table::{Cell, Records};
use palpate::error::Result;
use plotters::style::RGBColor;

/// The matrix drawn: row by row the object that was touched, column by column the one recognized.
///
/// # Errors
/// If the chart cannot be drawn.
pub(super) fn drawn(title: &str, names: &[String], shares: &[Vec<f64>], color: RGBColor) -> Result<Svg> {
    heat_map(title, ["recognized as", "touched"], names, shares, color)
}

/// The sum of matrices of counts, as shares of each row.
pub(super) fn normalized(matrices: &[&Vec<Vec<usize>>]) -> Vec<Vec<f64>> {
    let Some(first) = matrices.first() else { return Vec::new() };
    let row = |row: usize| {
        let sum = |column: usize| matrices.iter().map(|matrix| matrix[row][column]).sum::<usize>() as f64;
        let counts: Vec<f64> = (0..first[row].len()).map(sum).collect();
        let all = counts.iter().sum::<f64>().max(1.0);
        counts.into_iter().map(|count| count / all).collect()
    };
    (0..first.len()).map(row).collect()
}

/// Recall and precision of each object, from shares of rows that are weighted equally.
pub(super) fn recall_precision(shares: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let of = |object: usize| {
        let taken: f64 = shares.iter().map(|row| row[object]).sum();
        (shares[object][object], if taken > 0.0 { shares[object][object] / taken } else { 0.0 })
    };
    (0..shares.len()).map(of).collect()
}

/// Adds a matrix of shares to a figure's data, one row per cell.
pub(super) fn push_matrix(data: &mut Records, method: &str, names: &[String], shares: &[Vec<f64>]) {
    for (touched, row) in names.iter().zip(shares) {
        for (taken, &share) in names.iter().zip(row) {
            data.push([method.into(), touched.as_str().into(), taken.as_str().into(), Cell::Percent(share, 1)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recall_is_along_rows_and_precision_along_columns() {
        let shares = normalized(&[&vec![vec![8, 2], vec![1, 9]], &vec![vec![8, 2], vec![3, 7]]]);
        assert_eq!(shares, [[0.8, 0.2], [0.2, 0.8]]);
        let both = recall_precision(&[vec![0.8, 0.2], vec![0.0, 1.0]]);
        assert_eq!(both[0], (0.8, 1.0));
        assert!((both[1].1 - 1.0 / 1.2).abs() < 1e-12);
    }
}
