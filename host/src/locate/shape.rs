//! The heights of one object that stands still: what is known of them, what is guessed, and where to touch next.

use super::contacts::{Met, tips};
use super::follow::seen;
use super::grid::{connected, index, pieces, places};
use super::refused::{not_met, nowhere};
use super::{Approach, Hand, Lying, Standing};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::probe::approach::{FINGERS, Probe};
use crate::probe::scene::Scene;
use glam::{DMat3, DVec3};
use palpate_shared::Touch;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// A cell's guess is a plane through as many of the nearest samples.
const NEAR: usize = 10;
/// Passes that find this plane.
const PASSES: usize = 6;
/// Weight of a level plane, relative to that of the samples at their distances.
const LEVEL: f64 = 0.02;
/// Distance from a plane within which a sample counts fully, in millimeters: noise, not a step.
const STEP: f64 = 0.5;
/// Cells that are farther from each sample were not looked at, in millimeters.
const UNSEEN: f64 = 8.0;
/// A cell's interval holds the guesses within this factor of the distance to the nearest sample.
const ABOUT: f64 = 1.4;
/// Half of an interval where all guesses are equal, in standard deviations of a contact.
const DEVIATIONS: f64 = 1.6;
/// Heights above this may be the object's, in millimeters.
const OBJECT: f64 = 1.0;
/// Error of a guess for each millimeter to the nearest sample where all guesses are equal, in millimeters.
const UNKNOWN: f64 = 0.2;
/// Distance within which a sample helps to know a cell, in millimeters.
const TELLS: i32 = 4;
/// Directions of the row that are compared, in half a turn.
const ROLLS: u8 = 16;

/// A place that a fingertip came down on, in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Its place on the table.
    pub place: [f64; 2],
    /// Height of the contact; without one, height down to which there was none.
    pub height: f64,
    /// True for a contact with object or table.
    pub is_contact: bool,
}

/// Samples of a touch of a probe in millimeters. A missing finger met nothing within the stroke, or its contact was lost.
///
/// # Errors
/// Errors of [`seen`](super::seen).
pub fn samples(touch: &Touch, probe: &Probe) -> Result<[Sample; FINGERS]> {
    let micrometers = |millimeters: f64| (millimeters * 1e3) as u32;
    let stroke = probe.stroke.map(micrometers);
    seen(&Hand { spacing: micrometers(probe.spacing), speed: micrometers(probe.speed), stroke }, touch)?;
    let tips = tips(touch, probe).ok_or_else(nowhere)?;
    let (times, down) = (touch.times(), if touch.is_empty() { 0.0 } else { probe.stroke.unwrap_or(f64::INFINITY) });
    Ok(std::array::from_fn(|finger| {
        let Met { x, y, height } = tips[finger];
        let (height, is_contact) = match times[finger].micros() {
            Some(micros) => (height - f64::from(micros) * 1e-6 * probe.speed, true),
            None => ((height - down).max(0.0), false),
        };
        Sample { place: [x, y], height, is_contact }
    }))
}

/// Samples of all touches.
pub(super) fn all_samples(touches: &[Touch], probe: &Probe) -> Result<Vec<Sample>> {
    let all = touches.iter().map(|touch| samples(touch, probe)).collect::<Result<Vec<_>, _>>()?;
    Ok(all.concat())
}

/// Touches of one object that stands still.
#[derive(Clone, Debug)]
pub struct Shape {
    pub(super) probe: Probe,
    pub(super) noise: f64,
    pub(super) middle: [f64; 2],
    half: [f64; 2],
    pub(super) samples: Vec<Sample>,
}

impl Shape {
    /// No touches yet, of a hand in millimeters whose middle finger stays within `half` of the table's origin along x and y.
    /// `noise` is the standard deviation of a contact's height.
    pub fn within(probe: &Probe, half: [f64; 2], noise: f64) -> Self {
        Self { probe: *probe, noise, middle: [0.0; 2], half, samples: Vec::new() }
    }

    /// The object that samples met, and what is about it. Its middle is that of the box of the contacts with the largest connected
    /// part of the relief: contacts that stray above the table have no say in it.
    ///
    /// # Errors
    /// When no contact is clearly above the table, with this name.
    pub fn of(samples: Vec<Sample>, probe: &Probe, noise: f64, name: &str) -> Result<Self> {
        let least = OBJECT.max(3.0 * noise);
        let is_object = |sample: &&Sample| sample.is_contact && sample.height > least;
        let all = ends(samples.iter().filter(is_object)).ok_or_else(|| not_met(name, ""))?;
        let shape = Self { probe: *probe, noise, middle: [0.0; 2], half: [0.0; 2], samples }.about(all, all);
        let relief = shape.relief();
        let raised = places(relief.half).zip(&relief.heights).filter(|(_, height)| **height > least);
        let parts = connected(relief.half, raised.map(|(at, _)| at).collect());
        let largest: HashSet<_> = parts.into_iter().max_by_key(Vec::len).into_iter().flatten().collect();
        let is_of_largest = |sample: &&Sample| {
            is_object(sample)
                && largest.contains(&[0, 1].map(|axis| (sample.place[axis] - shape.middle[axis]).round() as i32))
        };
        let own = ends(shape.samples.iter().filter(is_of_largest)).unwrap_or(all);
        Ok(shape.about(own, all))
    }

    /// These samples about the middle of one box, as far as another box and the table around it reach.
    fn about(self, own: [[f64; 2]; 2], all: [[f64; 2]; 2]) -> Self {
        let middle = own.map(|[low, high]| ((low + high) / 2.0).round());
        let half = [0, 1].map(|axis| {
            let [low, high] = all[axis].map(|end| (end - middle[axis]).abs());
            (low.max(high) + UNSEEN).min(MOST)
        });
        Self { middle, half, ..self }
    }

    /// Takes in a touch.
    ///
    /// # Errors
    /// Errors of [`samples`].
    pub fn push(&mut self, touch: &Touch) -> Result<()> {
        self.add(samples(touch, &self.probe)?);
        Ok(())
    }

    /// Takes in samples, of three fingers at a time.
    pub fn add(&mut self, samples: impl IntoIterator<Item = Sample>) {
        self.samples.extend(samples);
    }

    /// The object standing on a simulated table, with its guessed heights taken as true.
    ///
    /// # Errors
    /// If no surface rises from the table.
    pub fn standing(&self, name: &str) -> Result<Standing> {
        let mesh = self.relief().solid(self.probe.radius);
        let [low, high] = mesh.bounds();
        let scene = Scene::new(&mesh, (high - low).max_element().into())?;
        Ok(Standing::of(name, vec![Lying::new(Arc::new(scene), DMat3::IDENTITY, String::new(), 1.0)]))
    }

    /// All samples.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Heights on a grid of 1 mm. Cost: cells × samples.
    pub fn relief(&self) -> Relief {
        Relief::new(&self.samples, self.middle, self.half.map(|half| half.ceil() as i32 + 2), self.noise)
    }

    /// The approach after which most is known: the one whose fingers come down where the guess may be most wrong.
    pub fn next(&self, relief: &Relief) -> Approach {
        let mut best = (0.0, Approach::default());
        if self.samples.is_empty() {
            return best.1;
        }
        let gains = relief.gains();
        let stroke = self.probe.stroke.unwrap_or(f64::INFINITY);
        for [x, y] in places(self.half.map(|half| half as i32)) {
            for roll in (0..ROLLS).map(|roll| roll * (128 / ROLLS)) {
                let (sin, cos) = (f64::from(roll) / 256.0 * std::f64::consts::TAU).sin_cos();
                let cells = [-1.0, 0.0, 1.0].map(|finger| {
                    let along = [cos, sin].map(|axis| (finger * self.probe.spacing * axis).round() as i32);
                    index(relief.half, [x + along[0], y + along[1]])
                });
                let first = cells.iter().flatten().map(|cell| relief.heights[*cell]).fold(0.0, f64::max);
                let is_reached = |cell: &&usize| relief.heights[**cell] > first - stroke;
                let gain: f64 = cells.iter().flatten().filter(is_reached).map(|cell| gains[*cell]).sum();
                if gain > best.0 {
                    let [x, y] = [0, 1].map(|axis| (1e3 * (self.middle[axis] + f64::from([x, y][axis]))) as i32);
                    best = (gain, Approach { x, y, roll });
                }
            }
        }
        best.1
    }
}

/// The box of samples: its ends along x and y; none without samples.
fn ends<'s>(samples: impl Iterator<Item = &'s Sample>) -> Option<[[f64; 2]; 2]> {
    samples
        .map(|sample| sample.place.map(|at| [at, at]))
        .reduce(|ends, at| [0, 1].map(|axis| [ends[axis][0].min(at[axis][0]), ends[axis][1].max(at[axis][1])]))
}

/// Farthest cell from the middle of a map, in millimeters.
const MOST: f64 = 245.0;

/// Heights on a grid of 1 mm, with what is known of them.
#[derive(Clone, Debug)]
pub struct Relief {
    /// Place of the middle cell, in millimeters.
    pub middle: [f64; 2],
    /// Cells on each side of the middle one.
    pub half: [i32; 2],
    /// Guesses in millimeters, row by row.
    pub heights: Vec<f64>,
    /// Interval of each height: nineteen of twenty hold the truth.
    pub bounds: Vec<[f64; 2]>,
    /// Distance of each cell from the nearest sample, in millimeters, at most 20.
    distances: Vec<f64>,
    spread: f64,
}

impl Relief {
    /// Guesses heights about `middle` from samples.
    pub(super) fn new(samples: &[Sample], middle: [f64; 2], half: [i32; 2], noise: f64) -> Self {
        let all: Vec<[i32; 2]> = places(half).collect();
        let guessed = |at: &[i32; 2]| guess(samples, [0, 1].map(|axis| middle[axis] + f64::from(at[axis])));
        let (heights, distances): (Vec<_>, Vec<_>) = all.par_iter().map(guessed).unzip();
        let mut relief = Self { middle, half, heights, bounds: Vec::new(), distances, spread: DEVIATIONS * noise };
        let top = relief.heights.iter().copied().fold(0.0, f64::max);
        let bound = |(cell, [low, high]): (usize, [f64; 2])| match relief.is_seen(cell) {
            true => [(low - relief.spread).max(0.0), high + relief.spread],
            false => [0.0, top.max(UNSEEN) + relief.spread],
        };
        relief.bounds = relief.about(ABOUT, 0.0).into_iter().enumerate().map(bound).collect();
        relief
    }

    fn is_seen(&self, cell: usize) -> bool {
        self.distances[cell] <= UNSEEN
    }

    /// True for a cell whose height is known to no better than this, in millimeters.
    pub fn is_guessed(&self, cell: usize, millimeters: f64) -> bool {
        let [low, high] = self.bounds[cell];
        high - low > 2.0 * millimeters
    }

    /// The guess of another map at a cell's place; 0 outside.
    pub fn height_in(&self, cell: usize, other: &Self) -> f64 {
        let width = 2 * self.half[0] + 1;
        let at = [cell as i32 % width - self.half[0], cell as i32 / width - self.half[1]];
        let in_other = [0, 1].map(|axis| at[axis] + (self.middle[axis] - other.middle[axis]).round() as i32);
        index(other.half, in_other).map_or(0.0, |cell| other.heights[cell])
    }

    /// True for a cell that may be the object's.
    pub fn may_be_object(&self, cell: usize) -> bool {
        self.bounds[cell][1] - self.spread > OBJECT
    }

    /// Share of the cells that may be the object's whose height is known to some millimeters; none without such cells.
    pub fn known(&self, millimeters: f64) -> f64 {
        let all = (0..self.heights.len()).filter(|cell| self.may_be_object(*cell));
        let (known, count) = all
            .fold((0, 0), |(known, count), cell| (known + usize::from(!self.is_guessed(cell, millimeters)), count + 1));
        known as f64 / count.max(1) as f64
    }

    /// Lowest and highest guess about each cell, within a factor of the distance to its nearest sample, and at
    /// least some millimeters.
    fn about(&self, factor: f64, least: f64) -> Vec<[f64; 2]> {
        let all: Vec<[i32; 2]> = places(self.half).collect();
        let of = |(at, distance): (&[i32; 2], &f64)| {
            let reach = (factor * distance).clamp(least, UNSEEN);
            let cells = disc(self.half, *at, reach as i32).filter(|(_, square)| f64::from(*square) <= reach * reach);
            cells.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], (cell, _)| {
                [low.min(self.heights[cell]), high.max(self.heights[cell])]
            })
        };
        all.par_iter().zip(&self.distances).map(of).collect()
    }

    /// Value of a sample in each cell: errors of the guesses that it is nearer to than other samples.
    fn gains(&self) -> Vec<f64> {
        let wrong = |([low, high], distance): ([f64; 2], &f64)| (high - low + UNKNOWN * distance) * distance.min(1.0);
        let wrong: Vec<f64> = self.about(1.0, 1.0).into_iter().zip(&self.distances).map(wrong).collect();
        let gain = |at: [i32; 2]| {
            let told = |(cell, square): (usize, i32)| {
                wrong[cell] * (1.0 - f64::from(square).sqrt() / self.distances[cell].max(0.01)).max(0.0)
            };
            disc(self.half, at, TELLS).map(told).sum()
        };
        places(self.half).map(gain).collect()
    }

    /// The surface that fingertips of this radius met, closed to the table: a mesh in millimeters, in the table's frame. Slopes
    /// under an overhang are not seen from above, and so the mesh is solid there.
    pub fn solid(&self, radius: f64) -> Mesh {
        // A fingertip rests on the highest point below it.
        let reach = radius.ceil() as i32;
        let lowest = |at: [i32; 2]| {
            let about = disc(self.half, at, reach).filter(|(_, square)| f64::from(*square) <= radius * radius);
            let raised = about.map(|(cell, square)| {
                self.heights[cell] + radius - (radius * radius - f64::from(square)).max(0.0).sqrt()
            });
            raised.fold(f64::INFINITY, f64::min)
        };
        let lowest: Vec<f64> = places(self.half).map(lowest).collect();
        let [x, y] = self.half;
        // The map's edge is on the table.
        let is_object = |[i, j]: &[i32; 2]| {
            i.abs() < x && j.abs() < y && index(self.half, [*i, *j]).is_some_and(|cell| lowest[cell] > OBJECT)
        };
        let mut heights = vec![0.0; lowest.len()];
        for at in pieces(self.half, places(self.half).filter(is_object).collect()) {
            if let Some(cell) = index(self.half, at) {
                heights[cell] = lowest[cell];
            }
        }
        let all: Vec<[i32; 2]> = places(self.half).collect();
        let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
        let mut numbers = [0; 2].map(|_| vec![None; all.len()]);
        let mut vertex = |cell: usize, is_top: bool| {
            // Where the surface meets the table, top and bottom share their vertex.
            let height = if is_top { heights[cell] } else { 0.0 };
            *numbers[usize::from(height > 0.0)][cell].get_or_insert_with(|| {
                let [x, y] = [0, 1].map(|axis| self.middle[axis] + f64::from(all[cell][axis]));
                mesh.vertices.push([x, y, height].map(|axis| axis as f32));
                mesh.vertices.len() as u32 - 1
            })
        };
        let mut triangles = Vec::new();
        for [i, j] in &all {
            for corners in [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]] {
                let [Some(a), Some(b), Some(c)] = corners.map(|[u, v]| index(self.half, [i + u, j + v])) else {
                    continue;
                };
                if [a, b, c].iter().any(|cell| heights[*cell] > 0.0) {
                    triangles.push([a, b, c].map(|cell| vertex(cell, true)));
                    triangles.push([a, c, b].map(|cell| vertex(cell, false)));
                }
            }
        }
        Mesh { triangles, ..mesh }
    }
}

/// Cells about a cell, with their squared distance.
fn disc(half: [i32; 2], [i, j]: [i32; 2], reach: i32) -> impl Iterator<Item = (usize, i32)> {
    places([reach; 2]).filter_map(move |[u, v]| Some((index(half, [i + u, j + v])?, u * u + v * v)))
}

/// The height at a place, and the distance to the nearest sample.
///
/// A plane is fitted that passes close to most of the nearest samples and ignores the rest, so that it stays on one side of a
/// step: least squares with weights that fall with the distance from the plane, begun at the weighted median. A sample without a
/// contact counts where the plane is above it.
fn guess(samples: &[Sample], [x, y]: [f64; 2]) -> (f64, f64) {
    let square = |sample: &Sample| (sample.place[0] - x).powi(2) + (sample.place[1] - y).powi(2);
    let mut near: Vec<(f64, &Sample)> = samples.iter().map(|sample| (square(sample), sample)).collect();
    if near.len() > NEAR {
        near.select_nth_unstable_by(NEAR - 1, |one, other| one.0.total_cmp(&other.0));
        near.truncate(NEAR);
    }
    let nearest = near.iter().map(|(square, _)| *square).fold(f64::INFINITY, f64::min).sqrt().min(2.5 * UNSEEN);
    let weight = |square: f64| 1.0 / (square + 0.3);
    let mut plane = DVec3::new(middle(&near, weight), 0.0, 0.0);
    for _ in 0..PASSES {
        let (mut matrix, mut right, mut reach) = (DMat3::from_diagonal(DVec3::splat(1e-9)), DVec3::ZERO, 0.0);
        for (square, sample) in &near {
            let factors = DVec3::new(1.0, sample.place[0] - x, sample.place[1] - y);
            let off = sample.height - plane.dot(factors);
            if sample.is_contact || off < 0.0 {
                let near = off.abs() + STEP;
                let weight = weight(*square) / (near * near.sqrt());
                matrix += DMat3::from_cols(factors, factors * factors.y, factors * factors.z) * weight;
                right += factors * weight * sample.height;
                reach += weight * square;
            }
        }
        matrix += DMat3::from_diagonal(DVec3::new(0.0, LEVEL * reach, LEVEL * reach));
        plane = matrix.inverse() * right;
    }
    (if plane.x.is_finite() { plane.x.max(0.0) } else { 0.0 }, nearest)
}

/// Weighted median of the contacts; 0 without any.
fn middle(near: &[(f64, &Sample)], weight: impl Fn(f64) -> f64) -> f64 {
    let contacts = near.iter().filter(|(_, sample)| sample.is_contact);
    let mut by_height: Vec<(f64, f64)> = contacts.map(|(square, sample)| (sample.height, weight(*square))).collect();
    by_height.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    let (all, mut sum) = (by_height.iter().map(|(_, weight)| weight).sum::<f64>(), 0.0);
    let is_middle = |(_, weight): &&(f64, f64)| {
        sum += weight;
        2.0 * sum >= all
    };
    by_height.iter().find(is_middle).map_or(0.0, |(height, _)| *height)
}
