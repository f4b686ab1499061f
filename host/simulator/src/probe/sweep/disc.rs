//! Discs that bound the surface in the boxes of a fine mesh more closely than the boxes do.
//!
//! If triangles are small compared with the sphere, the surface in a box is nearly flat, and mostly oblique: the box's
//! corners stand out of it, toward the sphere. A disc about the box's center, perpendicular to the surface's mean normal
//! and only a little thicker than the surface is bent, excludes boxes that the sphere passes close to without touching.

use super::narrow::Triangle;
use super::pack::Ray;
use glam::{BVec4A, DVec3, Vec4};

/// Discs about the centers of the boxes of four children.
#[derive(Clone, Debug)]
pub(super) struct Discs {
    /// Unit vectors, axis by axis.
    normal: [Vec4; 3],
    /// Extent of the surface from the center along the normal, to either side.
    thickness: Vec4,
    /// Extent perpendicular to the normal.
    spread: Vec4,
}

/// Distances that the sphere travels before it may touch the discs.
pub(super) struct ContactBounds {
    /// No contact before this; infinite for never.
    pub(super) near: Vec4,
    /// Contact is likely at this distance or soon after: a search order, not a bound.
    pub(super) expected: Vec4,
}

/// Larger parts of a mesh are seldom flat, and would take time to measure again on every level of the tree.
const MOST_TRIANGLES: usize = 512;

/// Cosine between motion and normal below which dividing by it would cost too many digits.
const LEAST_SLOPE: f32 = 0.2;

impl Discs {
    /// Discs so large that they exclude nothing.
    pub(super) const UNKNOWN: Self =
        Self { normal: [Vec4::ZERO; 3], thickness: Vec4::splat(1e30), spread: Vec4::splat(1e30) };

    /// Sets the disc of one child: about the center of its box, around its triangles.
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
        // The slack in the ray's margin covers the rounding of these to f32.
        self.thickness[child] = thickness as f32;
        self.spread[child] = spread.sqrt() as f32;
    }

    /// Bounds of the sphere's contact with the discs, given that it does not touch them before `near`.
    #[inline]
    pub(super) fn contact_bounds(&self, center: &[Vec4; 3], ray: &Ray, near: Vec4) -> ContactBounds {
        let direction = ray.direction().to_array().map(Vec4::splat);
        let way = [0, 1, 2].map(|axis| center[axis] - ray.origin[axis]);
        let (height, slope) = (dot(&self.normal, &way), dot(&self.normal, &direction));
        let gap = height.abs() - self.thickness - ray.margin;
        let approaches = (height * slope).cmpgt(Vec4::ZERO);
        let is_steep = slope.abs().cmpge(Vec4::splat(LEAST_SLOPE));
        let plane = gap.max(Vec4::ZERO) / slope.abs().max(Vec4::splat(LEAST_SLOPE));
        let near = near.max(Vec4::select(is_steep & approaches, plane, Vec4::ZERO));
        // Where the sphere touches the disc's plane, but beside the disc's center, it has to travel a little further.
        let there = [0, 1, 2].map(|axis| way[axis] - direction[axis] * near);
        let height = dot(&self.normal, &there);
        let beside = (dot(&there, &there) - height * height).max(Vec4::ZERO);
        let expected = near + (beside / (2.0 * ray.margin)).min(beside.sqrt());
        let never = gap.cmpgt(Vec4::ZERO) & !approaches;
        ContactBounds { near: Vec4::select(never, Vec4::INFINITY, near), expected }
    }

    /// The discs that the sphere has not reached when it has traveled as far as `limit`: as for boxes, all of the disc
    /// lies beyond the radius in a direction that points forward.
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
