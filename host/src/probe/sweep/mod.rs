//! First contact of a moving sphere with a triangle mesh.
//!
//! Boxes in f32 with slack find the leaves that the sphere may reach (`tree`), an f32 test on eight triangles at once
//! throws out those that it cannot (`pack`), and the rest is decided in f64 ([`narrow`]).

pub mod budget;
mod flat;
pub mod narrow;
mod pack;
mod tree;

#[cfg(test)]
mod tests;

use glam::DVec3;
use narrow::{Motion, Triangle, double, single};
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use tree::Tree;

/// How the triangles of a leaf are decided: the choices that there are between speed and error.
pub trait Precision {
    /// Whether the eight-wide f32 test goes first.
    const REJECT: bool;

    /// The distance until the sphere touches the triangle, if that is less than `limit`.
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64>;
}

/// f64 after the f32 reject: what casts use.
#[derive(Clone, Copy, Debug)]
pub struct Exact;

/// f64 for every triangle of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

/// f32 after the f32 reject, only to measure what that costs.
#[derive(Clone, Copy, Debug)]
pub struct Single;

impl Precision for Exact {
    const REJECT: bool = true;

    #[inline]
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
        double::first_contact(motion, triangle, limit)
    }
}

impl Precision for Plain {
    const REJECT: bool = false;

    #[inline]
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
        double::first_contact(motion, triangle, limit)
    }
}

impl Precision for Single {
    const REJECT: bool = true;

    #[inline]
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
        let motion = single::Motion {
            origin: motion.origin.as_vec3(),
            direction: motion.direction.as_vec3(),
            radius: motion.radius as f32,
        };
        single::first_contact(&motion, &triangle.map(|corner| corner.as_vec3()), limit as f32).map(f64::from)
    }
}

/// A triangle mesh, ready for spheres to be moved against it.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Where the mesh's box has its center.
    center: DVec3,
    /// A power of two: the mesh's units in one unit of the frame that casts are made in, where the box's longest side
    /// is between 1 and 2. Exact, and it keeps f32 in its range for meshes of any size.
    unit: f64,
    /// Half the box's sides, in the frame of the casts.
    half: DVec3,
    /// In the frame of the casts, in the tree's order.
    triangles: Vec<Triangle>,
    tree: Tree,
}

impl Surface {
    /// A surface of these triangles (corners with finite coordinates, at least one triangle).
    pub fn new(mut triangles: Vec<Triangle>) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &corner in triangles.iter().flatten() {
            (low, high) = (low.min(corner), high.max(corner));
        }
        let center = (low + high) / 2.0;
        let longest = (high - low).max_element();
        let unit = if longest > 0.0 { libm::ldexp(1.0, libm::ilogb(longest)) } else { 1.0 };
        for corner in triangles.iter_mut().flatten() {
            *corner = (*corner - center) / unit;
        }
        let (triangles, tree) = Tree::new(without_repeats(triangles));
        Self { center, unit, half: (high - low) / (2.0 * unit), triangles, tree }
    }

    /// The triangles, in the order of the tree; one that the mesh repeats comes once.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = Triangle> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|corner| corner * self.unit + self.center))
    }

    /// The box around the mesh: its lowest and highest corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.center - self.half * self.unit, self.center + self.half * self.unit]
    }

    /// The first time t ≥ 0 at which a sphere of this radius (greater than 0), centered at origin + t · direction, touches
    /// the surface; 0 when it starts in contact, none when it never does. The direction need not have unit length;
    /// without a direction (zero, or not finite) only a contact at the start counts.
    pub fn first_contact(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
        self.first_contact_in::<Exact>(origin, direction, radius)
    }

    /// The same in another [`Precision`].
    pub fn first_contact_in<P: Precision>(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
        let length = direction.length();
        let moves = length > 0.0 && length.is_finite();
        let motion = Motion {
            origin: (origin - self.center) / self.unit,
            direction: if moves { direction / length } else { DVec3::ZERO },
            radius: radius / self.unit,
        };
        let entry = self.entry(&motion)?;
        let near = Motion { origin: motion.origin + motion.direction * entry, ..motion };
        let distance = entry + self.tree.first_contact::<P>(&self.triangles, &near)?;
        Some(if moves { distance * self.unit / length } else { 0.0 })
    }

    /// Whether the sphere's path meets the mesh's box at all: a cheap necessary condition for a contact.
    pub fn may_touch(&self, origin: DVec3, direction: DVec3, radius: f64) -> bool {
        let motion = Motion { origin: (origin - self.center) / self.unit, direction, radius: radius / self.unit };
        self.entry(&motion).is_some()
    }

    /// How far the sphere can be moved up to the mesh's box, stopping short of any contact; none when it never gets
    /// there. From far away this saves the digits that the distance would cost.
    fn entry(&self, motion: &Motion) -> Option<f64> {
        // Rounding moves a point that is far away by this much at most.
        let slack = budget::ENTRY + budget::ENTRY_FAR * motion.origin.abs().max_element();
        let reach = self.half + DVec3::splat(motion.radius + slack);
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (o, d, h) = (motion.origin[axis], motion.direction[axis], reach[axis]);
            if d == 0.0 {
                if o.abs() > h {
                    return None;
                }
            } else {
                let (a, b) = ((-h - o) / d, (h - o) / d);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
        }
        (near <= far).then_some(near)
    }
}

/// Leaves out triangles that have the corners of an earlier one. They change no contact, but many boxes that coincide
/// cost the tree's builder a time that grows with the square of their number.
fn without_repeats(mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    let corners = |triangle: &Triangle| {
        let mut corners = triangle.map(|corner| corner.to_array().map(|value| (value + 0.0).to_bits()));
        corners.sort_unstable();
        corners
    };
    let hash = BuildHasherDefault::<DefaultHasher>::default();
    let mut order: Vec<(u64, u32)> =
        triangles.iter().zip(0..).map(|(triangle, index)| (hash.hash_one(corners(triangle)), index)).collect();
    order.sort_unstable();
    let mut repeats = vec![false; triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let mut kept: Vec<[[u64; 3]; 3]> = Vec::new();
        for &(_, index) in same {
            let corners = corners(&triangles[index as usize]);
            repeats[index as usize] = kept.contains(&corners);
            if !repeats[index as usize] {
                kept.push(corners);
            }
        }
    }
    let mut repeats = repeats.into_iter();
    triangles.retain(|_| repeats.next() == Some(false));
    triangles
}
