//! Placements that differ by a turn about the vertical only, since the object is symmetric.

use crate::mesh::Mesh;
use glam::{DMat3, DVec3};

/// Number of points that the surface is made of, and how many of them are compared.
const POINTS: usize = 60_000;
const COMPARED: usize = 1_000;

/// Largest distance, as a share of the longest side, between a surface and what it is turned onto, and the share of the
/// surface that may be farther away.
const TOLERANCE: f64 = 0.02;
const STRAY: f64 = 0.02;

/// Cells of the grid along the longest side.
const CELLS: f64 = 100.0;

/// Turns about the vertical that are tried.
const TURNS: u32 = 360;

/// The surface of a mesh, as points about the center of mass and as the cells of a grid that are near to it. Lengths are
/// shares of the longest side.
pub(super) struct Shape {
    points: Vec<DVec3>,
    low: DVec3,
    size: [usize; 3],
    near: Vec<bool>,
}

impl Shape {
    /// The surface of a mesh whose vertices are `at` these places about the center of mass.
    pub(super) fn new(mesh: &Mesh, at: &[DVec3], longest: f64) -> Self {
        let points = points(mesh, at, longest);
        let corner =
            |pick: fn(DVec3, DVec3) -> DVec3, start: f64| points.iter().copied().fold(DVec3::splat(start), pick);
        let margin = TOLERANCE + 2.0 / CELLS;
        let low = corner(DVec3::min, f64::INFINITY) - margin;
        let high = corner(DVec3::max, f64::NEG_INFINITY) + margin;
        let size = ((high - low) * CELLS).to_array().map(|side| side.max(0.0) as usize + 1);
        let mut near = vec![false; size.iter().product()];
        let reach = (TOLERANCE * CELLS) as i64;
        let ball: Vec<[i64; 3]> = (-reach..=reach)
            .flat_map(|x| (-reach..=reach).flat_map(move |y| (-reach..=reach).map(move |z| [x, y, z])))
            .filter(|[x, y, z]| x * x + y * y + z * z <= reach * reach)
            .collect();
        let mut shape = Self { points: Vec::new(), low, size, near: Vec::new() };
        for &point in &points {
            let cell = ((point - low) * CELLS).to_array().map(|along| along as i64);
            for step in &ball {
                if let Some(index) = shape.index([cell[0] + step[0], cell[1] + step[1], cell[2] + step[2]]) {
                    near[index] = true;
                }
            }
        }
        let step = (points.len() / COMPARED).max(1);
        shape.points = points.into_iter().step_by(step).collect();
        shape.near = near;
        shape
    }

    fn index(&self, [x, y, z]: [i64; 3]) -> Option<usize> {
        let [x, y, z] = [usize::try_from(x).ok()?, usize::try_from(y).ok()?, usize::try_from(z).ok()?];
        (x < self.size[0] && y < self.size[1] && z < self.size[2]).then(|| (x * self.size[1] + y) * self.size[2] + z)
    }

    fn is_near(&self, point: DVec3) -> bool {
        let cell = ((point - self.low) * CELLS).floor().to_array().map(|along| along as i64);
        self.index(cell).is_some_and(|index| self.near[index])
    }

    /// True if the object in one rotation, turned about the vertical by some angle, is the object in the other.
    pub(super) fn is_alike(&self, one: DMat3, other: DMat3) -> bool {
        let most = (STRAY * self.points.len() as f64) as usize;
        (0..TURNS).any(|turn| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS));
            let about = DMat3::from_cols(DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0), DVec3::Z);
            let onto = other.transpose() * about * one;
            self.points.iter().filter(|&&point| !self.is_near(onto * point)).take(most + 1).count() <= most
        })
    }
}

/// Points of the surface, each standing for the same area.
fn points(mesh: &Mesh, at: &[DVec3], longest: f64) -> Vec<DVec3> {
    let corners = |triangle: &[u32; 3]| triangle.map(|index| at[index as usize] / longest);
    let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
    let whole: f64 = mesh.triangles.iter().map(|triangle| area(corners(triangle))).sum();
    let (mut before, mut points) = (0.0, Vec::with_capacity(POINTS));
    for triangle in &mesh.triangles {
        let [a, b, c] = corners(triangle);
        before += area([a, b, c]);
        while ((points.len() as f64) + 0.5) * whole <= before * POINTS as f64 && points.len() < POINTS {
            // A sequence of low discrepancy in the unit square, folded into the triangle.
            let number = points.len() as f64;
            let [u, v] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step: f64| (number * step) % 1.0);
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    if points.is_empty() {
        // A surface without area: its corners.
        points.extend(mesh.triangles.iter().flat_map(corners));
    }
    points
}
