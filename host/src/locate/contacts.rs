//! Places and heights of fingertips.

use crate::probe::approach::{FINGERS, Probe};
use palpate_shared::Touch;

/// A height that a fingertip met, in the placement's frame, in millimeters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) height: f64,
}

/// Fingertips of a touch at its first contact; none without a position or pose.
pub(super) fn tips(touch: &Touch, probe: &Probe) -> Option<[Met; FINGERS]> {
    let (pose, position) = (touch.pose()?, touch.position()?);
    let [x, y, z] = position.micrometers.map(|micrometers| f64::from(micrometers) / 1_000.0);
    let one = f64::from(palpate_shared::Q15_ONE);
    let row = pose.alignment.map(|share| f64::from(share) / one * probe.spacing);
    Some([-1.0, 0.0, 1.0].map(|finger| Met {
        x: x + finger * row[0],
        y: y + finger * row[1],
        height: z + finger * row[2],
    }))
}
