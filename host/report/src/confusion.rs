//! Confusion matrices: which object is recognized as which.

use crate::page::document::Figure;
use crate::page::heat_map::heat_map;
use palpate::error::Result;
use palpate::results::{Results, Value};
use palpate::row;
use plotters::style::RGBColor;

/// A method's confusion: its name in the data, its title in the drawing, its color, and shares of each row.
pub(super) type Method<'a> = (&'a str, &'a str, RGBColor, Vec<Vec<f64>>);

/// The figure of several methods' matrices: row by row the object that was touched, column by column the one recognized.
///
/// # Errors
/// If a chart cannot be drawn.
pub(super) fn figure<'a>(
    [id, title, caption]: [&str; 3],
    names: &[String],
    methods: impl Iterator<Item = Method<'a>>,
) -> Result<Figure> {
    let mut data = Results::new(["method", "touched", "recognized as", "share"]);
    let mut panels = Vec::new();
    for (method, title, color, shares) in methods {
        panels.push(heat_map(title, ["recognized as", "touched"], names, &shares, color)?);
        for (touched, row) in names.iter().zip(&shares) {
            for (taken, &share) in names.iter().zip(row) {
                data.push(row![method, touched, taken, Value::Percent(share, 1)]);
            }
        }
    }
    Ok(Figure::new(id, title, caption, data).drawn(panels))
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

/// Means of recall and of precision over objects.
pub(super) fn mean(of_objects: &[(f64, f64)]) -> (f64, f64) {
    let mean = |of: fn(&(f64, f64)) -> f64| of_objects.iter().map(of).sum::<f64>() / of_objects.len().max(1) as f64;
    (mean(|pair| pair.0), mean(|pair| pair.1))
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
