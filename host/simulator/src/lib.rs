//! A probe with three fingers that touches triangle meshes.
//!
//! ```text
//! mesh ──► scene ──► approach ──► contact times
//! ```
//!
//! | module | what it does | start with |
//! |---|---|---|
//! | [`mesh`] | reads triangles from files; makes the built-in objects | [`mesh::source::objects`](fn@mesh::source::objects) |
//! | [`probe`] | the simulator: scene, approach, first contact; the noise of a real probe | [`probe::scene::Scene`] |
//! | [`random`] | random numbers that depend on a seed and on what they are for | [`random::generator`] |
//! | [`in_order`](mod@in_order) | parallel work that fails with the first failure in order | |
//!
//! The crate `palpate` builds on this one, adds touches, training and recognition, and re-exports it.

pub mod error;
pub mod in_order;
pub mod random;

pub mod mesh;
pub mod probe;

pub use error::{Error, Result};
