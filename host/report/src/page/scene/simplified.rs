//! A mesh as a page holds it: its triangles, few enough and small enough.

use glam::{DVec3, Vec3};
use palpate::mesh::Mesh;
use std::collections::HashMap;

/// Largest number of triangles on a page.
pub(crate) const MOST_TRIANGLES: usize = 120_000;

/// A mesh with at most [`MOST_TRIANGLES`] triangles, its corners on a grid of 2¹⁶ steps along the longest side.
#[derive(Clone, Debug)]
pub(crate) struct SimplifiedMesh {
    /// Multiples of `step` from `origin`, in units.
    pub(crate) points: Vec<[u16; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) step: f64,
    pub(crate) origin: DVec3,
}

impl SimplifiedMesh {
    /// The mesh, scaled so that its longest side is `length` and its box is centered on the origin, with at most
    /// [`MOST_TRIANGLES`] triangles.
    pub(crate) fn new(mesh: &Mesh, length: f64) -> Self {
        Self::with_at_most(mesh, length, MOST_TRIANGLES)
    }

    /// The mesh with at most this many triangles: in a larger mesh, the vertices in each cell of a grid become one, on the
    /// finest grid that is coarse enough.
    pub(crate) fn with_at_most(mesh: &Mesh, length: f64, most: usize) -> Self {
        let [low, high] = mesh.bounds();
        let longest = f64::from((high - low).max_element());
        let origin = -(high - low).as_dvec3() / 2.0 * (length / longest);
        let step = length / f64::from(u16::MAX);
        let place = |point: [f32; 3]| {
            let steps = (Vec3::from(point) - low).as_dvec3() / longest * f64::from(u16::MAX);
            // Between 0 and 65535 by construction.
            steps.to_array().map(|x| x.round() as u16)
        };
        let Mesh { vertices, triangles } = mesh.welded();
        let mut shown = Self { points: vertices.into_iter().map(place).collect(), triangles, step, origin };
        if shown.triangles.len() > most {
            let full = shown;
            let mut cells = 800.0;
            loop {
                shown = full.clustered(cells);
                if shown.triangles.len() <= most || cells < 2.0 {
                    break;
                }
                // The number of triangles grows about as the square of the number of cells.
                let ratio = most as f64 / shown.triangles.len() as f64;
                cells *= ratio.sqrt().clamp(0.5, 0.95);
            }
        }
        shown
    }

    fn clustered(&self, cells: f64) -> Self {
        let side = (65536.0 / cells).max(1.0) as u64;
        let mut cluster = HashMap::new();
        let mut sums: Vec<([u64; 3], u64)> = Vec::new();
        let of_point: Vec<u32> = self
            .points
            .iter()
            .map(|point| {
                let cell = point.map(|x| u64::from(x) / side);
                let index = *cluster.entry(cell).or_insert(sums.len());
                if index == sums.len() {
                    sums.push(([0; 3], 0));
                }
                let (sum, count) = &mut sums[index];
                *sum = std::array::from_fn(|i| sum[i] + u64::from(point[i]));
                *count += 1;
                index as u32
            })
            .collect();
        let mean = |(sum, count): ([u64; 3], u64)| sum.map(|x| (x / count) as u16);
        let mut triangles: Vec<[u32; 3]> = self
            .triangles
            .iter()
            .map(|triangle| least_first(triangle.map(|i| of_point[i as usize])))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        triangles.sort_unstable();
        triangles.dedup();
        Self { points: sums.into_iter().map(mean).collect(), triangles, ..*self }
    }

    /// True if indices need four bytes instead of two.
    pub(crate) fn is_wide(&self) -> bool {
        self.points.len() > usize::from(u16::MAX)
    }

    pub(crate) fn position_bytes(&self) -> Vec<u8> {
        self.points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
    }

    pub(crate) fn index_bytes(&self) -> Vec<u8> {
        let bytes = if self.is_wide() { 4 } else { 2 };
        self.triangles.iter().flatten().flat_map(|i| i.to_le_bytes().into_iter().take(bytes)).collect()
    }
}

fn least_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    }
}
