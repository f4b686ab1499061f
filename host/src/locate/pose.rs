//! Poses against the truth, modulo symmetry, and how wide their intervals must be.

use super::lying::{Onto, TURNS, radians};
use super::surface::{SAME, Surface};
use super::world::{Standing, Truth};
use super::{Lying, Maps, Pose};
use crate::probe::approach::Probe;
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
pub(crate) struct Off {
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

/// Turns by which poses on the table look like placements of the maps.
pub(super) struct Equivalents {
    /// Each object has one for each of its poses.
    objects: Vec<Vec<Equivalent>>,
}

/// Turns by which a pose looks like placements of the maps.
struct Equivalent {
    /// The first pose that looks the same, which has the turns.
    first: usize,
    onto: Onto,
    /// For each placement of the maps, turns in radians; each looks more alike than its neighbors, so a turn that differs a little is
    /// not excused.
    turns: Vec<Vec<f64>>,
}

impl Equivalents {
    /// Compares all that look different. Cost: some seconds for a hundred of them.
    pub(super) fn new(maps: Maps<'_>, standing: &[Standing], probe: &Probe) -> Self {
        let known: Vec<Surface> = (0..maps.placements()).map(|index| of_maps(maps, index)).collect();
        let of = |object: &Standing| {
            let turns = |lying: &Lying| {
                let surface = Surface::cast(lying, probe.radius, 1.0);
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
            let own = |(index, lying): (usize, &Lying)| Equivalent {
                first: lying.first,
                onto: lying.onto,
                turns: if lying.first == index { turns(lying) } else { Vec::new() },
            };
            object.placements.iter().enumerate().map(own).collect()
        };
        Self { objects: standing.par_iter().map(of).collect() }
    }

    /// Distance of a pose from the nearest equivalent of the truth; none if the object lies in another way.
    pub(super) fn off(&self, truth: &Truth, pose: &Pose) -> Option<Off> {
        let object = self.objects.get(truth.object)?;
        let own = object.get(truth.placement)?;
        let turns = object.get(own.first)?.turns.get(usize::from(pose.placement))?;
        let (place, turned) = own.onto.placed(truth.place, truth.yaw);
        let [x, y] = pose.position.map(|micrometers| f64::from(micrometers) / 1_000.0);
        let yaw = f64::from(pose.yaw) / 65_536.0 * TAU;
        let degrees = |turn: f64| {
            let apart = (yaw - turned - turn).rem_euclid(TAU);
            apart.min(TAU - apart).to_degrees()
        };
        let least = turns.iter().map(|turn| degrees(*turn)).min_by(f64::total_cmp)?;
        let degrees = if pose.yaw_within.is_none() { 0.0 } else { least };
        Some(Off { millimeters: [x - place[0], y - place[1]], degrees })
    }
}

/// Two maps are the same where their heights differ by less than this on average, in millimeters: the learned one has noise.
const LIKE: f64 = 1.5 * SAME;

/// The surface of a placement of the maps, in cells of 1 mm.
fn of_maps(maps: Maps<'_>, index: usize) -> Surface {
    let placement = u8::try_from(index).unwrap_or(u8::MAX);
    let reach = (maps.radius(placement) / 1_000 + 3).min(250);
    let height = |[i, j]: [i32; 2]| f64::from(maps.height(placement, [i * 1_000, j * 1_000])) / 1_000.0;
    Surface::of(usize::from(maps.object_of(placement)), [reach; 2], 1.0, height)
}
