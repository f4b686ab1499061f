//! Sequences of a data set's touches: whole ones, no touch in two of them.

use super::ahead::{Ahead, Feed};
use super::demand::Demand;
use crate::error::{Error, Result};
use crate::evaluate::by_pose;
use crate::evidence::Sequence;
use crate::evidence::{self, Drawer, Follower, Limit, Sequences, Supplier, Turns, chip};
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use crate::random::Purpose;
use crate::touches::ObjectTouches;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::Plan;
use rayon::prelude::*;

/// The touches of one object that no sequence has used yet.
#[derive(Debug)]
pub struct TouchSupply<'d> {
    object: usize,
    feed: Feed<'d>,
    /// One for each source and robot: a sequence is of touches of one pool.
    pools: Vec<Pool>,
    turns: Turns,
    /// True if a pool makes one sequence only.
    is_once: bool,
    /// The poses that the model's plan may propose; none where touches are taken in their order.
    candidates: Vec<u16>,
}

/// Touches that may be mixed, in the order in which they are used.
#[derive(Debug, Default)]
struct Pool {
    order: Vec<u32>,
    /// Under a plan the same by pose, each pose's last touch the next one.
    by_pose: Vec<Vec<u32>>,
}

impl<'d> TouchSupply<'d> {
    /// The touches of the object with this index in the model. A sequence is of touches of one source, such as an
    /// instance, by one robot. Where robots differ, every robot makes one sequence, so that the sequences' biases are
    /// independent.
    pub(crate) fn new(object: usize, touched: &'d ObjectTouches, seed: u64) -> Self {
        let pools = touched.pools().iter().map(|pool| pool.range.clone().map(|touch| touch as u32).collect()).collect();
        let supply = Self::of(object, Feed::Given(touched.touches()), pools);
        let is_once = touched.has_robots();
        if is_once { Self { is_once, ..supply }.begun() } else { supply.shuffled(&touched.name, seed) }
    }

    /// Touches as if they were all captured before.
    pub(super) fn on_demand(object: usize, demand: &'d Demand<'d>, seed: u64) -> Self {
        Self::of(object, Feed::Captured(demand), demand.pools()).shuffled(demand.name(), seed)
    }

    fn of(object: usize, feed: Feed<'d>, pools: Vec<Vec<u32>>) -> Self {
        let pools = pools.into_iter().map(|order| Pool { order, ..Pool::default() }).collect();
        Self { object, feed, pools, turns: Turns::default(), is_once: false, candidates: Vec::new() }.begun()
    }

    /// The supply with all touches of its pools ahead.
    fn begun(self) -> Self {
        Self { turns: Turns::new(self.pools.len(), self.is_once), ..self }
    }

    fn shuffled(mut self, name: &str, seed: u64) -> Self {
        let drawer = Drawer { purpose: Purpose::Calibration, name, seed };
        (0..).zip(&mut self.pools).for_each(|(turn, pool)| drawer.shuffle(turn, &mut pool.order));
        self
    }

    /// Splits off one in `parts` of the touches as a supply of its own; where there are robots, one in `parts` of them.
    pub(super) fn take_part(&mut self, parts: usize) -> Self {
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
        self.turns = Turns::new(self.pools.len(), self.is_once);
        Self { pools, turns: Turns::default(), candidates: Vec::new(), ..*self }.begun()
    }
}

/// A supply's touches as a model takes them.
pub(super) struct MarginSupply<'s, 'd, 'm> {
    supply: &'s mut TouchSupply<'d>,
    ahead: Ahead<'m>,
    progress: &'s dyn Progress,
}

impl<'s, 'd, 'm> MarginSupply<'s, 'd, 'm> {
    pub(super) fn new(model: &'m Model<'m>, supply: &'s mut TouchSupply<'d>, progress: &'s dyn Progress) -> Self {
        let ahead = Ahead::new(model, supply.pools.len(), supply.is_once);
        Self { supply, ahead, progress }
    }

    /// The position among the object's touches of the last one that was supplied in its pool's order.
    #[cfg(all(test, feature = "train"))]
    pub(super) fn last(&self) -> u32 {
        let (pool, next) = self.supply.turns.place();
        self.supply.pools[pool].order[next - 1]
    }
}

impl<F: Follower<Step = [i32]> + ?Sized> Supplier<F> for MarginSupply<'_, '_, '_> {
    type Error = Error;

    fn step(&mut self, follower: &F) -> Result<Option<Option<&[i32]>>> {
        let TouchSupply { feed, pools, turns, candidates, .. } = &mut *self.supply;
        let (number, next) = turns.place();
        let Some(pool) = pools.get_mut(number) else { return Ok(None) };
        if !pool.by_pose.is_empty() {
            // The next touch in the pose that the follower proposes.
            let pose = follower.propose(&mut candidates.iter().copied());
            let position = pose.and_then(|pose| pool.by_pose.get_mut(usize::from(pose))?.pop());
            return Ok(position.and_then(|position| feed.given(position)).map(|touch| self.ahead.one(touch)));
        }
        turns.advance();
        self.ahead.next(number, next, &pool.order, feed)
    }
}

impl<F: Follower<Step = [i32]> + ?Sized> Sequences<F> for MarginSupply<'_, '_, '_> {
    fn begin(&mut self) -> Result<Option<Sequence>> {
        progress::advance(self.progress, 1)?;
        Ok(self.supply.turns.begin().then(|| Sequence::new(self.supply.object)))
    }

    fn end(&mut self, steps: u32, is_whole: bool) -> bool {
        self.supply.turns.end(steps, is_whole)
    }
}

/// Lets sequences go where the plan of the model says: each next touch is one of those that no sequence has used, in the
/// pose that the recognizer proposes. Poses that some supply has no touch in are never proposed; a sequence that proposes
/// one that is used up ends its supply, as the end of all touches does without a plan.
///
/// # Errors
/// When a touch has no pose.
pub(super) fn follow_plan(supplies: &mut [TouchSupply<'_>], names: &[String], plan: &Plan<'_>) -> Result<()> {
    let poses = plan.poses();
    for supply in &mut *supplies {
        for pool in &mut supply.pools {
            let name = names.get(supply.object).map_or("", String::as_str);
            let touches = pool.order.iter().rev().filter_map(|&touch| Some((touch, supply.feed.given(touch)?)));
            pool.by_pose = by_pose(name, touches, poses)?;
        }
    }
    let pools = || supplies.iter().flat_map(|supply| &supply.pools);
    let has_some = |pose: &u16| pools().all(|pool| !pool.by_pose[usize::from(*pose)].is_empty());
    let candidates: Vec<u16> = (0..poses.count()).filter(|&pose| plan.may_touch(pose)).filter(has_some).collect();
    supplies.iter_mut().for_each(|supply| supply.candidates.clone_from(&candidates));
    Ok(())
}

/// Parts of the sequences wanted, after each of which it is seen whether a supply has ended.
const ROUNDS: u128 = 16;

/// Follows sequences of all objects' touches, `wanted` of each supply's, in parallel. Every supply then has as many sequences
/// of those wanted as the one with the smallest share of them.
///
/// # Errors
/// [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn follow(
    model: &Model<'_>,
    supplies: &mut [TouchSupply<'_>],
    wanted: &[usize],
    limit: Limit,
    progress: &dyn Progress,
) -> Result<Vec<Sequence>> {
    let of = |(supply, wanted): (&mut MarginSupply<'_, '_, '_>, usize)| {
        let mut follower = chip(model, Stopping::from_odds(0, u32::MAX), None);
        evidence::sequences(supply, &mut *follower, wanted, limit)
    };
    let mut drawn: Vec<MarginSupply<'_, '_, '_>> =
        supplies.iter_mut().map(|supply| MarginSupply::new(model, supply, progress)).collect();
    let mut found: Vec<Vec<Sequence>> = vec![Vec::new(); drawn.len()];
    // Side by side: once a supply has ended, what the others had beyond its share would be left out again.
    for round in 1..=ROUNDS {
        let goal = |wanted: usize| (wanted as u128 * round).div_ceil(ROUNDS) as usize;
        let wanted: Vec<usize> = found.iter().zip(wanted).map(|(found, &wanted)| goal(wanted) - found.len()).collect();
        let more = in_order(drawn.par_iter_mut().zip(wanted.par_iter().copied()).map(of))?;
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
