//! The constant that is added to a taught object's margin with every touch.
//!
//! A model is too unsure of an object with few touches where it has not been touched. The constant is chosen so
//! that errors balance: over groups of approaches, each object touched equally often, a taught object is missed as often
//! as its name is given to others.
//!
//! On groups that a constant was chosen on errors look rarer than they are. So the figures come from others: the approaches
//! are divided in three, and each third's groups are counted with constants from the other two thirds. The constant that
//! goes into the ensemble is from all groups, and so a little better than those of the figures.

use crate::evidence::{Drawer, best};
use crate::random::Purpose;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// The largest constant, in nats to either side.
const MOST: f64 = 2.0;
/// Halvings of the range: to 0.001 nats.
const HALVINGS: usize = 12;
/// Rounds over several taught objects, whose constants depend on each other.
const ROUNDS: usize = 4;

/// Evidence of an approach for a model that never saw it: the margins of all objects, or no evidence.
pub(super) type Held = Vec<Option<Vec<f64>>>;

/// A group of approaches to one object.
struct Group {
    /// The margins' sums; empty without evidence.
    sums: Vec<f64>,
    /// Touches that are evidence.
    touches: f64,
}

/// Number of parts that the approaches to each object are divided into, so that those of a part judge what others chose.
const PARTS: usize = 3;

/// Groups of approaches to each object, by the object's index.
pub(super) struct Groups {
    of: Vec<Vec<Group>>,
    /// The indices of the taught objects.
    taught: Vec<usize>,
    /// The index of the background, which is nobody's name.
    background: Option<usize>,
}

/// Frequency with which a taught object is named, rightly or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Named {
    /// The share of its groups that are given its name.
    pub(super) right: f64,
    /// The share of the other objects' groups that are given its name, added up over these objects.
    pub(super) wrong: f64,
}

impl Groups {
    /// Draws `count` groups of `approaches` approaches for each object, without replacement in a group: each of one of the
    /// object's `sources`, such as an instance or a recording, which take turns.
    pub(super) fn draw(
        (held, sources): (&[Held], &[Vec<Vec<usize>>]),
        taught: Vec<usize>,
        background: Option<usize>,
        [count, approaches]: [usize; 2],
        seed: u64,
    ) -> Self {
        let of = held.iter().zip(sources).enumerate().map(|(object, (held, sources))| {
            let name = format!("{object}");
            let drawer = Drawer { purpose: Purpose::Teach, name: &name, seed };
            let group = |group: usize| {
                let own = &sources[group % sources.len()];
                let drawn = drawer.some(group as u64, own.len(), approaches.min(own.len()));
                let (mut sums, mut touches) = (Vec::new(), 0.0);
                for margins in drawn.filter_map(|drawn| held[own[drawn]].as_ref()) {
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

    /// Frequency with which taught object number `index` is named.
    pub(super) fn named(&self, index: usize, constants: &[f64]) -> Named {
        let own = self.taught[index];
        let shares = |object| self.share(object, constants, |name| name == own);
        let others = (0..self.of.len()).filter(|&object| object != own);
        Named { right: shares(own), wrong: others.map(shares).sum() }
    }

    /// The share of recognized groups of an object, in the mean of all objects that were not taught.
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

/// Groups that judge constants which they had no part in: for each part of the approaches, groups of it, and the constants
/// that balance the errors of groups of the other parts.
pub(super) struct Judged(Vec<Third>);

/// A part of the approaches.
struct Third {
    /// Groups of it.
    groups: Groups,
    /// The constants that balance the errors of groups of the other parts.
    constants: Vec<f64>,
}

impl Judged {
    /// Divides the approaches of each source of each object at random, and draws groups as [`Groups::draw`].
    pub(super) fn new(
        (held, sources): (&[Held], &[Vec<Vec<usize>>]),
        taught: &[usize],
        background: Option<usize>,
        sizes: [usize; 2],
        seed: u64,
    ) -> Self {
        let shuffled = |(object, sources): (usize, &Vec<Vec<usize>>)| -> Vec<Vec<usize>> {
            let mut random = Drawer { purpose: Purpose::Teach, name: &format!("{object}"), seed }.random(u64::MAX - 1);
            let mut sources = sources.clone();
            sources.iter_mut().for_each(|approaches| approaches.shuffle(&mut random));
            sources
        };
        let sources: Vec<Vec<Vec<usize>>> = sources.iter().enumerate().map(shuffled).collect();
        let part = |part: usize| {
            let of = |approaches: &Vec<usize>, is_of: bool| -> Vec<usize> {
                let own = approaches.iter().enumerate().filter(|(rank, _)| (rank % PARTS == part) == is_of);
                own.map(|(_, &approach)| approach).collect()
            };
            let groups = |is_of: bool| {
                let own = |sources: &Vec<Vec<usize>>| sources.iter().map(|approaches| of(approaches, is_of)).collect();
                let own: Vec<Vec<Vec<usize>>> = sources.iter().map(own).collect();
                Groups::draw((held, &own), taught.to_vec(), background, sizes, seed)
            };
            Third { groups: groups(true), constants: groups(false).balanced() }
        };
        Self((0..PARTS).map(part).collect())
    }

    /// Frequency with which taught object number `index` is named, in the mean of the parts.
    pub(super) fn named(&self, index: usize) -> Named {
        let of = |Third { groups, constants }: &Third| groups.named(index, constants);
        let sum = self.0.iter().map(of).fold([0.0; 2], |[right, wrong], of| [right + of.right, wrong + of.wrong]);
        let [right, wrong] = sum.map(|sum| sum / self.0.len() as f64);
        Named { right, wrong }
    }

    /// The share of groups that are recognized, of all objects that were not taught.
    pub(super) fn others(&self) -> f64 {
        self.0.iter().map(|third| third.groups.others(&third.constants)).sum::<f64>() / self.0.len() as f64
    }
}

/// Most approaches of a group if each object has at least `fewest`: a part then makes one group.
pub(super) fn most_approaches(fewest: usize) -> usize {
    (fewest / PARTS).max(1)
}
