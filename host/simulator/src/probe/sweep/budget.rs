//! The error budget: by how much each step of a cast may be wrong, and why that is good enough.
//!
//! Lengths are in the frame of the casts, where the mesh's longest side is between 1 and 2. Times of contact are whole
//! microseconds in a touch, so that an error of 5e-7 s is always there.

/// The precision in which contacts are decided.
pub(super) type Real = f64;

/// A vector of that precision.
pub(super) type Vector = glam::DVec3;

/// Boxes, and the eight-wide reject: rounding in f32, as a share of 1 + radius + distance of the start. A few
/// roundings of 6e-8 each; they let more triangles through, never fewer.
pub(crate) const BOX: f64 = 4e-6;
/// Moving the start up to the mesh's box, where the start is near: more than the six roundings of 1e-16 that
/// this costs.
pub(crate) const ENTRY: f64 = 1e-9;
/// Moving a start that is far away up to the box, as a share of its distance. The start itself has no more digits; a path
/// that grazes by d magnifies it to 1/sqrt(d) of it in time.
pub(crate) const ENTRY_FAR: f64 = 1e-15;
/// A triangle narrower than this share of its length is treated as having no face: between edges w apart the surface
/// lies at most w²/8r outside the cylinders about them.
pub(crate) const FLAT: f64 = 1e-8;
/// An edge closer to the direction of motion than this angle, in radians, is treated as having no cylinder:
/// the most by which the sphere drifts away from the edge between its ends.
pub(crate) const PARALLEL: f64 = 1e-12;
/// A contact up to this much before the start counts as one at the start, so that a start within rounding of contact is
/// neither lost nor found late.
pub(crate) const EARLY: f64 = 1e-12;
/// The time of contact with a triangle's plane, when it is used to skip the triangle. The plane's rounding is
/// below 1e-14 / FLAT of the triangle's size times FLAT, far below this.
pub(crate) const PLANE: f64 = 1e-9;

/// A triangle narrower than this share of its length has all its edges tested; one that is wider, only those that the
/// center is outside of, or less than this share of the length inside of.
pub(crate) const NARROW: f64 = 1e-6;
/// Squared sine of an edge's angle with the motion below which both its ends are tested as well.
pub(crate) const STEEP: f64 = 1e-6;
/// A squared distance of this many times the squared radius is a miss, regardless of rounding.
pub(crate) const CLEAR: f64 = 1.0 + 1e-12;
