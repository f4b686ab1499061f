//! Content of a file as its reader found it, before points become a surface.

use super::exact::Moved;
#[cfg(feature = "scans")]
use super::scan;

/// Triangles or points.
pub(super) enum Parsed {
    /// Triangles.
    Mesh(Moved),
    /// Points of a surface.
    #[cfg(feature = "scans")]
    Points(scan::Points),
}
