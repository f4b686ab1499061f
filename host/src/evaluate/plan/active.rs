//! Approaches where the model's plan says.

use super::poses::{ByPose, Stock};
use super::{check_approaches, no_plan};
use crate::error::Result;
use crate::evaluate::margins::{Margins, Tested, row};
use crate::evidence::{Chip, Counted, Follower, Outcome, Supplier, chip, follow, outcome};
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::Stopping;
use palpate_shared::Poses;
use serde::Serialize;
use std::convert::Infallible;

/// The test approaches by pose: what a robot meets that goes where the plan says.
///
/// Every approach is drawn from those of the sequence's object in the proposed pose, none twice in a sequence. Poses that
/// some object has no test approach in are never proposed, and one whose approaches are used up in a sequence is not
/// proposed again in it; where none is left, the sequence ends without a verdict.
pub(crate) struct Active {
    /// For each tested object, for each pool: of its sources, and of robots.
    by_pose: Vec<Vec<ByPose>>,
    /// Poses that may be proposed.
    candidates: Vec<u16>,
    poses: Poses,
    /// Poses in which the plan's approaches never touched anything.
    left_out: usize,
}

/// Conditions under which a plan's policy was tested.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ActiveFacts {
    /// Rolls of the row of fingers for each of 26 directions.
    pub rolls: u8,
    /// Poses that could be proposed.
    pub poses: usize,
    /// Poses in which the plan's approaches never touched anything.
    pub left_out: usize,
    /// Poses that some object has no test approach in, which were not proposed.
    pub without_approaches: usize,
}

impl Active {
    /// The approaches of a data set, which the margins are of, by the poses of the model's plan.
    ///
    /// # Errors
    /// When there is no plan; when the data set is without approaches or without poses.
    pub(crate) fn new(margins: &Margins<'_>, dataset: &Dataset) -> Result<Self> {
        let plan = margins.model.plan().ok_or_else(no_plan)?;
        check_approaches(dataset)?;
        let poses = plan.poses();
        let turns = |(tested, object): (&Tested, &ObjectTouches)| -> Result<Vec<ByPose>> {
            tested.pools.iter().map(|pool| ByPose::new(object, poses, &pool.touches)).collect()
        };
        let by_pose: Vec<Vec<ByPose>> =
            margins.tested.iter().zip(&dataset.objects).map(turns).collect::<Result<_>>()?;
        let has_some = |pose: &u16| by_pose.iter().flatten().all(|of| of.count(*pose) > 0);
        let touching: Vec<u16> = (0..poses.count()).filter(|&pose| plan.may_touch(pose)).collect();
        let left_out = usize::from(poses.count()) - touching.len();
        Ok(Self { candidates: touching.into_iter().filter(has_some).collect(), by_pose, poses, left_out })
    }

    /// Conditions of the test.
    pub(crate) fn facts(&self) -> ActiveFacts {
        ActiveFacts {
            rolls: self.poses.rolls(),
            poses: self.candidates.len(),
            left_out: self.left_out,
            without_approaches: usize::from(self.poses.count()) - self.left_out - self.candidates.len(),
        }
    }

    /// The approaches to a tested object that sequence `group` may use.
    fn stock(&self, position: usize, group: usize, seed: u64) -> Stock<'_> {
        let turns = &self.by_pose[position];
        turns[group % turns.len()].stock(group, seed)
    }
}

impl Margins<'_> {
    /// Follows one sequence of a tested object under the plan's policy, until `see` says that it is enough or no approach
    /// is left.
    pub(super) fn follow_plan(
        &self,
        active: &Active,
        which: (usize, usize),
        (stopping, seed): (Stopping, u64),
        see: impl FnMut(&Chip<'_>, Counted) -> bool,
    ) {
        let Ok(_) = follow(&mut self.chosen(active, which, seed), &mut *chip(self.model, stopping, None), see);
    }

    /// Outcome of a sequence of approaches under the plan's policy.
    pub(super) fn active_outcome(
        &self,
        active: &Active,
        which: (usize, usize),
        (stopping, seed): (Stopping, u64),
    ) -> Outcome {
        let Ok(outcome) = outcome(&mut self.chosen(active, which, seed), &mut *chip(self.model, stopping, None));
        outcome
    }

    fn chosen<'c>(&'c self, active: &'c Active, (position, group): (usize, usize), seed: u64) -> Chosen<'c> {
        let tested = &self.tested[position];
        let stock = active.stock(position, group, seed);
        Chosen { active, stock, approaches: &tested.approaches, values: &tested.values, objects: self.objects.len() }
    }
}

/// An object's approaches and their margins, each next one in the pose that the follower proposes.
struct Chosen<'s> {
    active: &'s Active,
    stock: Stock<'s>,
    /// For each approach the position of its touch among those that are evidence.
    approaches: &'s [Option<u32>],
    values: &'s [i32],
    objects: usize,
}

impl<F: Follower<Step = [i32]> + ?Sized> Supplier<F> for Chosen<'_> {
    type Error = Infallible;

    fn step(&mut self, follower: &F) -> Result<Option<Option<&[i32]>>, Infallible> {
        let Self { active, stock, approaches, values, objects } = self;
        let mut candidates = active.candidates.iter().copied().filter(|&pose| stock.left(pose) > 0);
        let pose = follower.propose(&mut candidates);
        let approach = pose.and_then(|pose| stock.draw(pose));
        let touch = approach.map(|approach| approaches[approach as usize]);
        Ok(touch.map(|touch| touch.map(|touch| &values[row(touch as usize, *objects)])))
    }
}
