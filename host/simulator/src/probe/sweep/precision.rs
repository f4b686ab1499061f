//! Other precisions than the production search has: savings and costs.
//!
//! The production search rejects triangles in f32 and decides the rest in f64. Benchmarks and the report compare it with
//! the two searches here, which share its tree but decide otherwise.

use super::Surface;
use super::narrow::{self, Motion, Triangle};
use super::pack::{Earliest, Ray};
use super::tree::{self, Tree, scale};
use glam::DVec3;

/// A way to decide which triangle of a pack the sphere touches first.
pub trait Precision {
    /// True if triangles are rejected in f32 first, eight at a time.
    const REJECT: bool;

    /// The distance that the sphere travels until it touches the triangle, if that is less than `limit`.
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64>;
}

/// Every triangle of a pack in f64, none rejected first.
#[derive(Clone, Copy, Debug)]
pub struct DoubleWithoutReject;

/// The reject in f32, then the remaining triangles in f32, too.
#[derive(Clone, Copy, Debug)]
pub struct SingleAfterReject;

impl Precision for DoubleWithoutReject {
    const REJECT: bool = false;

    #[inline]
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
        narrow::first_contact(motion, triangle, limit)
    }
}

impl Precision for SingleAfterReject {
    const REJECT: bool = true;

    #[inline]
    fn first_contact(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
        let motion = single::narrow::Motion {
            origin: motion.origin.as_vec3(),
            direction: motion.direction.as_vec3(),
            radius: motion.radius as f32,
        };
        let triangle = triangle.map(|corner| corner.as_vec3());
        single::narrow::first_contact(&motion, &triangle, limit as f32).map(f64::from)
    }
}

/// The text of [`narrow`] compiled in f32.
#[allow(unreachable_pub, clippy::duplicate_mod, reason = "the same text in two precisions")]
#[path = "."]
mod single {
    /// The constants of the error budget, in f32.
    mod budget {
        pub type Real = f32;
        pub type Vector = glam::Vec3;

        pub(crate) const EARLY: Real = 1e-6;
        pub(crate) const FLAT: Real = 1e-4;
        pub(crate) const PARALLEL: Real = 1e-6;
        pub(crate) const PLANE: Real = 1e-5;
        pub(crate) const NARROW: Real = 1e-3;
        pub(crate) const STEEP: Real = 1e-3;
        pub(crate) const CLEAR: Real = 1.0 + 1e-5;
    }

    #[path = "narrow.rs"]
    pub mod narrow;
}

/// [`Surface::first_contact`] in another precision.
pub fn first_contact<P: Precision>(surface: &Surface, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let start = surface.start(origin, direction, radius)?;
    let (tree, triangles, motion) = (&surface.tree, &surface.triangles, &start.motion);
    let ray = Ray::new(motion);
    let distance = match tree.scale_for(&ray) {
        scale::COARSE => search::<P, { scale::COARSE }>(tree, triangles, motion, &ray),
        scale::MIDDLE => search::<P, { scale::MIDDLE }>(tree, triangles, motion, &ray),
        _ => search::<P, { scale::FINE }>(tree, triangles, motion, &ray),
    }?;
    Some((start.skipped + distance) * surface.unit / start.length)
}

/// The production search, with the contacts decided by `P`.
fn search<P: Precision, const SCALE: u8>(
    tree: &Tree,
    triangles: &[Triangle],
    motion: &Motion,
    ray: &Ray,
) -> Option<f64> {
    let mut first = tree::farthest(motion);
    let mut limit = first as f32;
    let mut stack = tree.candidates::<SCALE>(ray, limit);
    while let Some(candidate) = stack.pop() {
        let Some(pack) = tree.resolve::<SCALE>(&candidate, ray, limit, &mut stack) else { continue };
        let mut earliest = if P::REJECT { pack.earliest(ray, limit) } else { Earliest::at_once(pack.count) };
        while let Some(lane) = earliest.pop(limit) {
            let triangle = &triangles[pack.first as usize + lane];
            if let Some(distance) = P::first_contact(motion, triangle, first) {
                first = distance;
                limit = tree::limit_after(first, motion, ray);
            }
        }
    }
    (first < tree::farthest(motion)).then_some(first)
}
