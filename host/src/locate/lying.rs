//! Poses of an object on a table, and those of them that look the same.

use super::surface::{Surface, TABLE};
use crate::mesh::placements::kept;
use crate::probe::scene::Scene;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Number of turns at which two poses are compared.
pub(super) const TURNS: usize = 120;
/// Number of these turns, the most similar ones, that are compared exactly.
const TRIED: usize = 4;
/// Number of cells along the longest side of the grid on which poses are compared.
const CELLS: f64 = 30.0;
/// Number of areas at which the profiles of two poses are compared.
const AREAS: usize = 100;
/// Amount beyond the limit by which profiles of poses that look the same may differ, in millimeters: cells are coarse.
const COARSE: f64 = 1.0;
/// A difference that exceeds the limit by more than this is not lowered below it by a turn nearby, in millimeters.
const HOPELESS: f64 = 3.0;
/// Poses that differ by less look the same without further comparison, in millimeters.
const EQUAL: f64 = 0.05;

/// A compared turn as an angle.
pub(super) fn radians(turn: usize) -> f64 {
    turn as f64 / TURNS as f64 * TAU
}

/// A pose of an object on the table.
#[derive(Clone, Debug)]
pub struct Lying {
    /// Name of the placement.
    pub name: String,
    /// Frequency of this pose, relative to the object's others.
    pub share: f64,
    /// The rotation from the object's frame to that of the table, whose z axis points up.
    pub rotation: DMat3,
    /// Position of the first pose that looks the same, among the object's.
    pub(super) first: usize,
    pub(super) onto: Onto,
    scene: Arc<Scene>,
    bounds: [DVec3; 2],
}

impl Lying {
    /// A scene without a table, which is turned and then stands on one. Cost: one pass over its triangles.
    pub fn new(scene: Arc<Scene>, rotation: DMat3, name: String, share: f64) -> Self {
        let grow = |[low, high]: [DVec3; 2], corner: DVec3| [low.min(rotation * corner), high.max(rotation * corner)];
        let bounds = scene.triangles().flatten().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], grow);
        Self { name, share, rotation, first: 0, onto: Onto::default(), scene, bounds }
    }

    /// Half of the sides of its box.
    pub fn half(&self) -> DVec3 {
        let [low, high] = self.bounds;
        (high - low) / 2.0
    }

    /// The height above the table that a fingertip of this radius meets as it comes straight down on a place, from the middle of the
    /// box; 0 beside the object.
    pub fn height(&self, [x, y]: [f64; 2], radius: f64) -> f64 {
        let [low, high] = self.bounds;
        let start = DVec3::new((low.x + high.x) / 2.0 + x, (low.y + high.y) / 2.0 + y, high.z + 2.0 * radius);
        let back = self.rotation.transpose();
        let distance = self.scene.first_contact(back * start, back * DVec3::NEG_Z, radius);
        distance.map_or(0.0, |distance| (start.z - distance - radius - low.z).max(0.0))
    }
}

/// The frame of a pose in that of another one that looks the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Onto {
    turn: f64,
    shift: [f64; 2],
}

impl Onto {
    /// Turned about the middles of what rises from the table.
    fn about([to, from]: [[f64; 2]; 2], turn: f64) -> Self {
        let [x, y] = turned(from, turn);
        Self { turn, shift: [to[0] - x, to[1] - y] }
    }

    /// A point of the pose, in the other's frame.
    fn forth(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = turned(point, self.turn);
        [x + self.shift[0], y + self.shift[1]]
    }

    /// A point of the other one, in the pose's frame.
    fn back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        turned([x - self.shift[0], y - self.shift[1]], -self.turn)
    }

    /// Place and turn of the other one at which it looks like the pose at a place.
    pub(super) fn placed(&self, place: [f64; 2], yaw: f64) -> ([f64; 2], f64) {
        let yaw = yaw - self.turn;
        let [x, y] = turned(self.shift, yaw);
        ([place[0] - x, place[1] - y], yaw)
    }
}

fn turned([x, y]: [f64; 2], turn: f64) -> [f64; 2] {
    let (sin, cos) = turn.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// A pose, and what a fingertip meets on it in a few places.
struct View<'p> {
    pose: &'p Lying,
    surface: Surface,
    middle: [f64; 2],
    /// The heights above the table, the greatest first.
    profile: Vec<f64>,
}

impl<'p> View<'p> {
    fn new(pose: &'p Lying, radius: f64) -> Self {
        let half = pose.half();
        let surface = Surface::cast(pose, radius, (2.0 * half.x.max(half.y) / CELLS).max(1.0));
        let middle = surface.middle();
        let mut profile: Vec<f64> = surface.heights.iter().copied().filter(|height| *height > TABLE).collect();
        profile.sort_by(|one, other| other.total_cmp(one));
        Self { pose, surface, middle, profile }
    }

    /// The area that rises from the table, in square millimeters.
    fn area(&self) -> f64 {
        self.profile.len() as f64 * self.surface.cell.powi(2)
    }

    /// Mean difference of the heights that each area rises above. On the same footprint, heights differ by no less at any turn.
    fn apart(&self, other: &Self) -> f64 {
        let larger = self.area().max(other.area());
        let above = |view: &Self, area: f64| {
            view.profile.get((area / view.surface.cell.powi(2)) as usize).copied().unwrap_or(0.0)
        };
        let areas = (0..AREAS).map(|number| larger * (number as f64 + 0.5) / AREAS as f64);
        areas.map(|area| (above(self, area) - above(other, area)).abs()).sum::<f64>() / AREAS as f64
    }

    /// The frame of another pose in this one's, if they look the same: if heights differ by less than this on average, at the best
    /// turn.
    fn like(&self, other: &Self, radius: f64, limit: f64) -> Option<Onto> {
        if self.apart(other) > limit + COARSE {
            return None;
        }
        let onto = |turn| Onto::about([self.middle, other.middle], turn);
        let guesses: Vec<f64> = (0..TURNS)
            .map(|turn| other.surface.off(|point| self.surface.near(onto(radians(turn)).forth(point))))
            .collect();
        let is_minimum =
            |turn: &usize| [1, TURNS - 1].iter().all(|step| guesses[*turn] <= guesses[(turn + step) % TURNS]);
        let mut turns: Vec<usize> = (0..TURNS).filter(is_minimum).collect();
        turns.sort_by(|one, other| guesses[*one].total_cmp(&guesses[*other]));
        // Both ways: one of them may look like a part of the other.
        let exact = |turn: f64| {
            let onto = onto(turn);
            let from_other = other.surface.off(|point| self.pose.height(onto.forth(point), radius));
            from_other.max(self.surface.off(|point| other.pose.height(onto.back(point), radius)))
        };
        let tried = turns.into_iter().take(TRIED).map(|turn| {
            let mut best = (exact(radians(turn)), radians(turn));
            let mut step = radians(1) / 2.0;
            while step > radians(1) / 20.0 && (EQUAL..limit + HOPELESS).contains(&best.0) {
                let about = [best.1 - step, best.1 + step].map(|turn| (exact(turn), turn));
                best = about.into_iter().fold(best, |best, next| if next.0 < best.0 { next } else { best });
                step /= 2.0;
            }
            best
        });
        let best = tried.min_by(|one, other| one.0.total_cmp(&other.0))?;
        (best.0 < limit).then(|| onto(best.1))
    }
}

/// Groups the poses of an object that look the same, and sorts the groups by descending share; returns as well the name and share
/// of each group that is left out because it is rare. Poses look the same if contacts of this noise, in millimeters, tell them
/// apart at no turn.
pub(super) fn grouped(mut poses: Vec<Lying>, radius: f64, noise: f64) -> (Vec<Lying>, Vec<(String, f64)>) {
    let limit = (1.5 * noise).max(0.2);
    let views: Vec<View<'_>> = poses.par_iter().map(|pose| View::new(pose, radius)).collect();
    let mut firsts: Vec<usize> = Vec::new();
    let mut found: Vec<(usize, Onto)> = Vec::with_capacity(poses.len());
    for (index, view) in views.iter().enumerate() {
        let like = |first: &usize| Some((*first, views[*first].like(view, radius, limit)?));
        found.push(firsts.par_iter().find_map_first(like).unwrap_or_else(|| (index, Onto::default())));
        if found[index].0 == index {
            firsts.push(index);
        }
    }
    for (pose, (first, onto)) in poses.iter_mut().zip(found) {
        (pose.first, pose.onto) = (first, onto);
    }
    let share = |first: usize| poses.iter().filter(|pose| pose.first == first).map(|pose| pose.share).sum::<f64>();
    let mut shares: Vec<(usize, f64)> = firsts.into_iter().map(|first| (first, share(first))).collect();
    shares.sort_by(|one, other| other.1.total_cmp(&one.1));
    let whole: Vec<f64> = shares.iter().map(|(_, share)| *share).collect();
    let rare = shares.split_off(kept(&whole));
    let left_out = rare.into_iter().map(|(first, share)| (poses[first].name.clone(), share)).collect();
    let mut all: Vec<Lying> = Vec::new();
    for (first, _) in shares {
        let position = all.len();
        let group = poses.iter().filter(|pose| pose.first == first);
        all.extend(group.map(|pose| Lying { first: position, ..pose.clone() }));
    }
    (all, left_out)
}
