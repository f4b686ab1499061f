//! Eight triangles at once in f32: which of them can a moving sphere not touch?
//!
//! Seen along the motion, the sphere's path is a disc and a triangle is a triangle: they are apart if a line separates
//! them (their bounding boxes' sides and the triangle's edges are tried). Along the motion, a triangle behind the start
//! or beyond the limit is out of reach. Slack makes up for the rounding, so a triangle that is thrown out is surely
//! not touched; of those that stay, most are.

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

    /// A bit for each triangle.
    #[inline]
    pub(super) fn all(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// A bit for each triangle that the sphere may touch within `limit`.
    #[inline]
    pub(super) fn candidates(&self, ray: &Ray, limit: f32) -> u32 {
        let u = self.corners.each_ref().map(|corner| ray.along(corner, 0));
        let v = self.corners.each_ref().map(|corner| ray.along(corner, 1));
        let w = self.corners.each_ref().map(|corner| ray.along(corner, 2));
        let mut apart = [false; LANES];
        let margin_squared = ray.margin * ray.margin;
        for lane in 0..LANES {
            let (us, vs, ws) = (u.map(|c| c[lane]), v.map(|c| c[lane]), w.map(|c| c[lane]));
            let mut out = least(us) > ray.margin;
            out |= greatest(us) < -ray.margin;
            out |= least(vs) > ray.margin;
            out |= greatest(vs) < -ray.margin;
            out |= least(ws) > limit + ray.margin;
            out |= greatest(ws) < -ray.margin;
            for (from, to, opposite) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                let (eu, ev) = (us[to] - us[from], vs[to] - vs[from]);
                // Where the path and the opposite corner stand across this edge, times its length.
                let path = ev * us[from] - eu * vs[from];
                let corner = eu * (vs[opposite] - vs[from]) - ev * (us[opposite] - us[from]);
                let beyond = bigger(path - bigger(corner, 0.0), smaller(corner, 0.0) - path);
                out |= (beyond > 0.0) & (beyond * beyond > margin_squared * (eu * eu + ev * ev));
            }
            apart[lane] = out;
        }
        let mut mask = 0;
        for (lane, apart) in apart.into_iter().enumerate() {
            mask |= u32::from(!apart) << lane;
        }
        mask & self.all()
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
