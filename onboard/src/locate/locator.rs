//! The follower: touches in, a verdict out.

use super::cell::{Cell, MOST_TOUCHES, NEAR, Pool};
use super::maps::Maps;
use super::number::{NOTHING, Random, add, logarithm, odds};
use super::seen::{Contact, Seen};
use crate::bytes::at;
use crate::decide::{CapacityError, Familiarity, Rivals, Stopping, Verdict};
use palpate_shared::Touch;

/// Touches from which on a test for unknown objects decides.
pub const TESTED: usize = 8;

/// Bounds on the work of an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Heights that are looked up until a search ends. They are most of the cost of an approach, besides
    /// passes over the cells and a choice; the firmware's image `located` counts all of it. 450,000 serve ten objects.
    pub lookups: u32,
    /// Cells that are kept, if there is room for as many.
    pub cells: u32,
    /// Approaches that are compared to choose the next.
    pub candidates: u16,
}

impl Default for Effort {
    fn default() -> Self {
        Self { lookups: 450_000, cells: u32::MAX, candidates: 64 }
    }
}

/// Bound at which a search ended before it was done. No object is named then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exhausted {
    /// The pool of cells was full.
    Cells,
    /// The limit of heights to look up was reached.
    Lookups,
}

/// Maps of at most this many objects, for a [`Locator`] with room for them: `maps.try_into()`.
#[derive(Clone, Copy, Debug)]
pub struct AtMost<'m, const OBJECTS: usize>(Maps<'m>);

impl<'m, const OBJECTS: usize> TryFrom<Maps<'m>> for AtMost<'m, OBJECTS> {
    type Error = CapacityError;

    fn try_from(maps: Maps<'m>) -> Result<Self, CapacityError> {
        let objects = maps.objects();
        if objects <= OBJECTS { Ok(Self(maps)) } else { Err(CapacityError { objects, capacity: OBJECTS }) }
    }
}

/// Recognizes which object lies on a table, and where, with room for `CELLS` cells of 8 bytes, `TOUCHES` touches and `OBJECTS`
/// objects. The cells are in `P`.
#[derive(Clone, Debug)]
pub struct Locator<'m, const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P = [Cell; CELLS]> {
    pub(super) maps: Maps<'m>,
    pub(super) stopping: Stopping,
    pub(super) effort: Effort,
    pub(super) seen: [Seen; TOUCHES],
    pub(super) touches: usize,
    pub(super) pool: P,
    pub(super) count: usize,
    /// Logarithm of each object's weight before the first touch.
    priors: [i32; OBJECTS],
    /// Logarithm of the weight of an object's cells that are not in the pool.
    pub(super) dropped: [i32; OBJECTS],
    pub(super) posteriors: [i32; OBJECTS],
    /// The likelihood of the most likely cell.
    pub(super) best: i32,
    pub(super) looked: u32,
    pub(super) exhausted: Option<Exhausted>,
    /// The first verdict, which stays.
    verdict: Verdict,
    pub(super) random: Random,
    seed: u32,
}

impl<'m, const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> Locator<'m, CELLS, TOUCHES, OBJECTS> {
    /// A locator without a touch, which stops as `stopping` says. The seed is of the choice of approaches. Until the first touch,
    /// choice or reset nothing is searched: all objects are as likely, and none has a pose.
    ///
    /// Cost: writing its RAM, which is taken once: the locator is made where it is kept. Cannot fail; other numbers of cells and
    /// touches do not build.
    pub fn new(maps: AtMost<'m, OBJECTS>, stopping: Stopping, effort: Effort, seed: u32) -> Self {
        Locator::without_pool(maps, stopping, effort, seed).over(maps.0, [Cell::NONE; CELLS])
    }
}

impl<'m, const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> Locator<'m, CELLS, TOUCHES, OBJECTS, ()> {
    /// Room in which a search can work: checked when a program is built.
    const IS_ENOUGH: () = assert!(CELLS >= 64 && TOUCHES > 0 && TOUCHES <= MOST_TOUCHES, "64 cells, 1 to 64 touches");

    /// A locator that has still to get its cells.
    pub(crate) fn without_pool(maps: AtMost<'m, OBJECTS>, stopping: Stopping, effort: Effort, seed: u32) -> Self {
        const { Self::IS_ENOUGH };
        let AtMost(maps) = maps;
        let objects = maps.objects();
        let each = |log: i32| core::array::from_fn(|object| if object < objects { log } else { NOTHING });
        // Xorshift stays at 0.
        let seed = seed.max(1);
        Self {
            maps,
            stopping,
            effort,
            seen: [Seen::default(); TOUCHES],
            touches: 0,
            pool: (),
            count: 0,
            priors: each(0),
            dropped: [NOTHING; OBJECTS],
            posteriors: each(-logarithm(u64::try_from(objects).unwrap_or(1))),
            best: NOTHING,
            looked: 0,
            exhausted: None,
            verdict: Verdict::Undecided,
            random: Random(seed),
            seed,
        }
    }
}

impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P> Locator<'_, CELLS, TOUCHES, OBJECTS, P> {
    /// This locator with the same maps at another place, and another place for the same cells. Cost: all but the cells is copied.
    pub(crate) fn over<'n, Q>(self, maps: Maps<'n>, pool: Q) -> Locator<'n, CELLS, TOUCHES, OBJECTS, Q> {
        let Self { stopping, effort, seen, touches, count, priors, dropped, posteriors, .. } = self;
        let Self { best, looked, exhausted, verdict, random, seed, .. } = self;
        Locator {
            maps,
            stopping,
            effort,
            seen,
            touches,
            pool,
            count,
            priors,
            dropped,
            posteriors,
            best,
            looked,
            exhausted,
            verdict,
            random,
            seed,
        }
    }

    /// Posterior of an object in Q16; 0 for one that is not there. Cost: a few instructions.
    pub fn posterior(&self, object: usize) -> u32 {
        super::number::power(-self.posteriors.get(object).copied().unwrap_or(NOTHING))
    }

    /// Logarithms of all posteriors, in 1/64 nat; beyond the objects there are any numbers.
    pub(crate) fn evidence(&self) -> [i64; OBJECTS] {
        self.posteriors.map(i64::from)
    }
}

impl<'m, const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P: Pool>
    Locator<'m, CELLS, TOUCHES, OBJECTS, P>
{
    /// Forgets all touches, for another object. Cost: that of a search without touches.
    pub fn reset(&mut self) {
        (self.touches, self.count, self.random) = (0, 0, Random(self.seed));
        self.verdict = Verdict::Undecided;
        self.search();
    }

    /// Begins another object: one of those that have a weight, which says how often each is met. Like [`reset`](Self::reset);
    /// changes nothing and returns false unless one of as many weights as there are objects is above 0. Cost: as
    /// [`reset`](Self::reset).
    pub fn reset_to(&mut self, weights: &[u32]) -> bool {
        if weights.len() != self.maps.objects() || weights.iter().all(|&weight| weight == 0) {
            return false;
        }
        self.priors.iter_mut().zip(weights).for_each(|(prior, &weight)| *prior = logarithm(weight.into()));
        self.reset();
        true
    }

    /// Logarithm of the weight of a placement's object; [`NOTHING`] for one that is not expected.
    pub(super) fn object_prior(&self, placement: u8) -> i32 {
        at(&self.priors, usize::from(self.maps.object_of(placement)))
    }

    /// Takes in a touch with pose and position, of a probe whose fingers are `spacing` micrometers apart and move at `speed`
    /// micrometers per second until `stroke` micrometers after the first contact.
    ///
    /// `None`, and nothing is counted, for a touch without a position, or from another direction than straight down (a direction's
    /// z above −0.95).
    /// Cost and verdict: see [`push_seen`](Self::push_seen).
    pub fn push(&mut self, touch: &Touch, hand: Hand) -> Option<Verdict> {
        hand.seen(touch).map(|seen| self.push_seen(seen))
    }

    /// Takes in the heights of an approach. The first verdict other than [`Verdict::Undecided`] stays until a reset; posteriors and
    /// the object's place go on with further touches.
    ///
    /// Cost: a search, about as much as [`Effort::lookups`] says. Until there is a verdict also a pass over the objects and one over
    /// the touches, and a few over the kept cells. Cannot fail: once there is no more
    /// room for touches, the verdict is [`Verdict::GaveUp`] unless there was another.
    pub fn push_seen(&mut self, seen: Seen) -> Verdict {
        if let Some(slot) = self.seen.get_mut(self.touches) {
            *slot = seen;
            self.touches += 1;
            self.search();
            if self.verdict == Verdict::Undecided {
                self.verdict = self.decide();
            }
        }
        self.verdict
    }

    /// The first verdict on the touches so far. Cost of this and of the next: a few instructions. Cannot fail, like all that follows.
    pub const fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// The object that was recognized, whichever leads by now; until then the [leader](Self::leader).
    pub fn best(&self) -> usize {
        match self.verdict {
            Verdict::Recognized { object, .. } => usize::from(object),
            _ => self.leader(),
        }
    }

    /// False if no object is named, whatever its lead: after a search that was not finished, before a finger met more than the table
    /// (on an empty table the object that is easiest to miss would be named), and while the place is at the [border](Self::is_at_border).
    ///
    /// Cost: a pass over the touches and one over the kept cells. Cannot fail.
    pub fn may_name(&self) -> bool {
        self.exhausted.is_none() && !self.met_table_alone() && !self.is_at_border()
    }

    /// A verdict on the last search alone.
    fn decide(&self) -> Verdict {
        let touches = u32::try_from(self.touches).unwrap_or(u32::MAX);
        let familiarity = self.familiarity();
        let is_sure =
            familiarity == Familiarity::Known && self.may_name() && self.rivals().q56() <= self.stopping.odds();
        if familiarity == Familiarity::Stranger {
            Verdict::Unknown
        } else if is_sure {
            let object = u8::try_from(self.leader()).unwrap_or(u8::MAX);
            Verdict::Recognized { object, touches, rivals: self.rivals() }
        } else if self.touches >= TOUCHES || touches >= self.stopping.max_touches() {
            Verdict::GaveUp
        } else {
            Verdict::Undecided
        }
    }

    /// The object with the most evidence. Cost: a few instructions for each object.
    pub fn leader(&self) -> usize {
        let objects = self.posteriors.iter().take(self.maps.objects()).enumerate();
        objects
            .fold(
                (0, i32::MIN),
                |best, (object, &posterior)| if posterior > best.1 { (object, posterior) } else { best },
            )
            .0
    }

    /// Sum of the weights of all objects but the leader, that of the leader being 1. It is above 1 while the leader has less than
    /// half of the belief. Cost: a pass over the objects.
    pub fn rivals(&self) -> Rivals {
        let leader = self.leader();
        let objects = self.posteriors.iter().take(self.maps.objects()).enumerate();
        let others =
            objects.filter(|(object, _)| *object != leader).fold(NOTHING, |sum, (_, &posterior)| add(sum, posterior));
        Rivals::from_q56(odds(at(&self.posteriors, leader) - others))
    }

    /// Result of the test of whether the touches fit an object at all, for maps that state one: doubtful before the eighth touch,
    /// and then by the [fit](Self::fit) of the leader. No object is named while it is not known.
    pub fn familiarity(&self) -> Familiarity {
        match self.least_fit() {
            None => Familiarity::Known,
            Some(_) if self.touches < TESTED => Familiarity::Doubtful,
            Some(least) if self.fit() < least => Familiarity::Stranger,
            Some(_) => Familiarity::Known,
        }
    }

    /// True if no finger of any touch so far met more than the table, within 1.5 mm: after a verdict without a name there is
    /// probably no object. False before the first touch.
    ///
    /// Cost: a pass over the touches. Cannot fail.
    pub fn met_table_alone(&self) -> bool {
        let seen = self.seen.get(..self.touches).unwrap_or_default();
        // What met nothing is below 0.
        !seen.is_empty() && seen.iter().flat_map(|seen| seen.z).all(|z| i32::from(z) < NEAR)
    }

    /// Number of touches so far.
    pub const fn touches(&self) -> usize {
        self.touches
    }

    /// Bound at which the last search ended before it was done, if it did.
    pub const fn exhausted(&self) -> Option<Exhausted> {
        self.exhausted
    }

    /// Heights that were looked up by the last search, and since.
    pub const fn looked(&self) -> u32 {
        self.looked
    }

    /// The maps.
    pub const fn maps(&self) -> Maps<'m> {
        self.maps
    }

    /// Number of cells that the last search kept.
    pub const fn kept(&self) -> usize {
        self.count
    }
}

/// More than 2 m, in micrometers.
const FAR: i64 = 4_000_000;

/// Measures of a hand that comes straight down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hand {
    /// Distance between neighboring fingers, in micrometers.
    pub spacing: u32,
    /// Speed, in micrometers per second.
    pub speed: u32,
    /// Way that the hand goes on after the first contact, in micrometers; none: until all fingers have met something.
    pub stroke: Option<u32>,
}

impl Hand {
    /// The hand that the maps were learned with; none if they do not state it, or not in millimeters. Cost: a few
    /// multiplications, some in f32. Cannot fail.
    pub fn of(maps: &Maps<'_>) -> Option<Self> {
        let probe = maps.probe()?;
        if probe.length != palpate_shared::format::Length::Millimeter {
            return None;
        }
        // Floats become integers without a panic.
        let micrometers = |millimeters: f32| (millimeters * 1_000.0) as u32;
        Some(Self {
            spacing: micrometers(probe.spacing),
            speed: micrometers(probe.speed),
            stroke: probe.stroke.map(micrometers),
        })
    }

    /// Heights that a touch met; none without a position, or from another direction than straight down. Cost: a few
    /// multiplications and divisions for each finger. Cannot fail.
    pub fn seen(&self, touch: &Touch) -> Option<Seen> {
        let (pose, position) = (touch.pose()?, touch.position()?);
        let [_, _, down] = pose.direction;
        if i32::from(down) > -31_128 {
            return None;
        }
        let [x, y, z] = position.micrometers;
        let along = |share: i16| {
            let micrometers = i64::from(self.spacing) * i64::from(share) / i64::from(palpate_shared::Q15_ONE);
            // What is farther than 2 m counts as 2 m away.
            i32::try_from(micrometers.clamp(-FAR, FAR)).unwrap_or(0)
        };
        let [row_x, row_y, row_z] = pose.alignment.map(along);
        let mut contacts = [Contact::Nothing; 3];
        for ((contact, time), finger) in contacts.iter_mut().zip(touch.times()).zip([-1, 0, 1]) {
            if let Some(micros) = time.micros() {
                let way = i64::from(micros).saturating_mul(self.speed.into()) / 1_000_000;
                let height = (i64::from(z) + finger * i64::from(row_z) - way).clamp(i32::MIN.into(), i32::MAX.into());
                *contact = Contact::At(i32::try_from(height).unwrap_or(0));
            }
        }
        let stroke = if touch.is_empty() { Some(0) } else { self.stroke };
        // Without a stroke the hand goes on to the table.
        let limit = stroke.map_or(i64::MIN, |stroke| i64::from(z) - i64::from(stroke)).max(i32::MIN.into());
        Some(Seen::new([x, y], [row_x, row_y], contacts, i32::try_from(limit).unwrap_or(i32::MAX)))
    }
}
