//! Facts about a mesh: is it closed, is it right side out, how large is it.
//!
//! The simulator touches any mesh, from both sides. But through a hole, a finger gets where no real one could, and an
//! inside-out mesh is often a sign of a broken export: whoever captures from such a mesh should know.

use crate::mesh::Mesh;
use glam::{DVec3, Vec3};

/// What can be said about a mesh, in the units of its file. Vertices at the same place count as one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Facts {
    /// How many triangles it has.
    pub triangles: usize,
    /// The lowest corner of its bounding box.
    pub low: Vec3,
    /// The highest corner of its bounding box.
    pub high: Vec3,
    /// Open edges: those that belong to one triangle only.
    pub open_edges: usize,
    /// Edges whose two triangles face opposite sides.
    pub contrary_edges: usize,
    /// Edges that three or more triangles share.
    pub branching_edges: usize,
    /// The volume that it encloses, in cubic units of its file: negative if it is inside out, meaningless if it is open.
    pub volume: f64,
}

impl Facts {
    /// The facts about `mesh`: a second or so for a million triangles.
    ///
    /// # Panics
    /// If a triangle names a vertex that the mesh does not have. Meshes that were read or built in never do.
    pub fn of(mesh: &Mesh) -> Self {
        let Mesh { vertices, triangles } = mesh.welded();
        let [low, high] = mesh.bounds();
        let mut edges: Vec<(u32, u32, bool)> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b), a < b))
            .collect();
        edges.sort_unstable();
        let (mut open_edges, mut contrary_edges, mut branching_edges) = (0, 0, 0);
        for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match uses {
                [_] => open_edges += 1,
                [one, other] if one.2 == other.2 => contrary_edges += 1,
                [_, _] => {}
                _ => branching_edges += 1,
            }
        }
        // From a corner of the box, so that a mesh far from its origin loses no digits.
        let corner = |i: u32| -> DVec3 { (Vec3::from(vertices[i as usize]) - low).as_dvec3() };
        let volume = triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum();
        Self { triangles: mesh.triangles.len(), low, high, open_edges, contrary_edges, branching_edges, volume }
    }

    /// Whether each edge belongs to exactly two triangles.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.branching_edges == 0
    }

    /// Whether it is closed and each triangle is anticlockwise when seen from outside.
    pub fn is_right_side_out(&self) -> bool {
        self.is_closed() && self.contrary_edges == 0 && self.volume > 0.0
    }

    /// Whether the mesh is closed, in words: "yes", or what is not.
    pub fn closed(&self) -> String {
        match (self.open_edges, self.branching_edges) {
            (0, 0) => "yes".into(),
            (0, branching) => format!("yes, but more than two triangles meet at {branching} edges"),
            (open, 0) => format!("no: {open} open edges"),
            (open, branching) => format!("no: {open} open edges, and more than two triangles at {branching}"),
        }
    }

    /// Whether the mesh is right side out, in words: "yes", or what is not.
    pub fn side(&self) -> String {
        if self.contrary_edges > 0 {
            format!("no: at {} edges the two triangles face opposite sides", self.contrary_edges)
        } else if !self.is_closed() {
            "unknown for an open surface: look for orange".into()
        } else if self.volume > 0.0 {
            "yes".into()
        } else {
            "no: inside out".into()
        }
    }

    /// What a user should know before touching the mesh, as a sentence: that it is open or inside out. None if it is
    /// neither.
    pub fn complaint(&self) -> Option<String> {
        if self.open_edges > 0 {
            let edges =
                if self.open_edges == 1 { "1 edge belongs" } else { &format!("{} edges belong", self.open_edges) };
            Some(format!("The mesh is open: {edges} to one triangle only, so fingers may reach through the gaps."))
        } else if self.contrary_edges > 0 {
            let places = if self.contrary_edges == 1 { "1 edge" } else { &format!("{} edges", self.contrary_edges) };
            Some(format!("The mesh is partly inside out: at {places}, the two triangles face opposite sides."))
        } else if self.is_closed() && self.volume <= 0.0 {
            Some("The mesh is inside out: reverse the order of the vertices in its faces.".into())
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Mesh {
        let vertices = (0..8_u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f32::from)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Mesh { vertices, triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
    }

    #[test]
    fn a_cube_is_closed_and_right_side_out_until_it_is_turned_over_or_opened() {
        let words = |mesh: &Mesh| {
            let facts = Facts::of(mesh);
            (facts.closed(), facts.side())
        };
        let complaint = |mesh: &Mesh| Facts::of(mesh).complaint();
        let mut mesh = cube();
        assert_eq!(words(&mesh), ("yes".into(), "yes".into()));
        assert_eq!(complaint(&mesh), None);
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        assert_eq!(words(&mesh), ("yes".into(), "no: inside out".into()));
        assert!(complaint(&mesh).unwrap().starts_with("The mesh is inside out"));
        mesh.triangles[0].swap(0, 1);
        assert_eq!(words(&mesh), ("yes".into(), "no: at 3 edges the two triangles face opposite sides".into()));
        assert!(complaint(&mesh).unwrap().contains("partly inside out: at 3 edges"));
        mesh.triangles.remove(0);
        assert_eq!(words(&mesh).0, "no: 3 open edges");
        assert!(words(&mesh).1.contains("open surface"));
        assert!(complaint(&mesh).unwrap().starts_with("The mesh is open: 3 edges belong to one triangle only"));
    }

    #[test]
    fn a_mesh_far_from_its_origin_keeps_its_size_and_volume() {
        let mut mesh = cube();
        mesh.vertices.iter_mut().flatten().for_each(|x| *x += 1000.0);
        let facts = Facts::of(&mesh);
        assert_eq!((facts.low, facts.high, facts.triangles), (Vec3::splat(1000.0), Vec3::splat(1001.0), 12));
        assert!((facts.volume - 1.0).abs() < 1e-9, "{}", facts.volume);
    }

    #[test]
    fn vertices_at_the_same_place_are_one() {
        let whole = cube();
        let vertices = whole.triangles.iter().flatten().map(|&i| whole.vertices[i as usize]).collect();
        let apart = Mesh { vertices, triangles: (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect() };
        assert!(Facts::of(&apart).is_right_side_out());
    }

    #[test]
    fn an_edge_of_four_triangles_is_no_reason_to_complain_but_not_closed() {
        // Two tetrahedra that share an edge.
        let mut mesh = crate::mesh::obj::parse(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n".as_bytes(),
            "two.obj".as_ref(),
        )
        .unwrap();
        mesh.vertices.extend([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        mesh.triangles.extend([[0, 1, 4], [0, 5, 1], [1, 5, 4], [4, 5, 0]]);
        let facts = Facts::of(&mesh);
        assert_eq!((facts.open_edges, facts.branching_edges, facts.complaint()), (0, 1, None));
        assert!(!facts.is_closed());
    }
}
