//! Rows of features as rows of bins.

use super::{Rows, cuts};
use rayon::prelude::*;
use std::ops::Range;

/// Rows whose derivatives are gathered before they are added.
const NEAR: usize = 64;

/// The bins of all rows, and the cuts between them.
pub(super) struct Bins {
    /// For each column the upper ends of its bins, ascending.
    pub(super) ends: Vec<Vec<f32>>,
    /// Start of each column among the bins of all columns, and the end of the last. After a column's bins comes one for
    /// missing values.
    pub(super) starts: Vec<usize>,
    /// Columns × rows: the number of the bin in its column.
    codes: Codes,
    rows: usize,
    /// No value is missing.
    pub(super) complete: bool,
}

/// The rows that go left at a split.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub(super) column: usize,
    /// Number of the column's first bins that go left.
    pub(super) limit: usize,
    /// True if rows without a value go left too.
    pub(super) missing_left: bool,
}

/// Bins' numbers, as narrow as the most bins of a column allow.
enum Codes {
    Byte(Vec<u8>),
    Short(Vec<u16>),
    Word(Vec<u32>),
}

impl Bins {
    /// Rows in at most `most` bins of each column.
    pub(super) fn new(rows: &Rows<'_>, most: usize) -> Self {
        let ends: Vec<Vec<f32>> = (0..rows.columns)
            .into_par_iter()
            .map(|column| {
                let features = rows.features.iter().skip(column).step_by(rows.columns).copied();
                match rows.weights {
                    None => cuts::of_column(features.zip(std::iter::repeat(1.0)).filter(is_known), most),
                    Some(weights) => cuts::of_column(features.zip(weights.iter().copied()).filter(is_known), most),
                }
            })
            .collect();
        let complete = !rows.features.par_iter().any(|value| value.is_nan());
        let widest = ends.iter().map(Vec::len).max().unwrap_or(0);
        // The greatest number is that of missing values, or of the last bin where no value is missing.
        let codes = match widest - usize::from(complete) {
            0..=0xFF => Codes::Byte(coded(rows, &ends)),
            0x100..=0xFFFF => Codes::Short(coded(rows, &ends)),
            _ => Codes::Word(coded(rows, &ends)),
        };
        let mut starts = vec![0];
        starts.extend(ends.iter().scan(0, |start, ends| {
            *start += ends.len() + 1;
            Some(*start)
        }));
        Self { ends, starts, codes, rows: rows.labels.len(), complete }
    }

    /// Adds each row's `slopes` to its bin in each of these columns. `sums` are those of the columns' bins, of `rows` in their
    /// order; both hold `width` numbers for a row or bin.
    pub(super) fn add(&self, rows: &[u32], columns: &Range<usize>, slopes: &[f32], width: usize, sums: &mut [f64]) {
        match &self.codes {
            Codes::Byte(codes) => self.add_coded(codes, rows, columns, slopes, width, sums),
            Codes::Short(codes) => self.add_coded(codes, rows, columns, slopes, width, sums),
            Codes::Word(codes) => self.add_coded(codes, rows, columns, slopes, width, sums),
        }
    }

    fn add_coded<C: Copy + Into<u32>>(
        &self,
        codes: &[C],
        rows: &[u32],
        columns: &Range<usize>,
        slopes: &[f32],
        width: usize,
        sums: &mut [f64],
    ) {
        // Rows are gathered a few at a time, since those of a node lie scattered.
        let mut near = vec![0.0; width * NEAR.min(rows.len())];
        let first = self.starts[columns.start];
        for rows in rows.chunks(NEAR) {
            for (near, &row) in near.chunks_exact_mut(width).zip(rows) {
                let slopes = &slopes[row as usize * width..][..width];
                near.iter_mut().zip(slopes).for_each(|(near, slope)| *near = f64::from(*slope));
            }
            for column in columns.clone() {
                let bins = &mut sums[(self.starts[column] - first) * width..][..(self.ends[column].len() + 1) * width];
                let codes = &codes[column * self.rows..][..self.rows];
                let code = |&row: &u32| codes[row as usize].into() as usize;
                if width == 2 {
                    let (bins, near) = (bins.as_chunks_mut::<2>().0, near.as_chunks::<2>().0);
                    for (bin, slopes) in rows.iter().map(code).zip(near) {
                        let bin = &mut bins[bin];
                        *bin = [bin[0] + slopes[0], bin[1] + slopes[1]];
                    }
                } else {
                    for (bin, slopes) in rows.iter().map(code).zip(near.chunks_exact(width)) {
                        let bin = &mut bins[bin * width..][..width];
                        bin.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += slope);
                    }
                }
            }
        }
    }

    /// Moves the rows that go left before those that go right; both stay in order. Returns how many go left.
    pub(super) fn part(&self, rows: &mut [u32], side: &Side) -> usize {
        let mut right = Vec::with_capacity(rows.len());
        let mut left = 0;
        for start in (0..rows.len()).step_by(NEAR) {
            let end = rows.len().min(start + NEAR);
            let (mut near_left, mut near_right) = ([0; NEAR], [0; NEAR]);
            let (mut left_count, mut right_count) = (0, 0);
            self.route(&rows[start..end], side, |row, goes_left| {
                // Written to both sides, and counted on one: quicker than a branch that no processor can predict.
                near_left[left_count % NEAR] = row;
                near_right[right_count % NEAR] = row;
                left_count += usize::from(goes_left);
                right_count += usize::from(!goes_left);
            });
            rows[left..left + left_count].copy_from_slice(&near_left[..left_count]);
            right.extend_from_slice(&near_right[..right_count]);
            left += left_count;
        }
        rows[left..].copy_from_slice(&right);
        left
    }

    /// Tells each row, and true if it goes left.
    pub(super) fn route(&self, rows: &[u32], side: &Side, to: impl FnMut(u32, bool)) {
        match &self.codes {
            Codes::Byte(codes) => self.route_coded(codes, rows, side, to),
            Codes::Short(codes) => self.route_coded(codes, rows, side, to),
            Codes::Word(codes) => self.route_coded(codes, rows, side, to),
        }
    }

    fn route_coded<C: Copy + Into<u32>>(
        &self,
        codes: &[C],
        rows: &[u32],
        &Side { column, limit, missing_left }: &Side,
        mut to: impl FnMut(u32, bool),
    ) {
        let missing = self.ends[column].len();
        let codes = &codes[column * self.rows..][..self.rows];
        let code = |row: u32| codes[row as usize].into() as usize;
        if missing_left && !self.complete {
            rows.iter().for_each(|&row| to(row, code(row) < limit || code(row) == missing));
        } else {
            rows.iter().for_each(|&row| to(row, code(row) < limit));
        }
    }
}

fn is_known((value, _): &(f32, f32)) -> bool {
    !value.is_nan()
}

/// The bin of each value: how many ends are at or below it, since the last end is above all values.
fn coded<C: TryFrom<u32> + Default + Copy + Send>(rows: &Rows<'_>, ends: &[Vec<f32>]) -> Vec<C> {
    let mut codes = vec![C::default(); rows.features.len()];
    let columns = codes.par_chunks_mut(rows.labels.len()).zip(ends).enumerate();
    columns.for_each(|(column, (codes, ends))| {
        let values = rows.features.iter().skip(column).step_by(rows.columns);
        for (code, value) in codes.iter_mut().zip(values) {
            let below = || ends.partition_point(|end| end <= value).min(ends.len() - 1);
            let bin = if value.is_nan() { ends.len() } else { below() };
            // The caller chose a type that holds all numbers.
            *code = C::try_from(bin as u32).unwrap_or_default();
        }
    });
    codes
}
