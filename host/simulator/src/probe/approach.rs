//! One attempt of the probe to touch a scene.
//!
//! The probe is three spheres in a row that move together in a straight line. Where it starts, where it aims and how
//! its row is turned are drawn at random; when each finger first touches is what it measures.

use crate::error::{Error, Result};
use crate::probe::scene::Scene;
use glam::DVec3;
use palpate_shared::{ContactTime, Pose, Q15_ONE, Touch};
use rand::{Rng, RngExt};

/// The number of the probe's fingers.
pub const FINGERS: usize = 3;

/// Distance from the sphere about the object's bounding box at which an approach starts, in units.
pub const CLEARANCE: f64 = 5.0;

/// The probe's dimensions and motion.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Probe {
    /// The fingers' radius, in units.
    pub radius: f64,
    /// The distance between neighboring fingers' centers, in units.
    pub spacing: f64,
    /// Speed of the probe, in units per second.
    pub speed: f64,
    /// Largest tilt of the row of fingers from the perpendicular to the motion, in degrees, to either side.
    pub tilt: f64,
    /// Way that the hand goes on after the first contact, in units, at the nominal speed: a contact that comes later than it
    /// takes for that is missing. None: as far as any finger needs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stroke: Option<f64>,
    /// Way that the hand goes from its start before an approach without a contact counts as a miss, in units. None: past the
    /// object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub travel: Option<f64>,
    /// Length by which a recorded contact may be later than the stroke and is still of this hand, in units; see
    /// [`Probe::latest`]. None: as much as clocks and lengths are usually off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stroke_tolerance: Option<f64>,
}

/// The published probe: radius 0.15, spacing 1.5, 10 units per second, ±10°, and a hand that goes on past the object.
impl Default for Probe {
    fn default() -> Self {
        Self { radius: 0.15, spacing: 1.5, speed: 10.0, tilt: 10.0, stroke: None, travel: None, stroke_tolerance: None }
    }
}

impl Probe {
    /// Refuses a probe that cannot be: a radius, speed or spacing out of range, or a speed too low for contact times in
    /// microseconds on an object whose bounding box's longest side is `length` units.
    ///
    /// # Errors
    /// A [`Kind::Setting`](crate::error::Kind::Setting) that names the field, or `length`.
    pub fn check(&self, length: f64) -> Result<()> {
        let positive = [("length", length), ("radius", self.radius), ("speed", self.speed)];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(name, value, "a number greater than 0"));
            }
        }
        if !(self.spacing.is_finite() && self.spacing >= 0.0) {
            return Err(Error::setting("spacing", self.spacing, "a number of 0 or more"));
        }
        if !(0.0..90.0).contains(&self.tilt) {
            return Err(Error::setting("tilt", self.tilt, "a number of degrees from 0 to less than 90"));
        }
        for (name, value) in [("stroke", self.stroke), ("travel", self.travel)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(Error::setting(name, value, "a length greater than 0, or leave it out"));
            }
        }
        if let Some(tolerance) = self.stroke_tolerance {
            if !(tolerance.is_finite() && tolerance > 0.0) {
                return Err(Error::setting("stroke_tolerance", tolerance, "a length greater than 0, or leave it out"));
            }
            if self.stroke.is_none() {
                return Err(Error::setting("stroke_tolerance", tolerance, "it with the stroke that it belongs to"));
            }
        }
        if self.window() == Some(0) {
            let stroke = self.stroke.unwrap_or_default();
            return Err(Error::setting("stroke", stroke, "a longer one: one that takes a microsecond or more"));
        }
        // Twice the diagonal of a cube, the clearance, and the row, generously.
        let longest_way = 4.0 * length + 2.0 * (CLEARANCE + self.spacing + self.radius);
        if longest_way / self.speed * 1e6 >= f64::from(u32::MAX) {
            return Err(Error::setting("speed", self.speed, "a higher one, to keep contact times below 4294 s"));
        }
        Ok(())
    }
}

/// Target of approaches: what a robot must know about an object before it touches it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Aim {
    /// Anywhere in the object's bounding box.
    #[default]
    Box,
    /// In the middle of the bounding box: in the box of half its sides about its center.
    Middle,
    /// Near the surface's center of mass: in a box of a quarter of the bounding box's sides about it.
    Mass,
}

impl Aim {
    /// Every aim, the default first.
    pub const ALL: [Self; 3] = [Self::Box, Self::Middle, Self::Mass];

    /// The name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Middle => "middle",
            Self::Mass => "mass",
        }
    }

    /// The aim with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|aim| aim.name() == name)
    }

    /// The box in which an approach to the scene aims: its lowest and highest corner, in units.
    pub fn target(self, scene: &Scene) -> [DVec3; 2] {
        let [low, high] = scene.bounds();
        let (center, share) = match self {
            Self::Box => return [low, high],
            Self::Middle => ((low + high) / 2.0, 0.5),
            Self::Mass => (scene.center_of_mass(), 0.25),
        };
        let half = (high - low) * (share / 2.0);
        [center - half, center + half]
    }

    /// True if this is the default, which files leave out.
    pub fn is_box(&self) -> bool {
        *self == Self::Box
    }
}

/// Start of the probe, its direction of motion, and the roll of its row of fingers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Start of the middle finger, in units.
    pub start: DVec3,
    /// Unit vector of the motion.
    pub direction: DVec3,
    /// Unit vector along the row, from the first finger to the third.
    pub alignment: DVec3,
}

impl Approach {
    /// Draws an approach to an object with this bounding box, in units. Start: uniform in direction, at half the box's diagonal
    /// plus [`CLEARANCE`] from its center. Aim: uniform in the box; the middle finger moves from start to aim. Row:
    /// perpendicular to the motion, rolled uniformly about it, then tilted in the plane of row and motion by a uniform
    /// angle within ± `tilt` degrees.
    pub fn draw(rng: &mut impl Rng, bounds: [DVec3; 2], tilt: f64) -> Self {
        Self::draw_at(rng, bounds, bounds, tilt, CLEARANCE)
    }

    /// Like [`Self::draw`], with the aim uniform in another box, such as [`Aim::target`] gives, and another clearance than
    /// [`CLEARANCE`].
    fn draw_at(rng: &mut impl Rng, [low, high]: [DVec3; 2], target: [DVec3; 2], tilt: f64, clearance: f64) -> Self {
        let (center, side) = ((low + high) / 2.0, high - low);
        let start = center + on_sphere(rng) * (side.length() / 2.0 + clearance);
        let [low, high] = target;
        let aim = low + (high - low) * DVec3::new(unit(rng), unit(rng), unit(rng));
        let direction = (aim - start).normalize();
        Self { start, direction, alignment: row(rng, direction, tilt) }
    }

    /// Draws an approach to this scene, with the aim uniform in the `target`: to a floating object as `draw_at` does,
    /// to one on a table as `draw_above` does.
    pub fn draw_to(rng: &mut impl Rng, scene: &Scene, target: [DVec3; 2], tilt: f64, clearance: f64) -> Self {
        match scene.table() {
            None => Self::draw_at(rng, scene.bounds(), target, tilt, clearance),
            Some(table) => Self::draw_above(rng, scene.bounds(), target, tilt, clearance, table.cone),
        }
    }

    /// Draws an approach from above. Direction: uniform within `cone` degrees of straight down. Aim: uniform in the `target`; the
    /// middle finger moves to the aim, from the sphere about the box's center with half the box's diagonal plus `clearance` as
    /// its radius. Row: as [`draw_at`](Self::draw_at).
    fn draw_above(
        rng: &mut impl Rng,
        [low, high]: [DVec3; 2],
        target: [DVec3; 2],
        tilt: f64,
        clearance: f64,
        cone: f64,
    ) -> Self {
        let (center, radius) = ((low + high) / 2.0, (high - low).length() / 2.0 + clearance);
        let down = 1.0 - unit(rng) * (1.0 - libm::cos(cone.to_radians()));
        let [x, y] = on_circle(rng);
        let level = (1.0 - down * down).max(0.0).sqrt();
        let direction = DVec3::new(x * level, y * level, -down);
        let [low, high] = target;
        let aim = low + (high - low) * DVec3::new(unit(rng), unit(rng), unit(rng));
        // Back from the aim to the sphere, which it is inside of.
        let off = aim - center;
        let along = off.dot(direction);
        let back = along + (along * along + radius * radius - off.length_squared()).max(0.0).sqrt();
        let alignment = row(rng, direction, tilt);
        Self { start: aim - direction * back, direction, alignment }
    }

    /// Starts of the fingers, first to third, in units.
    pub fn fingers(&self, spacing: f64) -> [DVec3; FINGERS] {
        [-1.0, 0.0, 1.0].map(|place| self.start + self.alignment * (place * spacing))
    }

    /// Distance that the probe has moved when each finger first touches, in units; none for a finger that never does, or only
    /// after one of them has reached the table.
    pub fn distances(&self, scene: &Scene, probe: &Probe) -> [Option<f64>; FINGERS] {
        let each = self.fingers(probe.spacing).map(|finger| scene.first_contact(finger, self.direction, probe.radius));
        self.above_table(each, scene, probe)
    }

    /// Distances at which all three fingers touch, or none: as soon as one finger misses, no other is cast.
    pub fn full_distances(&self, scene: &Scene, probe: &Probe) -> Option<[f64; FINGERS]> {
        let distances = scene.all_contacts(self.fingers(probe.spacing), self.direction, probe.radius)?;
        let end = self.end_at_table(scene, probe);
        distances.iter().all(|distance| *distance <= end).then_some(distances)
    }

    /// Distance that the probe has moved when the first of its fingers reaches the table; infinite where there is none.
    pub fn end_at_table(&self, scene: &Scene, probe: &Probe) -> f64 {
        let reached = |finger| scene.reaches_table(finger, self.direction, probe.radius);
        self.fingers(probe.spacing).map(reached).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Distances of an approach without those behind its end at the table.
    pub fn above_table(
        &self,
        distances: [Option<f64>; FINGERS],
        scene: &Scene,
        probe: &Probe,
    ) -> [Option<f64>; FINGERS] {
        let end = self.end_at_table(scene, probe);
        distances.map(|distance| distance.filter(|distance| *distance <= end))
    }

    /// The touch that these distances give: times in whole microseconds after the first contact, and the pose.
    pub fn touch(&self, distances: [Option<f64>; FINGERS], probe: &Probe) -> Touch {
        let earliest = distances.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let micros =
            |distance: f64| ContactTime::from_micros(((distance - earliest) / probe.speed * 1e6).round() as u32);
        let times = distances.map(|distance| distance.map_or(ContactTime::MISSING, micros));
        Touch::new(times).with_pose(self.pose())
    }

    /// The pose that its touch has.
    pub fn pose(&self) -> Pose {
        Pose { direction: self.direction.to_array().map(to_q15), alignment: self.alignment.to_array().map(to_q15) }
    }
}

/// A direction cosine as the nearest Q15 number; values beyond ±1 become ±1.
pub fn to_q15(cosine: f64) -> i16 {
    let one = f64::from(Q15_ONE);
    (cosine * one).round().clamp(-one, one) as i16
}

/// The direction of the row of fingers: perpendicular to the motion, rolled uniformly about it, then tilted.
fn row(rng: &mut impl Rng, direction: DVec3, tilt: f64) -> DVec3 {
    let across = direction.any_orthonormal_vector();
    let [roll_cos, roll_sin] = on_circle(rng);
    let row = across * roll_cos + direction.cross(across) * roll_sin;
    let (tilt_sin, tilt_cos) = libm::sincos((tilt * (2.0 * unit(rng) - 1.0)).to_radians());
    row * tilt_cos + direction * tilt_sin
}

/// Uniform in [0, 1), of 53 bits.
fn unit(rng: &mut impl Rng) -> f64 {
    rng.random()
}

/// A uniform direction, by rejection: no trigonometry whose last bit could differ between machines.
fn on_sphere(rng: &mut impl Rng) -> DVec3 {
    loop {
        let point = DVec3::new(unit(rng), unit(rng), unit(rng)) * 2.0 - 1.0;
        let square = point.length_squared();
        if (1e-4..=1.0).contains(&square) {
            return point / square.sqrt();
        }
    }
}

/// The cosine and sine of a uniform angle, by rejection.
fn on_circle(rng: &mut impl Rng) -> [f64; 2] {
    loop {
        let [x, y] = [unit(rng), unit(rng)].map(|u| 2.0 * u - 1.0);
        let square = x * x + y * y;
        if (1e-4..=1.0).contains(&square) {
            return [x / square.sqrt(), y / square.sqrt()];
        }
    }
}
