//! Vertices at the same place.

use glam::DVec3;
use std::collections::HashMap;

/// Vertices closer to each other along every axis than this share of the longest side are at the same place. Exporters
/// leave such distances where a number should be 0.
const SAME: f64 = 1e-9;

/// The side of a cell in which places are looked up, in the largest distance between vertices at the same place.
const CELL: f64 = 8.0;

/// No place.
const NONE: u32 = u32::MAX;

/// The places of vertices, in the order in which they were first met.
pub(super) struct Places {
    /// The vertex that each place has its coordinates from.
    pub(super) vertices: Vec<[f32; 3]>,
    /// The place of each vertex, by its bits.
    known: HashMap<[u32; 3], u32>,
    /// The last place in each cell, and for each place the one before it in its cell.
    cells: HashMap<[i64; 3], u32>,
    before: Vec<u32>,
    low: DVec3,
    distance: f64,
}

impl Places {
    /// No places yet, of vertices in this bounding box.
    pub(super) fn new([low, high]: [glam::Vec3; 2]) -> Self {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        Self {
            vertices: Vec::new(),
            known: HashMap::new(),
            cells: HashMap::new(),
            before: Vec::new(),
            low,
            distance: SAME * (high - low).max_element(),
        }
    }

    /// The place of a vertex.
    pub(super) fn of(&mut self, vertex: [f32; 3]) -> u32 {
        // Zeros of either sign are the same place.
        let bits = vertex.map(|x| (x + 0.0).to_bits());
        if let Some(&place) = self.known.get(&bits) {
            return place;
        }
        let at = (glam::Vec3::from(vertex).as_dvec3() - self.low) / (CELL * self.distance);
        let cell = at.floor().to_array().map(|along| along as i64);
        let place = self.near(vertex, at, cell).unwrap_or_else(|| {
            let place = self.vertices.len() as u32;
            self.vertices.push(vertex);
            self.before.push(self.cells.insert(cell, place).unwrap_or(NONE));
            place
        });
        self.known.insert(bits, place);
        place
    }

    /// A place that is near enough to a vertex, which is `at` this place in cells.
    fn near(&self, vertex: [f32; 3], at: DVec3, cell: [i64; 3]) -> Option<u32> {
        if self.distance <= 0.0 {
            return None;
        }
        let inside = (at - at.floor()).to_array();
        // A place in the neighboring cell is near only to places at the edge of its own.
        let steps = inside.map(|inside| {
            if inside * CELL <= 1.0 {
                [0, -1]
            } else if (1.0 - inside) * CELL <= 1.0 {
                [0, 1]
            } else {
                [0, 0]
            }
        });
        let is_near = |place: u32| {
            let other = self.vertices[place as usize];
            vertex.iter().zip(other).all(|(&one, other)| (f64::from(one) - f64::from(other)).abs() <= self.distance)
        };
        for number in 0..8 {
            let chosen = [number & 1, number >> 1 & 1, number >> 2];
            if (0..3).any(|axis| chosen[axis] == 1 && steps[axis][1] == 0) {
                continue;
            }
            let neighbor = std::array::from_fn(|axis| cell[axis].saturating_add(steps[axis][chosen[axis]]));
            let mut place = self.cells.get(&neighbor).copied().unwrap_or(NONE);
            while place != NONE {
                if is_near(place) {
                    return Some(place);
                }
                place = self.before[place as usize];
            }
        }
        None
    }
}
