//! Fingers that bend aside where they meet a surface at a flat angle.

use crate::probe::approach::{Approach, FINGERS, Probe};
use crate::probe::scene::Scene;
use crate::probe::sweep::Contact;
use rand::Rng;
use rand_distr::{Distribution, Exp1};

/// Fingers that bend aside where they meet a surface at a flat angle: they touch late, or never.
///
/// Up to an angle between motion and normal, friction holds a fingertip where it touches. Beyond, it slides downhill: a
/// spring that closes the switch at a force F also bends aside by F · tan(angle − friction's) over the sideways stiffness. The
/// finger goes on beside the way it was on and touches where the surface is there: late, more so the flatter, and never
/// beyond an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grazing {
    /// Angle between motion and normal up to which a finger touches as simulated, in degrees.
    pub angle: f64,
    /// Way aside where the surface is 45 degrees flatter than that, in the mean of all touches: as the time that the probe
    /// takes for it at its nominal speed, in microseconds. 0 for fingers that do not bend.
    pub bend: f64,
}

impl Grazing {
    /// True if it changes no touch.
    pub fn is_none(&self) -> bool {
        self.bend == 0.0
    }

    /// Distances like [`Approach::distances`], with fingers that bend aside. Cost: two casts for each finger that does.
    pub fn distances(
        &self,
        approach: &Approach,
        scene: &Scene,
        probe: &Probe,
        random: &mut impl Rng,
    ) -> [Option<f64>; FINGERS] {
        let each = approach.fingers(probe.spacing).map(|finger| {
            let draw = Exp1.sample(random);
            let cast = [finger, approach.direction];
            self.distance(cast, &scene.contact(finger, approach.direction, probe.radius)?, draw, scene, probe)
        });
        approach.above_table(each, scene, probe)
    }

    /// Distance at which a finger touches that would do so at `contact` on its way from start in a direction; with an
    /// exponential number of mean 1, by how much it bends in this touch.
    pub fn distance(
        &self,
        [start, direction]: [glam::DVec3; 2],
        contact: &Contact,
        draw: f64,
        scene: &Scene,
        probe: &Probe,
    ) -> Option<f64> {
        let cosine = -contact.normal.dot(direction);
        let over = libm::acos(cosine.clamp(-1.0, 1.0)) - self.angle.to_radians();
        if over <= 0.0 || self.is_none() {
            return Some(contact.distance);
        }
        let aside = self.bend / 1e6 * probe.speed * draw * libm::tan(over.min(1.55));
        let downhill = (contact.normal + direction * cosine).normalize_or_zero();
        let there = scene.first_contact(start + downhill * aside, direction, probe.radius)?;
        Some(there.max(contact.distance))
    }
}
