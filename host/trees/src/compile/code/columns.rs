//! Columns that splits compare: numbers of eight bits, made of the features once for all trees.

use super::super::axes::{Axes, visit};
use super::super::forest::Forest;
use palpate_shared::format::{Columns as Directions, Key};
use std::collections::BTreeMap;

/// A column: a number of eight bits of a feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) feature: u8,
    /// True if a missing value has the number 0, otherwise it has 255.
    pub(super) missing_left: bool,
    pub(super) kind: Kind,
    /// Its thresholds as keys.
    pub(super) cuts: Vec<i32>,
}

/// Rule that makes the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A conversion: value · 2^bits, cut to a whole number from 0 to 255; or the same of the f32 before the value, where
    /// thresholds are the f32 after such numbers, as of a library that compares with `<=`.
    Grid { bits: i8, before: bool },
    /// A search among 2^steps − 1 thresholds, the last ones repeated.
    Search { steps: u8 },
}

/// The columns of a forest in the order in which they are stored: those of one kind together, the most used first.
pub(super) struct Columns {
    pub(super) columns: Vec<Column>,
    /// By the number of a column in [`Axes`].
    places: Vec<usize>,
}

impl Columns {
    pub(super) fn new(forest: &Forest<'_>, axes: &Axes, has_sentinel: bool) -> Self {
        let mut all = Vec::new();
        for (axis, cuts) in &axes.axes {
            let kind = kind(forest.key, has_sentinel, cuts);
            for (missing_left, unused) in [(true, Directions::MissingRight), (false, Directions::MissingLeft)] {
                if axis.columns != unused {
                    all.push(Column { feature: axis.feature, missing_left, kind, cuts: cuts.clone() });
                }
            }
        }
        let mut uses = vec![0_usize; all.len()];
        for tree in &forest.trees {
            visit(&tree.root, &mut |split| uses[axes.place(split).0] += 1);
        }
        let mut of_kind: BTreeMap<(Kind, bool), usize> = BTreeMap::new();
        for (column, uses) in all.iter().zip(&uses) {
            *of_kind.entry((column.kind, column.missing_left)).or_default() += uses;
        }
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by_key(|&index| {
            let kind = (all[index].kind, all[index].missing_left);
            (std::cmp::Reverse(of_kind[&kind]), kind, std::cmp::Reverse(uses[index]), index)
        });
        let mut places = vec![0; all.len()];
        order.iter().enumerate().for_each(|(place, &index)| places[index] = place);
        let columns = order.into_iter().map(|index| all[index].clone()).collect();
        Self { columns, places }
    }

    /// Position of the column with this number in [`Axes`].
    pub(super) fn place(&self, column: usize) -> usize {
        self.places[column]
    }
}

impl Column {
    /// The number at or below which a split at this threshold goes left.
    pub(super) fn at(&self, index: u8) -> u8 {
        match self.kind {
            Kind::Search { .. } => index,
            Kind::Grid { bits, before } => (grid_number(self.cuts[usize::from(index)], bits, before) - 1) as u8,
        }
    }

    /// The number of a feature's key.
    #[cfg(test)]
    pub(super) fn rank(&self, key: i32) -> u8 {
        if key == palpate_shared::MISSING_FEATURE {
            return if self.missing_left { 0 } else { u8::MAX };
        }
        match self.kind {
            Kind::Search { .. } => self.cuts.iter().filter(|&&cut| cut <= key).count() as u8,
            Kind::Grid { bits, before } => {
                let value = f64::from(value(if before { key.saturating_sub(1) } else { key }));
                (value * f64::from(bits).exp2()).floor().clamp(0.0, 255.0) as u8
            }
        }
    }
}

/// The f32 value with this key.
pub(super) fn value(key: i32) -> f32 {
    let magnitude = f32::from_bits(key.unsigned_abs());
    if key < 0 { -magnitude } else { magnitude }
}

/// Thresholds of f32 values that are on a grid are converted, all others searched.
fn kind(key: Key, has_sentinel: bool, cuts: &[i32]) -> Kind {
    let search = Kind::Search { steps: (usize::BITS - cuts.len().leading_zeros()) as u8 };
    if key != Key::Real || has_sentinel {
        return search;
    }
    // The coarsest first: it has the smallest numbers.
    let grids = (-16..=16).flat_map(|bits| [(bits, false), (bits, true)]);
    let mut fitting = grids.filter(|&(bits, before)| {
        cuts.iter().all(|&cut| {
            let number = grid_number(cut, bits, before);
            (1.0..=255.0).contains(&f64::from(number as i32)) && is_whole(cut, bits, before)
        })
    });
    fitting.next().map_or(search, |(bits, before)| Kind::Grid { bits, before })
}

/// The number of steps of 2^-bits from 0 to a threshold.
fn grid_number(cut: i32, bits: i8, before: bool) -> i64 {
    exact(cut, bits, before).clamp(-1e9, 1e9) as i64
}

fn is_whole(cut: i32, bits: i8, before: bool) -> bool {
    let number = exact(cut, bits, before);
    number == number.floor()
}

fn exact(cut: i32, bits: i8, before: bool) -> f64 {
    let cut = if before { cut.saturating_sub(1) } else { cut };
    f64::from(value(cut)) * f64::from(bits).exp2()
}
