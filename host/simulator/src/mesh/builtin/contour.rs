//! From an implicit shape to a triangle mesh.

use super::shape::Shape;
use super::slices;
use crate::mesh::Mesh;
use fidget_core::context::Tree;
use fidget_core::types::Grad;
use glam::Vec3;

/// An implicit shape, the box that it is in, and the resolution at which it is meshed.
pub(super) struct Form {
    /// Negative inside.
    pub(super) shape: Shape,
    /// The corners of a box that holds it, in centimeters.
    pub(super) bounds: [Vec3; 2],
    /// Number of the smallest cells along the longest side of `bounds`: enough for the thinnest feature to be three
    /// cells thick.
    pub(super) cells: f32,
}

/// The depth of the octree in which shapes are meshed.
const DEPTH: u8 = 9;

/// Meshes a form in one thread, so that the order of vertices and triangles is always the same. None if no resolution
/// that is tried gives a closed mesh.
///
/// If two sheets pass through one cell, dual contouring may join them in an edge of four triangles. That depends on
/// where the cells happen to lie, so a mesh that is not closed is made again with cells a hundredth larger.
pub(super) fn mesh(form: &Form) -> Option<Mesh> {
    const ATTEMPTS: u8 = 12;
    (0..ATTEMPTS).map(|attempt| contour(form, form.cells * (1.0 - 0.0117 * f32::from(attempt)))).find(is_closed)
}

/// True if there are edges, and each is used once in each direction.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges: Vec<(u32, u32)> = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    let mut opposites: Vec<(u32, u32)> = edges.iter().map(|&(a, b)| (b, a)).collect();
    edges.sort_unstable();
    opposites.sort_unstable();
    !edges.is_empty() && edges == opposites && edges.windows(2).all(|pair| pair[0] != pair[1])
}

fn contour(form: &Form, cells: f32) -> Mesh {
    let center = (form.bounds[0] + form.bounds[1]) / 2.0;
    // The mesher works in a cube of 2^DEPTH cells a side, and the bounds fill only a part of it. It merges cells as long
    // as the surface stays within about a thousandth of that cube, so flat parts get large triangles.
    let side = (form.bounds[1] - form.bounds[0]).max_element();
    let reach = side / cells * f32::from(1_u16 << DEPTH) / 2.0;
    let (x, y, z) = Tree::axes();
    let tree = form.shape.0.remap_xyz(x * reach + center.x, y * reach + center.y, z * reach + center.z) / reach;
    let shape = slices::Shape::from(tree);
    let settings = fidget_mesh::Settings { depth: DEPTH, threads: None, ..Default::default() };
    // Neither fails: the shapes have no variables but x, y and z, and nothing cancels. If they did, the mesh would be
    // empty, which `mesh` refuses.
    let Ok(bound) = shape.clone().try_into() else { return Mesh::default() };
    let Some(octree) = fidget_mesh::Octree::build(&bound, &settings) else { return Mesh::default() };
    let contoured = octree.walk_dual();
    let index = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
    let triangles: Vec<_> = contoured.triangles.iter().map(|t| [index(t.x), index(t.y), index(t.z)]).collect();
    let mut points: Vec<_> = contoured.vertices.iter().map(|v| Vec3::new(v.x, v.y, v.z)).collect();
    unfold(&mut points, &triangles, &shape, 2.0 / f32::from(1_u16 << DEPTH));
    Mesh { vertices: points.iter().map(|&p| (p * reach + center).to_array()).collect(), triangles }
}

/// The shape's value and gradient at each of `points`.
fn values(shape: &slices::Shape, points: &[Vec3]) -> Vec<(f32, Vec3)> {
    let tape = shape.grad_slice_tape(Default::default());
    let mut evaluator = slices::Shape::new_grad_slice_eval();
    let mut values = Vec::with_capacity(points.len());
    // In pieces small enough for their intermediate results to stay in the cache.
    for points in points.chunks(512) {
        let axis = |i: usize| -> Vec<Grad> {
            let along = |j| f32::from(u8::from(i == j));
            points.iter().map(|p| Grad::new(p[i], along(0), along(1), along(2))).collect()
        };
        // Cannot fail: there are no variables but x, y and z, and their slices are equally long.
        let Ok(slice) = evaluator.eval(&tape, &axis(0), &axis(1), &axis(2)) else { continue };
        values.extend(slice.iter().map(|g| (g.v, Vec3::new(g.dx, g.dy, g.dz))));
    }
    values
}

/// Straightens the folds that dual contouring leaves where small cells meet large ones: where a triangle faces against
/// the shape's gradient, its corners are moved to the mean of their neighbors and back onto the surface, a few times.
/// Each time, the way back onto the surface is limited to `cell`.
fn unfold(points: &mut [Vec3], triangles: &[[u32; 3]], shape: &slices::Shape, cell: f32) {
    const PASSES: usize = 12;
    /// A triangle counts as folded if the cosine between its normal and the gradient is below this.
    const FOLDED: f32 = 0.1;
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (i, triangle) in triangles.iter().enumerate() {
        triangle.iter().for_each(|&corner| around[corner as usize].push(i));
    }
    let mut suspects: Vec<usize> = (0..triangles.len()).collect();
    for pass in 0..PASSES {
        // The middles of dual contouring's quads have four triangles around them; the other vertices, which keep sharp
        // edges sharp, move only if moving those was not enough.
        let most = if pass < PASSES / 2 { 4 } else { usize::MAX };
        let corners = |i: usize| triangles[i].map(|corner| points[corner as usize]);
        let middles: Vec<Vec3> = suspects.iter().map(|&i| corners(i).iter().sum::<Vec3>() / 3.0).collect();
        let mut sides = values(shape, &middles).into_iter();
        suspects.retain(|&i| {
            let [a, b, c] = corners(i);
            let normal = (b - a).cross(c - a);
            sides.next().is_some_and(|(_, out)| normal.dot(out) < FOLDED * normal.length() * out.length())
        });
        let mut moving: Vec<u32> = suspects.iter().flat_map(|&i| triangles[i]).collect();
        moving.retain(|&vertex| around[vertex as usize].len() <= most);
        moving.sort_unstable();
        moving.dedup();
        // Each neighbor of a vertex in a closed mesh is in two of the triangles around it, and the vertex in all.
        let between: Vec<Vec3> = moving
            .iter()
            .map(|&vertex| {
                let ring = &around[vertex as usize];
                let sum: Vec3 = ring.iter().flat_map(|&i| corners(i)).sum();
                let count = ring.len() as f32;
                (sum - points[vertex as usize] * count) / (2.0 * count)
            })
            .collect();
        for ((&vertex, &place), (value, gradient)) in moving.iter().zip(&between).zip(values(shape, &between)) {
            let step = gradient * (value / gradient.length_squared());
            points[vertex as usize] = if step.is_finite() { place - step.clamp_length_max(cell) } else { place };
        }
        suspects.extend(moving.iter().flat_map(|&vertex| around[vertex as usize].iter().copied()));
        suspects.sort_unstable();
        suspects.dedup();
    }
}
