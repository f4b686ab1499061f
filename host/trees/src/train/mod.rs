//! The trainer: gradient boosting with softmax loss over histograms, XGBoost's algorithm and parameters (Chen and Guestrin,
//! 2016), for rows of features.
//!
//! On the same bins trees of one output are those of XGBoost 1.6.2, bit for bit, and trees of all outputs those of XGBoost 3;
//! cuts between bins are XGBoost 3's. All trees are those of hessboost 0.4, which Palpate trained with before.
//! Equal rows and parameters give equal trees on any number of threads: each sum is added up in the order of the rows.

mod bins;
mod cuts;
mod grow;
mod slopes;
mod split;

use crate::ensemble::{Output, Tree};
use crate::error::{Error, Result, problem};
use bins::Bins;
use grow::{Grower, Grown};
use rayon::prelude::*;
use slopes::Softmax;
use split::Score;
use std::ops::ControlFlow;

/// The largest magnitude of a feature.
const LARGEST: f32 = 1e38;
/// Rows whose derivatives a task computes.
const BLOCK: usize = 1024;

/// Rows of features, each of a class.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'r> {
    /// Rows × columns; NaN where missing.
    pub features: &'r [f32],
    /// Features of a row; at least one.
    pub columns: usize,
    /// Each row's class.
    pub labels: &'r [u32],
    /// Each row's weight, above 0; 1 where there are none.
    pub weights: Option<&'r [f32]>,
}

/// Parameters of trees. Names and meanings are XGBoost's.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// Leaves hold a value for each class (a tree for each round) instead of one (a tree for each class and round).
    pub multi_output: bool,
    /// Boosting rounds.
    pub rounds: usize,
    /// `max_depth`: 1 to 16.
    pub depth: usize,
    /// `eta`: the share of each tree that is added.
    pub eta: f32,
    /// `min_child_weight`: the least sum of second derivatives in a leaf; where it holds several values, their mean.
    pub min_child_weight: f32,
    /// `max_bin`: the most bins of a column; at least 2.
    pub bins: usize,
    /// `base_score`: the margin of every class without any tree.
    pub base_margin: f32,
}

/// Trains on `rows` of `classes` classes, and calls `on_round` after each round, which may break off. Returns the trees in the
/// order in which margins add them up, and before them each class's margin without any tree. With a number of `threads` a pool
/// of so many is made; else the current one serves.
///
/// # Errors
/// [`Kind::Cancelled`](crate::error::Kind::Cancelled) if the callback breaks off; for features, labels and weights whose
/// numbers do not go with each other, a parameter out of its range, a feature that is too large, a label that is no class, a
/// weight that is not above 0; if there are no threads.
pub fn train(
    rows: Rows<'_>,
    classes: usize,
    parameters: &Parameters,
    threads: Option<usize>,
    on_round: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<(Vec<f32>, Vec<Tree>)> {
    rows.check(classes)?;
    parameters.check()?;
    let train = || boost(&rows, classes, parameters, on_round);
    let trees = match threads.map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build()) {
        None => train(),
        Some(Ok(pool)) => pool.install(train),
        Some(Err(error)) => Err(Error::new(error.to_string())),
    };
    Ok((vec![parameters.base_margin; classes], trees?))
}

impl Parameters {
    fn check(&self) -> Result<()> {
        let refused = |name: &str, allowed: &str| Err(problem!("{name} is not {allowed}"));
        match self {
            _ if !(1..=16).contains(&self.depth) => refused("depth", "1 to 16"),
            _ if !(2..=65_536).contains(&self.bins) => refused("bins", "2 to 65536"),
            _ if !(self.eta > 0.0 && self.eta <= 1.0) => refused("eta", "above 0 and at most 1"),
            _ if !(self.min_child_weight >= 0.0 && self.min_child_weight.is_finite()) => {
                refused("min_child_weight", "a number of at least 0")
            }
            _ if !self.base_margin.is_finite() => refused("base_margin", "a number"),
            _ => Ok(()),
        }
    }
}

impl Rows<'_> {
    fn check(&self, classes: usize) -> Result<()> {
        let (rows, columns) = (self.labels.len(), self.columns);
        let features = rows.checked_mul(columns);
        let weights = self.weights.is_none_or(|weights| weights.len() == rows);
        if rows == 0 || rows > u32::MAX as usize || columns == 0 || features != Some(self.features.len()) || !weights {
            return Err(problem!(
                "{rows} labels need as many rows of {columns} features, and as many weights if there are any"
            ));
        }
        let found = |row: Option<usize>, what: &str| match row {
            None => Ok(()),
            Some(row) => Err(problem!("row {row} has a {what}")),
        };
        let bad = self.features.iter().position(|value| value.abs() > LARGEST);
        found(bad.map(|index| index / columns), "feature beyond ±1e38")?;
        found(self.labels.iter().position(|&label| label as usize >= classes), "label that is no class")?;
        let bad =
            self.weights.and_then(|weights| weights.iter().position(|&weight| !(weight > 0.0 && weight <= LARGEST)));
        found(bad, "weight that is not above 0 and at most 1e38")
    }
}

fn boost(
    rows: &Rows<'_>,
    classes: usize,
    parameters: &Parameters,
    on_round: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<Vec<Tree>> {
    let bins = Bins::new(rows, parameters.bins);
    let outputs = if parameters.multi_output { classes } else { 1 };
    let score = Score { outputs, least: f64::from(parameters.min_child_weight), complete: bins.complete };
    let grower = Grower { bins, score, depth: parameters.depth, eta: parameters.eta };
    let count = rows.labels.len();
    let mut state = State {
        rows,
        softmax: Softmax::new(classes, count),
        classes,
        outputs,
        margins: vec![parameters.base_margin; count * classes],
        slopes: vec![vec![0.0; 2 * count * outputs]; classes / outputs],
        grown: (0..classes / outputs).map(|_| Grown::default()).collect(),
    };
    let mut trees = Vec::with_capacity(parameters.rounds * state.grown.len());
    for round in 0..parameters.rounds {
        state.derive(round > 0);
        let grow = |(slopes, grown): (&Vec<f32>, &mut Grown)| grower.grow(slopes, grown);
        state.slopes.par_iter().zip(&mut state.grown).for_each(grow);
        trees.extend(state.grown.iter_mut().enumerate().map(|(class, grown)| Tree {
            nodes: std::mem::take(&mut grown.nodes),
            output: if parameters.multi_output { Output::Each } else { Output::One(class) },
        }));
        if on_round().is_break() {
            return Err(Error::cancelled());
        }
    }
    Ok(trees)
}

/// The state that a round hands to the next.
struct State<'r> {
    rows: &'r Rows<'r>,
    softmax: Softmax,
    classes: usize,
    /// Outputs of a leaf.
    outputs: usize,
    /// Rows × classes.
    margins: Vec<f32>,
    /// For each tree of a round rows × derivatives: first ones by each output, then second ones.
    slopes: Vec<Vec<f32>>,
    /// The trees of the last round.
    grown: Vec<Grown>,
}

impl State<'_> {
    /// Computes the derivatives of all rows; before that, adds the last round's trees to the margins if they are `grown`.
    fn derive(&mut self, grown: bool) {
        let Self { rows, softmax, classes, outputs, margins, slopes, grown: trees } = self;
        let (classes, outputs) = (*classes, *outputs);
        let mut blocks: Vec<Vec<&mut [f32]>> = Vec::new();
        for slopes in slopes {
            for (block, slopes) in slopes.chunks_mut(2 * BLOCK * outputs).enumerate() {
                if blocks.len() == block {
                    blocks.push(Vec::new());
                }
                blocks[block].push(slopes);
            }
        }
        let blocks = blocks.into_par_iter().zip(margins.par_chunks_mut(BLOCK * classes)).enumerate();
        blocks.for_each(|(block, (mut slopes, margins))| {
            let first = block * BLOCK;
            if grown {
                for (tree, margins_from) in trees.iter().zip((0..classes).step_by(outputs)) {
                    for (margins, &leaf) in margins.chunks_mut(classes).zip(&tree.leaf_of[first..]) {
                        let values = &tree.values[usize::from(leaf) * outputs..][..outputs];
                        let margins = &mut margins[margins_from..][..outputs];
                        margins.iter_mut().zip(values).for_each(|(margin, value)| *margin += value);
                    }
                }
            }
            let mut shares = vec![0.0; margins.len()];
            softmax.shares(first, margins, &mut shares);
            for (row, shares) in shares.chunks(classes).enumerate() {
                let own = rows.labels[first + row] as usize;
                let weight = rows.weights.map_or(1.0, |weights| weights[first + row]);
                let of_class = |(class, &share): (usize, &f32)| slopes::slope(share, class == own, weight);
                let of_classes = shares.iter().enumerate().map(of_class);
                if let [slopes] = slopes.as_mut_slice() {
                    let (firsts, seconds) = slopes[2 * row * classes..][..2 * classes].split_at_mut(classes);
                    for ((first, second), slope) in firsts.iter_mut().zip(seconds).zip(of_classes) {
                        [*first, *second] = slope;
                    }
                } else {
                    for (slopes, slope) in slopes.iter_mut().zip(of_classes) {
                        slopes[2 * row..2 * row + 2].copy_from_slice(&slope);
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests;
