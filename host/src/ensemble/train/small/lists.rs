//! The lists of values that leaves share, and which list each leaf takes.
//!
//! The lists start as the centers of the leaves' own values (k-means, weighted by second derivatives). Then lists are
//! fitted to the softmax loss of all touches, with all trees at once, and leaves go to the lists that suit them better now,
//! in turn. Both take the quadratic model of the loss whose second derivatives are those of softmax without its products
//! between objects, which is above the true one.
//!
//! Last of all values are rounded, and fitted again in steps of the unit: a list is added many times for a touch, and so
//! is its rounding.

use super::cases::Cases;
use super::grow::Grown;
use std::collections::HashMap;

/// Rounds of fitting lists and exchanging them.
const ROUNDS: usize = 12;
/// Length after rounding.
const ROUNDED: usize = 4;
/// Passes over all lists in a round.
const SWEEPS: usize = 4;
/// Cases times trees that all rounds together may visit in a pass; where there are more, there are fewer rounds, but two.
const WORK: usize = 3_000_000;
/// Rounds of k-means.
const MEANS: usize = 20;
/// Number of touches that hold each value at 0.
const RIDGE: f64 = 5.0;
/// The largest step of a value, in nats.
const LARGEST: f64 = 0.5;

/// Values of trees.
pub(super) struct Fitted {
    /// For each tree and leaf.
    pub(super) leaves: Vec<Vec<Vec<f32>>>,
    /// Starting values of the margins.
    pub(super) base: Vec<f32>,
}

/// Fits `count` lists of values at most, whole multiples of a power of two of which `bits` bits hold each.
pub(super) fn fit(cases: &Cases, trees: &[Grown], count: usize, bits: Option<u32>) -> Fitted {
    let mut lists = Lists::new(cases, trees);
    lists.start(trees, count);
    let rounds = (WORK / lists.paths.len().max(1)).max(2);
    lists.rounds(ROUNDS.min(rounds), None);
    if let Some(bits) = bits {
        lists.center();
        let most = 2.0_f64.powi(i32::try_from(bits).unwrap_or(32) - 1) - 1.0;
        let largest = lists.values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let digits = (1..=15).rev().find(|digits| largest * 2.0_f64.powi(*digits) <= most).unwrap_or(1);
        // Half the unit is finer, and cuts off the largest values.
        let rounded = [digits, (digits + 1).min(15)].map(|digits| {
            let mut lists = lists.clone();
            let unit = Unit { size: 2.0_f64.powi(-digits), most };
            lists.round(unit);
            lists.rounds(ROUNDED.min(rounds), Some(unit));
            lists
        });
        let [coarse, fine] = rounded;
        lists = if fine.loss() < coarse.loss() { fine } else { coarse };
    }
    lists.fitted()
}

/// Unit that values are whole multiples of, and the largest multiple.
#[derive(Clone, Copy)]
struct Unit {
    size: f64,
    most: f64,
}

impl Unit {
    fn nearest(self, value: f64) -> f64 {
        (value / self.size).round() * self.size
    }

    fn held(self, value: f64) -> f64 {
        (value / self.size).round().clamp(-self.most, self.most) * self.size
    }
}

#[derive(Clone)]
struct Lists {
    objects: usize,
    /// Cases × objects: touches. Cases that reach the same leaves are one.
    counts: Vec<f64>,
    /// Cases × trees: leaves.
    paths: Vec<u16>,
    /// For each tree and leaf its list.
    of_leaves: Vec<Vec<u16>>,
    /// Lists × objects.
    values: Vec<f64>,
    base: Vec<f64>,
    /// Cases × objects.
    margins: Vec<f64>,
    /// Cases × objects: touches of each object as the margins expect them.
    expected: Vec<f64>,
}

impl Lists {
    fn new(cases: &Cases, trees: &[Grown]) -> Self {
        let objects = cases.objects;
        let (mut counts, mut paths) = (Vec::new(), Vec::new());
        let mut numbers: HashMap<Vec<u16>, usize> = HashMap::new();
        for case in 0..cases.len() {
            let path: Vec<u16> = trees.iter().map(|tree| tree.leaf_of[case]).collect();
            let next = numbers.len();
            let number = *numbers.entry(path).or_insert_with_key(|path| {
                paths.extend_from_slice(path);
                counts.resize((next + 1) * objects, 0.0);
                next
            });
            let sums = &mut counts[number * objects..][..objects];
            sums.iter_mut().zip(cases.counts(case)).for_each(|(sum, count)| *sum += count);
        }
        let (margins, expected) = (vec![0.0; counts.len()], vec![0.0; counts.len()]);
        let of_leaves = trees.iter().map(|tree| vec![0; tree.values.len()]).collect();
        Self { objects, counts, paths, of_leaves, values: Vec::new(), base: vec![0.0; objects], margins, expected }
    }

    fn cases(&self) -> impl Iterator<Item = (usize, &[u16])> {
        self.paths.chunks(self.of_leaves.len()).enumerate()
    }

    /// The centers of the leaves' own values, each leaf's the nearest.
    fn start(&mut self, trees: &[Grown], count: usize) {
        let objects = self.objects;
        // A number that is the same for all objects says nothing.
        let own: Vec<Vec<f64>> = trees.iter().flat_map(|tree| &tree.values).map(|values| centered(values)).collect();
        for (case, path) in self.paths.chunks(trees.len()).enumerate() {
            let margins = &mut self.margins[case * objects..][..objects];
            for (tree, &leaf) in trees.iter().zip(path) {
                add(margins, &tree.values[usize::from(leaf)], 1.0);
            }
        }
        (0..self.expected.len() / objects).for_each(|case| self.expect(case));
        let mut weights = Vec::new();
        for tree in 0..trees.len() {
            weights.extend(
                self.slopes_of_leaves(tree)
                    .chunks(objects)
                    .map(|leaf| leaf.iter().map(|[_, second]| second + 1e-3).collect::<Vec<f64>>()),
            );
        }
        let (centers, of_leaves) = means(&own, &weights, count);
        let mut of_leaves = of_leaves.into_iter();
        for leaves in &mut self.of_leaves {
            leaves.iter_mut().zip(&mut of_leaves).for_each(|(leaf, list)| *leaf = list);
        }
        self.values = centers.concat();
        self.add_up();
    }

    /// Margins from the lists.
    fn add_up(&mut self) {
        let objects = self.objects;
        for (margins, path) in self.margins.chunks_mut(objects).zip(self.paths.chunks(self.of_leaves.len())) {
            margins.copy_from_slice(&self.base);
            for (of_leaves, &leaf) in self.of_leaves.iter().zip(path) {
                add(margins, &self.values[usize::from(of_leaves[usize::from(leaf)]) * objects..][..objects], 1.0);
            }
        }
        (0..self.expected.len() / objects).for_each(|case| self.expect(case));
    }

    /// Computes the counts that a case's margins predict.
    fn expect(&mut self, case: usize) {
        let range = case * self.objects..(case + 1) * self.objects;
        let (margins, expected) = (&self.margins[range.clone()], &mut self.expected[range.clone()]);
        let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        expected.iter_mut().zip(margins).for_each(|(expected, margin)| *expected = (margin - most).exp());
        let scale = self.counts[range].iter().sum::<f64>() / expected.iter().sum::<f64>();
        expected.iter_mut().for_each(|expected| *expected *= scale);
    }

    /// Adds to a case's margins.
    fn step(&mut self, case: usize, steps: &[f64], times: f64) {
        add(&mut self.margins[case * self.objects..][..self.objects], steps, times);
        self.expect(case);
    }

    fn rounds(&mut self, rounds: usize, unit: Option<Unit>) {
        for round in 0..rounds {
            if round > 0 {
                self.exchange();
            }
            (0..SWEEPS).for_each(|_| self.sweep(unit));
        }
    }

    /// A step of each list in turn, then of what margins start from.
    fn sweep(&mut self, unit: Option<Unit>) {
        let objects = self.objects;
        let lists = self.values.len() / objects;
        // Where a list is used, and how many times.
        let mut uses: Vec<Vec<(u32, f64)>> = vec![Vec::new(); lists];
        for (case, path) in self.cases() {
            for (of_leaves, &leaf) in self.of_leaves.iter().zip(path) {
                let uses = &mut uses[usize::from(of_leaves[usize::from(leaf)])];
                match uses.last_mut() {
                    Some((last, times)) if *last as usize == case => *times += 1.0,
                    _ => uses.push((case as u32, 1.0)),
                }
            }
        }
        let everywhere: Vec<(u32, f64)> = (0..(self.counts.len() / objects) as u32).map(|case| (case, 1.0)).collect();
        for (list, uses) in uses.iter().chain([&everywhere]).enumerate() {
            let mut slopes = vec![[0.0; 2]; objects];
            for &(case, times) in uses {
                self.add_slopes(case as usize, times, &mut slopes);
            }
            let values = self.values.get_mut(list * objects..(list + 1) * objects);
            let (values, ridge) = values.map_or((&mut self.base[..], 0.0), |values| (values, RIDGE));
            let is_base = ridge == 0.0;
            let steps: Vec<f64> = values
                .iter_mut()
                .zip(slopes)
                .map(|(value, [first, second])| {
                    let step = -(first + ridge * *value) / (second + ridge + 1e-9);
                    let wanted = *value + step.clamp(-LARGEST, LARGEST);
                    let wanted = match unit {
                        None => wanted,
                        Some(unit) if is_base => unit.nearest(wanted),
                        Some(unit) => unit.held(wanted),
                    };
                    wanted - std::mem::replace(value, wanted)
                })
                .collect();
            if steps.iter().any(|step| *step != 0.0) {
                uses.iter().for_each(|&(case, times)| self.step(case as usize, &steps, times));
            }
        }
    }

    /// Each leaf takes the list that suits it best, tree after tree.
    fn exchange(&mut self) {
        let objects = self.objects;
        for tree in 0..self.of_leaves.len() {
            let slopes = self.slopes_of_leaves(tree);
            let mut steps = vec![0.0; slopes.len()];
            for (leaf, slopes) in slopes.chunks(objects).enumerate() {
                let now = usize::from(self.of_leaves[tree][leaf]);
                let own = self.values[now * objects..][..objects].to_vec();
                let change = |values: &[f64]| -> f64 {
                    let terms = values.iter().zip(&own).zip(slopes).map(|((value, own), [first, second])| {
                        let step = value - own;
                        step * (first + 0.5 * second * step)
                    });
                    terms.sum()
                };
                let changes = self.values.chunks(objects).map(change).enumerate();
                let best = changes.fold((now, 0.0), |best, other| if other.1 < best.1 { other } else { best }).0;
                // There are at most 65,536 lists.
                self.of_leaves[tree][leaf] = best as u16;
                let new = &self.values[best * objects..][..objects];
                let steps = steps[leaf * objects..][..objects].iter_mut();
                steps.zip(new.iter().zip(&own)).for_each(|(step, (new, own))| *step = new - own);
            }
            let trees = self.of_leaves.len();
            for case in 0..self.counts.len() / objects {
                let leaf = usize::from(self.paths[case * trees + tree]);
                self.step(case, &steps[leaf * objects..][..objects], 1.0);
            }
        }
    }

    /// First and second derivatives of each leaf of a tree: leaves × objects.
    fn slopes_of_leaves(&self, tree: usize) -> Vec<[f64; 2]> {
        let objects = self.objects;
        let mut slopes = vec![[0.0; 2]; self.of_leaves[tree].len() * objects];
        for (case, path) in self.cases() {
            self.add_slopes(case, 1.0, &mut slopes[usize::from(path[tree]) * objects..][..objects]);
        }
        slopes
    }

    /// Adds the derivatives of a case's loss by a value that is added `times` times.
    fn add_slopes(&self, case: usize, times: f64, slopes: &mut [[f64; 2]]) {
        let range = case * self.objects..(case + 1) * self.objects;
        for ((slope, expected), count) in slopes.iter_mut().zip(&self.expected[range.clone()]).zip(&self.counts[range])
        {
            slope[0] += times * (expected - count);
            slope[1] += times * times * expected;
        }
    }

    /// The loss of all touches.
    fn loss(&self) -> f64 {
        let cases = self.margins.chunks(self.objects).zip(self.counts.chunks(self.objects));
        let losses = cases.map(|(margins, counts)| {
            let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let sum = most + margins.iter().map(|margin| (margin - most).exp()).sum::<f64>().ln();
            margins.iter().zip(counts).map(|(margin, count)| count * (sum - margin)).sum::<f64>()
        });
        losses.sum()
    }

    /// Moves each list so that its least and its largest value are equally far from 0, which changes no posterior.
    fn center(&mut self) {
        for values in self.values.chunks_mut(self.objects) {
            let (least, most) = extremes(values);
            values.iter_mut().for_each(|value| *value -= (least + most) / 2.0);
        }
        let mean = self.base.iter().sum::<f64>() / self.base.len() as f64;
        self.base.iter_mut().for_each(|base| *base -= mean);
        self.add_up();
    }

    fn round(&mut self, unit: Unit) {
        self.values.iter_mut().for_each(|value| *value = unit.held(*value));
        self.base.iter_mut().for_each(|value| *value = unit.nearest(*value));
        self.add_up();
    }

    fn fitted(&self) -> Fitted {
        let list = |&list: &u16| {
            let values = &self.values[usize::from(list) * self.objects..][..self.objects];
            values.iter().map(|value| *value as f32).collect()
        };
        let leaves = self.of_leaves.iter().map(|leaves| leaves.iter().map(list).collect()).collect();
        Fitted { leaves, base: self.base.iter().map(|value| *value as f32).collect() }
    }
}

fn add(sums: &mut [f64], values: &[f64], times: f64) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += times * value);
}

fn centered(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &value| (least.min(value), most.max(value)))
}

/// Lloyd's k-means with a weight for each coordinate of each point: the centers, and each point's. It starts from the
/// heaviest point, and then always from that which is worst off.
fn means(points: &[Vec<f64>], weights: &[Vec<f64>], count: usize) -> (Vec<Vec<f64>>, Vec<u16>) {
    let apart = |point: usize, center: &[f64]| -> f64 {
        let terms = points[point].iter().zip(&weights[point]).zip(center);
        terms.map(|((value, weight), center)| weight * (value - center).powi(2)).sum()
    };
    let largest = |of: &[f64]| (0..of.len()).reduce(|best, other| if of[other] > of[best] { other } else { best });
    let heavy: Vec<f64> = weights.iter().map(|weights| weights.iter().sum()).collect();
    let mut centers: Vec<Vec<f64>> = largest(&heavy).map(|first| points[first].clone()).into_iter().collect();
    let mut least = vec![f64::INFINITY; points.len()];
    while let Some(center) = centers.last().filter(|_| centers.len() < count) {
        least.iter_mut().enumerate().for_each(|(point, least)| *least = least.min(apart(point, center)));
        match largest(&least).filter(|&worst| least[worst] > 0.0) {
            Some(worst) => centers.push(points[worst].clone()),
            None => break,
        }
    }
    let mut nearest = vec![0; points.len()];
    for _ in 0..MEANS {
        for (point, nearest) in nearest.iter_mut().enumerate() {
            let all = centers.iter().map(|center| apart(point, center)).enumerate();
            // There are at most 65,536 centers.
            *nearest =
                all.reduce(|best, other| if other.1 < best.1 { other } else { best }).map_or(0, |best| best.0 as u16);
        }
        let mut sums = vec![vec![[0.0; 2]; points.first().map_or(0, Vec::len)]; centers.len()];
        for ((point, weights), &nearest) in points.iter().zip(weights).zip(&nearest) {
            for ((sum, value), weight) in sums[usize::from(nearest)].iter_mut().zip(point).zip(weights) {
                *sum = [sum[0] + weight * value, sum[1] + weight];
            }
        }
        for (center, sums) in centers.iter_mut().zip(sums) {
            for (center, [sum, weight]) in center.iter_mut().zip(sums).filter(|(_, [_, weight])| *weight > 0.0) {
                *center = sum / weight;
            }
        }
    }
    (centers, nearest)
}
