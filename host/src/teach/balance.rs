//! The constant that is added to a taught object's margin with every touch.
//!
//! An object of which there are few touches is too unsure of itself where it has not been seen. The constant is chosen so
//! that errors balance: over groups of approaches, each object touched equally often, a taught object is missed as often
//! as its name is given to others.

use crate::evaluate::best;
use crate::random::{self, Purpose};
use rayon::prelude::*;

/// The largest constant, in nats to either side.
const MOST: f64 = 2.0;
/// Halvings of the range: to 0.001 nats.
const HALVINGS: usize = 12;
/// Rounds over several taught objects, whose constants depend on each other.
const ROUNDS: usize = 4;

/// What an approach is to a model that never saw it: the margins of all objects, or no evidence.
pub(super) type Held = Vec<Option<Vec<f64>>>;

/// A group of approaches to one object.
struct Group {
    /// The margins' sums; empty without evidence.
    sums: Vec<f64>,
    /// Touches that are evidence.
    touches: f64,
}

/// Groups of approaches to each object, by the object's index.
pub(super) struct Groups {
    of: Vec<Vec<Group>>,
    /// The indices of the taught objects.
    taught: Vec<usize>,
    /// The index of the background, which is nobody's name.
    background: Option<usize>,
}

/// How often a taught object is named, rightly or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Named {
    /// The share of its groups that are given its name.
    pub(super) right: f64,
    /// The share of the other objects' groups that are given its name, added up over these objects.
    pub(super) wrong: f64,
}

impl Groups {
    /// Draws `count` groups of `approaches` approaches for each object, without replacement in a group.
    pub(super) fn draw(
        held: &[Held],
        taught: Vec<usize>,
        background: Option<usize>,
        [count, approaches]: [usize; 2],
        seed: u64,
    ) -> Self {
        let of = held.iter().enumerate().map(|(object, held)| {
            let name = format!("{object}");
            let group = |group: usize| {
                let mut random = random::generator(seed, Purpose::Teach, &name, group as u64);
                let drawn = rand::seq::index::sample(&mut random, held.len(), approaches.min(held.len()));
                let (mut sums, mut touches) = (Vec::new(), 0.0);
                for margins in drawn.into_iter().filter_map(|approach| held[approach].as_ref()) {
                    sums.resize(margins.len(), 0.0);
                    sums.iter_mut().zip(margins).for_each(|(sum, margin): (&mut f64, _)| *sum += margin);
                    touches += 1.0;
                }
                Group { sums, touches }
            };
            (0..count).into_par_iter().map(group).collect()
        });
        Self { of: of.collect(), taught, background }
    }

    /// The share of an object's groups that `is` holds for, with these constants of the taught objects.
    fn share(&self, object: usize, constants: &[f64], is: impl Fn(usize) -> bool) -> f64 {
        let named = |group: &&Group| {
            let mut sums = group.sums.clone();
            for (&taught, constant) in self.taught.iter().zip(constants) {
                sums.get_mut(taught).into_iter().for_each(|sum| *sum += constant * group.touches);
            }
            !sums.is_empty() && is(best(&sums))
        };
        let groups = &self.of[object];
        groups.iter().filter(named).count() as f64 / groups.len().max(1) as f64
    }

    /// How often taught object number `index` is named.
    pub(super) fn named(&self, index: usize, constants: &[f64]) -> Named {
        let own = self.taught[index];
        let shares = |object| self.share(object, constants, |name| name == own);
        let others = (0..self.of.len()).filter(|&object| object != own);
        Named { right: shares(own), wrong: others.map(shares).sum() }
    }

    /// The share of groups that are recognized, of all objects that were not taught.
    pub(super) fn others(&self, constants: &[f64]) -> f64 {
        let is_other = |object: &usize| !self.taught.contains(object) && Some(*object) != self.background;
        let others: Vec<usize> = (0..self.of.len()).filter(is_other).collect();
        let right = |&object: &usize| self.share(object, constants, |name| name == object);
        others.iter().map(right).sum::<f64>() / others.len().max(1) as f64
    }

    /// The constants with which errors balance; where a range of them does, the nearest to 0.
    pub(super) fn balanced(&self) -> Vec<f64> {
        let mut constants = vec![0.0; self.taught.len()];
        let rounds = if constants.len() == 1 { 1 } else { ROUNDS };
        for index in (0..rounds).flat_map(|_| 0..self.taught.len()) {
            let mut surplus = |constant: f64| {
                constants[index] = constant;
                let Named { right, wrong } = self.named(index, &constants);
                (1.0 - right) - wrong
            };
            let at_zero = surplus(0.0);
            // The surplus of misses falls as the constant grows.
            let mut range = if at_zero > 0.0 { [0.0, MOST] } else { [-MOST, 0.0] };
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(range[0], range[1]);
                let is_above = if at_zero > 0.0 { surplus(middle) <= 0.0 } else { surplus(middle) < 0.0 };
                range[usize::from(is_above)] = middle;
            }
            constants[index] = if at_zero == 0.0 { 0.0 } else { f64::midpoint(range[0], range[1]) };
        }
        constants
    }
}
