//! Poses against the truth, modulo symmetry, and how wide their intervals must be.

use super::surface::{SAME, Surface};
use super::world::{Standing, Truth};
use super::{Maps, Pose};
use crate::probe::approach::Probe;
use crate::probe::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A pose that is sure enough to end on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// Half of the 95 % intervals of x and y at most, in millimeters.
    pub millimeters: f64,
    /// Half of the 95 % interval of the yaw at most, in degrees.
    pub degrees: f64,
}

impl Until {
    /// True if the most likely of an object's poses is as sure: its intervals, and that the object is there, turned like that or
    /// as it looks the same. Those that it may be turned to are at the same place.
    pub(crate) fn is_met(&self, poses: &[Pose]) -> bool {
        let Some(first) = poses.first() else { return false };
        let most = self.millimeters * 1_000.0;
        let is_there = |pose: &&Pose| {
            let mut apart = first.position.iter().zip(pose.position).map(|(one, other)| one.abs_diff(other));
            pose.placement == first.placement && apart.all(|apart| f64::from(apart) <= most)
        };
        let share: f64 = poses.iter().filter(is_there).map(|pose| f64::from(pose.share)).sum();
        first.within.iter().all(|&within| f64::from(within) <= most)
            && first.yaw_within.is_none_or(|within| f64::from(within) / 65_536.0 * 360.0 <= self.degrees)
            && share >= 0.95 * 65_536.0
    }
}

/// Distance of a pose from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Off {
    /// Along x and y, in millimeters.
    pub millimeters: [f64; 2],
    /// In degrees; 0 for what is round.
    pub degrees: f64,
}

impl Off {
    /// Largest of its parts, each in units of the half of the pose's interval.
    pub(super) fn in_intervals(&self, pose: &Pose) -> f64 {
        let [x, y] = self.millimeters.map(|off| off.abs() * 1_000.0);
        let [within_x, within_y] = pose.within.map(f64::from);
        let yaw = pose.yaw_within.map_or(0.0, |within| self.degrees.abs() / (f64::from(within) / 65_536.0 * 360.0));
        (x / within_x).max(y / within_y).max(yaw)
    }
}

/// Turns by which a placement on the table looks like one of the maps.
pub(super) struct Equivalents {
    /// For each object and placement that stands, and each placement of the maps, turns in radians; each looks more alike than
    /// its neighbors, so a turn that differs a little is not excused.
    turns: Vec<Vec<Vec<Vec<f64>>>>,
}

/// Turns that are compared.
const TURNS: usize = 120;

/// A compared turn.
fn radians(turn: usize) -> f64 {
    turn as f64 / TURNS as f64 * TAU
}

impl Equivalents {
    /// Compares all placements. Cost: some seconds for a hundred of them.
    pub(super) fn new(maps: Maps<'_>, standing: &[Standing], probe: &Probe) -> Self {
        let known: Vec<Surface> = (0..maps.placements()).map(|index| of_maps(maps, index)).collect();
        let of = |object: &Standing| {
            let own = |scene: &Scene| {
                let surface = pressed(scene, probe);
                let differences = |known: &Surface| -> Vec<f64> {
                    let is_of = maps.object_name(known.object) == object.name;
                    let differs = |turn| if is_of { surface.differs(known, radians(turn)) } else { f64::INFINITY };
                    (0..TURNS).map(differs).collect()
                };
                let each: Vec<Vec<f64>> = known.iter().map(differences).collect();
                // A map learned from few touches is of its own placement, however noisy it is.
                let least = each.iter().flatten().copied().fold(f64::INFINITY, f64::min);
                let limit = LIKE.max(1.25 * least);
                let alike = |differences: &Vec<f64>| -> Vec<f64> {
                    let at = |turn: usize| differences[turn % TURNS];
                    let is_least = |turn: &usize| at(*turn) <= at(turn + 1) && at(*turn) <= at(turn + TURNS - 1);
                    (0..TURNS).filter(|turn| at(*turn) < limit).filter(is_least).map(radians).collect()
                };
                each.iter().map(alike).collect()
            };
            object.placements.iter().map(|(scene, _)| own(scene)).collect()
        };
        Self { turns: standing.par_iter().map(of).collect() }
    }

    /// Distance of a pose from the nearest equivalent of the truth; none if the object lies in another way.
    pub(super) fn off(&self, truth: &Truth, pose: &Pose) -> Option<Off> {
        let turns = self.turns.get(truth.object)?.get(truth.placement)?.get(usize::from(pose.placement))?;
        let [x, y] = pose.position.map(|micrometers| f64::from(micrometers) / 1_000.0);
        let yaw = f64::from(pose.yaw) / 65_536.0 * TAU;
        let degrees = |turn: f64| {
            let apart = (yaw - truth.yaw - turn).rem_euclid(TAU);
            apart.min(TAU - apart).to_degrees()
        };
        let least = turns.iter().map(|turn| degrees(*turn)).min_by(f64::total_cmp)?;
        let degrees = if pose.yaw_within.is_none() { 0.0 } else { least };
        Some(Off { millimeters: [x - truth.place[0], y - truth.place[1]], degrees })
    }
}

/// Two maps are the same where their heights differ by less than this on average, in millimeters: the learned one has noise.
const LIKE: f64 = 1.5 * SAME;

/// The surface of a placement of the maps, in cells of 1 mm.
fn of_maps(maps: Maps<'_>, index: usize) -> Surface {
    let placement = u8::try_from(index).unwrap_or(u8::MAX);
    let reach = (maps.radius(placement) / 1_000 + 3).min(250);
    let height = |[i, j]: [i32; 2]| f64::from(maps.height(placement, [i * 1_000, j * 1_000])) / 1_000.0;
    Surface::of(usize::from(maps.object_of(placement)), [reach; 2], height)
}

/// The surface that fingertips would meet, in cells of 1 mm.
fn pressed(scene: &Scene, probe: &Probe) -> Surface {
    let [low, high] = scene.bounds();
    let reach = [high.x, high.y].map(|half| (half + probe.radius).ceil() as i32 + 1);
    let start = high.z + 2.0 * probe.radius;
    let height = |[i, j]: [i32; 2]| {
        let from = DVec3::new(f64::from(i), f64::from(j), start);
        let way = scene.first_contact(from, DVec3::NEG_Z, probe.radius);
        way.map_or(0.0, |way| (start - way - probe.radius - low.z).max(0.0))
    };
    Surface::of(0, reach, height)
}
