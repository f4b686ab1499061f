//! Drawing without replacement, as far as is asked for.

use crate::random::{self, Purpose};
use rand::RngExt;
use rand::rngs::ChaCha8Rng;
use std::collections::HashMap;

/// Numbers below a limit in random order, each once, drawn only as far as they are asked for: Fisher–Yates with the
/// places that were swapped in a map.
pub(super) struct Draws {
    moved: HashMap<usize, usize>,
    next: usize,
    all: usize,
    random: ChaCha8Rng,
}

impl Draws {
    pub(super) fn new(all: usize, purpose: Purpose, name: &str, index: u64, seed: u64) -> Self {
        let random = random::generator(seed, purpose, name, index);
        Self { moved: HashMap::new(), next: 0, all, random }
    }

    /// Number of numbers that are left.
    pub(super) fn left(&self) -> usize {
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
        let mut firsts = [0; 5];
        for group in 0..5_000 {
            let mut drawn: Vec<usize> = Draws::new(5, Purpose::Approaches, "cup", group, 1).collect();
            firsts[drawn[0]] += 1;
            firsts[drawn[4]] += 1;
            drawn.sort_unstable();
            assert_eq!(drawn, [0, 1, 2, 3, 4]);
        }
        // 2,000 expected, with a standard deviation of 40.
        assert!(firsts.iter().all(|&count| (1_800..2_200).contains(&count)), "{firsts:?}");
        assert_eq!(Draws::new(0, Purpose::Approaches, "cup", 0, 1).count(), 0);
    }
}
