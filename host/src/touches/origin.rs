//! Origin of touches.

use super::{Longest, Samples, Surroundings};
use crate::error::{Error, Result, problem};
use crate::mesh::{Instance, Object};
use crate::probe::approach::{Aim, CLEARANCE, Probe};
use crate::probe::noise::Noise;
use crate::probe::unit;
use glam::DVec3;
use palpate_shared::format::Length;
use std::ops::Range;

/// Origin of the touches of a data set. The same origin and mesh give the same touches. The default is the published
/// method: 21,000 full touches per object, longest side 10 units.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Number of touches of each object; with `approaches`, number of approaches. Of all parts together.
    pub touches: u64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Unit of the probe's lengths: units, with every object scaled to `length`, or millimeters, with objects at their
    /// true size; units if it is not stated.
    #[serde(default = "unit::tenth", with = "unit")]
    pub unit: Length,
    /// The longest side of an object's bounding box, in units; of no meaning at true size.
    pub length: f64,
    /// The probe's measures.
    pub probe: Probe,
    /// Target of approaches.
    #[serde(default, skip_serializing_if = "Aim::is_box")]
    pub aim: Aim,
    /// Surroundings of the objects: floating, or on a table.
    #[serde(default, skip_serializing_if = "Surroundings::is_floating")]
    pub scene: Surroundings,
    /// True if the probe's direction and alignment are written too.
    pub pose: bool,
    /// True for recorded touches that state the hand's position. No simulated ones do.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub position: bool,
    /// True if every approach is kept, not only full touches: sample i is then approach i.
    pub approaches: bool,
    /// The samples that this data set holds, if it is a part of them all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<Samples>,
    /// Noise that the real probe added to each touch, as far as the touches were made as a real probe would make them.
    #[serde(default, skip_serializing_if = "Noise::is_none")]
    pub real: Noise,
}

impl Default for Origin {
    fn default() -> Self {
        Self {
            touches: 21_000,
            seed: 1,
            unit: Length::Tenth,
            length: 10.0,
            probe: Probe::default(),
            aim: Aim::Box,
            scene: Surroundings::Floating,
            pose: false,
            position: false,
            approaches: false,
            samples: None,
            real: Noise::default(),
        }
    }
}

impl Origin {
    /// Origin of recorded touches: every touch with a contact is kept, nothing is drawn.
    pub fn recorded(probe: Probe, unit: Length, pose: bool) -> Self {
        Self { touches: 0, seed: 0, probe, unit, pose, approaches: true, ..Self::default() }
    }

    /// Rejects settings that no touches can be made with.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) naming the field.
    pub fn check(&self) -> Result<()> {
        if self.touches == 0 {
            let name = if self.approaches { "approaches" } else { "touches" };
            return Err(Error::setting(name, 0, "1 or more"));
        }
        if let Some(samples) = self.samples.filter(|samples| samples.end > self.touches) {
            let allowed = format!("samples up to {}, as many as each object has", self.touches);
            return Err(Error::setting("samples", samples, allowed));
        }
        self.real.check()?;
        if self.position {
            return Err(Error::setting("position", true, "false: maps of meshes are cast, without touches"));
        }
        self.scene.check()?;
        match self.unit {
            Length::Tenth => self.probe.check(self.length),
            // Each object is checked when its size is known.
            Length::Millimeter => self.probe.check(1.0),
        }
    }

    /// The longest side that an instance's bounding box is scaled to.
    ///
    /// # Errors
    /// When it is to have its true size, and that is not known.
    pub fn length_of(&self, object: &Object, instance: &Instance) -> Result<f64> {
        let unknown = || {
            problem!("{}: the true size is unknown, because the mesh states no unit", object.name)
                .fix("State the unit of the mesh: mm, cm, m or in.")
        };
        match self.unit {
            Length::Tenth => Ok(self.length),
            Length::Millimeter => object.true_length(instance).ok_or_else(unknown),
        }
    }

    /// Distance from the sphere about a bounding box at which an approach starts: at true size half of the longest
    /// side, as where objects are 10 units long, and at least as far as a tilted probe reaches.
    pub fn clearance(&self, [low, high]: [DVec3; 2]) -> f64 {
        match self.unit {
            Length::Tenth => CLEARANCE,
            Length::Millimeter => ((high - low).max_element() / 2.0).max(self.probe.spacing + self.probe.radius),
        }
    }

    /// The longest time between two contacts of the touches: that of the whole way of an approach, where objects have one size.
    pub fn longest(&self) -> Longest {
        let way = 3_f64.sqrt() * self.length + 2.0 * self.clearance([DVec3::ZERO; 2]);
        match self.unit {
            Length::Tenth => Longest::of_scale("the data set", way / self.probe.speed, self.probe.speed, self.unit),
            Length::Millimeter => Longest::default(),
        }
    }

    /// The samples of each object: all, or the part of them.
    pub(crate) fn samples(&self) -> Range<u64> {
        self.samples.map_or(0..self.touches, Range::from)
    }
}
