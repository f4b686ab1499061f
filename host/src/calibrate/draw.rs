//! Sequences of a data set's touches: whole ones, no touch in two of them.

use super::ahead::{Ahead, Feed};
use super::demand::Demand;
use super::sequence::{Sequence, odds_of};
use crate::error::{EvaluateProblem, Result};
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use crate::random::{self, Purpose};
use crate::touches::ObjectTouches;
use palpate_onboard::{Familiarity, Model, Recognizer, Stopping};
use palpate_shared::Touch;
use palpate_shared::format::Plan;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// State after a touch that is evidence.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'s> {
    /// The touch.
    pub touch: &'s Touch,
    /// The evidence for each object, in units.
    pub evidence: &'s [i64],
    /// The object with the most.
    pub best: usize,
    /// Touches so far that are evidence.
    pub touches: u32,
    /// Approaches so far.
    pub approaches: u32,
}

/// End of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// Once the leader has this much more evidence than all others together, in nats.
    pub margin: f64,
    /// After this number of touches that are evidence, if no sooner.
    pub max_touches: u32,
}

/// The touches of one object that no sequence has used yet.
#[derive(Debug)]
pub struct Supply<'d> {
    object: usize,
    feed: Feed<'d>,
    /// One for each source and robot: a sequence is of touches of one pool.
    pools: Vec<Pool>,
    /// The pool of the next sequence.
    next: usize,
    /// True if a pool makes one sequence only.
    is_once: bool,
    /// The poses that the model's plan may propose; none where touches are taken in their order.
    candidates: Vec<u16>,
}

/// Touches that may be mixed, in the order in which they are used.
#[derive(Debug, Default)]
struct Pool {
    order: Vec<u32>,
    used: usize,
    /// Under a plan the same by pose, each pose's last touch the next one.
    by_pose: Vec<Vec<u32>>,
}

impl<'d> Supply<'d> {
    /// The touches of the object with this index in the model. A sequence is of touches of one source, such as an
    /// instance, by one robot. Where robots differ, every robot makes one sequence, so that the sequences' biases are
    /// independent.
    pub fn new(object: usize, touched: &'d ObjectTouches, seed: u64) -> Self {
        let pools = touched.pools().into_iter().map(|pool| pool.touches).collect();
        let supply = Self::of(object, Feed::Given(touched.touches()), pools);
        let is_once = touched.has_robots();
        if is_once { Self { is_once, ..supply } } else { supply.shuffled(&touched.name, seed) }
    }

    /// The same touches as if they were all captured before.
    pub(super) fn on_demand(object: usize, demand: &'d Demand<'d>, seed: u64) -> Self {
        Self::of(object, Feed::Captured(demand), demand.pools()).shuffled(demand.name(), seed)
    }

    fn of(object: usize, feed: Feed<'d>, pools: Vec<Vec<u32>>) -> Self {
        let pools = pools.into_iter().map(|order| Pool { order, ..Pool::default() }).collect();
        Self { object, feed, pools, next: 0, is_once: false, candidates: Vec::new() }
    }

    fn shuffled(mut self, name: &str, seed: u64) -> Self {
        for (turn, pool) in (0..).zip(&mut self.pools) {
            pool.order.shuffle(&mut random::generator(seed, Purpose::Calibration, name, turn));
        }
        self
    }

    /// Splits off one in `parts` of the touches as a supply of its own; where there are robots, one in `parts` of them.
    pub fn take_part(&mut self, parts: usize) -> Self {
        let part = |all: usize| all / parts.max(1);
        let pools = if self.is_once {
            self.pools.drain(..part(self.pools.len())).collect()
        } else {
            let take = |pool: &mut Pool| {
                let rest = pool.order.split_off(part(pool.order.len()));
                Pool { order: std::mem::replace(&mut pool.order, rest), ..Pool::default() }
            };
            self.pools.iter_mut().map(take).collect()
        };
        Self { pools, candidates: Vec::new(), ..*self }
    }

    /// Follows up to `wanted` sequences. One that the touches end in is left out; one that a robot's touches end in ends
    /// there.
    fn follow<const N: usize, G: FnMut(&Moment<'_>) -> bool>(
        &mut self,
        ahead: &mut Ahead<'_>,
        model: &Model<'_>,
        wanted: usize,
        until: Until,
        gate: impl Fn() -> G,
        progress: &dyn Progress,
    ) -> Result<Vec<Sequence>> {
        // Models have at most 256 objects, and the caller makes room for as many.
        let never = Stopping::from_odds(0, u32::MAX);
        let Ok(mut recognizer) = Recognizer::<N>::new(model, never) else { return Ok(Vec::new()) };
        let mut sequences = Vec::new();
        while sequences.len() < wanted {
            progress::advance(progress, 1)?;
            let Some(pool) = self.pools.get_mut(self.next) else { break };
            let mut order = Order {
                feed: &self.feed,
                candidates: &self.candidates,
                ahead: &mut *ahead,
                turn: self.next,
                next: pool.used,
                pool,
            };
            let (sequence, is_whole) = one(self.object, &mut recognizer, &mut order, until, gate())?;
            if !is_whole && (!self.is_once || pool.order.is_empty()) {
                break;
            }
            pool.used += sequence.approaches as usize;
            sequences.push(sequence);
            self.next += 1;
            if !self.is_once {
                self.next %= self.pools.len();
            }
        }
        Ok(sequences)
    }
}

/// A pool's touches, one after the other, as they are pushed.
struct Order<'o, 'd, 'm> {
    feed: &'o Feed<'d>,
    candidates: &'o [u16],
    ahead: &'o mut Ahead<'m>,
    pool: &'o mut Pool,
    /// Number of the pool.
    turn: usize,
    /// Position of the next touch in the pool's order.
    next: usize,
}

impl Order<'_, '_, '_> {
    /// Pushes the next touch, if there is one; it, and whether it is evidence.
    fn push<const N: usize>(&mut self, recognizer: &mut Recognizer<'_, N>) -> Result<Option<(&Touch, bool)>> {
        if !self.pool.by_pose.is_empty() {
            let Some(touch) = self.proposed(recognizer) else { return Ok(None) };
            return Ok(Some((touch, recognizer.push(touch).is_ok())));
        }
        let Some((touch, margins)) = self.ahead.next(self.turn, self.next, &self.pool.order, self.feed)? else {
            return Ok(None);
        };
        self.next += 1;
        if let Some(margins) = margins {
            recognizer.push_margins(margins);
        }
        Ok(Some((touch, margins.is_some())))
    }

    /// The next touch in the pose that the recognizer proposes.
    fn proposed<const N: usize>(&mut self, recognizer: &mut Recognizer<'_, N>) -> Option<&Touch> {
        let pose = recognizer.next_approach(self.candidates.iter().copied())?.pose;
        let position = self.pool.by_pose.get_mut(usize::from(pose))?.pop()?;
        self.feed.given(position)
    }
}

/// Lets sequences go where the plan of the model says: each next touch is one of those that no sequence has used, in the
/// pose that the recognizer proposes. Poses that some supply has no touch in are never proposed; a sequence that proposes
/// one that is used up ends its supply, as the end of all touches does without a plan.
///
/// # Errors
/// [`EvaluateProblem::NoPoseOf`] for a touch without a pose.
pub fn follow_plan(supplies: &mut [Supply<'_>], names: &[String], plan: &Plan<'_>) -> Result<()> {
    let poses = plan.poses();
    for supply in &mut *supplies {
        for pool in &mut supply.pools {
            let mut by_pose = vec![Vec::new(); poses.count().into()];
            for &touch in pool.order.iter().rev() {
                let no_pose =
                    || EvaluateProblem::NoPoseOf { object: names.get(supply.object).cloned().unwrap_or_default() };
                let pose = supply.feed.given(touch).and_then(Touch::pose).ok_or_else(no_pose)?;
                by_pose[usize::from(poses.number_of(&pose))].push(touch);
            }
            pool.by_pose = by_pose;
        }
    }
    let pools = || supplies.iter().flat_map(|supply| &supply.pools);
    let has_some = |pose: &u16| pools().all(|pool| !pool.by_pose[usize::from(*pose)].is_empty());
    let candidates: Vec<u16> = (0..poses.count()).filter(|&pose| plan.may_touch(pose)).filter(has_some).collect();
    supplies.iter_mut().for_each(|supply| supply.candidates.clone_from(&candidates));
    Ok(())
}

/// Follows one sequence; returns true if it ended before the touches did.
fn one<const N: usize>(
    object: usize,
    recognizer: &mut Recognizer<'_, N>,
    order: &mut Order<'_, '_, '_>,
    until: Until,
    mut gate: impl FnMut(&Moment<'_>) -> bool,
) -> Result<(Sequence, bool)> {
    let strictest = odds_of(until.margin);
    let mut sequence = Sequence::new(object);
    recognizer.reset();
    for approaches in 1_u32.. {
        let Some((touch, is_evidence)) = order.push(recognizer)? else { break };
        if !is_evidence {
            // No evidence: it cost an approach.
            sequence.end(approaches);
            continue;
        }
        let (evidence, best, touches) = (recognizer.evidence(), recognizer.best(), recognizer.touches());
        // What the model's own test says, as on the chip: a name is held back, or there is none.
        let familiarity = recognizer.familiarity();
        let may_name =
            gate(&Moment { touch, evidence, best, touches, approaches }) && familiarity == Familiarity::Known;
        let odds = sequence.push(recognizer, approaches, may_name);
        if (may_name && odds <= strictest) || familiarity == Familiarity::Stranger || touches >= until.max_touches {
            return Ok((sequence, true));
        }
    }
    Ok((sequence, false))
}

/// Parts of the sequences wanted, after each of which it is seen whether a supply has ended.
const ROUNDS: u128 = 16;

/// Follows sequences of all objects' touches, `wanted` of each supply's, in parallel; `gate` makes for each sequence what
/// says after each touch whether a name may be given. Every supply then has as many sequences of those wanted as the one
/// with the smallest share of them.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn follow<G: FnMut(&Moment<'_>) -> bool>(
    model: &Model<'_>,
    supplies: &mut [Supply<'_>],
    wanted: &[usize],
    until: Until,
    gate: impl Fn() -> G + Sync,
    progress: &dyn Progress,
) -> Result<Vec<Sequence>> {
    let of = |((supply, ahead), wanted): ((&mut Supply<'_>, &mut Ahead<'_>), usize)| match model.object_count() {
        0..=16 => supply.follow::<16, G>(ahead, model, wanted, until, &gate, progress),
        17..=64 => supply.follow::<64, G>(ahead, model, wanted, until, &gate, progress),
        _ => supply.follow::<256, G>(ahead, model, wanted, until, &gate, progress),
    };
    let ahead = |supply: &Supply<'_>| Ahead::new(model, supply.pools.len(), supply.is_once);
    let mut ahead: Vec<Ahead<'_>> = supplies.iter().map(ahead).collect();
    let mut found: Vec<Vec<Sequence>> = vec![Vec::new(); supplies.len()];
    // Side by side: once a supply has ended, what the others had beyond its share would be left out again.
    for round in 1..=ROUNDS {
        let goal = |wanted: usize| (wanted as u128 * round).div_ceil(ROUNDS) as usize;
        let wanted: Vec<usize> = found.iter().zip(wanted).map(|(found, &wanted)| goal(wanted) - found.len()).collect();
        let more = supplies.par_iter_mut().zip(&mut ahead).zip(wanted.par_iter().copied()).map(of);
        let more = in_order(more)?;
        let has_ended = more.iter().zip(&wanted).any(|(more, &wanted)| more.len() < wanted);
        found.iter_mut().zip(more).for_each(|(found, more)| found.extend(more));
        if has_ended {
            break;
        }
    }
    let share = |(found, wanted): (&Vec<Sequence>, &usize)| (*wanted > 0).then(|| found.len() as f64 / *wanted as f64);
    let share = found.iter().zip(wanted).filter_map(share).fold(1.0, f64::min);
    for (found, &wanted) in found.iter_mut().zip(wanted) {
        // Rounded up if it is a whole number except for the last bits.
        found.truncate((wanted as f64 * share + 1e-6) as usize);
    }
    Ok(found.into_iter().flatten().collect())
}
