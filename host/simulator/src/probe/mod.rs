//! The simulator: when does each finger of a moving probe first touch an object?
//!
//! - [`Scene`] is a [`Mesh`](crate::mesh::Mesh) in the units of the probe.
//! - [`Probe`] has the dimensions of the three fingers and their speed; [`Approach`] is one attempt to touch: where the
//!   probe starts, in which direction it moves, how its row of fingers is turned. It gives the distance that each finger
//!   travels, and from these distances a touch.
//! - [`sweep`] finds the first contact of one sphere with the mesh: boxes, then a quick reject, then the exact time.
//! - [`hand`] says how far the hand goes, and which contacts it therefore never makes.
//! - [`mod@file`] reads a probe from a TOML file, with what a real one adds; [`noise`] adds it to touches.
//!
//! Contact is rigid and motion straight: no forces, no friction. From here `palpate::capture` draws
//! approaches and keeps their touches.
//!
//! ```
//! use palpate_simulator::mesh::Mesh;
//! use palpate_simulator::probe::{Approach, Probe, Scene};
//! use rand::SeedableRng;
//!
//! # fn main() -> palpate_simulator::Result<()> {
//! let scene = Scene::new(&Mesh::globe(20), 10.0)?;
//! let probe = Probe::default();
//! let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
//!
//! // Approaches often miss: draw until all three fingers touch.
//! let touch = loop {
//!     let approach = Approach::draw(&mut random, scene.bounds(), probe.tilt);
//!     if let Some(distances) = approach.full_distances(&scene, &probe) {
//!         break approach.touch(distances.map(Some), &probe);
//!     }
//! };
//! // Times count from the first contact, in microseconds.
//! let first = touch.times().iter().filter_map(|time| time.micros()).min();
//! assert_eq!(first, Some(0));
//! # Ok(())
//! # }
//! ```

pub mod approach;
pub mod file;
pub mod hand;
pub mod noise;
pub mod scene;
pub mod sweep;
pub mod unit;

pub use approach::{Aim, Approach, Probe};
pub use scene::Scene;

/// The vectors in this room's signatures: [`DVec3`](glam::DVec3) for positions and directions, in units.
pub use glam;
