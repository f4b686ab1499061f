//! Eight triangles at once in f32: which of them can a moving sphere not touch?
//!
//! Seen along the motion, the sphere's path is a disc and a triangle is a triangle: they are apart if a line separates
//! them (the sides of the triangle's bounding rectangle and its edges are tried). Along the motion, a triangle behind
//! the start is out of reach, and one at a distance from the path is touched late. Slack makes up for rounding, so a
//! triangle that is rejected is certainly not touched; of those that remain, most are.

use super::budget::BOX;
use super::narrow::{Motion, Triangle};
use glam::{BVec4A, DVec3, Vec3, Vec4};

/// Number of triangles in a pack.
pub(super) const LANES: usize = 2 * WIDTH;

/// Number of lanes in a register of the baseline instruction sets; `glam` keeps a [`Vec4`] in one.
pub(super) const WIDTH: usize = 4;

/// Up to eight triangles, in two halves of four: corner by corner, axis by axis. Unused lanes repeat the first triangle.
#[derive(Clone, Debug)]
pub(super) struct Pack {
    halves: [[[Vec4; 3]; 3]; 2],
    /// Index of the first triangle; the others follow it.
    pub(super) first: u32,
    /// Number of lanes in use.
    pub(super) count: u32,
}

impl Pack {
    pub(super) fn new(triangles: &[Triangle], first: u32) -> Self {
        let mut halves = [[[Vec4::ZERO; 3]; 3]; 2];
        for lane in 0..LANES {
            let triangle = triangles.get(lane).unwrap_or(&triangles[0]);
            for (corner, place) in halves[lane / WIDTH].iter_mut().zip(triangle) {
                for (axis, value) in corner.iter_mut().zip(place.to_array()) {
                    axis[lane % WIDTH] = value as f32;
                }
            }
        }
        Self { halves, first, count: triangles.len() as u32 }
    }

    /// For each triangle, a distance before which the sphere does not touch it; infinite if it does not before `limit`.
    #[inline]
    pub(super) fn earliest(&self, ray: &Ray, limit: f32) -> Earliest {
        let first = half_earliest(&self.halves[0], ray, limit);
        let is_half = self.count as usize <= WIDTH;
        let second = if is_half { Vec4::INFINITY } else { half_earliest(&self.halves[1], ray, limit) };
        Earliest::new([first, second], self.count)
    }
}

/// Distances before which the triangles of a pack are not touched.
pub(super) struct Earliest {
    places: [f32; LANES],
    /// A bit for each triangle that is left.
    left: u32,
}

impl Earliest {
    /// A pack of the first `count` triangles.
    #[inline]
    fn new(halves: [Vec4; 2], count: u32) -> Self {
        let [low, high] = halves.map(|half| half.cmplt(Vec4::INFINITY).bitmask());
        let mut places = [0.0; LANES];
        for (places, half) in places.chunks_exact_mut(WIDTH).zip(halves) {
            places.copy_from_slice(&half.to_array());
        }
        Self { places, left: (low | high << WIDTH) & all(count) }
    }

    /// Distances that exclude none of this many triangles.
    pub(super) fn at_once(count: u32) -> Self {
        Self { places: [0.0; LANES], left: all(count) }
    }

    /// True if a triangle is left.
    #[inline]
    pub(super) fn has_some(&self) -> bool {
        self.left != 0
    }

    /// Leaves out everything that the other excludes, which was made with a lower limit.
    #[inline]
    pub(super) fn retain(&mut self, other: &Self) {
        self.left &= other.left;
    }

    /// The triangle with the least distance, if that is at most `limit`. Each is returned only once.
    #[inline]
    pub(super) fn pop(&mut self, limit: f32) -> Option<usize> {
        if self.left == 0 {
            return None;
        }
        let mut least = self.left.trailing_zeros() as usize;
        let mut others = self.left & (self.left - 1);
        while others != 0 {
            let lane = others.trailing_zeros() as usize;
            others &= others - 1;
            if self.places[lane % LANES] < self.places[least % LANES] {
                least = lane;
            }
        }
        self.left &= !(1 << least);
        (self.places[least % LANES] <= limit).then_some(least)
    }
}

/// A bit for each of this many lanes.
#[inline]
fn all(count: u32) -> u32 {
    (1 << count) - 1
}

#[inline]
fn half_earliest(corners: &[[Vec4; 3]; 3], ray: &Ray, limit: f32) -> Vec4 {
    let us = corners.each_ref().map(|corner| ray.along(corner, 0));
    let vs = corners.each_ref().map(|corner| ray.along(corner, 1));
    let ws = corners.each_ref().map(|corner| ray.along(corner, 2));
    let (zero, infinite) = (Vec4::ZERO, Vec4::INFINITY);
    let margin_squared = Vec4::splat(ray.margin * ray.margin);
    // The triangle's bounding rectangle, at its distance from the path, is met where the sphere is round.
    let beside = least(us).max(-greatest(us)).max(zero);
    let above = least(vs).max(-greatest(vs)).max(zero);
    let reach = margin_squared - (beside * beside + above * above);
    let mut out = reach.cmplt(zero) | greatest(ws).cmplt(Vec4::splat(-ray.margin));
    for (from, to, opposite) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let (eu, ev) = (us[to] - us[from], vs[to] - vs[from]);
        // Where the path and the opposite corner stand across this edge, times its length.
        let path = ev * us[from] - eu * vs[from];
        let corner = eu * (vs[opposite] - vs[from]) - ev * (us[opposite] - us[from]);
        let beyond = (path - corner.max(zero)).max(corner.min(zero) - path);
        out |= beyond.cmpgt(zero) & (beyond * beyond).cmpgt(margin_squared * (eu * eu + ev * ev));
    }
    if limit < f32::INFINITY {
        out |= apart([us, vs, ws.map(|w| w - limit)], margin_squared);
    }
    Vec4::select(out, infinite, (least(ws) - reach.max(zero).sqrt()).max(zero))
}

/// The triangles that a sphere at the origin of these coordinates does not touch there, nor before, moving along the third axis:
/// in a direction that points forward, all of the triangle lies beyond the radius. Two directions are tried: to the middle of
/// the triangle, and to the point closest to the sphere on the line from there to the corner that lies nearest in it.
#[inline]
fn apart(corners: [[Vec4; 3]; 3], margin_squared: Vec4) -> BVec4A {
    let [us, vs, ws] = corners;
    // How far each corner lies in a direction, times its length.
    let depths = |[u, v, w]: [Vec4; 3]| [0, 1, 2].map(|corner| us[corner] * u + vs[corner] * v + ws[corner] * w);
    let separates = |[u, v, w]: [Vec4; 3], nearest: Vec4| {
        let square = u * u + v * v + w * w;
        w.cmpge(Vec4::ZERO) & nearest.cmpgt(Vec4::ZERO) & (nearest * nearest).cmpgt(margin_squared * square)
    };
    let middle = corners.map(|[a, b, c]| (a + b + c) / 3.0);
    let from_middle = depths(middle);
    let nearest = least(from_middle);
    let is_first = from_middle[0].cmple(nearest);
    let is_second = from_middle[1].cmple(nearest);
    let corner = corners.map(|[a, b, c]| Vec4::select(is_first, a, Vec4::select(is_second, b, c)));
    let way = [0, 1, 2].map(|axis| corner[axis] - middle[axis]);
    let dot = |a: &[Vec4; 3], b: &[Vec4; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let share = -dot(&middle, &way) / dot(&way, &way).max(Vec4::splat(f32::MIN_POSITIVE));
    let share = share.min(Vec4::ONE).max(Vec4::ZERO);
    let closest = [0, 1, 2].map(|axis| middle[axis] + way[axis] * share);
    separates(middle, nearest) | separates(closest, least(depths(closest)))
}

/// A motion as the f32 tests need it.
pub(super) struct Ray {
    pub(super) origin: Vec3,
    /// The origin, one over the direction with tiny components instead of zeros, and its absolute value: axis by axis, for
    /// four boxes at once.
    pub(super) origins: [Vec4; 3],
    pub(super) inverse: [Vec4; 3],
    pub(super) spread: [Vec4; 3],
    /// Two directions perpendicular to the motion, and the direction of the motion.
    axes: [Vec3; 3],
    /// The origin along each of them.
    offsets: [f32; 3],
    /// The radius, and the most by which rounding in f32 can move anything.
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
        let origin = motion.origin.as_vec3();
        let inverse = direction.to_array().map(|along| Vec4::splat(component(along) as f32));
        Self {
            origin,
            origins: origin.to_array().map(Vec4::splat),
            inverse,
            spread: inverse.map(Vec4::abs),
            axes: [u.as_vec3(), v.as_vec3(), direction.as_vec3()],
            offsets: [across(u), across(v), across(direction)],
            margin: margin as f32,
        }
    }

    /// Extent of boxes along an axis, from their centers and half their sides: position of the center, and how far
    /// the box reaches from there.
    #[inline]
    pub(super) fn extent(&self, center: &[Vec4; 3], [x, y, z]: &[Vec4; 3], axis: usize) -> [Vec4; 2] {
        let size = self.axes[axis].abs();
        [self.along(center, axis), *x * size.x + *y * size.y + *z * size.z]
    }

    /// Unit vector of the motion.
    #[inline]
    pub(super) fn direction(&self) -> Vec3 {
        self.axes[2]
    }

    #[inline]
    fn along(&self, [x, y, z]: &[Vec4; 3], axis: usize) -> Vec4 {
        let direction = self.axes[axis];
        *x * direction.x + *y * direction.y + *z * direction.z - self.offsets[axis]
    }
}

#[inline]
fn least([a, b, c]: [Vec4; 3]) -> Vec4 {
    a.min(b).min(c)
}

#[inline]
fn greatest([a, b, c]: [Vec4; 3]) -> Vec4 {
    a.max(b).max(c)
}
