//! Numbers that a regression adds up, in f64.

use super::{Ensemble, Exact, Output, Tree};

/// Share of a regression's [reach](Ensemble::reach) that its values may be off without a word.
pub(crate) const TOLERATED: f64 = 1e-3;

impl Output {
    /// The output that a value of a leaf is for.
    pub(crate) const fn of_value(self, value: usize) -> usize {
        match self {
            Self::One(output) => output,
            Self::Each => value,
        }
    }
}

impl Ensemble {
    /// True if outputs are values over rows: a regression or a ranking.
    pub(crate) fn is_regression(&self) -> bool {
        self.schema().is_none() && (self.objects.len() == 1 || self.prediction().targets)
    }

    /// The library's own numbers, where it adds f64.
    fn exact(&self) -> Option<&Exact> {
        self.origin.imported.as_ref()?.exact.as_ref()
    }

    /// True if the library adds f32, so that each addition rounds.
    pub(crate) fn adds_f32(&self) -> bool {
        self.exact().is_none()
    }

    /// True if the library compares values in f64, otherwise it rounds them to f32 first.
    pub(crate) fn compares_f64(&self) -> bool {
        self.origin.imported.as_ref().is_some_and(|imported| imported.compares_f64)
    }

    /// Starting values of the margins as the library has them.
    pub(crate) fn base(&self) -> Vec<f64> {
        match self.exact() {
            Some(exact) => exact.base.clone(),
            None => self.base_margins.iter().copied().map(f64::from).collect(),
        }
    }

    /// Values of a leaf as the library has them; none of a split.
    pub(crate) fn values(&self, tree: usize, node: usize) -> impl Iterator<Item = f64> {
        let own = self.trees[tree].nodes[node].leaf().unwrap_or_default();
        let exact = self.exact().and_then(|exact| exact.leaves.get(tree)?.get(node));
        let value = move |(value, own): (usize, &f32)| {
            exact.and_then(|exact| exact.get(value)).copied().unwrap_or(f64::from(*own))
        };
        own.iter().enumerate().map(value)
    }

    /// For each value of a tree's leaves the least and the largest.
    pub(crate) fn ranges(&self, tree: usize) -> Vec<[f64; 2]> {
        let mut ranges: Vec<[f64; 2]> = Vec::new();
        for node in 0..self.trees[tree].nodes.len() {
            for (value, own) in self.values(tree, node).enumerate() {
                match ranges.get_mut(value) {
                    Some([least, most]) => (*least, *most) = (least.min(own), most.max(own)),
                    None => ranges.push([own; 2]),
                }
            }
        }
        ranges
    }

    /// For each output half the sum of the ranges of its trees' leaves: as far as margins can be from their middle.
    pub(crate) fn reach(&self) -> Vec<f64> {
        let mut reach = vec![0.0; self.objects.len()];
        for (number, tree) in self.trees.iter().enumerate() {
            for (value, [least, most]) in self.ranges(number).into_iter().enumerate() {
                reach[tree.output.of_value(value)] += (most - least) / 2.0 * f64::from(self.prediction().scale);
            }
        }
        reach
    }

    /// The margins of the leaves that `node` says are reached, of a tree given its number, as the library adds them.
    pub(crate) fn library_margins(&self, node: impl Fn(usize, &Tree) -> usize) -> Vec<f64> {
        if self.adds_f32() {
            let margins =
                self.margins_of_leaves(|number, tree| tree.nodes[node(number, tree)].leaf().unwrap_or_default());
            return margins.into_iter().map(f64::from).collect();
        }
        let mut margins = self.base();
        for (number, tree) in self.trees.iter().enumerate() {
            for (value, own) in self.values(number, node(number, tree)).enumerate() {
                margins[tree.output.of_value(value)] += own;
            }
        }
        let scale = f64::from(self.prediction().scale);
        margins.iter_mut().for_each(|margin| *margin *= scale);
        margins
    }
}
