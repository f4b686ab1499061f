//! Gaps in a mesh: open edges that hang together.

use super::parts::Sets;
use crate::mesh::Mesh;
use glam::DVec3;

/// Open edges that are connected.
#[derive(Clone, Copy, Default)]
struct Gap {
    /// Twice the area that they run about, as a vector.
    area: DVec3,
    length: f64,
}

/// The width of the widest gap of a welded mesh, in the units of its file: of open edges that hang together, four times the
/// area that they run about by their length, which is a round hole's diameter, and twice a slit's width. 0 without a gap.
/// The triangles about a gap must face one side.
pub(super) fn widest(mesh: &Mesh) -> f64 {
    let Mesh { vertices, triangles } = mesh;
    // The ends of each triangle's edges, the lower one first, and whether it runs from the lower one.
    let mut edges: Vec<(u32, u32, bool)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), a < b)))
        .collect();
    edges.sort_unstable();
    let uses = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    let open: Vec<_> = uses.filter_map(|uses| if let [one] = uses { Some(*one) } else { None }).collect();
    if open.is_empty() {
        return 0.0;
    }
    let mut sets = Sets::new(vertices.len());
    open.iter().for_each(|&(a, b, _)| sets.join(a, b));
    let (numbers, count) = sets.numbers();
    let mut gaps = vec![Gap::default(); count];
    // From a corner of the box, so that a mesh far from its origin loses no digits.
    let [corner, _] = mesh.bounds();
    let place = |vertex: u32| (glam::Vec3::from(vertices[vertex as usize]) - corner).as_dvec3();
    for (a, b, forward) in open {
        let gap = &mut gaps[numbers[a as usize]];
        let (from, to) = if forward { (place(a), place(b)) } else { (place(b), place(a)) };
        gap.area += from.cross(to);
        gap.length += from.distance(to);
    }
    gaps.iter().filter(|gap| gap.length > 0.0).map(|gap| 2.0 * gap.area.length() / gap.length).fold(0.0, f64::max)
}
