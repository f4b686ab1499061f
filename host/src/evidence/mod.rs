//! One stream of evidence: the steps of sequences, and what they add up to.
//!
//! ```text
//! supplier ──steps──► follower ──leader, lead, familiarity──┬──► sequence: its end under any threshold
//!     ▲                  │                                  └──► outcome: its end under the follower's own
//!     └─where to touch───┘
//! ```
//!
//! A [`Supplier`] yields steps: touches that were captured before or are when they are needed, drawn at random ([`Drawer`]) or
//! chosen by the follower's plan, or rows. A [`Follower`] adds them up: the chip's own recognizer ([`chip`]), or [`Sums`] that no
//! verdict ends. Everything above these two is the same for all of them: thresholds and promises take a [`Sequence`], figures
//! take an [`Outcome`].

mod chip;
mod draw;
mod outcome;
mod sequence;
mod sums;
#[cfg(test)]
mod tests;
mod turns;

pub(crate) use chip::{Chip, chip};
pub(crate) use draw::{Drawer, Draws};
pub use outcome::Outcome;
pub(crate) use outcome::{Totals, Unit, units};
use palpate_onboard::{Familiarity, Verdict};
pub(crate) use sequence::totals;
pub use sequence::{Lead, Odds, Sequence, margin_of, odds_of};
use std::convert::Infallible;
use std::marker::PhantomData;
pub(crate) use sums::{Sums, best};
pub(crate) use turns::Turns;

/// Adds up the steps of a sequence.
pub(crate) trait Follower {
    /// A step that is evidence, such as a row of margins.
    type Step: ?Sized + 'static;

    /// Forgets the steps, and begins another sequence.
    fn reset(&mut self);

    /// Takes in a step; returns the verdict under its own thresholds. After a verdict steps change nothing.
    fn push(&mut self, step: &Self::Step) -> Verdict;

    /// The class with the most evidence.
    fn leader(&self) -> usize;

    /// The sum of the weights of all others, its own being 1, in Q56.
    fn rivals(&self) -> u64;

    /// Result of a test of whether the steps fit a class at all.
    fn familiarity(&self) -> Familiarity {
        Familiarity::Known
    }

    /// True if two classes count as the same, such as two placements of an object.
    fn is_same(&self, one: usize, other: usize) -> bool {
        one == other
    }

    /// The pose among these in which to touch next; none without a plan.
    fn propose(&self, _poses: &mut dyn Iterator<Item = u16>) -> Option<u16> {
        None
    }
}

/// Supplies the steps of a sequence to followers of a kind.
pub(crate) trait Supplier<F: Follower + ?Sized> {
    /// The error of a step that cannot be made.
    type Error;

    /// The next step, which may depend on the follower's state: none at the end, and nothing to follow if it is no evidence.
    fn step(&mut self, follower: &F) -> Result<Option<Option<&F::Step>>, Self::Error>;
}

/// Supplies one sequence after the other.
pub(crate) trait Sequences<F: Follower + ?Sized>: Supplier<F> {
    /// Begins a sequence, which has a class and may have a group; none if there are no more.
    fn begin(&mut self) -> Result<Option<Sequence>, Self::Error>;

    /// Ends it after so many steps; `is_whole` if its steps did not run out. False if it does not count, and is the last.
    fn end(&mut self, steps: u32, is_whole: bool) -> bool;
}

/// Steps that are there, as an iterator; as sequences, those of one class.
pub(crate) struct Given<'g, I>(I, usize, PhantomData<&'g ()>);

impl<'g, S: ?Sized + 'g, I: Iterator<Item = Option<&'g S>>> Given<'g, I> {
    pub(crate) fn new(steps: I) -> Self {
        Self::of(0, steps)
    }

    pub(crate) fn of(class: usize, steps: I) -> Self {
        Self(steps, class, PhantomData)
    }
}

impl<'g, F: Follower + ?Sized, I: Iterator<Item = Option<&'g F::Step>>> Supplier<F> for Given<'g, I> {
    type Error = Infallible;

    fn step(&mut self, _: &F) -> Result<Option<Option<&F::Step>>, Infallible> {
        Ok(self.0.next())
    }
}

impl<'g, F: Follower + ?Sized, I: Iterator<Item = Option<&'g F::Step>>> Sequences<F> for Given<'g, I> {
    fn begin(&mut self) -> Result<Option<Sequence>, Infallible> {
        Ok(Some(Sequence::new(self.1)))
    }

    fn end(&mut self, _: u32, is_whole: bool) -> bool {
        is_whole
    }
}

/// End of a sequence at the latest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Once the leader has this much more evidence than all others together, in nats.
    pub margin: f64,
    /// After this number of touches that are evidence, if no sooner.
    pub max_touches: u32,
}

/// Numbers of steps in a sequence.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counted {
    /// Steps so far that are evidence.
    pub(crate) touches: u32,
    /// Steps so far.
    pub(crate) approaches: u32,
    /// The verdict after the last step; none if that is no evidence.
    pub(crate) verdict: Option<Verdict>,
}

/// Follows the steps of a sequence until `see`, called after each, has seen enough; false if they end before.
pub(crate) fn follow<F: Follower + ?Sized, S: Supplier<F> + ?Sized>(
    supplier: &mut S,
    follower: &mut F,
    mut see: impl FnMut(&F, Counted) -> bool,
) -> Result<bool, S::Error> {
    follower.reset();
    let mut counted = Counted { touches: 0, approaches: 0, verdict: None };
    while let Some(step) = supplier.step(follower)? {
        counted.verdict = step.map(|step| follower.push(step));
        counted.approaches += 1;
        counted.touches += u32::from(counted.verdict.is_some());
        if see(follower, counted) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Outcome of a sequence under the follower's own thresholds.
pub(crate) fn outcome<F: Follower + ?Sized, S: Supplier<F> + ?Sized>(
    supplier: &mut S,
    follower: &mut F,
) -> Result<Outcome, S::Error> {
    let mut outcome = Outcome::default();
    follow(supplier, follower, |_, Counted { touches, approaches, verdict }| {
        (outcome.touches, outcome.approaches) = (touches as usize, approaches as usize);
        if let Some(Verdict::Recognized { object, .. }) = verdict {
            (outcome.recognized, outcome.output) = (Some(object.into()), Some(object.into()));
        }
        outcome.unknown = verdict == Some(Verdict::Unknown);
        verdict.is_some_and(|verdict| verdict != Verdict::Undecided)
    })?;
    Ok(outcome)
}

/// Follows up to `most` sequences of a supplier to a limit. The follower must not stop by itself. Names are held back, and
/// sequences end, where its own test says so, as on the chip.
pub(crate) fn sequences<F: Follower + ?Sized, S: Sequences<F> + ?Sized>(
    supplier: &mut S,
    follower: &mut F,
    most: usize,
    limit: Limit,
) -> Result<Vec<Sequence>, S::Error> {
    let strictest = odds_of(limit.margin);
    each(supplier, follower, most, |sequence: &mut Sequence, follower, Counted { touches, approaches, verdict }| {
        if verdict.is_none() {
            // No evidence: it cost an approach.
            sequence.end(approaches);
            return false;
        }
        let (familiarity, leader, odds) = (follower.familiarity(), follower.leader(), follower.rivals());
        let may_name = familiarity == Familiarity::Known;
        // Of several outputs of the object that is touched, each is right.
        let name = if follower.is_same(leader, sequence.object) { sequence.object } else { leader };
        sequence.take(Lead { name, odds, touches, approaches }, may_name);
        (may_name && odds <= strictest) || familiarity == Familiarity::Stranger || touches >= limit.max_touches
    })
}

/// Follows up to `most` sequences of a supplier, each until `see`, called after each step, has seen enough.
pub(crate) fn each<F: Follower + ?Sized, S: Sequences<F> + ?Sized, T: From<Sequence>>(
    supplier: &mut S,
    follower: &mut F,
    most: usize,
    mut see: impl FnMut(&mut T, &F, Counted) -> bool,
) -> Result<Vec<T>, S::Error> {
    let mut found = Vec::new();
    while found.len() < most {
        let Some(sequence) = supplier.begin()? else { break };
        let (mut seen, mut steps) = (T::from(sequence), 0);
        let is_whole = follow(supplier, follower, |follower, counted| {
            steps = counted.approaches;
            see(&mut seen, follower, counted)
        })?;
        if !supplier.end(steps, is_whole) {
            break;
        }
        found.push(seen);
    }
    Ok(found)
}
