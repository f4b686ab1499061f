//! What lies flat in the boxes of a fine mesh.
//!
//! Where triangles are small against the sphere, the surface in a box is nearly flat, and mostly aslant: the box's
//! corners stand out of it, toward the sphere. A disc about the box's center, across the surface's mean normal and
//! hardly thicker than the surface is bent, tells the sphere's neighbors from what it touches.

use super::narrow::Triangle;
use super::pack::Ray;
use glam::{BVec4A, DVec3, Vec4};

/// Discs about the centers of the boxes of four children.
#[derive(Clone, Debug)]
pub(super) struct Flats {
    /// Unit vectors.
    normal: [Vec4; 3],
    /// How far the surface reaches from the center along the normal, to either side.
    thickness: Vec4,
    /// How far it reaches across the normal.
    spread: Vec4,
}

/// When the sphere may touch the discs.
pub(super) struct Reach {
    /// Not before this; infinite for never.
    pub(super) near: Vec4,
    /// Likely at this or soon after: an order to look in, not a bound.
    pub(super) expected: Vec4,
}

/// Larger parts of a mesh are seldom flat, and would cost time to look at again on every level of the tree.
const MOST_TRIANGLES: usize = 512;

/// Where the motion is more aslant than this, dividing by its slope would cost too many digits.
const LEAST_SLOPE: f32 = 0.2;

impl Flats {
    /// Discs so large that they exclude nothing.
    pub(super) const UNKNOWN: Self =
        Self { normal: [Vec4::ZERO; 3], thickness: Vec4::splat(1e30), spread: Vec4::splat(1e30) };

    /// Makes the disc of one child: of these triangles, about the center of their box.
    pub(super) fn set(&mut self, child: usize, triangles: &[Triangle], center: DVec3) {
        if triangles.len() > MOST_TRIANGLES {
            return;
        }
        let mut sum = DVec3::ZERO;
        for [a, b, c] in triangles {
            let normal = (b - a).cross(c - a);
            sum += if normal.dot(sum) < 0.0 { -normal } else { normal };
        }
        let normal = sum.normalize_or(DVec3::Z).as_vec3();
        let (mut thickness, mut spread) = (0.0_f64, 0.0_f64);
        for &corner in triangles.iter().flatten() {
            let way = corner - center;
            let height = normal.as_dvec3().dot(way);
            thickness = thickness.max(height.abs());
            spread = spread.max((way - normal.as_dvec3() * height).length_squared());
        }
        for axis in 0..3 {
            self.normal[axis][child] = normal[axis];
        }
        // Rounding these to f32 is part of the slack that the ray's margin has.
        self.thickness[child] = thickness as f32;
        self.spread[child] = spread.sqrt() as f32;
    }

    /// When the sphere may touch the discs, given a bound `near` that holds already.
    #[inline]
    pub(super) fn reach(&self, center: &[Vec4; 3], ray: &Ray, near: Vec4) -> Reach {
        let direction = ray.direction().to_array().map(Vec4::splat);
        let way = [0, 1, 2].map(|axis| center[axis] - ray.origin[axis]);
        let (height, slope) = (dot(&self.normal, &way), dot(&self.normal, &direction));
        let gap = height.abs() - self.thickness - ray.margin;
        let approaches = (height * slope).cmpgt(Vec4::ZERO);
        let is_steep = slope.abs().cmpge(Vec4::splat(LEAST_SLOPE));
        let plane = gap.max(Vec4::ZERO) / slope.abs().max(Vec4::splat(LEAST_SLOPE));
        let near = near.max(Vec4::select(is_steep & approaches, plane, Vec4::ZERO));
        // With the sphere at the disc's plane but its center beside the disc's, it still has to sink in.
        let there = [0, 1, 2].map(|axis| way[axis] - direction[axis] * near);
        let height = dot(&self.normal, &there);
        let beside = (dot(&there, &there) - height * height).max(Vec4::ZERO);
        let expected = near + (beside / (2.0 * ray.margin)).min(beside.sqrt());
        let never = gap.cmpgt(Vec4::ZERO) & !approaches;
        Reach { near: Vec4::select(never, Vec4::INFINITY, near), expected }
    }

    /// Which discs the sphere has not reached when it has gone as far as `limit`: as for boxes, all of the disc lies
    /// beyond the radius in a direction that points forward.
    #[inline]
    pub(super) fn passed(&self, center: &[Vec4; 3], ray: &Ray, limit: f32) -> BVec4A {
        let direction = ray.direction().to_array().map(Vec4::splat);
        let end = ray.origin + ray.direction() * limit;
        let way = [0, 1, 2].map(|axis| center[axis] - end[axis]);
        let height = dot(&self.normal, &way);
        let across = [0, 1, 2].map(|axis| way[axis] - self.normal[axis] * height);
        let distance = dot(&across, &across).sqrt();
        let above = (height.abs() - self.thickness).max(Vec4::ZERO).copysign(height);
        let beside = (distance - self.spread).max(Vec4::ZERO);
        let share = beside / distance.max(Vec4::splat(f32::MIN_POSITIVE));
        let forward = above * dot(&self.normal, &direction) + share * dot(&across, &direction);
        forward.cmpge(Vec4::ZERO) & (above * above + beside * beside).cmpgt(Vec4::splat(ray.margin * ray.margin))
    }
}

#[inline]
fn dot(a: &[Vec4; 3], b: &[Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
