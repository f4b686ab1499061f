//! Eight triangles at once in f32: which of them can a moving sphere not touch?
//!
//! Seen along the motion, the sphere's path is a disc and a triangle is a triangle: they are apart if a line separates
//! them (the sides of the triangle's bounding rectangle and its edges are tried). Along the motion, a triangle behind
//! the start is out of reach, and one at a distance from the path is touched late. Slack makes up for the rounding, so
//! a triangle that is thrown out is surely not touched; of those that stay, most are.

#![allow(clippy::needless_range_loop, reason = "arrays of lanes side by side, by index, are what vectorises")]

use super::budget::BOX;
use super::narrow::{Motion, Triangle};
use glam::{DVec3, Vec3};

/// How many triangles a pack holds: two SSE registers' worth of lanes, one of AVX.
pub(super) const LANES: usize = 8;

type Lanes = [f32; LANES];

/// Up to eight triangles, corner by corner, axis by axis; free lanes repeat the first triangle.
#[derive(Clone, Debug)]
pub(super) struct Pack {
    corners: [[Lanes; 3]; 3],
    /// Index of the first triangle; the others follow it.
    pub(super) first: u32,
    /// How many lanes are in use.
    pub(super) count: u32,
}

impl Pack {
    pub(super) fn new(triangles: &[Triangle], first: u32) -> Self {
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            let triangle = triangles.get(lane).unwrap_or(&triangles[0]);
            for (corner, place) in corners.iter_mut().zip(triangle) {
                for (axis, value) in corner.iter_mut().zip(place.to_array()) {
                    axis[lane] = value as f32;
                }
            }
        }
        Self { corners, first, count: triangles.len() as u32 }
    }

    /// For each triangle, that the sphere may touch it at once.
    #[inline]
    pub(super) fn unknown(&self) -> Lanes {
        std::array::from_fn(|lane| if lane < self.count as usize { 0.0 } else { f32::INFINITY })
    }

    /// For each triangle, a distance before which the sphere does not touch it; infinite if it does not before `limit`.
    #[inline]
    pub(super) fn earliest(&self, ray: &Ray, limit: f32) -> Lanes {
        let u = self.corners.each_ref().map(|corner| ray.along(corner, 0));
        let v = self.corners.each_ref().map(|corner| ray.along(corner, 1));
        let w = self.corners.each_ref().map(|corner| ray.along(corner, 2));
        let end = if limit < f32::INFINITY { limit } else { 0.0 };
        let open = limit == f32::INFINITY;
        let mut earliest = [0.0; LANES];
        let margin_squared = ray.margin * ray.margin;
        for lane in 0..LANES {
            let (us, vs, ws) = (u.map(|c| c[lane]), v.map(|c| c[lane]), w.map(|c| c[lane]));
            // The triangle's bounding rectangle, at its distance from the path, is met where the sphere is round.
            let beside = bigger(bigger(least(us), -greatest(us)), 0.0);
            let above = bigger(bigger(least(vs), -greatest(vs)), 0.0);
            let reach = margin_squared - (beside * beside + above * above);
            let mut out = (reach < 0.0) | (greatest(ws) < -ray.margin);
            for (from, to, opposite) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                let (eu, ev) = (us[to] - us[from], vs[to] - vs[from]);
                // Where the path and the opposite corner stand across this edge, times its length.
                let path = ev * us[from] - eu * vs[from];
                let corner = eu * (vs[opposite] - vs[from]) - ev * (us[opposite] - us[from]);
                let beyond = bigger(path - bigger(corner, 0.0), smaller(corner, 0.0) - path);
                out |= (beyond > 0.0) & (beyond * beyond > margin_squared * (eu * eu + ev * ev));
            }
            // With the sphere at the limit, in the direction of the triangle's middle: if that points forward and all of
            // the triangle lies beyond the radius, the sphere has not reached it there, nor before.
            let (mu, mv, mw) = (us[0] + us[1] + us[2], vs[0] + vs[1] + vs[2], ws[0] + ws[1] + ws[2] - 3.0 * end);
            let along = |corner: usize| us[corner] * mu + vs[corner] * mv + (ws[corner] - end) * mw;
            let nearest = least([along(0), along(1), along(2)]);
            let square = mu * mu + mv * mv + mw * mw;
            out |= !open & (mw >= 0.0) & (nearest > 0.0) & (nearest * nearest > margin_squared * square);
            let entry = least(ws) - bigger(reach, 0.0).sqrt();
            earliest[lane] = if out { f32::INFINITY } else { bigger(entry, 0.0) };
        }
        // Free lanes repeat the first triangle.
        earliest[self.count as usize..].fill(f32::INFINITY);
        earliest
    }
}

/// A motion as the f32 tests need it.
pub(super) struct Ray {
    pub(super) origin: Vec3,
    /// One over the direction, zeros replaced by something tiny.
    pub(super) inverse: Vec3,
    /// Two directions across the motion, and the motion's own.
    axes: [Vec3; 3],
    /// The origin along each of them.
    offsets: [f32; 3],
    /// The radius and what rounding in f32 can move anything by.
    pub(super) margin: f32,
}

impl Ray {
    /// Coordinates are at most 1 in the frame of the casts, a sphere that has been moved up to the box starts within
    /// √3 + radius of it or stands inside.
    pub(super) fn new(motion: &Motion) -> Self {
        let direction = if motion.direction == DVec3::ZERO { DVec3::X } else { motion.direction };
        let (u, v) = direction.any_orthonormal_pair();
        let margin = motion.radius + BOX * (1.0 + motion.radius + motion.origin.abs().max_element());
        let component = |c: f64| if c.abs() < 1e-12 { 1e12_f64.copysign(c) } else { 1.0 / c };
        let across = |axis: DVec3| axis.dot(motion.origin) as f32;
        Self {
            origin: motion.origin.as_vec3(),
            inverse: DVec3::from(direction.to_array().map(component)).as_vec3(),
            axes: [u.as_vec3(), v.as_vec3(), direction.as_vec3()],
            offsets: [across(u), across(v), across(direction)],
            margin: margin as f32,
        }
    }

    /// Of boxes, given by their centre and half their sides: where the centre is along one of the axes, and how far
    /// the box reaches from there.
    #[inline]
    pub(super) fn extent<const N: usize>(
        &self,
        [x, y, z]: &[[f32; N]; 3],
        [a, b, c]: &[[f32; N]; 3],
        axis: usize,
    ) -> ([f32; N], [f32; N]) {
        let (direction, offset, size) = (self.axes[axis], self.offsets[axis], self.axes[axis].abs());
        let (mut centre, mut reach) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            centre[lane] = x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z - offset;
            reach[lane] = a[lane] * size.x + b[lane] * size.y + c[lane] * size.z;
        }
        (centre, reach)
    }

    /// Unit vector of the motion.
    #[inline]
    pub(super) fn direction(&self) -> Vec3 {
        self.axes[2]
    }

    #[inline]
    fn along(&self, [x, y, z]: &[Lanes; 3], axis: usize) -> Lanes {
        let (direction, offset) = (self.axes[axis], self.offsets[axis]);
        let mut along = [0.0; LANES];
        for lane in 0..LANES {
            along[lane] = x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z - offset;
        }
        along
    }
}

// Comparisons instead of f32::min and max: they compile to one instruction, and nothing here is NaN.
#[inline]
pub(super) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
pub(super) fn bigger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline]
fn least([a, b, c]: [f32; 3]) -> f32 {
    smaller(smaller(a, b), c)
}

#[inline]
fn greatest([a, b, c]: [f32; 3]) -> f32 {
    bigger(bigger(a, b), c)
}
