//! The table that an object stands on in depth images.

use super::Points;
use super::near::Neighbor;
use super::smooth::{median, plane};
use crate::random::{self, Purpose};
use glam::DVec3;
use rand::RngExt;

/// Points that planes are compared on.
const SAMPLE: usize = 4_000;

/// Planes that are tried.
const TRIES: usize = 500;

/// Least share of points in the plane of a table.
const SHARE: f64 = 0.15;

/// Directions along the plane in which it must extend beyond everything else.
const DIRECTIONS: usize = 16;

/// Leaves out a plane of points that extends beyond all points on the side of the sensors, and everything below it.
pub(super) fn leave_out(points: &mut Points) {
    let step = points.measured.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<(DVec3, DVec3)> = points
        .measured
        .iter()
        .step_by(step)
        .filter_map(|point| Some((DVec3::from(point.place), DVec3::from(point.viewpoint?))))
        .collect();
    let Some((up, height, noise)) = table(&sample) else { return };
    let top = height + 3.0 * noise;
    let before = points.measured.len();
    points.measured.retain(|point| DVec3::from(point.place).dot(up) > top);
    points.table = Some((up, height));
    points.notes.push(format!(
        "the widest plane, which extends beyond all else, is removed as a table: {} of {before} points on or below it are left \
         out. Masks choose what stays",
        before - points.measured.len()
    ));
}

/// The plane of a table: its normal toward the sensors, its height along it, and the noise of its points. `sample` holds points
/// and their sensors.
fn table(sample: &[(DVec3, DVec3)]) -> Option<(DVec3, f64, f64)> {
    let distance = median(sample.iter().map(|(place, eye)| place.distance(*eye)).collect())?;
    let places: Vec<DVec3> = sample.iter().map(|(place, _)| *place).collect();
    let within = |up: DVec3, height: f64, tolerance: f64| {
        places.iter().filter(move |place| (place.dot(up) - height).abs() < tolerance)
    };
    let mut rng = random::generator(1, Purpose::View, "table", 0);
    let mut tolerance = 0.006 * distance;
    let (mut best, mut most) = (None, 0);
    for _ in 0..TRIES {
        let [a, b, c] = std::array::from_fn(|_| places[rng.random_range(0..places.len())]);
        let Some(up) = (b - a).cross(c - a).try_normalize() else { continue };
        let count = within(up, a.dot(up), tolerance).count();
        if count > most {
            (best, most) = (Some((up, a.dot(up))), count);
        }
    }
    let (mut up, mut height) = best?;
    let mut noise = tolerance;
    for _ in 0..4 {
        let flat: Vec<DVec3> = within(up, height, tolerance).copied().collect();
        let all: Vec<Neighbor> = (0..flat.len() as u32).map(|index| (0.0, index)).collect();
        let (middle, variance, normal) = plane(&all, 1.0, &flat);
        noise = variance.max(0.0).sqrt();
        (up, height, tolerance) = (normal, middle.dot(normal), (3.0 * noise).max(1e-4 * distance));
    }
    if sample.iter().map(|(_, eye)| eye.dot(up) - height).sum::<f64>() < 0.0 {
        (up, height) = (-up, -height);
    }
    let above: Vec<DVec3> = places.iter().filter(|place| place.dot(up) > height + tolerance).copied().collect();
    let flat: Vec<DVec3> = within(up, height, tolerance).copied().collect();
    let share = |count: usize| count as f64 / places.len() as f64;
    if share(flat.len()) < SHARE || share(above.len()) < 0.005 {
        return None;
    }
    let (right, ahead) = up.any_orthonormal_pair();
    let directions = (0..DIRECTIONS).map(|number| {
        let angle = std::f64::consts::TAU * number as f64 / DIRECTIONS as f64;
        right * libm::cos(angle) + ahead * libm::sin(angle)
    });
    let reach = |some: &[DVec3], direction: DVec3| {
        let mut along: Vec<f64> = some.iter().map(|place| place.dot(direction)).collect();
        along.sort_by(f64::total_cmp);
        along.get(along.len() * 98 / 100).copied().unwrap_or(f64::NEG_INFINITY)
    };
    let edges: Vec<(DVec3, f64)> = directions.map(|direction| (direction, reach(&flat, direction))).collect();
    if edges.iter().any(|&(direction, edge)| reach(&above, direction) >= edge) {
        return None;
    }
    // Of a box that is seen from above, the sides are below the top and within its edges.
    let size =
        edges.iter().map(|(direction, edge)| edge - flat.iter().sum::<DVec3>().dot(*direction) / flat.len() as f64);
    let size = size.fold(0.0, f64::max);
    let is_under = |place: &&DVec3| {
        place.dot(up) < height - tolerance
            && edges.iter().all(|(direction, edge)| place.dot(*direction) < edge + 0.1 * size)
    };
    (share(places.iter().filter(is_under).count()) < 0.05).then_some((up, height, noise))
}
