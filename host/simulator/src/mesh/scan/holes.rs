//! Parts of a surface that no point lies near: specks, which are left out, and holes, which were closed.

use super::near::Near;
use super::smooth::{self, Smoothed};
use super::{Points, Sensors};
use crate::mesh::Mesh;
use crate::mesh::facts::{Sets, short};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The largest part of the surface's area that a speck has.
const SPECK: f64 = 0.01;

/// The mesh without the parts whose area is below a hundredth of that of the largest one, and how many they were.
pub(super) fn without_specks(mesh: Mesh) -> (Mesh, usize) {
    let mut sets = Sets::new(mesh.vertices.len());
    for &[a, b, c] in &mesh.triangles {
        sets.join(a, b);
        sets.join(b, c);
    }
    let (numbers, count) = sets.numbers();
    let mut areas = vec![0.0; count];
    for triangle in &mesh.triangles {
        areas[numbers[triangle[0] as usize]] += area(&mesh, triangle);
    }
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let is_speck = |number: usize| areas[number] < SPECK * largest;
    let mut kept = Mesh::default();
    let mut moved = vec![u32::MAX; mesh.vertices.len()];
    for triangle in mesh.triangles.iter().filter(|triangle| !is_speck(numbers[triangle[0] as usize])) {
        kept.triangles.push(triangle.map(|index| {
            let new = &mut moved[index as usize];
            if *new == u32::MAX {
                *new = kept.vertices.len() as u32;
                kept.vertices.push(mesh.vertices[index as usize]);
            }
            *new
        }));
    }
    let specks = (0..count).filter(|&number| is_speck(number)).count();
    (kept, specks)
}

/// Holes that were closed: triangles that hang together, farther from every point than the neighbors of a point are.
pub(super) struct Holes {
    /// Says how large they are.
    pub(super) note: String,
    /// Share of the surface that they are, without the underside of what stood on a table.
    pub(super) guessed: f64,
}

impl Holes {
    pub(super) fn of(mesh: &Mesh, smoothed: &Smoothed, points: &Points, moved: [f64; 3]) -> Self {
        let near = Near::new(&smoothed.places);
        let reach = smoothed.reach;
        let corner = |index: u32| Vec3::from(mesh.vertices[index as usize]).as_dvec3();
        let is_bare = |triangle: &[u32; 3]| {
            let middle = triangle.map(corner).into_iter().sum::<DVec3>() / 3.0;
            !near.is_within(middle, reach * reach)
        };
        let bare: Vec<bool> = mesh.triangles.par_iter().map(is_bare).collect();
        let sorted = |wanted: bool| {
            mesh.triangles.iter().zip(&bare).filter(move |(_, bare)| **bare == wanted).map(|(triangle, _)| triangle)
        };
        let mut sets = Sets::new(mesh.vertices.len());
        for &[a, b, c] in sorted(true) {
            sets.join(a, b);
            sets.join(b, c);
        }
        let (numbers, count) = sets.numbers();
        let mut areas = vec![0.0; count];
        for triangle in sorted(true) {
            areas[numbers[triangle[0] as usize]] += area(mesh, triangle);
        }
        let mut holes: Vec<(f64, usize)> = areas.into_iter().zip(0..).collect();
        holes.retain(|(area, _)| *area > std::f64::consts::PI * reach * reach);
        holes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let whole: f64 = mesh.triangles.iter().map(|triangle| area(mesh, triangle)).sum();
        let stand = Stand::new(mesh, smoothed, points, moved);
        let is_underside = |(_, number): &(f64, usize)| {
            let within: BTreeSet<u32> =
                sorted(true).flatten().copied().filter(|&at| numbers[at as usize] == *number).collect();
            let rim: BTreeSet<u32> = sorted(false).flatten().copied().filter(|at| within.contains(at)).collect();
            let places = |set: BTreeSet<u32>| set.into_iter().map(corner).collect::<Vec<_>>();
            stand.is_on(&places(rim), &places(within))
        };
        let underside = holes.iter().rev().take(2).find(|hole| is_underside(hole)).copied();
        let all = holes.iter().fold(0.0, |all, (area, _)| all + area);
        let share = |area: f64| format!("{:.1} % of the surface", 100.0 * area / whole);
        let mut note = match holes.as_slice() {
            [] => format!("no hole is closed that is wider than {}", short(2.0 * reach)),
            [(only, _)] => format!("one hole is closed, of an area of {}, {}", short(*only), share(*only)),
            [.., (largest, _)] => format!(
                "{} holes are closed, the largest of an area of {}, {}; all of them {}",
                holes.len(),
                short(*largest),
                share(*largest),
                share(all)
            ),
        };
        match (underside, holes.len()) {
            (None, _) => {}
            (Some(_), 1) => note += ", the underside",
            (Some((area, _)), _) => note += &format!(", {:.1} % the underside", 100.0 * area / whole),
        }
        Self { note, guessed: (all - underside.map_or(0.0, |(area, _)| area)).max(0.0) / whole }
    }
}

/// Evidence that an object stood on a table.
struct Stand<'a> {
    places: &'a [DVec3],
    /// The longest side of the object's box.
    size: f64,
    /// The plane of the table that was seen.
    table: Option<(DVec3, f64)>,
    /// Different places of sensors.
    eyes: Vec<DVec3>,
}

impl<'a> Stand<'a> {
    /// Deviation from a plane that is still flat, in the size of the object.
    const FLAT: f64 = 0.03;

    fn new(mesh: &Mesh, smoothed: &'a Smoothed, points: &Points, moved: [f64; 3]) -> Self {
        let [low, high] = mesh.bounds();
        let moved = DVec3::from(moved);
        let eyes: BTreeSet<[u64; 3]> = match points.sensors {
            Sensors::Default => BTreeSet::new(),
            _ => points.measured.iter().filter_map(|point| point.viewpoint).map(|eye| eye.map(f64::to_bits)).collect(),
        };
        Self {
            places: &smoothed.places,
            size: f64::from((high - low).max_element()),
            table: points.table.map(|(up, height)| (up, height - moved.dot(up))),
            eyes: eyes.into_iter().map(|eye| DVec3::from(eye.map(f64::from_bits)) - moved).collect(),
        }
    }

    /// True if a hole with this rim is where the object stood: it is flat, all points are above it, and either a table was
    /// seen there, or sensors all around and above did not see it, or, without sensors, it is below the object.
    fn is_on(&self, rim: &[DVec3], within: &[DVec3]) -> bool {
        let tolerance = Self::FLAT * self.size;
        let all: Vec<(f64, u32)> = (0..rim.len() as u32).map(|index| (0.0, index)).collect();
        let (middle, variance, normal) = smooth::plane(&all, 1.0, rim);
        let heights = self.places.iter().map(|place| (*place - middle).dot(normal));
        let up = if heights.sum::<f64>() < 0.0 { -normal } else { normal };
        let height = |place: &DVec3| (*place - middle).dot(up);
        let below = self.places.iter().filter(|place| height(place) < -tolerance).count();
        let is_flat =
            variance.max(0.0).sqrt() < tolerance && within.iter().all(|place| height(place) > -4.0 * tolerance);
        if !is_flat || 100 * below > self.places.len() {
            return false;
        }
        if let Some((table, own)) = self.table {
            return table.dot(up) > 0.95 && (middle.dot(table) - own).abs() < 4.0 * tolerance;
        }
        if self.eyes.is_empty() {
            return up.z > 0.95;
        }
        let (right, ahead) = up.any_orthonormal_pair();
        let angle = |eye: &DVec3| libm::atan2((*eye - middle).dot(ahead), (*eye - middle).dot(right));
        let mut angles: Vec<f64> = self.eyes.iter().map(angle).collect();
        angles.sort_by(f64::total_cmp);
        let gaps = angles
            .iter()
            .zip(angles.iter().skip(1).copied().chain(angles.first().map(|first| first + std::f64::consts::TAU)));
        gaps.map(|(one, next)| next - one).fold(0.0, f64::max) < std::f64::consts::PI
            && self.eyes.iter().all(|eye| height(eye) > 0.0)
    }
}

fn area(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|index| Vec3::from(mesh.vertices[index as usize]).as_dvec3());
    (b - a).cross(c - a).length() / 2.0
}
