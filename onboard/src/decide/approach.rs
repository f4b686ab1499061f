//! The next approach.

use super::evidence::{Unit, best};
use super::recognizer::{Recognizer, State, unit};
use crate::model::Model;
use palpate_shared::MOST_POSES;
use palpate_shared::format::Plan;

/// An approach that is proposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proposal {
    /// Index of the candidate.
    pub index: usize,
    /// The number of its pose: see [`Poses`](palpate_shared::Poses).
    pub pose: u16,
    /// Degree to which the approach distinguishes the object with the most evidence from the others, in Q15: the mean
    /// separation, each other object weighted by how likely it still is.
    pub score: i32,
}

impl<const N: usize> Recognizer<'_, N> {
    /// The most helpful of the candidates, numbers of poses that the robot can reach: it tells the
    /// object with the most evidence best from the others, each weighted by its posterior. `0..plan.poses().count()` are
    /// all poses. `None` if the model has no [plan](Model::plan), or none of the candidates is a pose that may touch;
    /// of several that are as good, the first.
    ///
    /// Cost: an exponential for each other object, a multiplication and an addition for each of them and each pose (936
    /// for ten objects and 104 poses), a few instructions for each candidate, and a division. Stack: a
    /// score for each of up to 104 poses. Cannot fail.
    pub fn next_approach(&self, candidates: impl IntoIterator<Item = u16>) -> Option<Proposal> {
        self.state().propose(self.model(), candidates)
    }
}

/// See [`Recognizer::next_approach`].
fn propose(model: &Model<'_>, evidence: &[i64], candidates: impl IntoIterator<Item = u16>) -> Option<Proposal> {
    let plan = model.plan()?;
    let mut scores = [0; MOST_POSES];
    // A background is never named, and nothing is known about approaches to it.
    let known = evidence.get(..model.known_count()).unwrap_or(evidence);
    let weights = add_up(&plan, known, unit(model), &mut scores);
    let mut proposal: Option<Proposal> = None;
    for (index, pose) in candidates.into_iter().enumerate() {
        let Some(&score) = scores.get(usize::from(pose)).filter(|_| plan.may_touch(pose)) else { continue };
        if proposal.is_none_or(|best| score > best.score) {
            proposal = Some(Proposal { index, pose, score });
        }
    }
    proposal.map(|best| Proposal { score: mean(best.score, weights), ..best })
}

/// A sum of 128ths times weights as a mean in Q15, rounded toward 0. In two steps, so that 32 bits are enough: there are
/// less than 2^23 of weights.
fn mean(sum: i32, weights: i32) -> i32 {
    let weights = weights.max(1);
    sum / weights * 256 + sum % weights * 256 / weights
}

impl<const N: usize> State<N> {
    /// The approach that [`propose`] proposes by the evidence so far: before the first touch, by the priors.
    pub(crate) fn propose(&self, model: &Model<'_>, candidates: impl IntoIterator<Item = u16>) -> Option<Proposal> {
        propose(model, self.evidence_or_priors(model, &mut [0; N]), candidates)
    }
}

/// Adds up the separations of the object with the most evidence from each other one, times this one's weight in Q15, that
/// of the strongest other one being 1. Returns the sum of the weights.
fn add_up(plan: &Plan<'_>, evidence: &[i64], unit: Unit, scores: &mut [i32; MOST_POSES]) -> i32 {
    let (leader, _) = best(evidence);
    let others = || evidence.iter().enumerate().filter(|(object, _)| *object != leader);
    let strongest = others().map(|(_, &evidence)| evidence).max().unwrap_or(0);
    let mut weights = 0;
    for (object, &evidence) in others() {
        // At most 2^15; times 2^7, for at most 255 others, below 2^31.
        let weight = i32::try_from(unit.weight(strongest.abs_diff(evidence)) >> 41).unwrap_or(0);
        if weight > 0 {
            weights += weight;
            for (score, &separation) in scores.iter_mut().zip(plan.separations(leader, object)) {
                *score += weight * i32::from(separation.cast_signed());
            }
        }
    }
    weights
}
