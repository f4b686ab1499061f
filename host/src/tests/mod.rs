//! Tests of several rooms together, and helpers of all rooms' tests.

#[cfg(feature = "train")]
mod placements;
pub(crate) mod repetitions;
#[cfg(feature = "objects")]
mod several_meshes;
#[cfg(feature = "train")]
mod stroke;
pub(crate) mod synthetic;
