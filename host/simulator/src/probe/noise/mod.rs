//! Noise that a real sensor, timer and robot add to touches.
//!
//! [`Noise`] describes it, for training as well as for testing. What differs from touch to touch is noise; what is the
//! same for all touches of one robot is a bias.
//!
//! ```
//! use palpate_simulator::probe::noise::{Deviation, Noise, PartialNoise};
//! use palpate_shared::Touch;
//!
//! let noise = "noise=0..10ms,timer=1ms".parse::<PartialNoise>()?.over(Noise::default());
//! let noisy = noise.add("fork", &[Touch::from_micros([0, 12_345, 30_000])], 1);
//! // The first contact is 0 again, and the timer counts whole milliseconds.
//! assert!(noisy[0].times().iter().all(|time| time.micros().is_some_and(|micros| micros % 1_000 == 0)));
//! assert_eq!(Deviation::from(5_000.0).largest, 5_000.0);
//! # Ok::<_, palpate_simulator::Error>(())
//! ```

mod grazing;
mod partial;
pub mod quantity;
mod table;

pub use grazing::Grazing;
pub use partial::{PartialNoise, keys};

use crate::error::{Error, Result};
use crate::probe::approach::{FINGERS, to_q15};
use crate::random::{self, Purpose};
use glam::DVec3;
use palpate_shared::format::{PromisedNoise, TrainedNoise};
use palpate_shared::{ContactTime, Pose, Q15_ONE, Touch};
use quantity::DURATION;
use rand::RngExt;
use rand::rngs::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt;
use table::ROWS;

/// Noise that is added to touches. Times are in microseconds, angles in degrees, shares between 0 and 1. The default
/// adds nothing.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Noise {
    /// Gaussian noise of every contact time: its standard deviation, or a range that each touch draws it from.
    pub deviation: Deviation,
    /// The timer's resolution: times are rounded down to multiples of it, counted from a phase of the touch's own. 0 for
    /// none.
    pub timer: f64,
    /// Delay that a bouncing switch adds to every contact time: uniform from 0 to this.
    pub debounce: f64,
    /// The probability that a contact of each finger is missed. In files one number, if it is the same for all fingers.
    #[serde(with = "missed_shares")]
    pub missed: [f64; FINGERS],
    /// Time by which each finger touches too early: a bent finger.
    pub bent: [f64; FINGERS],
    /// The probe's speed over the nominal one.
    pub speed: f64,
    /// Largest error of the speed of a touch, as a share of it, to either side.
    pub speed_error: f64,
    /// Largest error of the speed of a robot, the same through all of its touches.
    pub speed_bias: f64,
    /// The standard deviation of the angle by which the pose of a touch is turned about a random axis.
    pub pose: f64,
    /// The standard deviation of the angle by which all poses of a robot are turned alike.
    pub pose_bias: f64,
    /// The standard deviation of each coordinate of a touch's position, in micrometers, for touches that state one.
    #[serde(skip_serializing_if = "is_zero")]
    pub position: f64,
    /// The standard deviations of an object's move in an approach, in micrometers, and of its turn, in degrees. Only a table that is
    /// simulated approach by approach has it.
    #[serde(skip_serializing_if = "is_still")]
    pub drift: [f64; 2],
    /// Fingers that bend aside at flat angles. Only a capture adds it: a data set does not hold the angles of contacts.
    #[serde(skip_serializing_if = "Grazing::is_none")]
    pub grazing: Grazing,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            deviation: Deviation::default(),
            timer: 0.0,
            debounce: 0.0,
            missed: [0.0; FINGERS],
            bent: [0.0; FINGERS],
            speed: 1.0,
            speed_error: 0.0,
            speed_bias: 0.0,
            pose: 0.0,
            pose_bias: 0.0,
            position: 0.0,
            drift: [0.0; 2],
            grazing: Grazing::default(),
        }
    }
}

/// A standard deviation in microseconds, or a range of them that each touch draws one from: its place in the range is a
/// uniform number to the power of 3/2. Small deviations are drawn more often, since a millisecond more makes the greatest
/// difference there: a model trained on 0 to 10 ms is then nowhere far behind one trained for the very level.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviation {
    /// The least.
    pub least: f64,
    /// The largest.
    pub largest: f64,
}

impl From<f64> for Deviation {
    fn from(deviation: f64) -> Self {
        Self { least: deviation, largest: deviation }
    }
}

/// Describes the noise in words: "noise of 0 to 10 ms, a timer of 1 ms".
impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let there = ROWS.iter().filter(|row| row.adds_to(self));
        let mut parts: Vec<String> = there.flat_map(|row| row.described(self)).collect();
        let Grazing { angle, bend } = self.grazing;
        if bend > 0.0 {
            parts.push(format!("fingers that bend aside by {} beyond {angle}°", (DURATION.said)(bend)));
        }
        f.write_str(&if parts.is_empty() { "no noise".into() } else { parts.join(", ") })
    }
}

impl Noise {
    /// Gaussian noise of one standard deviation, in microseconds, and nothing else.
    pub fn gaussian(deviation: f64) -> Self {
        Self { deviation: deviation.into(), ..Self::default() }
    }

    /// Noise of a usual switch: its contact closes up to 5 ms off, how much differs from touch to touch and switch to
    /// switch, and a program that polls it every millisecond counts whole ones.
    pub fn switch() -> Self {
        Self { deviation: Deviation { least: 0.0, largest: 5_000.0 }, timer: 1_000.0, ..Self::default() }
    }

    /// True if it changes no touch.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// True if something is the same through all touches of a robot, so that touches of several robots must not be
    /// mixed in a sequence.
    pub fn has_bias(&self) -> bool {
        self.speed_bias > 0.0 || self.pose_bias > 0.0
    }

    /// Statement of a compiled model about it. A robot's bias counts as noise of the pose: in training, every touch is
    /// made by a robot of its own.
    pub fn trained(&self) -> TrainedNoise {
        let whole = |number: f64| number.round().clamp(0.0, f64::from(u32::MAX)) as u32;
        TrainedNoise {
            least: whole(self.deviation.least),
            largest: whole(self.deviation.largest),
            timer: whole(self.timer),
            pose: whole(1e3 * self.pose.hypot(self.pose_bias)),
        }
    }

    /// The noise that a compiled model states that it was trained for.
    pub fn of_training(trained: &TrainedNoise) -> Self {
        Self::of_promise(&PromisedNoise { touch: *trained, ..PromisedNoise::default() })
    }

    /// Statement of a compiled model's promise about it.
    pub fn promised(&self) -> PromisedNoise {
        let whole = |number: f64| number.round().clamp(0.0, f64::from(u32::MAX)) as u32;
        let billionths = |share: f64| whole(1e9 * share);
        PromisedNoise {
            touch: Self { pose_bias: 0.0, ..*self }.trained(),
            debounce: whole(self.debounce),
            bent: self.bent.map(|early| early.round() as i32),
            missed: self.missed.map(billionths),
            speed_error: billionths(self.speed_error),
            speed_bias: billionths(self.speed_bias),
            speed: (1e9 * (self.speed - 1.0)).round() as i32,
            pose_bias: whole(1e3 * self.pose_bias),
            position: whole(self.position),
            drift: [whole(self.drift[0]), whole(1e3 * self.drift[1])],
        }
    }

    /// Noise of which a promise states this.
    pub fn of_promise(promised: &PromisedNoise) -> Self {
        let share = |billionths: u32| f64::from(billionths) / 1e9;
        let TrainedNoise { least, largest, timer, pose } = promised.touch;
        Self {
            deviation: Deviation { least: least.into(), largest: largest.into() },
            timer: timer.into(),
            debounce: promised.debounce.into(),
            missed: promised.missed.map(share),
            bent: promised.bent.map(f64::from),
            speed: 1.0 + f64::from(promised.speed) / 1e9,
            speed_error: share(promised.speed_error),
            speed_bias: share(promised.speed_bias),
            pose: f64::from(pose) / 1e3,
            pose_bias: f64::from(promised.pose_bias) / 1e3,
            position: promised.position.into(),
            drift: [promised.drift[0].into(), f64::from(promised.drift[1]) / 1e3],
            ..Self::default()
        }
    }

    /// Refuses noise that cannot be.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) that names the key.
    pub fn check(&self) -> Result<()> {
        for row in &ROWS {
            if let Some((wrong, allowed)) = row.wrong(&row.of(self)) {
                return Err(Error::setting(row.key, wrong, allowed));
            }
        }
        let Grazing { angle, bend } = self.grazing;
        if !(bend >= 0.0 && bend.is_finite()) {
            return Err(Error::setting("grazing", bend, "a duration of at least 0"));
        }
        if !(0.0..90.0).contains(&angle) {
            return Err(Error::setting("grazing", angle, "degrees from 0 to less than 90"));
        }
        Ok(())
    }

    /// `touches` of the object `name` with this noise, every touch made by a robot of its own: for training, and for
    /// noise without a bias.
    ///
    /// Then the earliest time is subtracted, so that the first contact is 0 again, and times are rounded to whole
    /// microseconds, as in the published evaluation. What is missing stays missing. The result is a pure function of
    /// noise, seed, name, and each touch with its position. Noise that [`check`](Self::check) refuses gives touches
    /// without meaning.
    pub fn add(&self, name: &str, touches: &[Touch], seed: u64) -> Vec<Touch> {
        let stream = self.stream(name, touches.len(), seed);
        (0..).zip(touches).map(|(index, touch)| stream.add(touch, index, index as u64)).collect()
    }

    /// The noise of the first `count` touches of the object `name`, in any order.
    pub fn stream(&self, name: &str, count: usize, seed: u64) -> Stream {
        let mut gaussian = random::generator(seed, Purpose::Noise, name, 0);
        let mut normal = || std::array::from_fn(|_| StandardNormal.sample(&mut gaussian));
        let normals = (0..count).map(|_| normal()).collect();
        Stream { noise: *self, name: name.into(), seed, normals }
    }

    /// A touch with this noise, whose random numbers come from `random`; made by a robot of its own. For touches
    /// that are made one at a time, such as those of a capture.
    pub fn add_to(&self, touch: &Touch, random: &mut ChaCha8Rng) -> Touch {
        let normal = std::array::from_fn(|_| StandardNormal.sample(random));
        let [own, robot] = [Draw::new(random), Draw::new(random)];
        self.one(touch, normal, &own, &robot)
    }

    /// This noise and `more` added after it, as far as one noise can say it: variances and shares of missed contacts add
    /// up, times of fingers add up, speeds are multiplied; of two timers the coarser one counts.
    #[must_use]
    pub fn and(&self, more: &Self) -> Self {
        let Deviation { least, largest } = self.deviation;
        let deviation =
            Deviation { least: least.hypot(more.deviation.least), largest: largest.hypot(more.deviation.largest) };
        Self {
            deviation,
            timer: self.timer.max(more.timer),
            debounce: self.debounce + more.debounce,
            missed: std::array::from_fn(|finger| {
                let [one, other] = [self.missed[finger], more.missed[finger]];
                one + other - one * other
            }),
            bent: std::array::from_fn(|finger| self.bent[finger] / more.speed + more.bent[finger]),
            speed: self.speed * more.speed,
            speed_error: (self.speed_error + more.speed_error).min(0.9),
            speed_bias: (self.speed_bias + more.speed_bias).min(0.9),
            pose: self.pose.hypot(more.pose),
            pose_bias: self.pose_bias.hypot(more.pose_bias),
            position: self.position.hypot(more.position),
            drift: std::array::from_fn(|axis| self.drift[axis].hypot(more.drift[axis])),
            // Added by a capture, and so by no second one.
            grazing: if self.grazing.is_none() { more.grazing } else { self.grazing },
        }
    }

    fn one(&self, touch: &Touch, normal: [f64; FINGERS], own: &Draw, robot: &Draw) -> Touch {
        let Deviation { least, largest } = self.deviation;
        let deviation = least + (largest - least) * own.level * own.level.sqrt();
        let speed = self.speed * (1.0 + self.speed_error * own.speed) * (1.0 + self.speed_bias * robot.speed);
        let missing = std::array::from_fn(|finger| own.missed[finger] < self.missed[finger]);
        let left = missed(touch, missing);
        let noisy = timed(&left, |finger, time| {
            let sensed =
                time / speed - self.bent[finger] + deviation * normal[finger] + self.debounce * own.debounce[finger];
            if self.timer > 0.0 { ((sensed / self.timer + own.phase).floor()) * self.timer } else { sensed }
        });
        match noisy.pose() {
            Some(pose) if self.pose > 0.0 || self.pose_bias > 0.0 => {
                let angle = |degrees: f64| degrees.to_radians();
                let turn = |vector| robot.turn(own.turn(vector, angle(self.pose)), angle(self.pose_bias));
                noisy.with_pose(Pose {
                    direction: turned(pose.direction, turn),
                    alignment: turned(pose.alignment, turn),
                })
            }
            _ => noisy,
        }
    }
}

/// The noise of an object's touches: a pure function of noise, seed, the object's name and the position of each touch.
#[derive(Debug)]
pub struct Stream {
    noise: Noise,
    name: String,
    seed: u64,
    /// For each touch its Gaussian numbers. They have a stream of their own, three for each touch, so that no other setting
    /// changes the noise of one level.
    normals: Vec<[f64; FINGERS]>,
}

impl Stream {
    /// Adds it to the touch at this position, below the count that it was made for, made by this robot. A robot's bias
    /// is the same for every object.
    pub fn add(&self, touch: &Touch, position: usize, robot: u64) -> Touch {
        let (noise, normal) = (&self.noise, self.normals[position]);
        if *noise == (Noise { deviation: noise.deviation.least.into(), ..Noise::default() }) {
            return timed(touch, |finger, time| time + noise.deviation.least * normal[finger]);
        }
        let mut sensor = random::generator(self.seed, Purpose::Sensor, &self.name, position as u64);
        let own = Draw::new(&mut sensor);
        let bias = || Draw::new(&mut random::generator(self.seed, Purpose::Robot, "", robot));
        let robot = noise.has_bias().then(bias).unwrap_or_default();
        noise.one(touch, normal, &own, &robot)
    }
}

/// Shares of the fingers: one number in files, if it is the same for all of them.
mod missed_shares {
    use super::FINGERS;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Shares {
        One(f64),
        Each([f64; FINGERS]),
    }

    pub(super) fn serialize<S: Serializer>(shares: &[f64; FINGERS], serializer: S) -> Result<S::Ok, S::Error> {
        let [first, others @ ..] = shares;
        if others.iter().all(|other| other == first) {
            first.serialize(serializer)
        } else {
            shares.serialize(serializer)
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; FINGERS], D::Error> {
        Ok(match Shares::deserialize(deserializer)? {
            Shares::One(share) => [share; FINGERS],
            Shares::Each(shares) => shares,
        })
    }
}

/// The random numbers of one touch, or of one robot. All of them are drawn, whichever are used, so that no setting
/// changes what another one does.
#[derive(Default)]
struct Draw {
    /// Uniform from 0 to 1: where in the range of deviations.
    level: f64,
    /// Uniform from −1 to 1.
    speed: f64,
    /// Uniform from 0 to 1: of a step of the timer.
    phase: f64,
    debounce: [f64; FINGERS],
    missed: [f64; FINGERS],
    /// The axis of the turn, a unit vector, and its angle as a standard normal number.
    axis: DVec3,
    angle: f64,
}

impl Draw {
    fn new(random: &mut ChaCha8Rng) -> Self {
        let level = random.random();
        let speed = 2.0 * random.random::<f64>() - 1.0;
        let phase = random.random();
        let (debounce, missed) = (random.random(), random.random());
        let [x, y, z, angle]: [f64; 4] = std::array::from_fn(|_| StandardNormal.sample(random));
        Self { level, speed, phase, debounce, missed, axis: DVec3::new(x, y, z).normalize_or(DVec3::Z), angle }
    }

    /// The vector, turned about the axis by an angle of this standard deviation, in radians.
    fn turn(&self, vector: DVec3, deviation: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(self.angle * deviation);
        let along = self.axis * self.axis.dot(vector);
        along + (vector - along) * cos + self.axis.cross(vector) * sin
    }
}

fn turned(vector: [i16; 3], turn: impl Fn(DVec3) -> DVec3) -> [i16; 3] {
    let vector = DVec3::from_array(vector.map(|cosine| f64::from(cosine) / f64::from(Q15_ONE)));
    turn(vector).to_array().map(to_q15)
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

fn is_still(drift: &[f64; 2]) -> bool {
    *drift == [0.0; 2]
}

/// The touch without the contacts of these fingers.
fn missed(touch: &Touch, missed: [bool; FINGERS]) -> Touch {
    let mut times = touch.times();
    times.iter_mut().zip(missed).filter(|(_, missed)| *missed).for_each(|(time, _)| *time = ContactTime::MISSING);
    touch.with_times(times)
}

/// The touch with other contact times, in microseconds: the earliest becomes 0.
fn timed(touch: &Touch, change: impl Fn(usize, f64) -> f64) -> Touch {
    let times = touch.times();
    let changed: [Option<f64>; FINGERS] =
        std::array::from_fn(|finger| times[finger].micros().map(|micros| change(finger, f64::from(micros))));
    let earliest = changed.into_iter().flatten().fold(f64::INFINITY, f64::min);
    // A difference of two times fits: u32::MAX itself is the missing contact, so the largest time is one less.
    let shifted = changed.map(|time| match time {
        Some(time) => ContactTime::from_micros((time - earliest).round().min(f64::from(u32::MAX - 1)) as u32),
        None => ContactTime::MISSING,
    });
    touch.with_times(shifted)
}
