//! Expected evidence of touches of each object, and the distance of evidence from it.

use super::Pools;
use nalgebra::{DMatrix, DVector};
use palpate_shared::format::MisfitTest;
use rayon::prelude::*;

/// The touches at which the spread of other shapes is weighed against that of touches.
const AT: f64 = 40.0;
/// Share of touches' own covariance that is added to that of shapes, for the directions that few shapes show; it
/// takes the shapes' place where there are none.
const OWN: f64 = 0.003;
const WITHOUT_SHAPES: f64 = 0.03;
/// Distance of an object behind the leader of a shape's touches, in nats per touch, at which the shape counts e times
/// less.
const NEAR: f64 = 0.05;

/// Means and covariances of the margins of one touch, in nats.
pub(super) struct Moments {
    /// Mean and covariance of each known object. If it has several instances, or robots differ, their means are spread; the
    /// covariance has this spread in the mean of [`AT`] touches, so that no instance is taken for a stranger.
    of: Vec<(DVector<f64>, DMatrix<f64>)>,
    /// Mean of each of many other shapes.
    shapes: Vec<DVector<f64>>,
    known: usize,
    objects: usize,
}

/// Expected evidence of touches of one object, in nats: see [`super`].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Misfit {
    /// Whose evidence against the object counts.
    pub(super) rivals: Vec<usize>,
    /// Mean evidence per touch.
    pub(super) mean: DVector<f64>,
    pub(super) slope: DVector<f64>,
    /// Lower triangular.
    pub(super) weights: DMatrix<f64>,
    pub(super) constant: f64,
}

impl Moments {
    /// A misfit from rows of margins in units, for each known object. `shapes` are mean rows.
    pub(super) fn new(supplies: &[Pools], shapes: &[Vec<f64>], known: usize, objects: usize, unit: f64) -> Self {
        let of_rows = |rows: &Vec<i32>| {
            let count = (rows.len() / objects).max(1) as f64;
            let mut mean = DVector::zeros(objects);
            for row in rows.chunks_exact(objects) {
                mean.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += f64::from(margin) * unit / count);
            }
            let mut covariance = DMatrix::zeros(objects, objects);
            for row in rows.chunks_exact(objects) {
                let away = DVector::from_iterator(objects, row.iter().map(|&margin| f64::from(margin) * unit)) - &mean;
                covariance.ger(1.0 / count, &away, &away, 1.0);
            }
            (mean, covariance)
        };
        let of = supplies.par_iter().map(|supply| {
            if supply.is_short {
                return of_short(&supply.pools, objects, unit);
            }
            let pools: Vec<(DVector<f64>, DMatrix<f64>)> =
                supply.pools.iter().filter(|rows| !rows.is_empty()).map(of_rows).collect();
            let share = 1.0 / pools.len().max(1) as f64;
            let (mut mean, mut covariance) = (DVector::zeros(objects), DMatrix::zeros(objects, objects));
            for (own_mean, own_covariance) in &pools {
                mean += own_mean * share;
                covariance += own_covariance * share;
            }
            for (own_mean, _) in pools.iter().filter(|_| pools.len() > 1) {
                let away = own_mean - &mean;
                covariance.ger(AT * share, &away, &away, 1.0);
            }
            (mean, covariance)
        });
        let shapes = shapes.iter().map(|mean| DVector::from_iterator(objects, mean.iter().map(|margin| margin * unit)));
        Self { of: of.collect(), shapes: shapes.collect(), known, objects }
    }

    /// The misfit of an object; none if its touches are too few or too much alike to have a covariance.
    fn misfit(&self, leader: usize) -> Option<Misfit> {
        let (mean, covariance) = self.of.get(leader)?;
        let rivals = self.rivals(leader);
        let count = rivals.len();
        let against = |row: &DVector<f64>| DVector::from_iterator(count, rivals.iter().map(|&r| row[r] - row[leader]));
        let own = covariance[(leader, leader)];
        let mut spread = DMatrix::from_fn(count, count, |a, b| {
            let (a, b) = (rivals[a], rivals[b]);
            covariance[(a, b)] - covariance[(a, leader)] - covariance[(leader, b)] + own
        });
        // Columns that never differ have none.
        let floor = 1e-9 * spread.trace() / count as f64 + 1e-12;
        (0..count).for_each(|index| spread[(index, index)] += floor);
        let expected = against(mean);

        let named = |row: &DVector<f64>| (0..self.known).map(|object| row[object]).fold(f64::NEG_INFINITY, f64::max);
        let weigh = |row: &DVector<f64>| ((row[leader] - named(row)) / NEAR).exp();
        let total: f64 = self.shapes.iter().map(weigh).sum();
        let (mut shift, mut between) = (DVector::zeros(count), &spread * WITHOUT_SHAPES);
        if total > 1e-12 {
            let shapes: Vec<_> = self.shapes.iter().map(|row| (weigh(row) / total, against(row))).collect();
            shift = shapes.iter().fold(shift, |sum, (weight, row)| sum + row * *weight);
            between = &spread * OWN;
            for (weight, row) in &shapes {
                let away = row - &shift;
                between.ger(*weight, &away, &away, 1.0);
            }
            shift -= &expected;
        }
        let precise = spread.clone().cholesky()?.inverse();
        let wide = (&spread + between * AT).cholesky()?.inverse();
        let slope = &wide * &shift;
        let constant = shift.dot(&slope) / 2.0;
        let form = (precise - wide) / 2.0;
        // Lᵀ·L of the form with its rows and columns in reverse is a lower triangle again once it is reversed.
        let reversed = DMatrix::from_fn(count, count, |a, b| {
            let (a, b) = (count - 1 - a, count - 1 - b);
            (form[(a, b)] + form[(b, a)]) / 2.0
        });
        let factor = reversed.cholesky()?.l();
        let weights =
            DMatrix::from_fn(count, count, |a, b| if b > a { 0.0 } else { factor[(count - 1 - b, count - 1 - a)] });
        Some(Misfit { rivals, mean: expected, slope, weights, constant })
    }

    /// The rivals of an object: all others, or those whose evidence is nearest to its own; the background always.
    fn rivals(&self, leader: usize) -> Vec<usize> {
        let mut rivals: Vec<usize> = (0..self.objects).filter(|&other| other != leader).collect();
        if rivals.len() > MisfitTest::MOST_RIVALS {
            let mean = &self.of[leader].0;
            let ahead = |&rival: &usize| if rival >= self.known { f64::INFINITY } else { mean[rival] };
            rivals.sort_by(|a, b| ahead(b).total_cmp(&ahead(a)));
            rivals.truncate(MisfitTest::MOST_RIVALS);
            rivals.sort_unstable();
        }
        rivals
    }
}

/// Mean and covariance of one row, from short sequences: what differs between these, less what their length makes of the
/// spread within them (analysis of variance), is in the covariance as it is in the mean of [`AT`] rows.
fn of_short(pools: &[Vec<i32>], objects: usize, unit: f64) -> (DVector<f64>, DMatrix<f64>) {
    let row = |row: &[i32]| DVector::from_iterator(objects, row.iter().map(|&margin| f64::from(margin) * unit));
    let pools: Vec<Vec<DVector<f64>>> = pools
        .iter()
        .map(|rows| rows.chunks_exact(objects).map(row).collect::<Vec<_>>())
        .filter(|rows| !rows.is_empty())
        .collect();
    let sum = |rows: &Vec<DVector<f64>>| rows.iter().fold(DVector::zeros(objects), |sum: DVector<f64>, row| sum + row);
    let means: Vec<DVector<f64>> = pools.iter().map(|rows| sum(rows) / rows.len() as f64).collect();
    let count = pools.len().max(1) as f64;
    let mean = sum(&means) / count;
    let mut within = DMatrix::zeros(objects, objects);
    let mut freedom = 0.0;
    for (rows, own) in pools.iter().zip(&means) {
        rows.iter().map(|row| row - own).for_each(|away| within.ger(1.0, &away, &away, 1.0));
        freedom += rows.len() as f64 - 1.0;
    }
    let mut between = DMatrix::zeros(objects, objects);
    means.iter().map(|own| own - &mean).for_each(|away| between.ger(1.0 / count, &away, &away, 1.0));
    if freedom < 1.0 {
        return (mean, between);
    }
    within /= freedom;
    between -= &within * (pools.iter().map(|rows| 1.0 / rows.len() as f64).sum::<f64>() / count);
    // What is left below 0 is chance.
    let mut parts = between.symmetric_eigen();
    parts.eigenvalues.iter_mut().for_each(|value| *value = value.max(0.0));
    (mean, within + parts.recompose() * AT)
}

/// The misfit of every known object; none if one has none.
pub(super) fn misfits(moments: &Moments) -> Option<Vec<Misfit>> {
    let misfits: Option<Vec<Misfit>> = (0..moments.known).map(|object| moments.misfit(object)).collect();
    misfits.filter(|misfits| misfits.iter().all(|misfit| !misfit.rivals.is_empty()))
}
