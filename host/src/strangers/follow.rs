//! Sequences of touches, and how badly they fit after each touch.

use super::{EARLY, FIRST, HALVED_AFTER, NAT, Pools};
use crate::evaluate::leading;
use crate::random::{self, Purpose};
use palpate_onboard::{Model, Stopping};
use rand::seq::SliceRandom;
use rayon::prelude::*;

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

/// Puts the touches of an object's pool in a random order.
pub(super) fn shuffle<T>(touches: &mut [T], name: &str, seed: u64, pool: u64) {
    touches.shuffle(&mut random::generator(seed, Purpose::Misfit, name, pool));
}

/// Amount by which a misfit may exceed the threshold after this number of touches, in nats.
pub(super) fn early(touches: u32) -> f64 {
    EARLY * libm::exp2(-f64::from(touches) / HALVED_AFTER)
}

/// Follows as many sequences of each object as its touches allow, each touch in one only, at most `most` of all
/// together: of each pool as many, in turn. A sequence that the touches end in is left out; one that a robot's touches end
/// in ends there.
pub(super) fn sequences(model: &Model<'_>, supplies: &[Pools], ending: Ending, most: usize) -> Vec<Vec<Sequence>> {
    let objects = model.object_count();
    let of_each = most.div_ceil(supplies.len().max(1));
    // Where several outputs belong to one object, it is the object that is named.
    let numbers: Option<Vec<u8>> = model.outputs().map(|outputs| outputs.objects().collect());
    let numbers = numbers.as_deref();
    let limit = match ending {
        Ending::Touches(touches) => touches,
        Ending::Named { .. } => Stopping::from_model(model).max_touches(),
    };
    let of = |supply: &Pools| {
        let mut all = Vec::new();
        if supply.is_once {
            let once = supply.pools.iter().take(of_each).map(|rows| {
                let mut states = Vec::new();
                one(model, numbers, &mut rows.chunks_exact(objects), (ending, limit), &mut states);
                Sequence(states)
            });
            return once.filter(|sequence| !sequence.0.is_empty()).collect();
        }
        let mut pools: Vec<_> = supply.pools.iter().map(|rows| rows.chunks_exact(objects)).collect();
        while all.len() < of_each && !pools.is_empty() {
            let next = all.len() % pools.len();
            let mut states = Vec::new();
            if !one(model, numbers, &mut pools[next], (ending, limit), &mut states) {
                break;
            }
            all.push(Sequence(states));
        }
        all
    };
    supplies.par_iter().map(of).collect()
}

/// Follows one sequence; returns true if it ended before the touches did.
fn one<'r>(
    model: &Model<'_>,
    numbers: Option<&[u8]>,
    rows: &mut impl Iterator<Item = &'r [i32]>,
    (ending, limit): (Ending, u32),
    states: &mut Vec<State>,
) -> bool {
    let mut evidence: Vec<i64> = (0..model.object_count()).map(|object| model.prior(object).into()).collect();
    for touches in 1..=limit {
        let Some(row) = rows.next() else { return false };
        evidence.iter_mut().zip(row).for_each(|(sum, &margin)| *sum += i64::from(margin));
        let misfit = model.misfit(&evidence, touches).filter(|_| touches >= FIRST);
        let level = misfit.map_or(f64::NEG_INFINITY, |misfit| misfit as f64 / NAT - early(touches));
        let state = State { level, is_decided: is_decided(model, numbers, &evidence, touches) };
        states.push(state);
        match ending {
            Ending::Named { level } if touches >= FIRST && state.is_decided && state.level <= level => break,
            _ => {}
        }
    }
    true
}

/// True if the leader's posterior passes the model's threshold.
fn is_decided(model: &Model<'_>, numbers: Option<&[u8]>, evidence: &[i64], touches: u32) -> bool {
    if numbers.is_some() {
        let unit = f64::from(model.unit()) * f64::from(model.weight_of(touches)) / 65_536.0;
        let evidence: Vec<f64> = evidence.iter().map(|&sum| sum as f64).collect();
        let (leader, rivals) = leading(&evidence, model.known_count(), numbers, unit);
        return rivals <= Stopping::from_model(model).odds_of(leader, model) as f64 / 2.0_f64.powi(56);
    }
    let known = 0..model.known_count();
    let leader = known.reduce(|best, other| if evidence[other] > evidence[best] { other } else { best }).unwrap_or(0);
    // A weight of 1 changes nothing.
    let weight = f64::from(model.weight_of(touches)) / 65_536.0;
    let ahead = |other: i64| (other - evidence[leader]) as f64 * f64::from(model.unit()) * weight;
    let others = evidence.iter().enumerate().filter(|(object, _)| *object != leader);
    let rivals: f64 = others.map(|(_, &other)| ahead(other).exp()).sum();
    rivals <= Stopping::from_model(model).odds_of(leader, model) as f64 / 2.0_f64.powi(56)
}

/// The level that this share of sequences stays at or below.
pub(super) fn quantile(sequences: &[&Sequence], share: f64) -> f64 {
    let mut levels: Vec<f64> = sequences.iter().map(|sequence| sequence.highest()).collect();
    levels.sort_unstable_by(f64::total_cmp);
    let position = (levels.len() as f64 * share).floor() as usize;
    levels.get(position.min(levels.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
