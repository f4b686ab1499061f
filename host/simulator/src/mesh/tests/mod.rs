//! Meshes and files for the tests of all formats.

#[cfg(feature = "objects")]
mod far;
pub(super) mod samples;

use crate::mesh::Mesh;
use crate::probe::{Approach, Probe, Scene};
use palpate_shared::Touch;
use rand::SeedableRng;

/// The first `count` touches of all three fingers.
pub(super) fn full_touches(mesh: &Mesh, count: usize) -> Vec<Touch> {
    let (scene, probe) = (Scene::new(mesh, 10.0).unwrap(), Probe::default());
    let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
    let approaches = std::iter::repeat_with(|| Approach::draw(&mut random, scene.bounds(), probe.tilt));
    let touches = approaches.filter_map(|approach| {
        approach.full_distances(&scene, &probe).map(|distances| approach.touch(distances.map(Some), &probe))
    });
    touches.take(count).collect()
}
