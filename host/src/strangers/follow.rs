//! Sequences of touches, and how badly they fit after each touch.

use super::{EARLY, FIRST, HALVED_AFTER, NAT, Pools};
use crate::evidence::{self, Counted, Follower, Sequences, Sums, Supplier, Turns, each};
use palpate_onboard::{Model, Stopping};
use rayon::prelude::*;
use std::convert::Infallible;

/// End of sequences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ending {
    /// After this number of touches.
    Touches(u32),
    /// At a name that a threshold of misfit at this level, in nats, would let be given; at the limit of touches at the latest.
    Named { level: f64 },
}

/// State after a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct State {
    /// The misfit of the leading object less what is allowed at first, in nats; infinitely small before the first test.
    level: f64,
    /// True if the leading object's posterior has passed the model's threshold.
    is_decided: bool,
}

/// One sequence of a known object's touches.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sequence(Vec<State>);

impl From<evidence::Sequence> for Sequence {
    fn from(_: evidence::Sequence) -> Self {
        Self(Vec::new())
    }
}

/// End of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End {
    pub(super) is_alarm: bool,
    pub(super) touches: u64,
}

impl Sequence {
    /// Its end with this limit of misfit.
    pub(super) fn end(&self, threshold: f64) -> End {
        for (state, touches) in self.0.iter().zip(1_u64..) {
            if state.level > threshold {
                return End { is_alarm: true, touches };
            }
            if touches >= u64::from(FIRST) && state.is_decided {
                return End { is_alarm: false, touches };
            }
        }
        End { is_alarm: false, touches: self.0.len() as u64 }
    }

    /// The touches after which it ends without a test.
    pub(super) fn decided_after(&self) -> u32 {
        self.0.iter().position(|state| state.is_decided).map_or(self.0.len(), |at| at + 1) as u32
    }

    /// The highest level up to the last state.
    fn highest(&self) -> f64 {
        self.0.iter().map(|state| state.level).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Amount by which a misfit may exceed the threshold after this number of touches, in nats.
pub(super) fn early(touches: u32) -> f64 {
    EARLY * libm::exp2(-f64::from(touches) / HALVED_AFTER)
}

/// Follows as many sequences of each object as its touches allow, each touch in one only, at most `most` of all
/// together: of each pool as many, in turn. A sequence that the touches end in is left out; one that a robot's touches end
/// in ends there.
pub(super) fn sequences(model: &Model<'_>, supplies: &[Pools], ending: Ending, most: usize) -> Vec<Vec<Sequence>> {
    let of_each = most.div_ceil(supplies.len().max(1));
    let limit = match ending {
        Ending::Touches(touches) => touches,
        Ending::Named { .. } => Stopping::from_model(model).max_touches(),
    };
    let see = |sequence: &mut Sequence, sums: &Sums<'_>, counted: Counted| {
        let touches = counted.touches;
        let misfit = model.misfit(sums.evidence(), touches).filter(|_| touches >= FIRST);
        let level = misfit.map_or(f64::NEG_INFINITY, |misfit| misfit as f64 / NAT - early(touches));
        let state = State { level, is_decided: is_decided(model, sums, touches) };
        sequence.0.push(state);
        let is_named = match ending {
            Ending::Named { level } => touches >= FIRST && state.is_decided && state.level <= level,
            Ending::Touches(_) => false,
        };
        is_named || touches >= limit
    };
    let of = |pools: &Pools| {
        let Ok(found) = each(&mut Supply::new(pools, model.object_count()), &mut Sums::new(model, None), of_each, see);
        found
    };
    supplies.par_iter().map(of).collect()
}

/// Sequences of margins that were computed before.
struct Supply<'p> {
    pools: Vec<&'p [i32]>,
    objects: usize,
    turns: Turns,
}

impl<'p> Supply<'p> {
    fn new(pools: &'p Pools, objects: usize) -> Self {
        let all = pools.pools.iter().map(Vec::as_slice);
        // A robot without touches makes no sequence, and the others do.
        let pools_used: Vec<&[i32]> = all.filter(|rows| !(pools.is_once && rows.is_empty())).collect();
        Self { turns: Turns::new(pools_used.len(), pools.is_once), pools: pools_used, objects }
    }
}

impl<F: Follower<Step = [i32]> + ?Sized> Supplier<F> for Supply<'_> {
    type Error = Infallible;

    fn step(&mut self, _: &F) -> Result<Option<Option<&[i32]>>, Infallible> {
        let (pool, next) = self.turns.place();
        self.turns.advance();
        Ok(self.pools.get(pool).and_then(|rows| rows.chunks_exact(self.objects).nth(next)).map(Some))
    }
}

impl<F: Follower<Step = [i32]> + ?Sized> Sequences<F> for Supply<'_> {
    fn begin(&mut self) -> Result<Option<evidence::Sequence>, Infallible> {
        Ok(self.turns.begin().then(|| evidence::Sequence::new(0)))
    }

    fn end(&mut self, steps: u32, is_whole: bool) -> bool {
        self.turns.end(steps, is_whole)
    }
}

/// True if the leader's posterior passes the model's threshold.
fn is_decided(model: &Model<'_>, sums: &Sums<'_>, touches: u32) -> bool {
    // A weight of 1 changes nothing.
    let (leader, rivals) = sums.leading(f64::from(model.unit()) * f64::from(model.weight_of(touches)) / 65_536.0);
    rivals <= Stopping::from_model(model).odds_of(leader, model) as f64 / 2.0_f64.powi(56)
}

/// The level that this share of sequences stays at or below.
pub(super) fn quantile(sequences: &[&Sequence], share: f64) -> f64 {
    let mut levels: Vec<f64> = sequences.iter().map(|sequence| sequence.highest()).collect();
    levels.sort_unstable_by(f64::total_cmp);
    let position = (levels.len() as f64 * share).floor() as usize;
    levels.get(position.min(levels.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
