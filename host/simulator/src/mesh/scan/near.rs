//! Neighbors of points: a k-d tree, and queries of many points together.

use glam::DVec3;
use rayon::prelude::*;

/// Most points of a leaf, and of a block whose neighbors are found together.
const LEAF: usize = 16;

/// A neighbor: its squared distance, and its number.
pub(super) type Neighbor = (f64, u32);

/// Points in the order of a k-d tree's leaves.
pub(super) struct Near {
    places: Vec<DVec3>,
    numbers: Vec<u32>,
    /// Of a node above its two halves, 2 n and 2 n + 1: the axis along which they are divided, and where.
    splits: Vec<(usize, f64)>,
}

/// A part of a tree: its node, the first of its points, and the one after its last.
type Part = (usize, usize, usize);

impl Near {
    pub(super) fn new(places: &[DVec3]) -> Self {
        let mut points: Vec<(DVec3, u32)> = places.iter().copied().zip(0..).collect();
        let mut splits = vec![(0, 0.0); places.len().div_ceil(LEAF).next_power_of_two()];
        divide(&mut points, 1, &mut splits);
        let (places, numbers) = points.into_iter().unzip();
        Self { places, numbers, splits }
    }

    fn root(&self) -> Part {
        (1, 0, self.places.len())
    }

    /// Calls `leaf` with the points of the leaves that may be nearer than a bound, which it returns.
    fn search(&self, part: Part, place: DVec3, away: DVec3, bound: &mut f64, leaf: &mut impl FnMut(usize, usize) -> f64) {
        let (node, first, end) = part;
        if end - first <= LEAF {
            *bound = leaf(first, end);
            return;
        }
        let (axis, split) = self.splits[node];
        let middle = first.midpoint(end);
        let (below, above) = ((2 * node, first, middle), (2 * node + 1, middle, end));
        let beyond = place[axis] - split;
        let (near, far) = if beyond < 0.0 { (below, above) } else { (above, below) };
        self.search(near, place, away, bound, leaf);
        let mut away = away;
        away[axis] = beyond;
        if away.length_squared() <= *bound {
            self.search(far, place, away, bound, leaf);
        }
    }

    /// The `count` nearest points, in no order.
    fn nearest(&self, place: DVec3, count: usize, found: &mut Vec<Neighbor>) {
        found.clear();
        let mut bound = f64::INFINITY;
        self.search(self.root(), place, DVec3::ZERO, &mut { f64::INFINITY }, &mut |first, end| {
            for (at, other) in self.places[first..end].iter().enumerate() {
                let squared = other.distance_squared(place);
                if squared <= bound {
                    found.push((squared, (first + at) as u32));
                }
            }
            if found.len() >= 2 * count + LEAF || (bound == f64::INFINITY && found.len() >= count) {
                keep_nearest(found, count);
                bound = farthest(found);
            }
            bound
        });
        keep_nearest(found, count);
    }

    /// True if a point is no farther than this.
    pub(super) fn is_within(&self, place: DVec3, squared: f64) -> bool {
        let mut is_there = false;
        self.search(self.root(), place, DVec3::ZERO, &mut { squared }, &mut |first, end| {
            is_there |= self.places[first..end].iter().any(|other| other.distance_squared(place) <= squared);
            if is_there { -1.0 } else { squared }
        });
        is_there
    }

    /// The leaves, as blocks of points that lie together.
    fn blocks(&self) -> Vec<Vec<usize>> {
        let mut blocks = Vec::new();
        let mut parts = vec![self.root()];
        while let Some((_, first, end)) = parts.pop() {
            let middle = first.midpoint(end);
            match end - first <= LEAF {
                true => blocks.push((first..end).collect()),
                false => parts.extend([(0, middle, end), (0, first, middle)]),
            }
        }
        blocks
    }

    /// What `of` makes of each point and its neighbors, itself among them and in no order: the `count` nearest that
    /// `is_kept` takes for it, of the `among` times as many that are nearest.
    pub(super) fn each<T: Send>(
        &self,
        count: usize,
        among: usize,
        is_kept: impl Fn(usize, usize) -> bool + Sync,
        of: impl Fn(usize, &[Neighbor]) -> T + Sync,
    ) -> Vec<T> {
        let blocks = self.blocks();
        let found = blocks.par_iter().map(|block| self.block(block, count, among, &is_kept, &of));
        let mut all: Vec<(usize, T)> = found.collect::<Vec<_>>().into_iter().flatten().collect();
        all.sort_unstable_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, made)| made).collect()
    }

    /// As [`each`](Self::each), for every `step`th point, in no order.
    pub(super) fn some<T: Send>(
        &self,
        step: usize,
        count: usize,
        among: usize,
        is_kept: impl Fn(usize, usize) -> bool + Sync,
        of: impl Fn(usize, &[Neighbor]) -> T + Sync,
    ) -> Vec<T> {
        let chosen = (0..self.places.len()).into_par_iter().filter(|&at| self.numbers[at] as usize % step == 0);
        let found = chosen.map(|at| self.block(&[at], count, among, &is_kept, &of));
        found.collect::<Vec<_>>().into_iter().flatten().map(|(_, made)| made).collect()
    }

    /// Neighbors of the points of a block, which are found together: they are among those of its center.
    fn block<T>(
        &self,
        block: &[usize],
        count: usize,
        among: usize,
        is_kept: &impl Fn(usize, usize) -> bool,
        of: &impl Fn(usize, &[Neighbor]) -> T,
    ) -> Vec<(usize, T)> {
        let center = block.iter().map(|&at| self.places[at]).sum::<DVec3>() / block.len() as f64;
        let radius = block.iter().map(|&at| self.places[at].distance(center)).fold(0.0, f64::max);
        let (mut made, mut near) = (Vec::with_capacity(block.len()), Vec::new());
        let mut pending = block.to_vec();
        // Most points have enough neighbors on their side among few.
        for wanted in [count + count / 2, among * count] {
            self.nearest(center, wanted, &mut near);
            let reach = farthest(&near).sqrt() + 2.0 * radius;
            let is_last = wanted >= among * count || near.len() == self.places.len();
            let around = self.around(center, reach);
            pending.retain(|&at| {
                let (place, number) = (self.places[at], self.numbers[at] as usize);
                // All points so near are among those around the center.
                let sure = reach - place.distance(center);
                near.clear();
                near.extend(
                    around
                        .iter()
                        .map(|&other| (self.places[other as usize].distance_squared(place), other))
                        .filter(|(squared, _)| *squared <= sure * sure),
                );
                let is_whole = is_last || near.len() >= among * count;
                keep_nearest(&mut near, among * count);
                near.iter_mut().for_each(|(_, other)| *other = self.numbers[*other as usize]);
                near.retain(|&(_, other)| is_kept(number, other as usize));
                if near.len() < count && !is_whole {
                    return true;
                }
                keep_nearest(&mut near, count);
                made.push((number, of(number, &near)));
                false
            });
            if pending.is_empty() {
                break;
            }
        }
        made
    }

    /// The points no farther than this.
    fn around(&self, center: DVec3, reach: f64) -> Vec<u32> {
        let mut found = Vec::new();
        let squared = reach * reach;
        self.search(self.root(), center, DVec3::ZERO, &mut { squared }, &mut |first, end| {
            let inside = |at: &usize| self.places[*at].distance_squared(center) <= squared;
            found.extend((first..end).filter(inside).map(|at| at as u32));
            squared
        });
        found
    }
}

/// Divides points into halves, down to leaves, each along the axis on which they spread most.
fn divide(points: &mut [(DVec3, u32)], node: usize, splits: &mut [(usize, f64)]) {
    if points.len() <= LEAF {
        return;
    }
    let low = points.iter().fold(DVec3::INFINITY, |low, (place, _)| low.min(*place));
    let high = points.iter().fold(DVec3::NEG_INFINITY, |high, (place, _)| high.max(*place));
    let axis = (high - low).max_position();
    // As `midpoint` of the first and the end, whatever the first is.
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
    if let Some(split) = splits.get_mut(node) {
        *split = (axis, points[middle].0[axis]);
    }
    let (below, above) = points.split_at_mut(middle);
    divide(below, 2 * node, splits);
    divide(above, 2 * node + 1, splits);
}

/// Keeps the nearest: of neighbors that are as far, those with the lowest numbers.
fn keep_nearest(found: &mut Vec<Neighbor>, count: usize) {
    if found.len() > count {
        found.select_nth_unstable_by(count, |(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
        found.truncate(count);
    }
}

/// The largest squared distance of neighbors.
pub(super) fn farthest(found: &[Neighbor]) -> f64 {
    found.iter().fold(0.0, |farthest, (squared, _)| squared.max(farthest))
}
