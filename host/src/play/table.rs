//! A game on a table: an object lies at a hidden place, a hand comes straight down, and a locator follows.

use crate::locate::{Approach, Drawn, Hand, Locating, Maps, Pose, TOUCHES, Truth, World, locating};
use crate::probe::approach::FINGERS;

/// Share of the pose in what an approach is chosen to tell, in 64ths.
const POSE: u16 = 10;
/// Most poses that are shown, and the least share of all belief that one is worth showing for.
const SHOWN: (usize, f64) = (12, 1e-3);

/// An object that lies hidden on a table, and what a locator believes of it.
pub struct Hidden<'w> {
    drawn: Drawn<'w>,
    hand: Hand,
    within: u32,
    /// The locator.
    pub locating: Box<dyn Locating + 'w>,
}

/// Contacts of an approach's fingers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Height of each finger's contact above the table, as sensed, in millimeters; none for one that met nothing.
    pub heights: [Option<f64>; FINGERS],
    /// Height that the hand went down to, in millimeters.
    pub lowest: f64,
}

/// A pose that the object may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ghost {
    /// The object's number in the maps.
    pub object: usize,
    /// Its pose.
    pub pose: Pose,
    /// Share of all belief.
    pub share: f64,
}

impl<'w> Hidden<'w> {
    /// Hides an object of a world: the number `index` modulo that of its objects, at a place that the number and the world's seed
    /// determine. `None` for maps that do not state their hand.
    pub fn new(world: &World<'w>, maps: Maps<'w>, index: u64) -> Option<Self> {
        let locating = locating(maps, maps.stopping(), None);
        Some(Self {
            drawn: world.draw(index),
            hand: Hand::of(&maps)?,
            within: maps.range().unsigned_abs() * 2,
            locating,
        })
    }

    /// An object and its place.
    pub const fn truth(&self) -> Truth {
        self.drawn.truth
    }

    /// The approach that tells most; before the first one the middle, with the row turned by chance.
    pub fn choose(&mut self) -> Approach {
        match self.locating.touches() {
            0 => Approach { x: 0, y: 0, ..self.drawn.anywhere([0.0; 2], 0.0) },
            _ => self.locating.choose(&self.hand, self.within, POSE),
        }
    }

    /// Presses straight down; `None`, and nothing happens, if the locator has no room for another touch.
    pub fn press(&mut self, at: Approach) -> Option<Pressed> {
        if self.locating.touches() >= TOUCHES {
            return None;
        }
        let touch = self.drawn.press(at);
        let [.., z] = touch.position()?.micrometers.map(|micrometers| f64::from(micrometers) / 1e3);
        let way = |micros: u32| f64::from(micros) * f64::from(self.hand.speed) / 1e9;
        self.locating.push(self.hand.seen(&touch)?);
        // Without any contact the position is where the hand stopped.
        let stroke = if touch.is_empty() { Some(0) } else { self.hand.stroke };
        Some(Pressed {
            heights: touch.times().map(|time| Some(z - way(time.micros()?))),
            lowest: stroke.map_or(0.0, |stroke| z - f64::from(stroke) / 1e3).max(0.0),
        })
    }

    /// The poses that the object may have, likeliest first, at most twelve; none before the first touch.
    pub fn ghosts(&self) -> Vec<Ghost> {
        if self.locating.touches() == 0 {
            return Vec::new();
        }
        let mut ghosts = Vec::new();
        for (object, posterior) in self.locating.posteriors().into_iter().enumerate() {
            if posterior >= SHOWN.1 {
                let share = |pose: &Pose| posterior * f64::from(pose.share) / 65_536.0;
                let poses = self.locating.poses(object).into_iter();
                ghosts.extend(poses.map(|pose| Ghost { object, pose, share: share(&pose) }));
            }
        }
        ghosts.retain(|ghost| ghost.share >= SHOWN.1);
        ghosts.sort_by(|a, b| b.share.total_cmp(&a.share));
        ghosts.truncate(SHOWN.0);
        ghosts
    }
}
