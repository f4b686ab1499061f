//! Trees, grown one after the other as boosting grows them, at a price for thresholds that no tree had before.
//!
//! XGBoost's algorithm over histograms with softmax loss and one value for each object in a leaf (Chen and Guestrin, 2016).

use super::Settings;
use super::cases::Cases;
use crate::ensemble::Node;
use rayon::prelude::*;

/// `lambda`: addition to a sum of second derivatives.
const LAMBDA: f64 = 1.0;
/// The least gain of a split.
const LEAST: f64 = 1e-3;

/// A tree without values.
pub(super) struct Grown {
    /// Splits, and empty leaves.
    pub(super) nodes: Vec<Node>,
    /// The number of each case's leaf; leaves are numbered in the order of the nodes. A tree is at most 16 deep.
    pub(super) leaf_of: Vec<u16>,
    /// The leaves' values as boosting sets them.
    pub(super) values: Vec<Vec<f64>>,
}

/// The trees so far.
pub(super) struct Growth<'c> {
    cases: &'c Cases,
    depth: usize,
    eta: f64,
    min_child_weight: f64,
    /// Cost of a new threshold, as gain.
    price: f64,
    /// For each feature and threshold whether some tree has it.
    used: Vec<Vec<bool>>,
    /// Cases × objects.
    margins: Vec<f64>,
    /// Cases × objects × (first, second derivative).
    slopes: Vec<[f64; 2]>,
    pub(super) trees: Vec<Grown>,
}

/// The best split of some cases by one feature, or of all.
#[derive(Clone, Copy)]
struct Split {
    gain: f64,
    feature: usize,
    /// Cases in bins up to this one go left.
    bin: usize,
    missing_left: bool,
}

impl<'c> Growth<'c> {
    pub(super) fn new(cases: &'c Cases, settings: &Settings, threshold_cost: f64) -> Self {
        Self {
            cases,
            depth: settings.depth,
            eta: settings.eta,
            min_child_weight: settings.min_child_weight,
            // A gain is twice the decrease of the loss of all touches.
            price: 2.0 * threshold_cost * cases.total(),
            used: cases.thresholds.iter().map(|thresholds| vec![false; thresholds.len()]).collect(),
            margins: vec![0.0; cases.counts.len()],
            slopes: vec![[0.0; 2]; cases.counts.len()],
            trees: Vec::new(),
        }
    }

    /// Grows one more tree on the residuals of the others.
    pub(super) fn add_tree(&mut self) {
        let (objects, cases) = (self.cases.objects, self.cases);
        let margins = self.margins.par_chunks(objects).zip(cases.counts.par_chunks(objects));
        self.slopes.par_chunks_mut(objects).zip(margins).for_each(|(slopes, (margins, counts))| {
            let total: f64 = counts.iter().sum();
            let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = margins.iter().map(|margin| (margin - most).exp()).sum();
            for ((slope, margin), count) in slopes.iter_mut().zip(margins).zip(counts) {
                let share = (margin - most).exp() / sum;
                *slope = [share * total - count, (2.0 * share * (1.0 - share)).max(1e-16) * total];
            }
        });
        let mut tree = Grown { nodes: Vec::new(), leaf_of: vec![0; cases.len()], values: Vec::new() };
        // There are fewer than 2^32 touches.
        let mut all: Vec<u32> = (0..cases.len() as u32).collect();
        self.branch(&mut all, self.depth, &mut tree);
        for (margins, &leaf) in self.margins.chunks_mut(objects).zip(&tree.leaf_of) {
            margins.iter_mut().zip(&tree.values[usize::from(leaf)]).for_each(|(margin, value)| *margin += value);
        }
        self.trees.push(tree);
    }

    /// Appends the branch of these cases, at most `levels` deep.
    fn branch(&mut self, among: &mut [u32], levels: usize, tree: &mut Grown) {
        let sums = self.sums(among);
        let split = if levels == 0 { None } else { self.best(among, &sums) };
        let Some(split) = split else {
            for &case in &*among {
                tree.leaf_of[case as usize] = tree.values.len() as u16;
            }
            tree.values.push(sums.iter().map(|[first, second]| -self.eta * first / (second + LAMBDA)).collect());
            tree.nodes.push(Node::Leaf(Vec::new()));
            return;
        };
        self.used[split.feature][split.bin] = true;
        let node = tree.nodes.len();
        tree.nodes.push(Node::Leaf(Vec::new()));
        let missing = self.cases.thresholds[split.feature].len() + 1;
        let goes_left = |case: u32| match self.bin(case, split.feature) {
            bin if bin == missing => split.missing_left,
            bin => bin <= split.bin,
        };
        // Stable, so that sums are always added in the same order.
        among.sort_by_key(|&case| !goes_left(case));
        let (left, right) = among.split_at_mut(among.partition_point(|&case| goes_left(case)));
        self.branch(left, levels - 1, tree);
        let right_node = tree.nodes.len();
        self.branch(right, levels - 1, tree);
        tree.nodes[node] = Node::Split {
            feature: split.feature,
            threshold: self.cases.thresholds[split.feature][split.bin],
            missing_left: split.missing_left,
            left: node + 1,
            right: right_node,
        };
    }

    fn bin(&self, case: u32, feature: usize) -> usize {
        usize::from(self.cases.bins[case as usize * self.cases.thresholds.len() + feature])
    }

    fn slopes(&self, case: u32) -> &[[f64; 2]] {
        &self.slopes[case as usize * self.cases.objects..][..self.cases.objects]
    }

    fn sums(&self, among: &[u32]) -> Vec<[f64; 2]> {
        let mut sums = vec![[0.0; 2]; self.cases.objects];
        among.iter().for_each(|&case| add(&mut sums, self.slopes(case)));
        sums
    }

    /// The split that gains most; the first of several.
    fn best(&self, among: &[u32], sums: &[[f64; 2]]) -> Option<Split> {
        let of_features: Vec<Option<Split>> = (0..self.cases.thresholds.len())
            .into_par_iter()
            .map(|feature| self.best_of_feature(among, sums, feature))
            .collect();
        let better = |best: Split, other: Split| if other.gain > best.gain { other } else { best };
        of_features.into_iter().flatten().reduce(better)
    }

    fn best_of_feature(&self, among: &[u32], sums: &[[f64; 2]], feature: usize) -> Option<Split> {
        let (objects, count) = (self.cases.objects, self.cases.thresholds[feature].len());
        let mut histogram = vec![[0.0; 2]; (count + 2) * objects];
        for &case in among {
            add(&mut histogram[self.bin(case, feature) * objects..][..objects], self.slopes(case));
        }
        let (histogram, missing) = histogram.split_at((count + 1) * objects);
        let has_missing = missing.iter().any(|[_, second]| *second > 0.0);
        let whole = score(sums.iter().copied());
        let mut best: Option<Split> = None;
        for missing_left in if has_missing { &[true, false][..] } else { &[true] } {
            let mut left = if *missing_left { missing.to_vec() } else { vec![[0.0; 2]; objects] };
            for (bin, of_bin) in histogram.chunks(objects).take(count).enumerate() {
                add(&mut left, of_bin);
                let right = || sums.iter().zip(&left).map(|(sum, left)| [sum[0] - left[0], sum[1] - left[1]]);
                let weight = |second: f64| second / objects as f64 >= self.min_child_weight;
                if !weight(left.iter().map(|[_, second]| second).sum())
                    || !weight(right().map(|[_, second]| second).sum())
                {
                    continue;
                }
                let price = if self.used[feature][bin] { 0.0 } else { self.price };
                let gain = score(left.iter().copied()) + score(right()) - whole - price;
                if gain > best.map_or(LEAST, |best| best.gain) {
                    best = Some(Split { gain, feature, bin, missing_left: *missing_left });
                }
            }
        }
        best
    }
}

fn add(sums: &mut [[f64; 2]], slopes: &[[f64; 2]]) {
    for (sum, slope) in sums.iter_mut().zip(slopes) {
        sum[0] += slope[0];
        sum[1] += slope[1];
    }
}

/// Twice the decrease of the loss with the best values.
fn score(sums: impl Iterator<Item = [f64; 2]>) -> f64 {
    sums.map(|[first, second]| first * first / (second + LAMBDA)).sum()
}
