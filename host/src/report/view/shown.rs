//! A mesh as the page shows it: what is to be known of it, and its triangles, few enough and small enough.

use crate::mesh::Mesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// How many triangles a page holds at most.
pub(super) const MOST_TRIANGLES: usize = 120_000;

/// What a user wants to know of a mesh.
pub(super) struct Facts {
    pub(super) triangles: usize,
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    /// Edges that only one triangle has.
    open: usize,
    /// Edges that two triangles have in the same direction: one of the two faces the wrong way.
    contrary: usize,
    /// Edges that three triangles or more have.
    branching: usize,
    /// The volume that the triangles enclose if they are closed; negative if they are inside out.
    volume: f64,
}

impl Facts {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let (points, triangles) = welded(mesh);
        let [low, high] = bounds(mesh);
        let mut edges: Vec<(u32, u32, bool)> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b), a < b))
            .collect();
        edges.sort_unstable();
        let (mut open, mut contrary, mut branching) = (0, 0, 0);
        for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match uses {
                [_] => open += 1,
                [one, other] if one.2 == other.2 => contrary += 1,
                [_, _] => {}
                _ => branching += 1,
            }
        }
        let at = |i: u32| (points[i as usize] - low).as_dvec3();
        let volume = triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum();
        Self { triangles: mesh.triangles.len(), low, high, open, contrary, branching, volume }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.open == 0 && self.branching == 0
    }

    pub(super) fn is_right_side_out(&self) -> bool {
        self.is_closed() && self.contrary == 0 && self.volume > 0.0
    }

    /// Whether the mesh is closed, in words.
    pub(super) fn closed(&self) -> String {
        match (self.open, self.branching) {
            (0, 0) => "yes".into(),
            (0, branching) => format!("yes, but more than two triangles meet at {branching} edges"),
            (open, 0) => format!("no: {open} open edges"),
            (open, branching) => format!("no: {open} open edges, and more than two triangles at {branching}"),
        }
    }

    /// Whether the mesh is right side out, in words.
    pub(super) fn side(&self) -> String {
        if self.contrary > 0 {
            format!("no: at {} edges the two triangles face opposite sides", self.contrary)
        } else if !self.is_closed() {
            "cannot be told of an open surface: look for orange".into()
        } else if self.volume > 0.0 {
            "yes".into()
        } else {
            "no: inside out".into()
        }
    }
}

/// The triangles that are shown.
pub(super) struct Shown {
    /// Multiples of `step` from `origin`, in units.
    pub(super) points: Vec<[u16; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) step: f64,
    pub(super) origin: DVec3,
}

impl Shown {
    /// The mesh, scaled so that its longest side is `length` and its box is centered on the origin, with at most
    /// [`MOST_TRIANGLES`] triangles: in a larger mesh, the vertices in each cell of a grid become one, on the finest grid
    /// that is coarse enough.
    pub(super) fn of(mesh: &Mesh, length: f64) -> Self {
        let [low, high] = bounds(mesh);
        let longest = f64::from((high - low).max_element());
        let origin = -(high - low).as_dvec3() / 2.0 * (length / longest);
        let step = length / f64::from(u16::MAX);
        let place = |point: Vec3| {
            let steps = (point - low).as_dvec3() / longest * f64::from(u16::MAX);
            // Between 0 and 65535 by construction.
            steps.to_array().map(|x| x.round() as u16)
        };
        let (points, triangles) = welded(mesh);
        let mut shown = Self { points: points.into_iter().map(place).collect(), triangles, step, origin };
        if shown.triangles.len() > MOST_TRIANGLES {
            let full = shown;
            let mut cells = 800.0;
            loop {
                shown = full.clustered(cells);
                if shown.triangles.len() <= MOST_TRIANGLES {
                    break;
                }
                // The number of triangles grows about as the square of the number of cells.
                let ratio = MOST_TRIANGLES as f64 / shown.triangles.len() as f64;
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

    /// Whether indices need four bytes instead of two.
    pub(super) fn is_wide(&self) -> bool {
        self.points.len() > usize::from(u16::MAX)
    }

    pub(super) fn position_bytes(&self) -> Vec<u8> {
        self.points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
    }

    pub(super) fn index_bytes(&self) -> Vec<u8> {
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

/// The mesh with vertices at the same place made one, without triangles that thereby lose a corner.
fn welded(mesh: &Mesh) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut places = HashMap::new();
    let mut points = Vec::new();
    let of_vertex: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|&vertex| {
            // Zeros of either sign are the same place.
            *places.entry(vertex.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                points.push(Vec3::from(vertex));
                points.len() as u32 - 1
            })
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|i| of_vertex[i as usize]));
    (points, triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

fn bounds(mesh: &Mesh) -> [Vec3; 2] {
    let corners = mesh.triangles.iter().flatten().map(|&i| Vec3::from(mesh.vertices[i as usize]));
    corners.map(|v| [v, v]).reduce(|[low, high], [v, _]| [low.min(v), high.max(v)]).unwrap_or([Vec3::ZERO; 2])
}
