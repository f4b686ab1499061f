//! Touches as the leaves that they reach, for fitting a column's values, and reading them.

use crate::ensemble::{Ensemble, Node, OverTouches, feature_row};
use palpate_onboard::Refused;
use palpate_shared::format::TrainedTouches;
use palpate_shared::{Descriptor, Touch};
use rayon::prelude::*;
use std::ops::Range;

/// The leaves of an ensemble's trees, counted through all trees.
pub(super) struct Leaves {
    /// For each tree and node the number of the leaf; of no meaning for splits.
    numbers: Vec<Vec<u32>>,
    /// For each tree the numbers of its leaves.
    pub(super) trees: Vec<Range<usize>>,
}

impl Leaves {
    pub(super) fn of(ensemble: &Ensemble) -> Self {
        let (mut numbers, mut trees, mut next) = (Vec::new(), Vec::new(), 0_u32);
        for tree in &ensemble.trees {
            let first = next;
            let number = |node: &Node| {
                let number = next;
                next += u32::from(node.leaf().is_some());
                number
            };
            numbers.push(tree.nodes.iter().map(number).collect());
            trees.push(first as usize..next as usize);
        }
        Self { numbers, trees }
    }

    /// Number of rows.
    pub(super) fn count(&self) -> usize {
        self.trees.last().map_or(0, |leaves| leaves.end)
    }

    /// The numbers of the leaves that features reach, one in each tree.
    fn reached<'e>(&'e self, ensemble: &'e Ensemble, features: &'e [f32]) -> impl Iterator<Item = u32> + 'e {
        ensemble.trees.iter().zip(&self.numbers).map(|(tree, numbers)| numbers[tree.leaf_node(features)])
    }
}

/// Touches of one object that are evidence.
#[derive(Default)]
pub(super) struct Rows {
    /// Number of trees.
    trees: usize,
    /// Row after row the leaf that it reaches in each tree.
    leaves: Vec<u32>,
    /// Number of objects that the ensemble knows.
    known: usize,
    /// Row after row the ensemble's margins.
    margins: Vec<f32>,
    /// For each row the logarithm of the sum of its exponentials.
    pub(super) log_sums: Vec<f64>,
    /// For each row the touch that it is, or is a copy of: its position among all that were given.
    pub(super) sources: Vec<u32>,
    /// Number of touches that were given, evidence or not.
    pub(super) given: usize,
}

impl Rows {
    /// The rows of touches of which touch i is a copy of touch i modulo `given`. However long it is between contacts, they
    /// are evidence: a recorded object may be larger than those that the ensemble knows.
    pub(super) fn new(
        ensemble: &Ensemble,
        leaves: &Leaves,
        descriptor: Descriptor,
        touches: &[Touch],
        given: usize,
    ) -> Self {
        let trained = ensemble.trained_touches();
        let evidence = TrainedTouches { patterns: trained.counted.patterns(), largest_spread: u32::MAX, ..trained };
        let row = |(index, touch): (usize, &Touch)| {
            Refused::check(&evidence, touch).ok()?;
            let features = feature_row(descriptor, touch);
            let reached: Vec<u32> = leaves.reached(ensemble, &features).collect();
            // A data set's touches are counted in 32 bits elsewhere too.
            Some((reached, ensemble.margins_of_features(&features), (index % given.max(1)) as u32))
        };
        let found: Vec<_> = touches.par_iter().enumerate().map(row).collect();
        let mut rows = Self { trees: ensemble.trees.len(), known: ensemble.objects.len(), given, ..Self::default() };
        for (reached, margins, source) in found.into_iter().flatten() {
            rows.leaves.extend(reached);
            rows.log_sums.push(log_sum(margins.iter().copied().map(f64::from)));
            rows.margins.extend(margins);
            rows.sources.push(source);
        }
        rows
    }

    pub(super) fn count(&self) -> usize {
        self.sources.len()
    }

    /// The leaf that a row reaches in a tree.
    pub(super) fn leaf(&self, row: usize, tree: usize) -> usize {
        self.leaves[row * self.trees + tree] as usize
    }

    /// The ensemble's margins of a row.
    pub(super) fn margins(&self, row: usize) -> &[f32] {
        &self.margins[row * self.known..(row + 1) * self.known]
    }

    /// The sum of a column's values in the leaves that a row reaches.
    pub(super) fn sum(&self, row: usize, column: &[f64]) -> f64 {
        self.leaves[row * self.trees..(row + 1) * self.trees].iter().map(|&leaf| column[leaf as usize]).sum()
    }
}

/// ln Σ exp(x); −∞ of nothing.
pub(super) fn log_sum(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = numbers.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + numbers.map(|number| (number - most).exp()).sum::<f64>().ln()
}
