//! Distance of margins from the ensemble's once leaves are rounded.

use super::cells::Cells;
use super::forest::{Branches, Forest, each_leaf};
use super::quantize::Scale;
use palpate_shared::format::LeafType;
use rayon::prelude::*;
use std::ops::AddAssign;

/// The farthest that a margin can be from the ensemble's f32 sum: the largest error in any cell, where cells can be
/// counted; otherwise the sum of the trees' largest roundings, and what f32 sums lose.
pub(super) fn margin_error(forest: &Forest<'_>, cells: Option<&Cells>, leaf: LeafType, scale: &Scale) -> f32 {
    let objects = || (0..forest.objects()).into_par_iter();
    let unit = f64::from(scale.unit);
    let error = if leaf == LeafType::F32 {
        unit / 2.0
    } else {
        objects().map(|object| bound(forest, object, scale)).reduce(|| 0.0, f64::max)
    };
    let Some(cells) = cells.filter(|_| leaf != LeafType::F32 && error > 0.0) else { return round_up(error) };
    let in_cells = |object| {
        let margins = in_cells(forest, cells, object, scale);
        margins.iter().fold(0.0, |worst, margins| f64::max(worst, margins.difference(unit)))
    };
    round_up(objects().map(in_cells).reduce(|| 0.0, f64::max))
}

/// An object's margins in every cell.
fn in_cells(forest: &Forest<'_>, cells: &Cells, object: usize, scale: &Scale) -> Vec<Margins> {
    let start = Margins { full: forest.base[object], compiled: scale.integer(forest.base[object], 0) };
    cells.sums(forest, object, start, |tree, value| {
        let shift = scale.shifts[tree];
        Margins { full: value, compiled: scale.integer(value, shift) << shift }
    })
}

/// A bound on the error of an object's margin, from its trees one by one.
fn bound(forest: &Forest<'_>, object: usize, scale: &Scale) -> f64 {
    let unit = f64::from(scale.unit);
    let base = Margins { full: forest.base[object], compiled: scale.integer(forest.base[object], 0) };
    let trees = forest.trees.iter().zip(&scale.shifts).filter(|(tree, _)| tree.values_for(object));
    let rounding: f64 = trees.map(|(tree, &shift)| leaf_error(tree, object, scale, shift)).sum();
    let bound = base.difference(unit) + rounding;
    // What f32 sums lose: half an ulp of the largest partial sum at each addition, or nothing at all while they are
    // whole numbers of a power of two that f32 holds.
    let range = forest.range(object);
    if bound == 0.0 && unit.to_bits().trailing_zeros() >= f64::MANTISSA_DIGITS - 1 && range / unit <= f64::from(1 << 24)
    {
        return 0.0;
    }
    bound + forest.trees_of(object).count() as f64 * range * f64::from(f32::EPSILON) / 2.0
}

/// A margin of the full model, and the same of the compiled one in units.
#[derive(Clone, Copy)]
struct Margins {
    full: f32,
    compiled: i32,
}

impl Margins {
    fn difference(self, unit: f64) -> f64 {
        (f64::from(self.full) - f64::from(self.compiled) * unit).abs()
    }
}

impl AddAssign for Margins {
    fn add_assign(&mut self, other: Self) {
        self.full += other.full;
        self.compiled += other.compiled;
    }
}

/// The largest rounding of a tree's leaves for an object.
fn leaf_error(tree: &Branches<'_>, object: usize, scale: &Scale, shift: u8) -> f64 {
    let mut worst = 0.0_f64;
    each_leaf(&tree.root, &mut |values| {
        let value = tree.value_of(object, values);
        let rounded = f64::from(scale.integer(value, shift)) * f64::from(1_u32 << shift) * f64::from(scale.unit);
        worst = worst.max((f64::from(value) - rounded).abs());
    });
    worst
}

/// The f32 at or above a value.
pub(super) fn round_up(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}
