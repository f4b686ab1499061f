//! Pictures of meshes.
//!
//! A small software rasterizer: a depth buffer, one soft light from above the viewer's left shoulder, normals smoothed
//! over everything but sharp edges, and several samples per pixel. Orthographic, so that proportions can be judged.

mod picture;
mod raster;
mod viewpoint;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use palpate::mesh::{Mesh, Object};
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

/// A contact sheet of `objects` with their names, five in a row, `width` pixels wide, as PNG on a light ground.
pub fn sheet(objects: &[Object], width: u32) -> Vec<u8> {
    const COLUMNS: u32 = 5;
    let count = u32::try_from(objects.len()).unwrap_or(u32::MAX);
    let columns = COLUMNS.min(count.max(1));
    let cell = (width / columns).max(1);
    let caption = RasterHeight::Size20 as u32 + 12;
    let mut picture = Picture::new(width, count.div_ceil(columns) * (cell + caption));
    for (i, object) in (0..).zip(objects) {
        let (left, top) = (i % columns * cell, i / columns * (cell + caption));
        picture.draw(&raster::render(object.mesh(), cell, Viewpoint::three_quarter(object.mesh())), left, top);
        write(&mut picture, &object.name, left + cell / 2, top + cell);
    }
    picture.on_light_ground();
    picture.png()
}

/// Writes `text` centered on the column `middle`, shortened to what a cell holds by the picture's own edges.
fn write(picture: &mut Picture, text: &str, middle: u32, top: u32) {
    let advance = u32::try_from(get_raster_width(FontWeight::Regular, RasterHeight::Size20)).unwrap_or(1);
    let width = u32::try_from(text.chars().count()).unwrap_or(0) * advance;
    let left = middle.saturating_sub(width / 2);
    for (i, character) in (0..).zip(text.chars()) {
        let Some(glyph) = get_raster(character, FontWeight::Regular, RasterHeight::Size20) else { continue };
        for (y, row) in (0..).zip(glyph.rows()) {
            for (x, &ink) in (0..).zip(row) {
                picture.ink(left + i * advance + x, top + y, ink);
            }
        }
    }
}

#[cfg(test)]
mod tests;
