//! Points moved onto their neighbors' planes, with normals.

use super::Cloud;
use super::near::{Near, Neighbor, farthest};
use glam::{DMat3, DVec3};

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
}

/// Fewest neighbors that a plane is fitted to.
pub(super) const FEWEST: usize = 32;

/// Most of them.
const MOST: usize = 400;

/// Distance to the farthest neighbor, in standard deviations of the noise: closer ones do not show where the plane is.
const REACH: f64 = 5.0;

/// Neighbors that are looked at for one on the same side.
const AMONG: usize = 4;

/// Times that points are moved.
const ROUNDS: usize = 2;

/// Points that move onto planes fitted to their neighbors; none if all are at one place.
pub(super) fn smoothed(cloud: Cloud) -> Option<Smoothed> {
    // In an order in which neighbors are close to each other in memory.
    let order = Near::new(&cloud.places).order().to_vec();
    let ordered = |values: &[DVec3]| order.iter().map(|&number| values[number as usize]).collect::<Vec<_>>();
    let [mut places, mut outward] = [ordered(&cloud.places), ordered(&cloud.outward)];
    let mut near = Near::new(&places);
    let step = places.len().div_ceil(2_000).max(1);
    let mut count = FEWEST;
    let noise = loop {
        let is_kept = |number: usize, other: usize| outward[other].dot(outward[number]) > SEEN;
        let fits = near.some(
            |number| (order[number] as usize).is_multiple_of(step),
            count,
            AMONG,
            is_kept,
            |number, near| fit(number, near, &places, &outward),
        );
        let (reach, noise): (Vec<f64>, Vec<f64>) =
            fits.into_iter().flatten().map(|plane| (plane.reach, plane.noise)).unzip();
        let (reach, noise) = (median(reach)?, median(noise)?);
        if reach >= REACH * noise || count >= MOST {
            break noise;
        }
        count = (count * 3 / 2).min(MOST);
    };
    let mut fits = Vec::new();
    for round in 0..=ROUNDS {
        let side = if round == 0 { SEEN } else { SAME };
        let is_kept = |number: usize, other: usize| outward[other].dot(outward[number]) > side;
        fits = near.each(count, AMONG, is_kept, |number, near| fit(number, near, &places, &outward));
        for (index, plane) in fits.iter().enumerate() {
            let Some(plane) = plane else { continue };
            outward[index] = plane.normal;
            // Directions alone, at first: those of the views are no normals.
            if round > 0 {
                places[index] = plane.foot;
            }
        }
        if (1..ROUNDS).contains(&round) {
            near = Near::new(&places);
        }
    }
    let (mut kept, mut normals, mut areas, mut reach) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut indices: Vec<usize> = (0..places.len()).collect();
    indices.sort_unstable_by_key(|&index| order[index]);
    for index in indices {
        let Some(plane) = &fits[index] else { continue };
        kept.push(places[index]);
        normals.push(outward[index]);
        areas.push(plane.area);
        reach.push(plane.reach);
    }
    Some(Smoothed { places: kept, normals, areas, reach: median(reach)?, noise })
}

/// Least cosine between the outward directions of neighbors, for directions to viewpoints: neighboring views share a
/// surface only in part.
const SEEN: f64 = 0.6;

/// Least cosine between the normals of neighbors.
const SAME: f64 = 0.5;

struct Plane {
    foot: DVec3,
    normal: DVec3,
    area: f64,
    reach: f64,
    noise: f64,
}

/// The plane through the neighbors of a point on its side; none if there are too few.
fn fit(index: usize, near: &[Neighbor], places: &[DVec3], outward: &[DVec3]) -> Option<Plane> {
    let (place, direction) = (places[index], outward[index]);
    let farthest = farthest(near);
    if near.len() < FEWEST / 2 || farthest <= 0.0 {
        return None;
    }
    let (middle, variance, normal) = plane(near, farthest, places);
    let normal = if normal.dot(direction) < 0.0 { -normal } else { normal };
    Some(Plane {
        foot: place + normal * (middle - place).dot(normal),
        normal,
        area: std::f64::consts::PI * farthest / near.len() as f64,
        reach: farthest.sqrt(),
        noise: variance.max(0.0).sqrt(),
    })
}

/// Number of neighbors that planes are fitted to, whichever side they are on.
pub(super) fn neighbors_of_planes(near: &Near, places: &[DVec3]) -> usize {
    let step = places.len().div_ceil(2_000).max(1);
    let mut count = FEWEST;
    loop {
        let fits = near.some(
            |number| number % step == 0,
            count,
            1,
            |_, _| true,
            |_, near| {
                let farthest = farthest(near);
                let (_, variance, _) = plane(near, farthest, places);
                (farthest.sqrt(), variance.max(0.0).sqrt())
            },
        );
        let (reach, noise): (Vec<f64>, Vec<f64>) = fits.into_iter().unzip();
        if median(reach) >= median(noise).map(|noise| REACH * noise) || count >= MOST {
            return count;
        }
        count = (count * 3 / 2).min(MOST);
    }
}

/// The plane that fits points best, with those that are farther counting less: a point on it, the variance of the others'
/// distances, and its normal, which may point to either side.
pub(super) fn plane(near: &[Neighbor], farthest: f64, places: &[DVec3]) -> (DVec3, f64, DVec3) {
    let (middle, spread) = spread(near, farthest, places);
    let (variance, normal) = least_axis(spread);
    (middle, variance, normal)
}

/// The mean of points and the covariance of their coordinates, with those that are farther counting less.
pub(super) fn spread(near: &[Neighbor], farthest: f64, places: &[DVec3]) -> (DVec3, DMat3) {
    let weighted = || near.iter().map(|&(squared, other)| (1.0 - squared / farthest + 1e-3, places[other as usize]));
    let total: f64 = weighted().map(|(weight, _)| weight).sum();
    let middle = weighted().map(|(weight, place)| place * weight).sum::<DVec3>() / total;
    let mut spread = DMat3::ZERO;
    for (weight, place) in weighted() {
        let away = place - middle;
        spread += DMat3::from_cols(away * away.x, away * away.y, away * away.z) * (weight / total);
    }
    (middle, spread)
}

/// The least eigenvalue of a symmetric matrix and its axis (Smith, *Eigenvalues of a symmetric 3 × 3 matrix*, 1961).
pub(super) fn least_axis(matrix: DMat3) -> (f64, DVec3) {
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

/// Flags of points to keep: not those whose neighbors are far away, which a sensor makes up at edges.
pub(super) fn near_others(places: &[DVec3]) -> Vec<bool> {
    let near = Near::new(places);
    let distance = |_, near: &[Neighbor]| near.iter().map(|(squared, _)| squared.sqrt()).sum::<f64>() / FEWEST as f64;
    let distances = near.each(FEWEST + 1, 1, |_, _| true, distance);
    let typical = median(distances.clone()).unwrap_or(f64::INFINITY);
    distances.into_iter().map(|distance| distance <= FAR * typical).collect()
}

/// Distance of an outlier from its neighbors, in those of the median point.
const FAR: f64 = 4.0;

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
