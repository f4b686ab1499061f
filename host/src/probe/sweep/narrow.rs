//! First contact of a moving sphere with one triangle.
//!
//! The region that the sphere's center must not enter is the triangle thickened by the radius: two faces, three
//! cylinders about the edges, three spheres about the corners. The first contact is the earliest entry into any of
//! them. Where two meet, both give the same time up to rounding, so a contact that one loses to rounding the other
//! finds; and what is no triangle (a needle, a segment, a point) is left to its edges and corners.
//!
//! The same text is compiled twice: in f64, which casts use, and in f32, to measure what that would save and cost.

/// In f64; the constants are those of the [budget](super::budget).
pub mod double {
    use crate::probe::sweep::budget::{EARLY, FLAT, PARALLEL, PLANE};

    type Real = f64;
    type Vector = glam::DVec3;

    include!("narrow/contact.rs");
}

/// In f32, with what the f64 constants have to become in it.
pub mod single {
    type Real = f32;
    type Vector = glam::Vec3;

    const EARLY: Real = 1e-6;
    const FLAT: Real = 1e-4;
    const PARALLEL: Real = 1e-6;
    const PLANE: Real = 1e-5;

    include!("narrow/contact.rs");
}

pub use double::{Motion, Triangle};
