//! Meshes, scenes, touches and noise through the crate's public interface. Private modules whose every case no public function
//! reaches are compiled here from their sources.

/// A value with some of its fields changed.
macro_rules! with {
    ($base:expr; $($field:ident: $value:expr),+) => {{
        let mut value = $base;
        $(value.$field = $value;)+
        value
    }};
}

#[cfg(feature = "objects")]
mod builtin;
mod cast;
mod collada;
mod exact;
mod facts;
#[cfg(feature = "objects")]
mod far;
mod file;
mod gltf;
mod hand;
mod hull;
#[cfg(feature = "objects")]
mod implicit;
mod in_order;
mod noise;
mod obj;
mod partial_noise;
mod placements;
mod ply;
mod polygon;
mod probe_file;
mod random;
mod samples;
mod scene;
mod source;
mod stl;
mod sweep;
mod text;
mod triangles;
mod unread;
mod weld;

use palpate_shared::Touch;
// Named so by the sources that are compiled here.
#[cfg(feature = "objects")]
use palpate_simulator::mesh;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::probe::{Approach, Probe, Scene};
use rand::SeedableRng;

/// Checks that an error says all of this.
#[track_caller]
fn assert_says(said: impl std::fmt::Display, parts: &[&str]) {
    let said = said.to_string();
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
}

/// The first `count` touches of all three fingers.
fn full_touches(mesh: &Mesh, count: usize) -> Vec<Touch> {
    let (scene, probe) = (Scene::new(mesh, 10.0).unwrap(), Probe::default());
    let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
    let approaches = std::iter::repeat_with(|| Approach::draw(&mut random, scene.bounds(), probe.tilt));
    let touches = approaches.filter_map(|approach| {
        approach.full_distances(&scene, &probe).map(|distances| approach.touch(distances.map(Some), &probe))
    });
    touches.take(count).collect()
}
