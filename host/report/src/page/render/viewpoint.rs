//! Viewpoint from which a mesh is drawn.

use glam::{Mat3, Vec3};
use palpate::mesh::Mesh;

/// A direction to look from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Viewpoint {
    /// Turns the mesh's axes into the viewer's: x to the right, y up, z toward the viewer.
    pub(super) turn: Mat3,
}

impl Viewpoint {
    /// From `azimuth` degrees (0 looks along −x, 90 along −y) and `elevation` degrees above the plane of x and y, with z
    /// up.
    fn new(azimuth: f32, elevation: f32) -> Self {
        let (sin_a, cos_a) = libm::sincosf(azimuth.to_radians());
        let (sin_e, cos_e) = libm::sincosf(elevation.to_radians());
        let right = Vec3::new(-sin_a, cos_a, 0.0);
        let up = Vec3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e);
        let toward = Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        Self { turn: Mat3::from_cols(right, up, toward).transpose() }
    }

    /// From the front, right and above, with z up.
    pub(super) fn above() -> Self {
        Self::new(-50.0, 32.0)
    }

    /// From the front, right and above; the flatter the mesh lies, the more from above. A mesh that is thin in x or y
    /// is first turned onto its side.
    pub(super) fn three_quarter(mesh: &Mesh) -> Self {
        let [low, high] = bounds(mesh);
        let side = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        let thin = |a: f32, b: f32, c: f32| a < 0.3 * b.min(c);
        let laid = if thin(side.x, side.y, side.z) {
            Mat3::from_cols(Vec3::Z, Vec3::X, Vec3::Y)
        } else if thin(side.y, side.x, side.z) {
            Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X)
        } else {
            Mat3::IDENTITY
        };
        let lain = laid * side;
        let flatness = (lain.z.abs() / lain.x.abs().min(lain.y.abs())).clamp(0.0, 1.0);
        Self { turn: Self::new(-42.0 - 18.0 * flatness, 62.0 - 36.0 * flatness).turn * laid }
    }
}

/// The least and the greatest corner of the mesh's bounding box; the origin twice if it has no finite vertex.
fn bounds(mesh: &Mesh) -> [Vec3; 2] {
    let finite = mesh.vertices.iter().map(|&v| Vec3::from(v)).filter(|v| v.is_finite());
    finite.map(|v| [v, v]).reduce(|[low, high], [v, _]| [low.min(v), high.max(v)]).unwrap_or([Vec3::ZERO; 2])
}
