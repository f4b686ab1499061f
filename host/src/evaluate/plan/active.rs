//! Approaches where the model's plan says.

use super::poses::{ByPose, Stock};
use crate::error::{EvaluateProblem, Result};
use crate::evaluate::Candidate;
use crate::evaluate::margins::{Margins, Tested, Values, row};
use crate::evaluate::sequential::Outcome;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Poses;
use serde::Serialize;

/// The test approaches by pose: what a robot meets that goes where the plan says.
///
/// Every approach is drawn from those of the sequence's object in the proposed pose, none twice in a sequence. Poses that
/// some object has no test approach in are never proposed, and one whose approaches are used up in a sequence is not
/// proposed again in it; where none is left, the sequence ends without a verdict.
pub struct Active {
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
    /// [`EvaluateProblem::NoPlan`] for a model without one, or an ensemble; [`EvaluateProblem::NoApproaches`] and
    /// [`EvaluateProblem::NoPoseOf`] for a data set without approaches or without poses.
    pub fn new(margins: &Margins<'_>, dataset: &Dataset) -> Result<Self> {
        let plan = match margins.candidate {
            Candidate::Full(_) => None,
            Candidate::Compiled(model) => model.plan(),
        };
        let plan = plan.ok_or(EvaluateProblem::NoPlan)?;
        if !dataset.holds_approaches() {
            return Err(EvaluateProblem::NoApproaches.into());
        }
        let poses = plan.poses();
        let turns = |(tested, object): (&Tested<'_>, &ObjectTouches)| -> Result<Vec<ByPose>> {
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
    pub fn facts(&self) -> ActiveFacts {
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

    /// The number of the next approach in a sequence, as the recognizer proposes it and the stock has it; `None` if none
    /// is left.
    pub fn next<const N: usize>(&self, recognizer: &Recognizer<'_, N>, stock: &mut Stock<'_>) -> Option<u32> {
        let candidates = self.candidates.iter().copied().filter(|&pose| stock.left(pose) > 0);
        let pose = recognizer.next_approach(candidates)?.pose;
        stock.draw(pose)
    }
}

/// State after an approach.
pub(super) struct Moment {
    /// The object with the most evidence.
    pub(super) best: usize,
    /// Approaches so far.
    pub(super) approaches: usize,
    /// Touches so far that are evidence.
    pub(super) touches: usize,
    pub(super) verdict: Verdict,
}

/// Function called after each approach of a sequence; true ends it.
type See<'s> = &'s mut dyn FnMut(&Moment) -> bool;

impl Margins<'_> {
    /// Follows one sequence of a tested object under the plan's policy, until `see` says that it is enough or no approach
    /// is left. A full model has no plan and no sequence.
    pub(super) fn follow_plan(
        &self,
        active: &Active,
        (position, group): (usize, usize),
        (stopping, seed): (Stopping, u64),
        see: See<'_>,
    ) {
        let Values::Compiled(model, values) = &self.tested[position].values else { return };
        let sequence = Sequence { active, approaches: &self.tested[position].approaches, values };
        let stock = active.stock(position, group, seed);
        match self.objects().len() {
            0..=16 => sequence.follow::<16>(model, stopping, stock, see),
            17..=64 => sequence.follow::<64>(model, stopping, stock, see),
            _ => sequence.follow::<256>(model, stopping, stock, see),
        }
    }

    /// Outcome of a sequence of approaches under the plan's policy.
    pub(super) fn active_outcome(&self, active: &Active, which: (usize, usize), rule: (Stopping, u64)) -> Outcome {
        let mut outcome = Outcome { touches: 0, approaches: 0, recognized: None, output: None, unknown: false };
        self.follow_plan(active, which, rule, &mut |moment| {
            (outcome.touches, outcome.approaches) = (moment.touches, moment.approaches);
            if let Verdict::Recognized { object, .. } = moment.verdict {
                outcome.recognized = Some(object.into());
            }
            outcome.unknown = moment.verdict == Verdict::Unknown;
            moment.verdict != Verdict::Undecided
        });
        outcome
    }
}

/// An object's approaches and their margins, and the policy.
struct Sequence<'s> {
    active: &'s Active,
    /// For each approach the position of its touch among those that are evidence.
    approaches: &'s [Option<u32>],
    values: &'s [i32],
}

impl Sequence<'_> {
    fn follow<const N: usize>(&self, model: &Model<'_>, stopping: Stopping, mut stock: Stock<'_>, see: See<'_>) {
        // Room was made for at least as many objects as the model has.
        let Ok(mut recognizer) = Recognizer::<N>::new(model, stopping) else { return };
        let (mut approaches, mut touches) = (0, 0);
        while let Some(approach) = self.active.next(&recognizer, &mut stock) {
            approaches += 1;
            if let Some(touch) = self.approaches[approach as usize] {
                recognizer.push_margins(&self.values[row(touch as usize, model.object_count())]);
                touches += 1;
            }
            let (best, verdict) = (recognizer.best(), recognizer.verdict());
            if see(&Moment { best, approaches, touches, verdict }) {
                break;
            }
        }
    }
}
