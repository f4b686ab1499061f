//! The sweep's test of one triangle in f32: the text of `narrow.rs`, compiled in another precision.

use glam::DVec3;
use palpate::probe::sweep::Surface;
use palpate::probe::sweep::narrow::{Motion, Triangle};

#[allow(unreachable_pub, clippy::all, clippy::pedantic, reason = "the same text in two precisions")]
#[path = "."]
mod single {
    /// The constants of the sweep, in f32.
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

    #[path = "../../host/simulator/src/probe/sweep/narrow.rs"]
    pub mod narrow;
}

/// The distance that the sphere travels until it touches the triangle, if that is less than `limit`, computed in f32.
fn first_in_single(motion: &Motion, triangle: &Triangle, limit: f64) -> Option<f64> {
    let motion = single::narrow::Motion {
        origin: motion.origin.as_vec3(),
        direction: motion.direction.as_vec3(),
        radius: motion.radius as f32,
    };
    single::narrow::first_contact(&motion, &triangle.map(|corner| corner.as_vec3()), limit as f32).map(f64::from)
}

/// [`Surface::first_contact`] with the remaining triangles in f32 too.
#[must_use]
pub fn single_after_reject(surface: &Surface, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    surface.first_contact_by::<true>(origin, direction, radius, first_in_single)
}

/// [`Surface::first_contact`] with every triangle of a pack in f64, none rejected first.
#[must_use]
pub fn double_without_reject(surface: &Surface, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    surface.first_contact_by::<false>(origin, direction, radius, palpate::probe::sweep::narrow::first_contact)
}
