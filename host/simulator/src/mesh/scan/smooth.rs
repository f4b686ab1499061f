//! Points moved onto their neighbors' planes, with normals.

use super::Cloud;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Points on the surface, as far as they tell.
pub(super) struct Smoothed {
    pub(super) places: Vec<DVec3>,
    /// Unit vectors that point outward.
    pub(super) normals: Vec<DVec3>,
    /// Area that each point stands for.
    pub(super) areas: Vec<f64>,
    /// Distance to the farthest of the neighbors that a plane is fitted to, as a median.
    pub(super) reach: f64,
    /// Standard deviation of the distances from planes, as a median.
    pub(super) noise: f64,
    /// Number of points that were left out.
    pub(super) outliers: usize,
}

/// Fewest neighbors that a plane is fitted to.
const FEWEST: usize = 32;

/// Most of them.
const MOST: usize = 400;

/// Distance to the farthest neighbor, in standard deviations of the noise: closer ones do not show where the plane is.
const REACH: f64 = 5.0;

/// Times that points are moved.
const ROUNDS: usize = 2;

pub(super) type Tree = RTree<GeomWithData<[f64; 3], usize>>;

pub(super) fn tree(places: &[DVec3]) -> Tree {
    RTree::bulk_load(
        places.iter().enumerate().map(|(index, place)| GeomWithData::new(place.to_array(), index)).collect(),
    )
}

/// Points that move onto planes fitted to their neighbors; none if all are at one place.
pub(super) fn smoothed(cloud: &Cloud) -> Option<Smoothed> {
    let Cloud { mut places, mut outward } = without_outliers(cloud);
    let outliers = cloud.places.len() - places.len();
    let all = tree(&places);
    let sample: Vec<usize> = (0..places.len()).step_by(places.len().div_ceil(2_000)).collect();
    let mut count = FEWEST;
    let noise = loop {
        let fits = sample.par_iter().filter_map(|&index| fit(index, &places, &outward, &all, count, SEEN));
        let (reach, noise): (Vec<f64>, Vec<f64>) =
            fits.map(|plane| (plane.reach, plane.noise)).collect::<Vec<_>>().into_iter().unzip();
        let (reach, noise) = (median(reach)?, median(noise)?);
        if reach >= REACH * noise || count >= MOST {
            break noise;
        }
        count = (count * 3 / 2).min(MOST);
    };
    let mut all = all;
    let mut fits = Vec::new();
    for round in 0..=ROUNDS {
        let side = if round == 0 { SEEN } else { SAME };
        let planes = (0..places.len()).into_par_iter().map(|index| fit(index, &places, &outward, &all, count, side));
        fits = planes.collect::<Vec<_>>();
        for (index, plane) in fits.iter().enumerate() {
            let Some(plane) = plane else { continue };
            outward[index] = plane.normal;
            // Directions alone, at first: those of the views are no normals.
            if round > 0 {
                places[index] = plane.foot;
            }
        }
        all = tree(&places);
    }
    let (mut kept, mut normals, mut areas, mut reach) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, plane) in fits.iter().enumerate() {
        let Some(plane) = plane else { continue };
        kept.push(places[index]);
        normals.push(outward[index]);
        areas.push(plane.area);
        reach.push(plane.reach);
    }
    let outliers = outliers + places.len() - kept.len();
    Some(Smoothed { places: kept, normals, areas, reach: median(reach)?, noise, outliers })
}

/// Least cosine between the outward directions of neighbors: of directions to viewpoints, of which neighboring views share
/// a surface only in part.
const SEEN: f64 = 0.6;

/// And of normals.
const SAME: f64 = 0.5;

struct Plane {
    foot: DVec3,
    normal: DVec3,
    area: f64,
    reach: f64,
    noise: f64,
}

/// The plane through the neighbors of a point, as far as they are on its side; none if there are too few.
fn fit(index: usize, places: &[DVec3], outward: &[DVec3], tree: &Tree, count: usize, side: f64) -> Option<Plane> {
    let (place, direction) = (places[index], outward[index]);
    let near = tree.nearest_neighbor_iter_with_distance_2(&place.to_array()).take(4 * count);
    let near: Vec<(usize, f64)> = near
        .map(|(found, squared)| (found.data, squared))
        .filter(|&(other, _)| outward[other].dot(direction) > side)
        .take(count)
        .collect();
    let (_, farthest) = *near.last()?;
    if near.len() < FEWEST / 2 || farthest <= 0.0 {
        return None;
    }
    let weights: Vec<f64> = near.iter().map(|&(_, squared)| 1.0 - squared / farthest + 1e-3).collect();
    let total: f64 = weights.iter().sum();
    let middle = near.iter().zip(&weights).map(|(&(other, _), weight)| places[other] * *weight).sum::<DVec3>() / total;
    let mut spread = DMat3::ZERO;
    for (&(other, _), weight) in near.iter().zip(&weights) {
        let away = places[other] - middle;
        spread += DMat3::from_cols(away * away.x, away * away.y, away * away.z) * (*weight / total);
    }
    let (variance, normal) = least_axis(spread);
    let normal = if normal.dot(direction) < 0.0 { -normal } else { normal };
    Some(Plane {
        foot: place + normal * (middle - place).dot(normal),
        normal,
        area: std::f64::consts::PI * farthest / near.len() as f64,
        reach: farthest.sqrt(),
        noise: variance.max(0.0).sqrt(),
    })
}

/// The least eigenvalue of a symmetric matrix and its axis (Smith, *Eigenvalues of a symmetric 3 × 3 matrix*, 1961).
fn least_axis(matrix: DMat3) -> (f64, DVec3) {
    let mean = (matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z) / 3.0;
    let rest = matrix - DMat3::from_diagonal(DVec3::splat(mean));
    let size =
        ((rest.x_axis.length_squared() + rest.y_axis.length_squared() + rest.z_axis.length_squared()) / 6.0).sqrt();
    if size <= 0.0 {
        return (mean, DVec3::Z);
    }
    let half = ((rest * (1.0 / size)).determinant() / 2.0).clamp(-1.0, 1.0);
    let least = mean + 2.0 * size * libm::cos(libm::acos(half) / 3.0 + std::f64::consts::TAU / 3.0);
    let rows = matrix - DMat3::from_diagonal(DVec3::splat(least));
    let crosses = [rows.x_axis.cross(rows.y_axis), rows.y_axis.cross(rows.z_axis), rows.z_axis.cross(rows.x_axis)];
    let longest = crosses.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    (least, longest.and_then(DVec3::try_normalize).unwrap_or(DVec3::Z))
}

/// The cloud without the points whose neighbors are far away: those that a sensor makes up at edges.
fn without_outliers(cloud: &Cloud) -> Cloud {
    let Cloud { places, outward } = cloud;
    let tree = tree(places);
    let distance = |place: &DVec3| {
        let near = tree.nearest_neighbor_iter_with_distance_2(&place.to_array()).take(FEWEST + 1);
        near.map(|(_, squared)| squared.sqrt()).sum::<f64>() / FEWEST as f64
    };
    let distances: Vec<f64> = places.par_iter().map(distance).collect();
    let typical = median(distances.clone()).unwrap_or(f64::INFINITY);
    let kept = || distances.iter().map(|&distance| distance <= FAR * typical);
    let of = |values: &[DVec3]| values.iter().zip(kept()).filter(|(_, kept)| *kept).map(|(value, _)| *value).collect();
    Cloud { places: of(places), outward: of(outward) }
}

/// Distance of an outlier from its neighbors, in those of the median point.
const FAR: f64 = 4.0;

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
