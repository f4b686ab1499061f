//! Objects on a simulated table, pressed by a hand that knows where it is.

use super::Lying;
use super::lying::grouped;
use crate::capture;
use crate::error::{Error, Result, problem};
use crate::in_order::in_order;
use crate::mesh::Object;
use crate::mesh::placements::{self, Placement};
use crate::probe::approach::{FINGERS, Probe, to_q15};
use crate::probe::noise::{Deviation, Noise};
use crate::probe::scene::Scene;
use crate::progress::{self, Progress};
use crate::random::{self, Purpose};
use crate::touches::Origin;
use crate::with;
use palpate_onboard::locate::Approach;
use palpate_shared::format::Length;
use palpate_shared::{ContactTime, Pose, Position, Touch};
use rand::rngs::ChaCha8Rng;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

/// An object on the table, and the poses that it lies in.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Name of the object.
    pub name: String,
    /// Its poses, as they are: also those that look like another one.
    pub placements: Vec<Lying>,
    /// Poses that are left out because they are rare, with their shares.
    pub left_out: Vec<(String, f64)>,
}

impl Standing {
    /// An object that lies in these poses.
    pub fn of(name: &str, placements: Vec<Lying>) -> Self {
        Self { name: name.into(), placements, left_out: Vec::new() }
    }

    /// The poses that look different, each with the share of those that look like it.
    pub fn looks(&self) -> impl Iterator<Item = (&Lying, f64)> {
        let all: f64 = self.placements.iter().map(|lying| lying.share).sum();
        let is_first = |(index, lying): &(usize, &Lying)| lying.first == *index;
        self.placements.iter().enumerate().filter(is_first).map(move |(index, first)| {
            let alike = self.placements.iter().filter(|lying| lying.first == index);
            (first, alike.map(|lying| lying.share).sum::<f64>() / all)
        })
    }
}

/// Noise of a hand and of a table.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Real {
    /// Standard deviation of each finger's height, in millimeters.
    pub height: f64,
    /// Share of contacts with the object that are lost.
    pub lost: f64,
    /// Standard deviation of the hand's position along each axis, in millimeters.
    pub position: f64,
    /// Standard deviation of the object's move along x and y in an approach, in millimeters.
    pub drift: f64,
    /// Standard deviation of its turn in an approach, in degrees.
    pub drift_yaw: f64,
    /// Size of the objects relative to the maps.
    pub size: f64,
    /// Standard deviation of each fingertip's offset across the row and along it, in millimeters, the same for all approaches of an
    /// object: fingers that are bent.
    pub bent: f64,
    /// Standard deviation of each fingertip's height, in millimeters, the same for all approaches of an object.
    pub tips: f64,
    /// Height of the table in the frame that heights are stated in, in millimeters.
    pub table: f64,
    /// Turn of the row of fingers beyond the stated one, in degrees.
    pub turned: f64,
}

impl Default for Real {
    fn default() -> Self {
        Self {
            height: 0.5,
            lost: 0.02,
            position: 0.0,
            drift: 0.0,
            drift_yaw: 0.0,
            size: 1.0,
            bent: 0.0,
            tips: 0.0,
            table: 0.0,
            turned: 0.0,
        }
    }
}

impl Real {
    /// Checks that these are deviations, a share and a size.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) naming the first that is not.
    pub fn check(&self) -> Result<()> {
        let &Self { height, lost, position, drift, drift_yaw, size, bent, tips, table, turned } = self;
        let deviations = [
            ("height", height),
            ("position", position),
            ("drift", drift),
            ("drift_yaw", drift_yaw),
            ("bent", bent),
            ("tips", tips),
        ];
        let is_wrong = |number: f64| !number.is_finite() || number < 0.0;
        if let Some((name, number)) = deviations.into_iter().find(|(_, number)| is_wrong(*number)) {
            return Err(Error::setting(name, number, "a finite number, 0 or more"));
        }
        if !(0.0..=1.0).contains(&lost) {
            return Err(Error::setting("lost", lost, "a share from 0 to 1"));
        }
        if !size.is_finite() || size <= 0.0 {
            return Err(Error::setting("size", size, "a finite number above 0"));
        }
        match [("table", table), ("turned", turned)].into_iter().find(|(_, number)| !number.is_finite()) {
            Some((name, number)) => Err(Error::setting(name, number, "a finite number")),
            None => Ok(()),
        }
    }

    /// Noise of a hand of this speed, in millimeters per second.
    ///
    /// # Errors
    /// For noise that a simulated table does not have.
    pub fn of(noise: &Noise, speed: f64) -> Result<Self> {
        let real = Self::like(noise, speed);
        let Noise { deviation, timer, position, drift, .. } = *noise;
        let known = with!(real.noise(speed), deviation, timer, position, drift);
        if known != *noise {
            return Err(problem!("a simulated table has other noise")
                .fix("Use noise, timer, missed (one share for all fingers), position and drift."));
        }
        Ok(real)
    }

    /// The part of the noise that a simulated table has. A range of noise becomes its root mean square.
    pub fn like(noise: &Noise, speed: f64) -> Self {
        let Noise { deviation: Deviation { least, largest }, timer, missed: [lost, ..], position, drift, .. } = *noise;
        let [moved, turned] = drift;
        // A touch's deviation is at a uniform number to the power of 3/2 of the range.
        let more = largest - least;
        let square = least * least + 0.8 * least * more + 0.25 * more * more + timer * timer / 12.0;
        Self {
            height: square.sqrt() * 1e-6 * speed,
            lost,
            position: position / 1e3,
            drift: moved / 1e3,
            drift_yaw: turned,
            ..Self::default()
        }
    }

    /// The noise as touches have it, of a hand of this speed.
    pub fn noise(&self, speed: f64) -> Noise {
        // Rounded as a promise states it.
        let whole = |number: f64| (number * 1e3).round();
        with!(
            Noise::gaussian(whole(self.height / speed * 1e3)),
            missed = [self.lost; FINGERS],
            position = whole(self.position),
            drift = [whole(self.drift), whole(self.drift_yaw) / 1e3]
        )
    }
}

/// The aim of approaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Aimed {
    /// At the place that tells most.
    Chosen,
    /// At random about the most likely place.
    Random,
}

/// A truth on the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Position of the object among those that stand.
    pub object: usize,
    /// Position of its pose.
    pub placement: usize,
    /// Origin in millimeters.
    pub place: [f64; 2],
    /// Turn in radians.
    pub yaw: f64,
}

/// The objects as they lie on a table, at their true size: in every pose in which they rest on their hull, or in the placements that an
/// object states. Poses that look the same to contacts of this noise, a standard deviation in millimeters, are counted together; only
/// then the rare ones are left out. Cost: some milliseconds for each pose.
///
/// # Errors
/// A mesh that makes no scene, or whose true size is not known.
pub fn standing(objects: &[&Object], probe: &Probe, noise: f64, progress: &dyn Progress) -> Result<Vec<Standing>> {
    let origin = Origin { unit: Length::Millimeter, probe: *probe, touches: 1, approaches: true, ..Origin::default() };
    let scenes = capture::scenes(objects, &origin, progress)?;
    progress.begin("placements", Some(objects.len() as u64));
    let of = |(object, scenes): (&&Object, Vec<Scene>)| -> Result<Standing> {
        let each = match object.placement_weights.is_empty() {
            true => object.instances().map(|instance| placements::resting(&instance.mesh)).collect(),
            false => placements::of_object(object).map(|each| each.into_iter().map(|own| own.placements).collect()),
        };
        let each: Vec<Vec<Placement>> = each.map_err(|error| capture::in_object(object, error))?;
        let has_several = each.len() > 1;
        let mut poses = Vec::new();
        for ((instance, scene), own) in object.instances().zip(scenes.into_iter().map(Arc::new)).zip(each) {
            poses.extend(own.into_iter().map(|Placement { name, weight, rotation }| {
                let name = if has_several { format!("{} {name}", instance.name) } else { name };
                Lying::new(Arc::clone(&scene), rotation, name, weight)
            }));
        }
        let (placements, left_out) = grouped(poses, probe.radius, noise);
        progress::advance(progress, 1)?;
        Ok(Standing { left_out, ..Standing::of(&object.name, placements) })
    };
    in_order(objects.par_iter().zip(scenes).map(of))
}

/// A table with objects to choose from, and a hand.
#[derive(Clone, Copy, Debug)]
pub struct World<'w> {
    /// The objects.
    pub standing: &'w [Standing],
    /// The hand.
    pub probe: &'w Probe,
    /// Noise.
    pub real: Real,
    /// Half of the square that objects stand in, in millimeters.
    pub range: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl<'w> World<'w> {
    /// Draws an object that stands on the table: object after object in turn, everything else by chance.
    pub fn draw(&self, index: u64) -> Drawn<'w> {
        let mut random = random::generator(self.seed, Purpose::Table, "", index);
        let object = usize::try_from(index).unwrap_or(0) % self.standing.len().max(1);
        let placements = &self.standing[object].placements;
        let mut left: f64 = random.random::<f64>() * placements.iter().map(|lying| lying.share).sum::<f64>();
        let below = |lying: &Lying| {
            left -= lying.share;
            left < 0.0
        };
        let placement = placements.iter().position(below).unwrap_or(placements.len() - 1);
        let place = [0; 2].map(|_| (2.0 * random.random::<f64>() - 1.0) * self.range);
        let yaw = random.random::<f64>() * std::f64::consts::TAU;
        let bent = [[0; 2]; FINGERS].map(|axes| axes.map(|_| self.real.bent * normal(&mut random)));
        let tips = match self.real.tips {
            0.0 => [0.0; FINGERS],
            tips => [0; FINGERS].map(|_| tips * normal(&mut random)),
        };
        Drawn { world: *self, truth: Truth { object, placement, place, yaw }, random, bent, tips }
    }
}

/// An object that stands on the table.
#[derive(Debug)]
pub struct Drawn<'w> {
    world: World<'w>,
    /// An object and its place.
    pub truth: Truth,
    random: ChaCha8Rng,
    bent: [[f64; 2]; FINGERS],
    tips: [f64; FINGERS],
}

impl Drawn<'_> {
    /// Presses straight down, and returns the touch that the hand reports, in the table's frame. Then the object may have moved.
    pub fn press(&mut self, at: Approach) -> Touch {
        let World { standing, probe, real, .. } = self.world;
        let Truth { object, placement, place, yaw } = self.truth;
        let lying = &standing[object].placements[placement];
        let roll = f64::from(at.roll) / 256.0 * std::f64::consts::TAU;
        let (stated_sin, stated_cos) = roll.sin_cos();
        let (row_sin, row_cos) = (roll + real.turned.to_radians()).sin_cos();
        let stated = [at.x, at.y].map(|micrometers| f64::from(micrometers) / 1_000.0);
        let shift = [0; 3].map(|_| real.position * normal(&mut self.random));
        let (sin, cos) = yaw.sin_cos();
        let mut heights = [None; FINGERS];
        for (((height, bent), tip), finger) in heights.iter_mut().zip(self.bent).zip(self.tips).zip([-1.0, 0.0, 1.0]) {
            let along = finger * probe.spacing + bent[0];
            let x = stated[0] + shift[0] + along * row_cos - bent[1] * row_sin - place[0];
            let y = stated[1] + shift[1] + along * row_sin + bent[1] * row_cos - place[1];
            let (u, v) = ((cos * x + sin * y) / real.size, (cos * y - sin * x) / real.size);
            let met = real.size * lying.height([u, v], probe.radius / real.size);
            let is_lost = self.random.random::<f64>() < real.lost && met > 0.0;
            *height = (!is_lost).then_some(met + real.table + tip + shift[2] + real.height * normal(&mut self.random));
        }
        let first = heights.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        // Where every contact was lost, the hand went down to the table.
        let first = if first.is_finite() { first } else { 0.0 };
        let lowest = probe.stroke.map_or(f64::NEG_INFINITY, |stroke| first - stroke);
        let times = heights.map(|height| match height {
            Some(height) if height >= lowest => {
                ContactTime::from_micros(((first - height) / probe.speed * 1e6).round() as u32)
            }
            _ => ContactTime::MISSING,
        });
        let pose = Pose { direction: [0, 0, to_q15(-1.0)], alignment: [stated_cos, stated_sin, 0.0].map(to_q15) };
        let position = Position { micrometers: [at.x, at.y, (first * 1_000.0).round() as i32] };
        let mut drift = || real.drift * normal(&mut self.random);
        let moved = [place[0] + drift(), place[1] + drift()];
        let turned = yaw + (real.drift_yaw * normal(&mut self.random)).to_radians();
        self.truth = Truth { place: moved, yaw: turned, ..self.truth };
        Touch::new(times).with_pose(pose).with_position(position)
    }

    /// This world with the object at another place.
    #[must_use]
    pub fn at(self, truth: Truth) -> Self {
        Self { truth, ..self }
    }

    /// A seed of the choice of approaches.
    pub(super) fn seed(&mut self) -> u32 {
        self.random.random()
    }

    /// An approach at random within a square about a place, in millimeters.
    pub fn anywhere(&mut self, [x, y]: [f64; 2], reach: f64) -> Approach {
        let mut at = |middle: f64| ((middle + (2.0 * self.random.random::<f64>() - 1.0) * reach) * 1_000.0) as i32;
        let (x, y) = (at(x), at(y));
        Approach { x, y, roll: self.random.random::<u8>() }
    }
}

fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}
