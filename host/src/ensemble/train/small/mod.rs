//! Trees for little flash: few thresholds, and few different leaves.
//!
//! Most bytes of a small model are leaves, one value for each object, and thresholds, four bytes each. So
//!
//! 1. trees are grown at a price for each threshold that no tree had before ([`grow`]), as in "Boosted Trees on a Diet"
//!    (2510.26557);
//! 2. the leaves of all trees share a few lists of values, which [`compile`](fn@crate::compile::compile) writes once
//!    ([`crate::compile::Settings::shared_leaves`]): a leaf then takes a byte. Which list a leaf takes, and the lists' values,
//!    are fitted together, all trees at once ([`lists`]).
//!
//! Touches enter as counts of different rows of bins ([`cases`]), so that more of them hardly take longer.

mod cases;
mod grow;
mod lists;

use super::{Engine, Evidence, Rows, Settings, origin};
use crate::ensemble::{Ensemble, Node, Output, Tree, inputs};
use crate::error::{Error, Result};
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use crate::touches::Dataset;
use cases::Cases;
use grow::{Grown, Growth};
use rayon::prelude::*;

/// Limits on the flash of the trees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Small {
    /// The most different leaves: 1 to 65,536. Up to 256 a leaf takes one byte.
    pub leaves: usize,
    /// Loss of a touch on average, in nats, that a threshold must save if no tree had it before. At least 0.
    pub threshold_cost: f64,
}

impl Default for Small {
    /// For some 5 KB of ten objects.
    fn default() -> Self {
        Self { leaves: 128, threshold_cost: 2e-5 }
    }
}

impl Small {
    /// # Errors
    /// [`Setting`](crate::error::Setting) for a number out of its range, or for settings that go with other
    /// trainings.
    pub(super) fn check(&self, settings: &Settings) -> Result<()> {
        if !(1..=1 << 16).contains(&self.leaves) {
            return Err(Error::setting("different_leaves", self.leaves, "1 to 65536"));
        }
        if !(self.threshold_cost >= 0.0 && self.threshold_cost.is_finite()) {
            return Err(Error::setting("threshold_cost", self.threshold_cost, "a number of at least 0"));
        }
        if !settings.multi_output {
            return Err(Error::setting("leaves", "one", "each: few different leaves hold a value for each object"));
        }
        if settings.trainer != Engine::Palpate {
            return Err(Error::setting(
                "trainer",
                "xgboost",
                "none: few different leaves are trained by palpate itself",
            ));
        }
        Ok(())
    }
}

/// An ensemble for each of `stops`: its number of trees, and of different leaves at most. The trees are grown once, for the
/// longest; each ensemble takes the first of them, and its leaves are fitted by themselves.
pub(crate) fn train_each(
    dataset: &Dataset,
    settings: &Settings,
    threshold_cost: f64,
    stops: &[(usize, usize)],
    progress: &dyn Progress,
) -> Result<Vec<Ensemble>> {
    super::check(dataset, settings.descriptor)?;
    let settings = &settings.resolved(dataset);
    super::parameters(settings)?;
    stops.iter().try_for_each(|&(_, leaves)| Small { leaves, threshold_cost }.check(settings))?;
    let evidence = Evidence::new(dataset, settings)?;
    let origin = origin(dataset, settings, &evidence);
    let cases = Cases::new(Rows::new(&evidence, settings), dataset.objects.len(), settings.bins);
    let train = || {
        let rounds = stops.iter().map(|&(trees, _)| trees).max().unwrap_or(0);
        progress.begin("training", u64::try_from(rounds).ok());
        let mut growth = Growth::new(&cases, settings, threshold_cost);
        for _ in 0..rounds {
            growth.add_tree();
            progress::advance(progress, 1)?;
        }
        let fit = |&(trees, leaves): &(usize, usize)| {
            let grown = &growth.trees[..trees];
            let fitted = lists::fit(&cases, grown, leaves, settings.leaf_bits);
            progress::check(progress)?;
            Ok(Ensemble {
                inputs: inputs(settings.descriptor),
                objects: dataset.names(),
                base_margins: fitted.base,
                trees: grown.iter().zip(fitted.leaves).map(|(tree, leaves)| with_leaves(tree, leaves)).collect(),
                origin: origin.clone(),
            })
        };
        in_order(stops.par_iter().map(fit))
    };
    match settings.threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()) {
        Some(Ok(pool)) => pool.install(train),
        // Threads change no ensemble: where no pool can be had, all serve.
        _ => train(),
    }
}

fn with_leaves(tree: &Grown, leaves: Vec<Vec<f32>>) -> Tree {
    let mut leaves = leaves.into_iter();
    let nodes = tree.nodes.iter().map(|node| match node {
        Node::Leaf(_) => Node::Leaf(leaves.next().unwrap_or_default()),
        split => split.clone(),
    });
    Tree { nodes: nodes.collect(), output: Output::Each }
}

#[cfg(test)]
mod tests;
