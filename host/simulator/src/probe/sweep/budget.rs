//! The error budget: by how much each step of a cast may be wrong, and why that is good enough.
//!
//! Lengths are in the frame of the casts, where the mesh's longest side is between 1 and 2. The steps take their
//! constants from here, so the table and the code cannot disagree.

/// The precision in which contacts are decided.
pub type Real = f64;

/// A vector of that precision.
pub type Vector = glam::DVec3;

/// By how much one step may be wrong.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// The step.
    pub step: &'static str,
    /// The most that it may be off by.
    pub error: f64,
    /// In what unit, or as a share of what.
    pub of: &'static str,
    /// Reason why it is not larger, and why it does no harm.
    pub reason: &'static str,
}

/// Boxes, and the eight-wide reject: rounding in f32, as a share of 1 + radius + distance of the start.
pub const BOX: f64 = 4e-6;
/// Moving the start up to the mesh's box, where the start is near.
pub const ENTRY: f64 = 1e-9;
/// Moving a start that is far away up to the box, as a share of its distance.
pub const ENTRY_FAR: f64 = 1e-15;
/// A triangle narrower than this share of its length is treated as having no face.
pub const FLAT: f64 = 1e-8;
/// An edge closer to the direction of motion than this angle, in radians, is treated as having no cylinder.
pub const PARALLEL: f64 = 1e-12;
/// A contact up to this much before the start counts as one at the start.
pub const EARLY: f64 = 1e-12;
/// The time of contact with a triangle's plane, when it is used to skip the triangle.
pub const PLANE: f64 = 1e-9;

/// A triangle narrower than this share of its length has all its edges tested; one that is wider, only those that the
/// center is outside of, or less than this share of the length inside of.
pub const NARROW: f64 = 1e-6;
/// Squared sine of an edge's angle with the motion below which both its ends are tested as well.
pub const STEEP: f64 = 1e-6;
/// A squared distance of this many times the squared radius is a miss, whatever rounding does.
pub const CLEAR: f64 = 1.0 + 1e-12;

/// Every step of a cast that is not exact up to the last bits of an f64.
pub const BUDGET: [Allowance; 8] = [
    Allowance {
        step: "boxes of the tree, eight-wide reject (f32)",
        error: BOX,
        of: "1 + radius + start, added to the radius",
        reason: "a few roundings of 6e-8 each; they let more triangles through, never fewer",
    },
    Allowance {
        step: "moving the start up to the box",
        error: ENTRY,
        of: "length, added to the box",
        reason: "stops short of the box by more than the six roundings of 1e-16 that the move costs",
    },
    Allowance {
        step: "the same from far away",
        error: ENTRY_FAR,
        of: "the start's distance, sideways",
        reason: "the start itself has no more digits; a path that grazes by d magnifies it to 1/sqrt(d) of it in time",
    },
    Allowance {
        step: "needles count as their edges",
        error: FLAT * FLAT,
        of: "length",
        reason: "between edges w apart the surface lies at most w²/8r outside the cylinders about them",
    },
    Allowance {
        step: "edges along the motion count as their corners",
        error: PARALLEL,
        of: "the edge's length",
        reason: "the most by which the sphere drifts away from the edge between its ends",
    },
    Allowance {
        step: "contacts just before the start",
        error: EARLY,
        of: "length",
        reason: "a start within rounding of contact is neither lost nor found late",
    },
    Allowance {
        step: "skipping a triangle by the time of its plane",
        error: PLANE,
        of: "length, subtracted from the time",
        reason: "the plane's rounding is below 1e-14 / FLAT of the triangle's size times FLAT, far below this",
    },
    Allowance {
        step: "contact times in a touch",
        error: 5e-7,
        of: "seconds",
        reason: "times are whole microseconds, on the host as on the chip",
    },
];
