//! A located approach as a step of evidence, and an object's cells as a follower.

use super::refused::{BELOW, not_down, nowhere, reachable, too_low};
use super::world::{Aimed, Drawn, Truth};
use crate::error::{Error, Result};
use crate::evidence::{Follower, Sequence, Sequences, Supplier};
use palpate_onboard::locate::{Approach, AtMost, Effort, Hand, Locator, Maps, Pose, Seen};
use palpate_onboard::{Familiarity, Stopping, Verdict};
use palpate_shared::Touch;
use std::convert::Infallible;

/// Room for touches.
pub const TOUCHES: usize = 32;
/// Cells within the memory of a chip with 128 KB.
pub(crate) const CELLS: usize = 14_336;
/// Cells and objects on a host that follows many objects.
const MANY: usize = 65_536;

/// Heights that a touch met.
///
/// # Errors
/// When the touch has no position, or one that cannot be of a hand above a table; [`Kind::NotDown`](crate::error::Kind::NotDown).
pub fn seen(hand: &Hand, touch: &Touch) -> Result<Seen> {
    let position = touch.position().ok_or_else(nowhere)?;
    reachable(["x", "y", "z"].into_iter().zip(position.micrometers.map(|micrometers| f64::from(micrometers) / 1e3)))?;
    let last = touch.times().iter().filter_map(|time| time.micros()).max().unwrap_or(0);
    let way = f64::from(last) * 1e-6 * f64::from(hand.speed) / 1e3;
    let below = way - f64::from(position.micrometers[2]) / 1e3;
    if below > BELOW {
        return Err(too_low(below));
    }
    hand.seen(touch).ok_or_else(not_down)
}

/// A locator of the host: with a chip's room for up to 16 objects, with more for more.
pub trait Locating: Send + Sync {
    /// Begins another object, with another seed of the choice of approaches.
    fn begin(&mut self, seed: u32);
    /// Begins another object, one of those that have a weight.
    fn begin_of(&mut self, weights: &[u32]);
    /// Takes in the heights of an approach.
    fn push(&mut self, seen: Seen) -> Verdict;
    /// The first verdict, which stays.
    fn verdict(&self) -> Verdict;
    /// The object with the most evidence.
    fn leader(&self) -> usize;
    /// The object that was recognized; until then the leader.
    fn best(&self) -> usize;
    /// Sum of the weights of the others, in Q56.
    fn rivals(&self) -> u64;
    /// True if the last search ended before it was done.
    fn is_exhausted(&self) -> bool;
    /// False if no object is named, whatever its lead.
    fn may_name(&self) -> bool;
    /// Result of the test for unknown objects.
    fn familiarity(&self) -> Familiarity;
    /// Logarithm of the touches' likelihood under the leader for each touch, in 1/64 nat.
    fn fit(&self) -> i32;
    /// The most likely poses of an object, the largest share first, at most four.
    fn poses(&self, object: usize) -> Vec<Pose>;
    /// Posteriors of all objects.
    fn posteriors(&self) -> Vec<f64>;
    /// The next approach; `pose` is how much the pose counts, in 64ths.
    fn choose(&mut self, hand: &Hand, within: u32, pose: u16) -> Approach;
    /// True if no finger of any touch so far met more than the table.
    fn met_table_alone(&self) -> bool;
    /// Number of touches so far.
    fn touches(&self) -> usize;
    /// Heights that were looked up by the last search, and since.
    fn looked(&self) -> u32;
}

struct Room<'m, const CELLS: usize, const OBJECTS: usize> {
    fitting: AtMost<'m, OBJECTS>,
    stopping: Stopping,
    effort: Effort,
    locator: Locator<'m, CELLS, TOUCHES, OBJECTS>,
}

/// A locator of maps with these thresholds, and bounds on its work; by default a chip's for up to 16 objects.
pub fn locating<'m>(maps: Maps<'m>, stopping: Stopping, effort: Option<Effort>) -> Box<dyn Locating + 'm> {
    if maps.objects() <= 16 {
        of::<CELLS, 16>(maps, stopping, effort.unwrap_or_default())
    } else {
        let many = Effort { lookups: 2_000_000, ..Effort::default() };
        of::<MANY, 256>(maps, stopping, effort.unwrap_or(many))
    }
}

// On its own in the stack: a page has room for a chip's locator, not for the large one's.
#[inline(never)]
fn of<'m, const CELLS: usize, const OBJECTS: usize>(
    maps: Maps<'m>,
    stopping: Stopping,
    effort: Effort,
) -> Box<dyn Locating + 'm> {
    let Ok(fitting) = maps.try_into() else { unreachable!("there is room for as many objects") };
    let locator = Locator::new(fitting, stopping, effort, 1);
    let mut room = Box::new(Room::<CELLS, OBJECTS> { fitting, stopping, effort, locator });
    room.locator.reset();
    room
}

impl<const CELLS: usize, const OBJECTS: usize> Locating for Room<'_, CELLS, OBJECTS> {
    fn begin(&mut self, seed: u32) {
        self.locator = Locator::new(self.fitting, self.stopping, self.effort, seed);
        self.locator.reset();
    }

    fn begin_of(&mut self, weights: &[u32]) {
        _ = self.locator.reset_to(weights);
    }

    fn push(&mut self, seen: Seen) -> Verdict {
        self.locator.push_seen(seen)
    }

    fn verdict(&self) -> Verdict {
        self.locator.verdict()
    }

    fn leader(&self) -> usize {
        self.locator.leader()
    }

    fn best(&self) -> usize {
        self.locator.best()
    }

    fn rivals(&self) -> u64 {
        self.locator.rivals().q56()
    }

    fn is_exhausted(&self) -> bool {
        self.locator.exhausted().is_some()
    }

    fn may_name(&self) -> bool {
        self.locator.may_name()
    }

    fn familiarity(&self) -> Familiarity {
        self.locator.familiarity()
    }

    fn fit(&self) -> i32 {
        self.locator.fit()
    }

    fn poses(&self, object: usize) -> Vec<Pose> {
        let mut poses = vec![Pose::default(); 4];
        let found = self.locator.poses(object, &mut poses);
        poses.truncate(found);
        poses
    }

    fn posteriors(&self) -> Vec<f64> {
        (0..self.locator.maps().objects()).map(|object| f64::from(self.locator.posterior(object)) / 65_536.0).collect()
    }

    fn choose(&mut self, hand: &Hand, within: u32, pose: u16) -> Approach {
        self.locator.choose(hand.spacing, hand.stroke.unwrap_or(u32::MAX), within, pose)
    }

    fn met_table_alone(&self) -> bool {
        self.locator.met_table_alone()
    }

    fn touches(&self) -> usize {
        self.locator.touches()
    }

    fn looked(&self) -> u32 {
        self.locator.looked()
    }
}

/// Half the side of the square about the table's origin in which the middle finger may go, in micrometers, from a statement in
/// millimeters; by default twice the range of the maps. The outer fingers reach beyond it by their distance from the middle one.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) unless it is from 0 to 1,000 mm.
pub fn workspace(maps: &Maps<'_>, workspace: Option<f64>) -> Result<u32> {
    match workspace {
        None => Ok(2 * maps.range().unsigned_abs()),
        Some(millimeters) => within(millimeters),
    }
}

/// Half the side of a workspace that is stated, in micrometers.
///
/// # Errors
/// Errors of [`workspace`].
pub fn within(millimeters: f64) -> Result<u32> {
    match (0.0..=1_000.0).contains(&millimeters) {
        true => Ok((millimeters * 1e3) as u32),
        false => Err(Error::setting("workspace", millimeters, "a number of millimeters from 0 to 1000")),
    }
}

/// The follower of located approaches, which knows where to touch next.
pub(super) struct Pressing<'m> {
    pub(super) locating: Box<dyn Locating + 'm>,
    pub(super) hand: Hand,
    pub(super) within: u32,
    pub(super) aimed: Aimed,
    pub(super) pose: u16,
    /// Seed of the choice of approaches.
    pub(super) seed: u32,
    /// Weights of the objects that there may be; none: all alike.
    pub(super) weights: Option<Vec<u32>>,
    /// Next approach; none before the first touch, and where approaches are aimed at random.
    pub(super) next: Option<Approach>,
    /// Heights that were looked up by all approaches, and at most by one.
    pub(super) looked: [u64; 2],
}

impl Pressing<'_> {
    /// Place of the most likely cell, in millimeters.
    fn believed(&self) -> Option<[f64; 2]> {
        let pose = self.locating.poses(self.locating.leader()).into_iter().next()?;
        Some(pose.position.map(|micrometers| f64::from(micrometers) / 1_000.0))
    }
}

impl Follower for Pressing<'_> {
    type Step = Seen;

    fn reset(&mut self) {
        self.locating.begin(self.seed);
        if let Some(weights) = &self.weights {
            self.locating.begin_of(weights);
        }
        self.next = None;
    }

    fn push(&mut self, seen: &Seen) -> Verdict {
        let verdict = self.locating.push(*seen);
        if self.aimed == Aimed::Chosen {
            self.next = Some(self.locating.choose(&self.hand, self.within, self.pose));
        }
        let looked = self.locating.looked().into();
        self.looked = [self.looked[0] + looked, self.looked[1].max(looked)];
        verdict
    }

    fn leader(&self) -> usize {
        self.locating.leader()
    }

    fn rivals(&self) -> u64 {
        // No name.
        if self.locating.may_name() { self.locating.rivals() } else { 1 << 56 }
    }

    fn familiarity(&self) -> Familiarity {
        self.locating.familiarity()
    }
}

/// The approaches to one object on a simulated table.
pub(super) struct Pressed<'w> {
    pub(super) drawn: Drawn<'w>,
    /// Its number in the model; beyond all for an unknown one.
    pub(super) class: usize,
    pub(super) begun: bool,
    pub(super) seen: Seen,
    /// Half of the square that random approaches are aimed in, in millimeters.
    pub(super) reach: f64,
    /// The object and its place at the last approach.
    pub(super) before: Truth,
}

impl<'m> Supplier<Pressing<'m>> for Pressed<'_> {
    type Error = Infallible;

    fn step(&mut self, follower: &Pressing<'m>) -> Result<Option<Option<&Seen>>, Infallible> {
        let at = match (follower.next, follower.aimed) {
            (Some(next), _) => next,
            (None, Aimed::Chosen) => Approach { roll: self.drawn.anywhere([0.0; 2], 0.0).roll, ..Approach::default() },
            (None, Aimed::Random) => {
                let about = follower.believed().filter(|_| self.begun).unwrap_or_default();
                let at = self.drawn.anywhere(about, self.reach);
                let half = i32::try_from(follower.within).unwrap_or(i32::MAX);
                Approach { x: at.x.clamp(-half, half), y: at.y.clamp(-half, half), ..at }
            }
        };
        self.begun = true;
        self.before = self.drawn.truth;
        let touch = self.drawn.press(at);
        // It has a position, and comes straight down.
        self.seen = follower.hand.seen(&touch).unwrap_or_default();
        Ok(Some(Some(&self.seen)))
    }
}

impl<'m> Sequences<Pressing<'m>> for Pressed<'_> {
    fn begin(&mut self) -> Result<Option<Sequence>, Infallible> {
        Ok((!self.begun).then(|| Sequence::new(self.class)))
    }

    fn end(&mut self, _: u32, _: bool) -> bool {
        true
    }
}
