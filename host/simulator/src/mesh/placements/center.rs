//! The center of mass of a mesh, and whether it is that of its volume or of its hull.

use super::Center;
use crate::mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// The smallest share of the hull's volume for which a mesh is taken as the surface of a solid: less is a sheet, or parts
/// that cancel each other.
const LEAST_SHARE: f64 = 1e-4;

/// The volume that triangles enclose, and its center of mass; negative if they face inward.
pub(super) fn of_volume(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> (f64, DVec3) {
    let add = |(volume, moment): (f64, DVec3), [a, b, c]: [DVec3; 3]| {
        let six = a.dot(b.cross(c));
        (volume + six / 6.0, moment + (a + b + c) * (six / 24.0))
    };
    let (volume, moment) = triangles.into_iter().fold((0.0, DVec3::ZERO), add);
    (volume, if volume == 0.0 { DVec3::ZERO } else { moment / volume })
}

/// The center of mass of a mesh whose vertices are `at` these places: its volume's if it is closed and its volume is at most
/// the hull's, otherwise the hull's.
pub(super) fn center(mesh: &Mesh, at: &[DVec3], hull: &[[DVec3; 3]]) -> (DVec3, Center) {
    let (whole, of_hull) = of_volume(hull.iter().copied());
    if !is_closed(mesh) {
        return (of_hull, Center::OfHullSinceOpen);
    }
    let (volume, center) = of_volume(mesh.triangles.iter().map(|triangle| triangle.map(|index| at[index as usize])));
    let share = volume.abs() / whole;
    let is_within = hull.iter().all(|&[a, b, c]| (b - a).cross(c - a).dot(center - a) < 0.0);
    match (share > 1.0 + 1e-3, share >= LEAST_SHARE && is_within) {
        (true, _) => (of_hull, Center::OfHullSinceTooLarge),
        (false, false) => (of_hull, Center::OfHullSinceHollow),
        (false, true) => (center, Center::OfVolume),
    }
}

/// True if as many triangles run along each edge in one direction as in the other: then a volume is well defined.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
        }
    }
    edges.values().all(|&sum| sum == 0)
}
