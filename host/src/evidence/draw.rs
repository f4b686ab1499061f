//! Drawing of the steps of sequences, at random.

use crate::random::{self, Purpose};
use rand::RngExt;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use std::collections::HashMap;

/// Draws steps for sequences of one kind: the same ones for the same seed and number of a sequence, whatever else is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawer<'n> {
    pub(crate) purpose: Purpose,
    /// Name of what the steps are of.
    pub(crate) name: &'n str,
    pub(crate) seed: u64,
}

impl Drawer<'_> {
    /// The random numbers of a sequence.
    pub(crate) fn random(self, number: u64) -> ChaCha8Rng {
        random::generator(self.seed, self.purpose, self.name, number)
    }

    /// Puts steps that sequences take one after the other into a random order.
    pub(crate) fn shuffle<T>(self, number: u64, steps: &mut [T]) {
        steps.shuffle(&mut self.random(number));
    }

    /// A number of steps out of all, none twice.
    pub(crate) fn some(self, number: u64, all: usize, count: usize) -> impl Iterator<Item = usize> + use<> {
        rand::seq::index::sample(&mut self.random(number), all, count).into_iter()
    }

    /// All steps, each once, drawn only as far as they are asked for.
    pub(crate) fn each(self, number: u64, all: usize) -> Draws {
        Draws { moved: HashMap::new(), next: 0, all, random: self.random(number) }
    }
}

/// Numbers below a limit in random order: Fisher–Yates with the places that were swapped in a map.
pub(crate) struct Draws {
    moved: HashMap<usize, usize>,
    next: usize,
    all: usize,
    random: ChaCha8Rng,
}

impl Draws {
    /// Number of numbers that are left.
    pub(crate) fn left(&self) -> usize {
        self.all - self.next
    }
}

impl Iterator for Draws {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        if self.next >= self.all {
            return None;
        }
        let chosen = self.random.random_range(self.next..self.all);
        let at_next = self.moved.remove(&self.next).unwrap_or(self.next);
        let drawn = if chosen == self.next { at_next } else { self.moved.insert(chosen, at_next).unwrap_or(chosen) };
        self.next += 1;
        Some(drawn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_a_permutation_and_any_order_is_as_likely() {
        let drawer = Drawer { purpose: Purpose::Approaches, name: "cup", seed: 1 };
        let mut firsts = [0; 5];
        for group in 0..5_000 {
            let mut drawn: Vec<usize> = drawer.each(group, 5).collect();
            firsts[drawn[0]] += 1;
            firsts[drawn[4]] += 1;
            drawn.sort_unstable();
            assert_eq!(drawn, [0, 1, 2, 3, 4]);
        }
        // 2,000 expected, with a standard deviation of 40.
        assert!(firsts.iter().all(|&count| (1_800..2_200).contains(&count)), "{firsts:?}");
        assert_eq!(drawer.each(0, 0).count(), 0);
    }
}
