//! Approaches straight down to an object on a table, by a hand that knows where it is.
//!
//! Each finger goes on by itself: one that comes down beside the object touches the table, which is a contact with its time.
//! Poses and positions are in the frame of the placement: x and y count from the center of its bounding box, z from the table,
//! and the axes are those of [`Scene::on_table`].

use crate::probe::approach::{Approach, FINGERS, Probe, row, unit};
use crate::probe::hand;
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use glam::DVec3;
use palpate_shared::{Position, Touch};
use rand::Rng;
use rand::rngs::ChaCha8Rng;

/// A touch with a position, and what the hand did not reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// The touch, with pose and position.
    pub touch: Touch,
    /// The fingers whose contact came later than the stroke, and is missing.
    pub late: [bool; FINGERS],
    /// True if the approach ended before the first contact, at the end of the travel.
    pub is_turned_back: bool,
}

impl Approach {
    /// An approach straight down at a place, in the placement's frame: with the lowest point of the middle fingertip at x and y,
    /// from `height` above the table, all in millimeters. The row is level and turned by `roll` degrees about the vertical; at 0
    /// it runs along x, from the first finger to the third.
    pub fn straight_down(scene: &Scene, probe: &Probe, [x, y]: [f64; 2], roll: f64, height: f64) -> Self {
        let (sin, cos) = libm::sincos(roll.to_radians());
        let [low, _] = scene.bounds();
        let start = DVec3::new(x, y, low.z + height + probe.radius);
        Self { start, direction: DVec3::NEG_Z, alignment: DVec3::new(cos, sin, 0.0) }
    }

    /// Draws an approach straight down. Place: uniform in a `region`, from its lowest to its highest x and y. Start: the lowest
    /// point of the middle fingertip is at `clearance` above the object's highest point. Row: as [`draw`](Self::draw).
    pub fn draw_down(
        rng: &mut impl Rng,
        scene: &Scene,
        probe: &Probe,
        [low, high]: [[f64; 2]; 2],
        clearance: f64,
    ) -> Self {
        let place = std::array::from_fn(|axis| low[axis] + (high[axis] - low[axis]) * unit(rng));
        let [bottom, top] = scene.bounds();
        let level = Self::straight_down(scene, probe, place, 0.0, top.z - bottom.z + clearance);
        Self { alignment: row(rng, level.direction, probe.tilt), ..level }
    }

    /// The touch of this approach to an object on a table, each finger going on by itself. Noise is added, if any, with random
    /// numbers of the generator beside it; it includes fingers that bend aside. Contacts later than the stroke are missing. The
    /// position is that of the first contact that is noticed.
    ///
    /// Cost: a cast for each finger, and with fingers that bend aside two more.
    pub fn locate(&self, scene: &Scene, probe: &Probe, mut noise: Option<(&Noise, &mut ChaCha8Rng)>) -> Located {
        let mut distances = match &mut noise {
            Some((Noise { grazing, .. }, random)) if !grazing.is_none() => {
                grazing.each_distance(self, scene, probe, *random)
            }
            _ => self.each_distance(scene, probe),
        };
        for (distance, finger) in distances.iter_mut().zip(self.fingers(probe.spacing)) {
            let table = Some(scene.reaches_table(finger, self.direction, probe.radius)).filter(|way| way.is_finite());
            *distance = match (*distance, table) {
                (Some(object), Some(table)) => Some(object.min(table)),
                (object, table) => object.or(table),
            };
        }
        let (distances, is_turned_back) = probe.within_travel(distances);
        let first = distances.iter().flatten().copied().reduce(f64::min);
        // Without a travel the hand goes on to something; an approach that leaves the table ends where it begins.
        let end = self.lowest(scene, probe, probe.travel.unwrap_or_default());
        let position = first.map_or(end, |way| self.lowest(scene, probe, way));
        let touch = self.touch(distances, probe).with_position(position);
        let touch = match noise {
            Some((noise, random)) => noise.add_to(&touch, probe, random),
            None => touch,
        };
        // The stroke begins with the first contact that is noticed.
        let late = hand::late(&touch, probe.window());
        Located { touch: hand::within(&touch, probe.window()), late, is_turned_back }
    }

    /// The lowest point of the middle fingertip after the hand has moved by `way`.
    fn lowest(&self, scene: &Scene, probe: &Probe, way: f64) -> Position {
        let [low, _] = scene.bounds();
        let DVec3 { x, y, z } = self.start + self.direction * way;
        Position { micrometers: [x, y, z - probe.radius - low.z].map(|length| (1e3 * length).round() as i32) }
    }
}
