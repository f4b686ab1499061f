//! A follower of the touches of an object, and the messages after each of them.

use crate::wire::{self, Approach, Evidence, PoseWithCovariance, Verdict};
use palpate::onboard::Verdict as Decision;
use palpate::onboard::shared::Touch as Felt;

/// The likeliest place of the likeliest object.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placed {
    /// Name of the placement; empty for an object without.
    pub(crate) placement: String,
    pub(crate) pose: PoseWithCovariance,
}

/// Messages after a touch, or a reset.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Step {
    pub(crate) verdict: Verdict,
    /// None where a chip cannot be asked about it any more.
    pub(crate) evidence: Option<Evidence>,
    /// Next approach, for a model with a plan, while nothing is decided.
    pub(crate) approach: Option<Approach>,
    /// Place of the object, after a touch, for a model of maps.
    pub(crate) placed: Option<Placed>,
    /// Next approach, for a model of maps, while nothing is decided.
    pub(crate) next_pose: Option<wire::Pose>,
}

impl Step {
    /// True if no further touch of this object can change the verdict.
    pub(crate) fn is_decided(&self) -> bool {
        self.verdict.verdict != UNDECIDED
    }
}

/// The verdict while nothing is decided.
pub(crate) const UNDECIDED: &str = Decision::Undecided.name();

/// Follows the touches of one object.
pub(crate) trait Following {
    /// The model's objects.
    fn names(&self) -> Vec<String>;
    /// The objects that can be named, each once.
    fn known(&self) -> Vec<String>;
    /// Begins another object, of those that have a weight if there are weights.
    fn begin(&mut self, weights: Option<&[u32]>);
    /// Takes in a touch.
    ///
    /// # Errors
    /// Why it is not counted; nothing changes then.
    fn push(&mut self, felt: &Felt) -> Result<(), String>;
    fn verdict(&self) -> Decision;
    fn touches(&self) -> u32;
    /// The likeliest object.
    fn best(&self) -> usize;
    fn posteriors(&self) -> Vec<f64>;
    /// Adds where to touch next, and where the object is.
    fn complete(&self, step: &mut Step);
}
