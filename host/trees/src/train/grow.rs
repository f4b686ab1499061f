//! One tree, grown level by level.

use super::bins::{Bins, Side};
use super::split::{Score, Split};
use crate::ensemble::Node;
use rayon::prelude::*;
use std::ops::Range;

/// The gain that a split has to exceed.
const LEAST_GAIN: f32 = 1e-6;
/// A node with this many rows adds them up in blocks of about half as many, where hessboost 0.4 and XGBoost do.
const LARGE: usize = 8_192;
/// With more rows than this the blocks are used for complete data too.
const MANY: usize = 1 << 18;
/// Nodes' memory that is kept for others: enough for a tree of depth 6.
const SPARE: usize = 64;

/// Everything that all trees have in common.
pub(super) struct Grower {
    pub(super) bins: Bins,
    pub(super) score: Score,
    pub(super) depth: usize,
    /// The factor of all leaves.
    pub(super) eta: f32,
}

/// A tree, and the memory that growing the next one uses again.
#[derive(Default)]
pub(super) struct Grown {
    pub(super) nodes: Vec<Node>,
    /// Leaves × outputs.
    pub(super) values: Vec<f32>,
    /// The number of each row's leaf. There are at most 2¹⁶.
    pub(super) leaf_of: Vec<u16>,
    rows: Vec<u32>,
    spare: Vec<Vec<f64>>,
}

impl Grown {
    /// Keeps memory for another node.
    fn keep(&mut self, memory: Vec<f64>) {
        if self.spare.len() < SPARE {
            self.spare.push(memory);
        }
    }
}

/// A node that may be split.
struct Open {
    id: usize,
    rows: Range<usize>,
    sums: Vec<f64>,
    whole: f64,
    /// Sums of the rows in each bin of all columns.
    bins: Vec<f64>,
    best: Split,
}

impl Open {
    fn new(id: usize, rows: Range<usize>, sums: Vec<f64>, score: &Score) -> Self {
        Self { id, rows, whole: score.whole(&sums), sums, bins: Vec::new(), best: Split::none() }
    }
}

impl Grower {
    /// Grows a tree on the rows' derivatives.
    pub(super) fn grow(&self, slopes: &[f32], grown: &mut Grown) {
        let count = slopes.len() / self.width();
        // There are fewer than 2³² rows.
        grown.rows.clear();
        grown.rows.extend(0..count as u32);
        grown.leaf_of.resize(count, 0);
        grown.nodes.clear();
        grown.nodes.push(Node::Leaf(Vec::new()));
        grown.values.clear();
        let mut open = vec![self.root(slopes, grown)];
        for level in 1..=self.depth {
            let (split, closed): (Vec<Open>, Vec<Open>) =
                open.into_iter().partition(|node| node.best.gain > LEAST_GAIN);
            closed.into_iter().for_each(|node| self.close(node, grown));
            if level == self.depth {
                return split.into_iter().for_each(|node| self.close_children(node, grown));
            }
            let mut children = self.split(split, grown);
            self.search(&mut children, slopes, grown);
            open = children.into_iter().flatten().collect();
        }
    }

    /// The numbers in a sum.
    fn width(&self) -> usize {
        2 * self.score.outputs
    }

    /// The node of all rows, and its best split.
    fn root(&self, slopes: &[f32], grown: &mut Grown) -> Open {
        let mut bins = self.memory(grown);
        let rows = grown.rows.as_slice();
        let mut sums = vec![0.0; self.width()];
        let add_all = || {
            if let ([first, second], (slopes, _)) = (sums.as_mut_slice(), slopes.as_chunks::<2>()) {
                for slope in slopes {
                    (*first, *second) = (*first + f64::from(slope[0]), *second + f64::from(slope[1]));
                }
                return;
            }
            for slopes in slopes.chunks_exact(self.width()) {
                sums.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += f64::from(*slope));
            }
        };
        let groups = self.groups(&mut bins, 1);
        rayon::join(add_all, || {
            groups.into_par_iter().for_each(|(columns, bins)| {
                bins.fill(0.0);
                self.add(rows, &columns, slopes, bins);
            });
        });
        let mut root = Open::new(0, 0..rows.len(), sums, &self.score);
        let groups = self.groups(&mut bins, 1);
        let found: Vec<Split> =
            groups.into_par_iter().map(|(columns, bins)| self.best(&root, &columns, bins)).collect();
        root.best = best_of(found.iter());
        root.bins = bins;
        root
    }

    /// Makes nodes branch, and moves their rows: the left and right child of each.
    fn split(&self, nodes: Vec<Open>, grown: &mut Grown) -> Vec<[Open; 2]> {
        let mut rest = grown.rows.as_mut_slice();
        let mut passed = 0;
        let mut parts: Vec<(&Open, &mut [u32])> = Vec::with_capacity(nodes.len());
        for node in &nodes {
            let (rows, after) = rest.split_at_mut(node.rows.end - passed);
            parts.push((node, &mut rows[node.rows.start - passed..]));
            (rest, passed) = (after, node.rows.end);
        }
        let part = |(node, rows): (&Open, &mut [u32])| self.bins.part(rows, &node.best.side);
        let lefts: Vec<usize> = parts.into_par_iter().map(part).collect();
        let mut children = Vec::with_capacity(nodes.len());
        for (node, count) in nodes.into_iter().zip(lefts) {
            let left = self.branch(&node, grown);
            let middle = node.rows.start + count;
            let [left_sums, right_sums] = node.best.sides(&node.sums);
            let mut pair = [
                Open::new(left, node.rows.start..middle, left_sums, &self.score),
                Open::new(left + 1, middle..node.rows.end, right_sums, &self.score),
            ];
            // Those of both together, until they are told apart.
            pair[0].bins = node.bins;
            children.push(pair);
        }
        children
    }

    /// Makes a node branch: the left child's place. The right child is next.
    fn branch(&self, node: &Open, grown: &mut Grown) -> usize {
        let Side { column, limit, missing_left } = node.best.side;
        let left = grown.nodes.len();
        grown.nodes.extend([Node::Leaf(Vec::new()), Node::Leaf(Vec::new())]);
        grown.nodes[node.id] = Node::Split {
            feature: column,
            // Without a bin to the left, only a missing value goes there: no value is below the least number.
            threshold: limit.checked_sub(1).map_or(f32::MIN, |last| self.bins.ends[column][last]),
            missing_left,
            left,
            right: left + 1,
        };
        left
    }

    /// Finds the best split of each child. The rows of one child are added up; the other has what is left of the parent's sums.
    fn search(&self, children: &mut [[Open; 2]], slopes: &[f32], grown: &mut Grown) {
        let mut memory: Vec<[Vec<f64>; 2]> =
            children.iter_mut().map(|[left, _]| [self.memory(grown), std::mem::take(&mut left.bins)]).collect();
        let count = children.len();
        let mut tasks = Vec::with_capacity(count);
        for (pair, [added, parent]) in children.iter().zip(&mut memory) {
            let first = self.added(pair);
            let groups = self.groups(added, count).into_iter().zip(self.groups(parent, count));
            tasks.extend(groups.map(|(added, parent)| ([&pair[first], &pair[1 - first]], added, parent.1)));
        }
        let rows = &grown.rows;
        let found: Vec<[Split; 2]> = tasks
            .into_par_iter()
            .map(|(nodes, (columns, added), parent)| {
                added.fill(0.0);
                self.add(&rows[nodes[0].rows.clone()], &columns, slopes, added);
                parent.iter_mut().zip(&*added).for_each(|(sum, added)| *sum -= added);
                [self.best(nodes[0], &columns, added), self.best(nodes[1], &columns, parent)]
            })
            .collect();
        let groups = found.len() / count.max(1);
        for ((pair, memory), found) in children.iter_mut().zip(memory).zip(found.chunks(groups.max(1))) {
            let first = self.added(pair);
            for (turn, bins) in memory.into_iter().enumerate() {
                let node = &mut pair[if turn == 0 { first } else { 1 - first }];
                node.bins = bins;
                node.best = best_of(found.iter().map(|found| &found[turn]));
            }
        }
    }

    /// The child whose rows are added up: with leaves of one value that of fewer rows, else that of less weight.
    fn added(&self, [left, right]: &[Open; 2]) -> usize {
        let outputs = self.score.outputs;
        let weight = |node: &Open| node.sums[outputs..].iter().sum::<f64>();
        let right_first = if outputs == 1 { right.rows.len() < left.rows.len() } else { weight(right) < weight(left) };
        usize::from(right_first)
    }

    /// Adds up rows in their order, or in blocks of the same size on any machine.
    fn add(&self, rows: &[u32], columns: &Range<usize>, slopes: &[f32], sums: &mut [f64]) {
        let add = |rows: &[u32], sums: &mut [f64]| self.bins.add(rows, columns, slopes, self.width(), sums);
        let together = || rows.windows(2).all(|pair| pair[0] + 1 == pair[1]);
        let few = || self.bins.complete && (slopes.len() / self.width() <= MANY || together());
        if self.score.outputs > 1 || rows.len() < LARGE || few() {
            return add(rows, sums);
        }
        let mut blocks = rows.chunks(rows.len().div_ceil(rows.len() / (LARGE / 2)));
        blocks.next().into_iter().for_each(|rows| add(rows, sums));
        let mut block = vec![0.0; sums.len()];
        for rows in blocks {
            block.fill(0.0);
            add(rows, &mut block);
            sums.iter_mut().zip(&block).for_each(|(sum, block)| *sum += block);
        }
    }

    /// The best split of a node by these columns, whose bins have these sums.
    fn best(&self, node: &Open, columns: &Range<usize>, bins: &[f64]) -> Split {
        let mut best = Split::none();
        let starts = &self.bins.starts;
        for column in columns.clone() {
            let at = |bin: usize| (bin - starts[columns.start]) * self.width();
            // Without the last, of missing values.
            let bins = &bins[at(starts[column])..at(starts[column + 1] - 1)];
            self.score.search(bins, &node.sums, node.whole, column, &mut best);
        }
        best
    }

    /// The sums of all bins by the columns that are added up together. That is all of them, which reads each row once, unless
    /// there are too few nodes to keep all threads busy.
    fn groups<'b>(&self, bins: &'b mut [f64], nodes: usize) -> Vec<(Range<usize>, &'b mut [f64])> {
        let (columns, threads) = (self.bins.ends.len(), rayon::current_num_threads());
        if self.score.outputs == 1 || threads == 1 || nodes >= 2 * threads {
            return vec![(0..columns, bins)];
        }
        let mut rest = bins;
        let mut groups = Vec::with_capacity(columns);
        for column in 0..columns {
            let count = self.bins.starts[column + 1] - self.bins.starts[column];
            let (bins, after) = rest.split_at_mut(count * self.width());
            groups.push((column..column + 1, bins));
            rest = after;
        }
        groups
    }

    /// Makes a node a leaf.
    fn close(&self, node: Open, grown: &mut Grown) {
        let number = self.leaf(node.id, &node.sums, grown);
        for &row in &grown.rows[node.rows] {
            grown.leaf_of[row as usize] = number;
        }
        grown.keep(node.bins);
    }

    /// Makes a node branch into two leaves.
    fn close_children(&self, node: Open, grown: &mut Grown) {
        let left = self.branch(&node, grown);
        let sides = node.best.sides(&node.sums);
        let [left, right] = [(left, &sides[0]), (left + 1, &sides[1])].map(|(id, sums)| self.leaf(id, sums, grown));
        let Grown { rows, leaf_of, .. } = grown;
        self.bins.route(&rows[node.rows], &node.best.side, |row, goes_left| {
            leaf_of[row as usize] = if goes_left { left } else { right };
        });
        grown.keep(node.bins);
    }

    /// Makes a node with these sums a leaf: the leaf's number.
    fn leaf(&self, id: usize, sums: &[f64], grown: &mut Grown) -> u16 {
        let values: Vec<f32> = self.score.leaf(sums).into_iter().map(|value| value * self.eta).collect();
        let number = (grown.values.len() / self.score.outputs) as u16;
        grown.values.extend(&values);
        grown.nodes[id] = Node::Leaf(values);
        number
    }

    /// Memory for the sums of all bins.
    fn memory(&self, grown: &mut Grown) -> Vec<f64> {
        let length = self.bins.starts.last().map_or(0, |end| end * self.width());
        grown.spare.pop().unwrap_or_else(|| vec![0.0; length])
    }
}

/// The split that gains most; the first of several.
fn best_of<'s>(splits: impl Iterator<Item = &'s Split>) -> Split {
    let better = |best: &'s Split, other: &'s Split| if other.gain > best.gain { other } else { best };
    splits.reduce(better).cloned().unwrap_or_else(Split::none)
}
