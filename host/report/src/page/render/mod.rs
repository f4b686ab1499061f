//! Pictures of meshes.
//!
//! A small software rasterizer: a depth buffer, one soft light from above the viewer's left shoulder, normals smoothed
//! over everything but sharp edges, and several samples per pixel. Orthographic, so that proportions can be judged.

mod picture;
mod raster;
mod viewpoint;

use palpate::mesh::Mesh;
use picture::Picture;
use viewpoint::Viewpoint;

/// A picture of `mesh`, `size` pixels wide and high, as PNG: from a three-quarter view, on a transparent ground so that
/// it works on light and dark pages. A mesh without extent gives an empty picture.
pub fn thumbnail(mesh: &Mesh, size: u32) -> Vec<u8> {
    let mut picture = Picture::new(size, size);
    picture.draw(&raster::render(mesh, size, Viewpoint::three_quarter(mesh)), 0, 0);
    picture.png()
}

/// A picture of `mesh` as it lies on a table, z pointing up, `size` pixels wide and high, as PNG on a transparent ground: all
/// placements of an object are seen from the same side.
pub(crate) fn on_table(mesh: &Mesh, size: u32) -> Vec<u8> {
    let [low, high] = mesh.bounds();
    let (middle, longest) = ((low + high) / 2.0, (high - low).max_element());
    let mut shown = mesh.clone();
    // The table's top is a little below, so that nothing that lies on it shows through.
    let corner = |x: f32, y: f32| [middle.x + x * 0.6 * longest, middle.y + y * 0.6 * longest, low.z - 0.004 * longest];
    let first = shown.vertices.len() as u32;
    shown.vertices.extend([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    shown.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|index| first + index)));
    let mut picture = Picture::new(size, size);
    picture.draw(&raster::render(&shown, size, Viewpoint::above()), 0, 0);
    picture.png()
}

#[cfg(test)]
mod tests;
