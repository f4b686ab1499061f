//! Recordings of one object, registered by the follower where its pose is sure.

use super::grid::{index, places};
use super::shape::{Relief, Sample, Shape, all_samples};
use super::surface::{Surface, footprint};
use super::{CastSettings, Effort, Hand, Maps, TOUCHES, Until, locating, seen, write};
use crate::error::Result;
use crate::probe::approach::Probe;
use crate::with;
use palpate_shared::Touch;

/// Widest intervals of a pose that counts as sure.
const SURE_POSE: Until = Until { millimeters: 3.0, degrees: 8.0 };
/// The object's middle is looked for no farther than this from the middle of a recording's contacts, along each axis in
/// millimeters.
const MAX_OFFSET: f64 = 15.0;
/// Fewest touches that a pose is taken from.
const MIN_TOUCHES: usize = 8;
/// Share of a recording's contacts that must lie within the intervals of the map that it is merged with.
const MIN_AGREEING: f64 = 0.9;
/// Two poses are different if the cosine of the turn between them is below this.
const DIFFERENT_TURN: f64 = 0.94;
/// Another turn fits nearly as well if its contacts have less than this many times the error.
const RIVAL_FACTOR: f64 = 1.25;
/// Limit of the error that a single contact counts with, in millimeters.
const MAX_ERROR: f64 = 5.0;
/// Guessed heights below this are those of the table, in millimeters.
const TABLE_HEIGHT: f64 = 0.8;
/// Largest error of a guessed height that counts as known, in millimeters.
const KNOWN_ERROR: f64 = 2.0;

/// A pose of one recording's object in another's frame: place in millimeters, and turn in radians.
type Placed = [f64; 3];

/// The surfaces of an object's recordings: one for those whose places relative to each other are sure, and one for each of the rest.
///
/// # Errors
/// Errors of [`samples`](super::samples), and when no touch met the object.
pub(super) fn recorded(
    name: &str,
    recordings: &[Vec<Touch>],
    probe: &Probe,
    settings: &CastSettings,
) -> Result<Vec<Surface>> {
    let mut pieces: Vec<(Shape, f64)> = Vec::new();
    for touches in recordings {
        let samples: Vec<Sample> = all_samples(touches, probe)?;
        let merged = pieces.iter_mut().find_map(|(shape, merged_count)| {
            let moved = registered(shape, touches, &samples, probe, settings)?;
            let all = [shape.samples(), &moved].concat();
            *shape = Shape::of(all, probe, settings.noise, name).ok()?;
            *merged_count += 1.0;
            Some(())
        });
        if merged.is_none() {
            pieces.push((Shape::of(samples, probe, settings.noise, name)?, 1.0));
        }
    }
    let recording_count = recordings.len() as f64;
    let surface = |(number, (shape, merged_count)): (usize, (Shape, f64))| Surface {
        placement: if number == 0 { String::new() } else { format!(" {}", number + 1) },
        share: merged_count / recording_count,
        ..guessed(&shape.relief(), settings.cell())
    };
    Ok(pieces.into_iter().enumerate().map(surface).collect())
}

impl Shape {
    /// Another recording of the same object, moved and turned onto this one; none unless the follower is sure of its pose, and
    /// the contacts agree.
    #[must_use]
    pub fn aligned(&self, touches: &[Touch]) -> Option<Self> {
        let samples = all_samples(touches, &self.probe).ok()?;
        let settings = CastSettings { noise: self.noise, ..CastSettings::default() };
        let mut aligned = self.clone();
        aligned.samples = registered(self, touches, &samples, &self.probe, &settings)?;
        Some(aligned)
    }
}

/// The surface of an object whose touches are few: guesses between them, about the middle of its footprint.
fn guessed(relief: &Relief, cell: f64) -> Surface {
    let step = cell.round() as i32;
    let half = relief.half.map(|half| half / step);
    let relief_cell = |place: [i32; 2]| index(relief.half, place.map(|axis| axis * step));
    let height = |cell: usize| {
        if relief.may_be_object(cell) && relief.heights[cell] > TABLE_HEIGHT { relief.heights[cell] } else { 0.0 }
    };
    let heights: Vec<f64> = places(half).map(|place| relief_cell(place).map_or(0.0, height)).collect();
    let is_known = |cell: usize| !relief.is_guessed(cell, KNOWN_ERROR);
    let known: Vec<bool> = places(half).map(|place| relief_cell(place).is_some_and(is_known)).collect();
    footprint(half, cell, &heights, &known)
}

/// The samples of another recording in a shape's frame; none unless the follower is sure of its pose, no other turn fits nearly as
/// well, and the contacts agree.
fn registered(
    shape: &Shape,
    touches: &[Touch],
    samples: &[Sample],
    probe: &Probe,
    settings: &CastSettings,
) -> Option<Vec<Sample>> {
    let relief = shape.relief();
    let other = Shape::of(samples.to_vec(), probe, settings.noise, "").ok()?;
    let (found, is_round) = follow(&relief, touches, &other, probe, settings)?;
    let (error, placed) = refined(&relief, samples, found);
    let is_rival = |turn: i32| {
        let (rival, rival_pose) = refined(&relief, samples, turned(&relief, found, f64::from(15 * turn).to_radians()));
        (rival_pose[2] - placed[2]).cos() < DIFFERENT_TURN && rival < RIVAL_FACTOR * error
    };
    if !is_round && (1..24).any(is_rival) {
        return None;
    }
    let moved: Vec<Sample> =
        samples.iter().map(|sample| Sample { place: back(placed, sample.place), ..*sample }).collect();
    let inside = moved.iter().filter(|sample| sample.is_contact).filter_map(|sample| {
        let cell = cell(&relief, sample.place)?;
        let [low, high] = relief.bounds[cell];
        let is_object = relief.may_be_object(cell) || sample.height > 3.0 * settings.noise;
        is_object.then(|| (low - settings.noise..=high + settings.noise).contains(&sample.height))
    });
    let (agreeing, count) =
        inside.fold((0, 0), |(agreeing, count), agrees| (agreeing + usize::from(agrees), count + 1));
    (agreeing as f64 >= MIN_AGREEING * f64::from(count) && count > 0).then_some(moved)
}

/// The pose of a shape in another recording's frame, from its touches one after the other; and true if it is round; none unless
/// it becomes sure.
fn follow(
    relief: &Relief,
    touches: &[Touch],
    other: &Shape,
    probe: &Probe,
    settings: &CastSettings,
) -> Option<(Placed, bool)> {
    // A guess is off at steps; the recording's own footprint is near its middle.
    let settings = with!(
        settings.clone(),
        noise = settings.noise.max(1.0),
        position = settings.position.max(1.0),
        outliers = 1e-3,
        range = MAX_OFFSET
    );
    let surface = guessed(relief, settings.cell());
    let model = write(&[surface], &["object".into()], probe, &settings).ok()?;
    let maps = Maps::new(&model).ok()?;
    let hand = Hand::of(&maps)?;
    let effort = Effort { lookups: 5_000_000, ..Effort::default() };
    let mut locating = locating(maps, maps.stopping(), Some(effort));
    locating.begin(1);
    let middle = other.middle.map(|place| (place * 1e3) as i32);
    let step = (touches.len() / TOUCHES).max(1);
    for touch in touches.iter().step_by(step).take(TOUCHES) {
        let mut position = touch.position()?;
        (0..2).for_each(|axis| position.micrometers[axis] -= middle[axis]);
        locating.push(seen(&hand, &touch.with_position(position)).ok()?);
        let poses = locating.poses(0);
        let first = *poses.first()?;
        // Another turn may look the same, but samples would be mixed up.
        let is_unambiguous = first.yaw_within.is_none() || f64::from(first.share) >= 0.95 * 65_536.0;
        if locating.touches() >= MIN_TOUCHES && is_unambiguous && !locating.is_exhausted() && SURE_POSE.is_met(&poses) {
            let [x, y] = [0, 1].map(|axis| f64::from(first.position[axis] + middle[axis]) / 1e3);
            let yaw = f64::from(first.yaw) / 65_536.0 * std::f64::consts::TAU;
            // The surface's frame is about the middle of the relief.
            let (sin, cos) = yaw.sin_cos();
            let [u, v] = relief.middle;
            return Some(([x - cos * u + sin * v, y - sin * u - cos * v, yaw], first.yaw_within.is_none()));
        }
    }
    None
}

/// A place in a recording's frame, in the shape's.
fn back([x, y, yaw]: Placed, place: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = yaw.sin_cos();
    let [u, v] = [place[0] - x, place[1] - y];
    [cos * u + sin * v, cos * v - sin * u]
}

fn cell(relief: &Relief, place: [f64; 2]) -> Option<usize> {
    index(relief.half, [0, 1].map(|axis| (place[axis] - relief.middle[axis]).round() as i32))
}

/// A pose turned about the shape's middle.
fn turned(relief: &Relief, [x, y, yaw]: Placed, by: f64) -> Placed {
    let [u, v] = relief.middle;
    let (sin, cos) = yaw.sin_cos();
    let middle = [x + cos * u - sin * v, y + sin * u + cos * v];
    let (sin, cos) = (yaw + by).sin_cos();
    [middle[0] - cos * u + sin * v, middle[1] - sin * u - cos * v, yaw + by]
}

/// The pose near `found` at which contacts are closest to the guessed heights, and the sum of their distances.
fn refined(relief: &Relief, samples: &[Sample], found: Placed) -> (f64, Placed) {
    let contacts: Vec<&Sample> = samples.iter().filter(|sample| sample.is_contact).collect();
    let total_error = |placed: &Placed| -> f64 {
        let error = |sample: &&Sample| {
            let guess = cell(relief, back(*placed, sample.place)).map_or(0.0, |cell| relief.heights[cell]);
            (sample.height - guess).abs().min(MAX_ERROR)
        };
        contacts.iter().map(error).sum()
    };
    let (mut smallest, mut best, mut step) = (total_error(&found), found, 2.0);
    while step > 0.1 {
        let around = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]];
        let moved = around.map(|by| [best[0] + by[0], best[1] + by[1], best[2]]);
        let turns = [1.0, -1.0].map(|sign| turned(relief, best, sign * (2.0_f64 * step).to_radians()));
        let better = moved.into_iter().chain(turns).map(|placed| (total_error(&placed), placed));
        match better.min_by(|one, other| one.0.total_cmp(&other.0)).filter(|(error, _)| *error < smallest) {
            Some(nearer) => (smallest, best) = nearer,
            None => step /= 2.0,
        }
    }
    (smallest, best)
}
