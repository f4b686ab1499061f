//! Pieces of a mesh that float apart from the rest of it.

use super::Part;
use crate::mesh::Mesh;
use glam::{DVec3, IVec3, Vec3};

/// Number of cells along the longest side of the box: a piece floats if a layer of cells around it is empty.
const CELLS: i32 = 64;

/// Largest number of places on triangles that are examined: enough for a surface some hundred times as large as that of
/// its box. In a larger one nothing is said to float.
const MOST_PLACES: usize = 30_000_000;

/// A piece that floats.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Piece {
    /// Number of triangles.
    pub triangles: usize,
    /// The lowest corner of its bounding box, in the units of the file.
    pub low: Vec3,
    /// The highest corner of its bounding box.
    pub high: Vec3,
    /// The area of its surface.
    pub area: f64,
}

impl Piece {
    /// Location in words.
    pub(super) fn place(&self) -> String {
        Part::place_of(self.triangles, self.low, self.high)
    }
}

/// The pieces of a mesh that are farther from each other than about a fiftieth of its longest side, except for the one with
/// the largest area; the largest first.
pub(super) fn pieces(mesh: &Mesh) -> Vec<Piece> {
    let [low, high] = mesh.bounds();
    let length = (high - low).max_element();
    if length <= 0.0 || !length.is_finite() {
        return Vec::new();
    }
    let step = f64::from(length) / f64::from(CELLS);
    // In cells, and in f64: squares of coordinates that f32 holds may be more than it holds.
    let place = |vertex: Vec3| (vertex.as_dvec3() - low.as_dvec3()) / step;
    let cell = |place: DVec3| place.as_ivec3().clamp(IVec3::ZERO, IVec3::splat(CELLS - 1));
    let number = |cell: IVec3| ((cell.z * CELLS + cell.y) * CELLS + cell.x) as usize;
    let corners = |triangle: &[u32; 3]| triangle.map(|i| Vec3::from(mesh.vertices[i as usize]));
    let mut cells = vec![EMPTY; (CELLS * CELLS * CELLS) as usize];
    let mut places = MOST_PLACES;
    for triangle in &mesh.triangles {
        let [mut a, mut b, mut c] = corners(triangle).map(place);
        // Looked up later, so exactly here, however the places below are rounded.
        [a, b, c].into_iter().for_each(|corner| cells[number(cell(corner))] = FULL);
        // The longest side is a to b.
        for _ in 0..2 {
            if a.distance_squared(b) < b.distance_squared(c).max(c.distance_squared(a)) {
                (a, b, c) = (b, c, a);
            }
        }
        // Two places to a cell, along the longest side and across it, so that no cell between them is left out.
        let height = (b - a).cross(c - a).length() / a.distance(b).max(f64::MIN_POSITIVE);
        let [columns, rows] = [a.distance(b), height].map(|side| (2.0 * side).ceil().clamp(1.0, 256.0) as usize);
        let Some(left) = places.checked_sub(columns * rows) else { return Vec::new() };
        places = left;
        for row in 0..=rows {
            let v = row as f64 / rows as f64;
            for column in 0..=columns {
                let u = (1.0 - v) * column as f64 / columns as f64;
                cells[number(cell(a + u * (b - a) + v * (c - a)))] = FULL;
            }
        }
    }
    let count = flood(&mut cells, &number);
    let mut pieces =
        vec![Piece { triangles: 0, low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, area: 0.0 }; count as usize];
    for triangle in &mesh.triangles {
        let [a, b, c] = corners(triangle);
        let piece = &mut pieces[cells[number(cell(place(a)))] as usize];
        piece.triangles += 1;
        piece.low = piece.low.min(a).min(b).min(c);
        piece.high = piece.high.max(a).max(b).max(c);
        let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
        piece.area += (b - a).cross(c - a).length() / 2.0;
    }
    pieces.retain(|piece| piece.triangles > 0);
    pieces.sort_by(|one, other| other.area.total_cmp(&one.area));
    pieces.drain(..pieces.len().min(1));
    pieces
}

/// A cell without a surface, and one with a surface whose piece is not known yet.
const EMPTY: u32 = u32::MAX;
const FULL: u32 = u32::MAX - 1;

/// Gives full cells that touch each other, even at a corner, one number; returns how many numbers there are.
fn flood(cells: &mut [u32], number: &impl Fn(IVec3) -> usize) -> u32 {
    let mut count = 0;
    let mut waiting = Vec::new();
    for start in 0..cells.len() {
        if cells[start] != FULL {
            continue;
        }
        let index = start as i32;
        cells[start] = count;
        waiting.push(IVec3::new(index % CELLS, index / CELLS % CELLS, index / CELLS / CELLS));
        while let Some(cell) = waiting.pop() {
            for neighbor in 0..27 {
                let next = cell + IVec3::new(neighbor % 3, neighbor / 3 % 3, neighbor / 9) - IVec3::ONE;
                let is_inside = next.cmpge(IVec3::ZERO).all() && next.cmplt(IVec3::splat(CELLS)).all();
                if is_inside && cells[number(next)] == FULL {
                    cells[number(next)] = count;
                    waiting.push(next);
                }
            }
        }
        count += 1;
    }
    count
}
