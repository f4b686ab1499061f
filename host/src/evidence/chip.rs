//! The chip's own recognizer as a follower of margins.

use super::Follower;
use palpate_onboard::{Familiarity, Model, Recognizer, Stopping, Verdict};

/// A follower of rows of margins.
pub(crate) type Chip<'m> = dyn Follower<Step = [i32]> + 'm;

/// The recognizer of a model that stops at these thresholds. `weights` say how often each object is touched, if not as often
/// as the model's priors.
pub(crate) fn chip<'m>(model: &Model<'m>, stopping: Stopping, weights: Option<&'m [u32]>) -> Box<Chip<'m>> {
    match model.object_count() {
        0..=16 => of::<16>(model, stopping, weights),
        17..=64 => of::<64>(model, stopping, weights),
        _ => of::<256>(model, stopping, weights),
    }
}

fn of<'m, const N: usize>(model: &Model<'m>, stopping: Stopping, weights: Option<&'m [u32]>) -> Box<Chip<'m>> {
    let Ok(recognizer) = Recognizer::<N>::new(model, stopping) else {
        unreachable!("there is room for as many objects, and models have at most 256")
    };
    Box::new(Onboard { recognizer, weights })
}

struct Onboard<'m, const N: usize> {
    recognizer: Recognizer<'m, N>,
    weights: Option<&'m [u32]>,
}

impl<const N: usize> Follower for Onboard<'_, N> {
    type Step = [i32];

    fn reset(&mut self) {
        match self.weights {
            // One of them is above 0, which whoever made them saw to; otherwise the priors stay.
            Some(weights) => _ = self.recognizer.reset_to(weights),
            None => self.recognizer.reset(),
        }
    }

    fn push(&mut self, margins: &[i32]) -> Verdict {
        self.recognizer.push_margins(margins)
    }

    fn leader(&self) -> usize {
        self.recognizer.best()
    }

    fn rivals(&self) -> u64 {
        self.recognizer.rivals()
    }

    fn familiarity(&self) -> Familiarity {
        self.recognizer.familiarity()
    }

    fn is_same(&self, one: usize, other: usize) -> bool {
        self.recognizer.model().is_same_object(one, other)
    }

    fn propose(&self, poses: &mut dyn Iterator<Item = u16>) -> Option<u16> {
        Some(self.recognizer.next_approach(poses)?.pose)
    }
}
