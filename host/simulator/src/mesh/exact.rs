//! Coordinates in f64, as files hold them, on their way to the f32 of a [`Mesh`](super::Mesh).
//!
//! An `f32` has 24 bits: a cup of 0.1 m in the coordinates of a country would come out in steps of centimeters. So the
//! center of a mesh that is far from the origin is subtracted before its coordinates are rounded.

use super::Mesh;
use glam::DVec3;

/// A mesh as read, the offset subtracted from its coordinates, and the step in which its file rounds them; 0 if that is not
/// known.
pub(super) type Moved = (Mesh, [f64; 3], f64);

/// Largest distance of a mesh's center from the origin, along an axis and in longest sides, at which its coordinates
/// stay as they are. So far out, rounding moves a surface by less than a probe moves in a microsecond.
const FAR: f64 = 16.0;

/// The bounding box of vertices, one after the other. What is not finite is left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY }
    }
}

impl Bounds {
    pub(super) fn of(vertices: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut bounds = Self::default();
        vertices.into_iter().for_each(|vertex| bounds.add(vertex));
        bounds
    }

    pub(super) fn add(&mut self, vertex: [f64; 3]) {
        let vertex = DVec3::from(vertex);
        if vertex.is_finite() {
            (self.low, self.high) = (self.low.min(vertex), self.high.max(vertex));
        }
    }

    /// Offset to subtract from the coordinates: the center, if it is far from the origin, else nothing.
    pub(super) fn offset(&self) -> [f64; 3] {
        let (center, side) = (self.low.midpoint(self.high), (self.high - self.low).max_element());
        // Without a vertex, neither is a number.
        if center.is_finite() && side > 0.0 && center.abs().max_element() > FAR * side {
            center.to_array()
        } else {
            [0.0; 3]
        }
    }
}

/// The share of its longest side that a mesh's coordinates may be rounded to.
pub(super) const FINE: f64 = 1e-3;

/// The step of 32-bit numbers along the axis where they are largest; 0 if no axis has 32-bit numbers only.
pub(super) fn step_of_f32(vertices: impl Iterator<Item = [f64; 3]> + Clone) -> f64 {
    let step = |axis: usize| {
        let numbers = vertices.clone().map(|vertex| vertex[axis]);
        let largest = numbers.clone().fold(0.0_f64, |most, number| most.max(number.abs())) as f32;
        let is_f32 = numbers.into_iter().all(|number| f64::from(number as f32) == number);
        if is_f32 { f64::from(largest - largest.next_down()) } else { 0.0 }
    };
    step(0).max(step(1)).max(step(2))
}

/// The step of the decimals of a text, if it is coarse and left a tenth of the triangles without area: fewer digits than that may
/// be meant. Else 0.
pub(super) fn step_of_decimals(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corners = || triangles.iter().map(|triangle| triangle.map(|index| vertices.get(index as usize).copied()));
    let flat = corners().filter(|[a, b, c]| a == b || b == c || c == a).count();
    let Bounds { low, high } = Bounds::of(corners().flatten().flatten());
    let (sides, side) = (high - low, (high - low).max_element());
    if 10 * flat < triangles.len() || side <= 0.0 {
        return 0.0;
    }
    let is_step = |step: f64| {
        let is_whole = |number: f64| (number / step - (number / step).round()).abs() < 1e-4;
        let is_coarse = |axis: usize| sides[axis] > 0.0 && vertices.iter().all(|vertex| is_whole(vertex[axis]));
        (0..3).any(is_coarse)
    };
    let finest = libm::exp10(libm::ceil(libm::log10(FINE * side)));
    let steps = std::iter::successors(Some(finest), |step| Some(10.0 * step));
    steps.take_while(|&step| step <= side && is_step(step)).last().unwrap_or(0.0)
}

impl Mesh {
    /// A mesh of coordinates in f64, and what was subtracted from them: the center of a mesh that is far from the origin, so
    /// that rounding to f32 does not damage it; zeros for one that is not. Indices are not checked.
    pub fn from_f64(vertices: &[[f64; 3]], triangles: Vec<[u32; 3]>) -> (Self, [f64; 3]) {
        let used = triangles.iter().flatten().filter_map(|&index| vertices.get(index as usize).copied());
        let offset = Bounds::of(used).offset();
        (Self { vertices: vertices.iter().map(|&vertex| rounded(vertex, offset)).collect(), triangles }, offset)
    }
}

/// A vertex in f32, counted from `offset`.
pub(super) fn rounded(vertex: [f64; 3], offset: [f64; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| (vertex[axis] - offset[axis]) as f32)
}
