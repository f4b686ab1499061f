//! The simulator: a scene, a probe, an approach, and when each finger first touches.

pub mod approach;
pub mod cast;
pub mod scene;
pub mod sweep;

pub use approach::{Approach, Probe};
pub use scene::Scene;
