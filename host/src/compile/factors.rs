//! Leaves that share a table: with many objects nearly all of a model is leaves, and they resemble each other.
//!
//! A leaf's values, one for each object, are a vector. The vectors of all leaves lie close to a space of far fewer
//! dimensions than there are objects: where touches say the same about two objects, so do the leaves. A model stores each
//! leaf as a few coordinates in that space, in bytes, and once a matrix that makes a margin for each object of what the
//! coordinates add up to.

use super::cells::Cells;
use super::forest::{Branches, Forest, each_leaf};
use super::parts::Parts;
use super::quantize::Scale;
use super::rounding::round_up;
use crate::ensemble::{Ensemble, Node, Output};
use crate::error::{CompileProblem, Error, Result};
use palpate_shared::format::{Factors, Group, LeafType};
use rayon::prelude::*;

/// A unit of margins is at most this many nats.
const UNIT: f64 = 1.0 / 1024.0;
/// The largest weight.
const MOST: f64 = 127.0;
/// Rounds of [`directions`]: far more than the leading directions need, and the last ones may be any that are as good.
const ROUNDS: usize = 40;

/// An ensemble whose leaves hold coordinates, and what makes margins of them.
pub(super) struct Factored {
    /// As many pseudo-objects as factors.
    pub(super) small: Ensemble,
    /// What each object's margin starts from: its base margin, and what each tree's leaves have in common.
    base: Vec<f32>,
    /// What each tree's leaves have in common.
    means: Vec<Vec<f64>>,
    /// For each object a weight for each factor.
    weights: Vec<Vec<f64>>,
}

/// Refuses what no leaves can share.
///
/// # Errors
/// [`Problem::Setting`](crate::error::Problem::Setting) `factors` or `leaf`.
pub(super) fn check(ensemble: &Ensemble, count: usize, leaf: LeafType) -> Result<()> {
    if count == 0 || !count.is_multiple_of(4) || count > Factors::MOST {
        return Err(Error::setting("factors", count, "a multiple of 4 up to 64"));
    }
    if leaf != LeafType::I8 {
        return Err(Error::setting("leaf", format!("{leaf:?}").to_lowercase(), "i8 with factors"));
    }
    if !ensemble.trees.iter().all(|tree| tree.output == Output::Each) {
        return Err(Error::setting("factors", count, "none: the leaves hold one value, for one object"));
    }
    Ok(())
}

/// The fewest factors that leave out at most `most` nats of a margin; none if even the most do not.
pub(super) fn fewest(ensemble: &Ensemble, most: f64) -> Option<usize> {
    let space = Space::new(ensemble, Factors::MOST);
    (1..=Factors::MOST / 4).map(|four| 4 * four).find(|&count| space.left_out(count) <= most)
}

impl Factored {
    /// The ensemble with leaves of `count` coordinates.
    pub(super) fn new(ensemble: &Ensemble, count: usize) -> Self {
        let space = Space::new(ensemble, count);
        let Space { means, mut directions, .. } = space;
        directions.truncate(count);
        let mut small = ensemble.clone();
        small.objects = (0..count).map(|factor| factor.to_string()).collect();
        small.base_margins = vec![0.0; count];
        let mut coordinates: Vec<Vec<f64>> = Vec::new();
        for (tree, mean) in ensemble.trees.iter().zip(&means) {
            for values in tree.nodes.iter().filter_map(Node::leaf) {
                let along = |direction: &Vec<f64>| {
                    let parts = values.iter().zip(mean).zip(direction);
                    parts.map(|((value, mean), part)| (f64::from(*value) - mean) * part).sum::<f64>()
                };
                coordinates.push((0..count).map(|at| directions.get(at).map_or(0.0, along)).collect());
            }
        }
        // As coarse on either side: the largest coordinate of a factor is as large as its largest weight.
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(1e-12, |most: f64, value| most.max(value.abs()));
        let balance: Vec<f64> = (0..count)
            .map(|at| {
                let weight = directions.get(at).map_or(1.0, |direction| largest(&mut direction.iter().copied()));
                (weight / largest(&mut coordinates.iter().map(|leaf| leaf[at]))).sqrt()
            })
            .collect();
        let mut leaves = coordinates.into_iter();
        for node in small.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Leaf(values) = node {
                let leaf = leaves.next().unwrap_or_default();
                *values = leaf.iter().zip(&balance).map(|(value, balance)| (value * balance) as f32).collect();
            }
        }
        let objects = ensemble.objects.len();
        let weight =
            |object: usize, at: usize| directions.get(at).map_or(0.0, |direction| direction[object]) / balance[at];
        let weights = (0..objects).map(|object| (0..count).map(|at| weight(object, at)).collect()).collect();
        let common = |object: usize| means.iter().map(|mean| mean[object]).sum::<f64>();
        let base = ensemble.base_margins.iter().enumerate();
        let base = base.map(|(object, base)| (f64::from(*base) + common(object)) as f32).collect();
        Self { small, base, means, weights }
    }

    /// What a layout of the small ensemble becomes in a model of `ensemble`: its base margins and its unit, the matrix, and
    /// how far margins are from the ensemble's.
    pub(super) fn parts(&self, full: &Full<'_>, small: Parts) -> Result<Parts> {
        let sums = |group: &Group| u64::from(group.trees) << (7 + group.shift.min(30));
        let sum = small.groups.iter().map(sums).sum::<u64>().max(128);
        if sum.saturating_mul(128 * self.small.objects.len() as u64) > 1 << 30 {
            let (trees, factors) = (self.small.trees.len(), self.small.objects.len());
            return Err(CompileProblem::FactorRange { trees, factors }.into());
        }
        let largest = self.weights.iter().flatten().fold(1e-12_f64, |most, weight| most.max(weight.abs()));
        let product = f64::from(small.unit) * (largest / MOST).max(1e-9);
        let shift = (UNIT / product).log2().floor().clamp(0.0, f64::from(Factors::MAX_SHIFT)) as u8;
        let exact = product * f64::from(shift).exp2();
        // A little larger, so that no weight is above the largest; then the weights' unit is what makes it exact.
        let unit = (exact as f32).next_up().max(1.0 / (1 << 24) as f32);
        let weight_unit = f64::from(unit) / f64::from(shift).exp2() / f64::from(small.unit);
        let whole = |weight: &f64| (weight / weight_unit).round().clamp(-MOST, MOST) as i8;
        let weights: Vec<Vec<i8>> = self.weights.iter().map(|weights| weights.iter().map(whole).collect()).collect();
        let base: Vec<i32> = self.base.iter().map(|base| (f64::from(*base) / f64::from(unit)).round() as i32).collect();
        let count = u8::try_from(self.small.objects.len()).unwrap_or(u8::MAX);
        let mut factors = Factors::header(count, shift).to_vec();
        factors.extend(weights.iter().flatten().map(|weight| weight.cast_unsigned()));
        let products = f64::from(small.unit) * weight_unit;
        let margin_error = self.margin_error(full, &Whole { weights: &weights, products, base: &base, unit })?;
        let instructions = small.instructions.mixed(self.weights.len(), self.small.objects.len());
        Ok(Parts { base, unit, margin_error, instructions, factors, ..small })
    }

    /// The farthest that a margin is from the ensemble's f32 sum: in any cell, where cells can be counted; otherwise the sum
    /// of the trees' largest differences, and what f32 sums lose.
    fn margin_error(&self, full: &Full<'_>, whole: &Whole<'_>) -> Result<f32> {
        let &Full { ensemble, forest, cells, scales } = full;
        let &Whole { weights, products, base, unit } = whole;
        let small = Forest::new(&self.small, scales)?;
        let scale = Scale::for_trees(&small, LeafType::I8).ok_or(CompileProblem::FitsNoLayout)?;
        // What the compiled leaves are worth, as an ensemble of the same trees.
        let mut compiled = ensemble.clone();
        for (index, (tree, small)) in compiled.trees.iter_mut().zip(&self.small.trees).enumerate() {
            let shift = scale.shifts[index];
            for (node, small) in tree.nodes.iter_mut().zip(&small.nodes) {
                let (Node::Leaf(values), Node::Leaf(small)) = (node, small) else { continue };
                let whole: Vec<i64> =
                    small.iter().map(|value| i64::from(scale.integer(*value, shift)) << shift).collect();
                for (value, weights) in values.iter_mut().zip(weights) {
                    let sum: i64 = whole.iter().zip(weights).map(|(whole, weight)| whole * i64::from(*weight)).sum();
                    *value = (sum as f64 * products) as f32;
                }
            }
        }
        let compiled = Forest::new(&compiled, scales)?;
        let one = |object: usize| {
            let start = f64::from(base[object]) * f64::from(unit);
            // Half a unit in the last place of each leaf above, a unit for the shift.
            let range = compiled.range(object) + start.abs();
            let slack = f64::from(unit) + range * f64::from(f32::EPSILON);
            let difference = match cells {
                Some(cells) => {
                    let full = cells.sums(forest, object, forest.base[object], |_, value| value);
                    let compiled = cells.sums(&compiled, object, start, |_, value| f64::from(value));
                    full.iter()
                        .zip(&compiled)
                        .fold(0.0_f64, |worst, (full, compiled)| worst.max((f64::from(*full) - compiled).abs()))
                }
                None => {
                    let common = self.means.iter().map(|mean| mean[object]).sum::<f64>();
                    let mut sum = (f64::from(forest.base[object]) + common - start).abs();
                    let trees = forest.trees.iter().zip(&compiled.trees).zip(&self.means);
                    sum += trees
                        .map(|((full, compiled), mean)| farthest(full, compiled, mean[object], object))
                        .sum::<f64>();
                    sum + forest.trees.len() as f64 * forest.range(object) * f64::from(f32::EPSILON) / 2.0
                }
            };
            difference + slack
        };
        Ok(round_up((0..forest.objects()).into_par_iter().map(one).reduce(|| 0.0, f64::max)))
    }
}

/// The ensemble that is compiled.
pub(super) struct Full<'a> {
    pub(super) ensemble: &'a Ensemble,
    pub(super) forest: &'a Forest<'a>,
    pub(super) cells: Option<&'a Cells>,
    pub(super) scales: Option<&'a [f32]>,
}

/// The whole numbers of a model with factors.
struct Whole<'a> {
    weights: &'a [Vec<i8>],
    /// Nats in a product of a leaf and a weight.
    products: f64,
    base: &'a [i32],
    unit: f32,
}

/// The largest difference of an object's values in a tree's leaves, one of the trees less `mean`.
fn farthest(full: &Branches<'_>, compiled: &Branches<'_>, mean: f64, object: usize) -> f64 {
    let values = |tree: &Branches<'_>| {
        let mut values = Vec::new();
        each_leaf(&tree.root, &mut |leaf| values.push(f64::from(leaf[object])));
        values
    };
    let pairs = values(full).into_iter().zip(values(compiled));
    pairs.fold(0.0, |worst, (full, compiled)| f64::max(worst, (full - mean - compiled).abs()))
}

/// The directions in which leaves differ most.
struct Space {
    /// For each tree the mean of its leaves.
    means: Vec<Vec<f64>>,
    /// Of length 1, at right angles, those in which leaves differ most first.
    directions: Vec<Vec<f64>>,
    /// Mean squares of what leaves are along each of them, all trees together.
    squares: Vec<f64>,
    /// The same along all directions that there are.
    all: f64,
    objects: usize,
}

impl Space {
    fn new(ensemble: &Ensemble, count: usize) -> Self {
        let objects = ensemble.objects.len();
        let mut means = Vec::new();
        // Leaves less their tree's mean, each divided by the root of the number of the tree's leaves.
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for tree in &ensemble.trees {
            let leaves: Vec<&[f32]> = tree.nodes.iter().filter_map(Node::leaf).collect();
            let share = 1.0 / leaves.len().max(1) as f64;
            let mut mean = vec![0.0; objects];
            for leaf in &leaves {
                mean.iter_mut().zip(*leaf).for_each(|(mean, value)| *mean += f64::from(*value) * share);
            }
            let less = |leaf: &&[f32]| {
                leaf.iter().zip(&mean).map(|(value, mean)| (f64::from(*value) - mean) * share.sqrt()).collect()
            };
            rows.extend(leaves.iter().map(less));
            means.push(mean);
        }
        let products: Vec<Vec<f64>> = (0..objects)
            .into_par_iter()
            .map(|a| {
                let mut sums = vec![0.0; objects];
                for row in &rows {
                    sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += row[a] * value);
                }
                sums
            })
            .collect();
        let all = (0..objects).map(|object| products[object][object]).sum();
        let (directions, squares) = directions(&products, count.min(objects));
        Self { means, directions, squares, all, objects }
    }

    /// The root of the mean square that `count` directions leave out of a margin.
    fn left_out(&self, count: usize) -> f64 {
        let kept: f64 = self.squares.iter().take(count).sum();
        ((self.all - kept).max(0.0) / self.objects.max(1) as f64).sqrt()
    }
}

/// The `count` leading eigenvectors of a symmetric matrix without negative eigenvalues, and their eigenvalues, by
/// orthogonal iteration.
fn directions(matrix: &[Vec<f64>], count: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let size = matrix.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // Any start that is at right angles to nothing.
    let number = |at: usize, row: usize| ((at * 7_919 + row * 104_729 + 1) % 65_521) as f64 / 65_521.0 - 0.5;
    let mut vectors: Vec<Vec<f64>> = (0..count).map(|at| (0..size).map(|row| number(at, row)).collect()).collect();
    orthogonal(&mut vectors);
    let mut lengths = vec![0.0; count];
    for _ in 0..ROUNDS {
        vectors = vectors.par_iter().map(|vector| matrix.iter().map(|row| dot(row, vector)).collect()).collect();
        lengths = orthogonal(&mut vectors);
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]));
    (order.iter().map(|&at| vectors[at].clone()).collect(), order.iter().map(|&at| lengths[at]).collect())
}

/// Makes vectors orthogonal and of length 1, one after the other, and gives the lengths that they had left.
fn orthogonal(vectors: &mut [Vec<f64>]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut lengths = Vec::new();
    for at in 0..vectors.len() {
        let (before, rest) = vectors.split_at_mut(at);
        let vector = &mut rest[0];
        // Twice: once leaves what rounding brings in.
        for _ in 0..2 {
            for other in &*before {
                let along = dot(other, vector);
                vector.iter_mut().zip(other).for_each(|(value, other)| *value -= along * other);
            }
        }
        let length = dot(vector, vector).sqrt();
        let scale = if length > 1e-150 { 1.0 / length } else { 0.0 };
        vector.iter_mut().for_each(|value| *value *= scale);
        lengths.push(length);
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leading_directions_are_found_in_their_order() {
        // Eigenvalues 9, 4 and 1 along turned axes.
        let (c, s) = (0.6, 0.8);
        let axes = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
        let entry = |a: usize, b: usize| {
            [4.0, 9.0, 1.0].iter().zip(&axes).map(|(value, axis)| value * axis[a] * axis[b]).sum::<f64>()
        };
        let matrix: Vec<Vec<f64>> = (0..3).map(|a| (0..3).map(|b| entry(a, b)).collect()).collect();
        let (found, values) = directions(&matrix, 2);
        assert!((values[0] - 9.0).abs() < 1e-9 && (values[1] - 4.0).abs() < 1e-9, "{values:?}");
        assert!((found[0][0].abs() - s).abs() < 1e-9 && (found[1][0].abs() - c).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn directions_of_a_matrix_without_any_are_zero_and_not_a_number() {
        let (found, values) = directions(&[vec![0.0; 2], vec![0.0; 2]], 2);
        assert!(found.iter().flatten().chain(&values).all(|value| *value == 0.0));
    }
}
