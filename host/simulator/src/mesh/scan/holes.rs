//! Parts of a surface that no point lies near: specks, which are left out, and holes, which were closed.

use super::smooth::{self, Smoothed};
use crate::mesh::Mesh;
use crate::mesh::facts::Sets;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

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

/// Says which holes were closed: triangles that hang together, farther from every point than the neighbors of a point are.
pub(super) fn said(mesh: &Mesh, points: &Smoothed) -> String {
    let tree = smooth::tree(&points.places);
    let corner = |index: u32| Vec3::from(mesh.vertices[index as usize]).as_dvec3();
    let is_bare = |triangle: &[u32; 3]| {
        let middle = triangle.map(corner).into_iter().sum::<DVec3>() / 3.0;
        let nearest = tree.nearest_neighbor_iter_with_distance_2(&middle.to_array()).next();
        nearest.is_none_or(|(_, squared)| squared > points.reach * points.reach)
    };
    let bare: Vec<bool> = mesh.triangles.par_iter().map(is_bare).collect();
    let bare = || mesh.triangles.iter().zip(&bare).filter(|(_, bare)| **bare).map(|(triangle, _)| triangle);
    let mut sets = Sets::new(mesh.vertices.len());
    for &[a, b, c] in bare() {
        sets.join(a, b);
        sets.join(b, c);
    }
    let (numbers, count) = sets.numbers();
    let mut areas = vec![0.0; count];
    for triangle in bare() {
        areas[numbers[triangle[0] as usize]] += area(mesh, triangle);
    }
    areas.retain(|area| *area > std::f64::consts::PI * points.reach * points.reach);
    areas.sort_by(f64::total_cmp);
    let whole: f64 = mesh.triangles.iter().map(|triangle| area(mesh, triangle)).sum();
    let share = |area: f64| format!("{:.1} % of the surface", 100.0 * area / whole);
    match areas.as_slice() {
        [] => format!("no hole is closed that is wider than {}", short(2.0 * points.reach)),
        [only] => format!("one hole is closed, of an area of {}, {}", short(*only), share(*only)),
        [.., largest] => {
            let all: f64 = areas.iter().sum();
            format!(
                "{} holes are closed, the largest of an area of {}, {}; all of them {}",
                areas.len(),
                short(*largest),
                share(*largest),
                share(all)
            )
        }
    }
}

fn area(mesh: &Mesh, triangle: &[u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|index| Vec3::from(mesh.vertices[index as usize]).as_dvec3());
    (b - a).cross(c - a).length() / 2.0
}

/// A number with about three significant digits.
pub(super) fn short(value: f64) -> String {
    crate::mesh::facts::short(value)
}
