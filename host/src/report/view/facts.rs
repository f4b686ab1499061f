//! What is to be known of a mesh.

use crate::mesh::Mesh;
use glam::Vec3;
use std::collections::HashMap;

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
