//! Neighbors of points: a k-d tree, and queries of many points together.

use glam::DVec3;
use rayon::prelude::*;

/// Most points of a leaf, and of a block whose neighbors are found together.
const LEAF: usize = 32;

/// A neighbor: its squared distance, and its number.
pub(super) type Neighbor = (f64, u32);

/// Points in the order of a k-d tree's leaves.
pub(super) struct Near {
    places: Vec<DVec3>,
    numbers: Vec<u32>,
    /// For a node above its two halves, 2 n and 2 n + 1: the axis along which they are divided, and the coordinate.
    splits: Vec<(usize, f64)>,
}

/// Neighbors of a block's center that most of its points need: how many times those that are wanted, and how far they reach.
#[derive(Default)]
struct Usual {
    times: f64,
    reach: f64,
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
    fn search(
        &self,
        part: Part,
        place: DVec3,
        away: DVec3,
        bound: &mut f64,
        leaf: &mut impl FnMut(usize, usize) -> f64,
    ) {
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
                    found.push((squared, self.numbers[first + at]));
                }
            }
            if found.len() >= 2 * count + LEAF || (bound == f64::INFINITY && found.len() >= count) {
                let kept = keep_nearest(found, count);
                found.truncate(kept);
                bound = farthest(found);
            }
            bound
        });
        let kept = keep_nearest(found, count);
        found.truncate(kept);
    }

    /// The nearest point; none if there is no point.
    pub(super) fn nearest_one(&self, place: DVec3) -> Option<usize> {
        let mut found = Vec::new();
        self.nearest(place, 1, &mut found);
        found.first().map(|(_, number)| *number as usize)
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

    /// Results of `of` for each point and its neighbors, including itself, in no order: the `count` nearest that
    /// `is_kept` accepts, from the `among` times as many that are nearest.
    pub(super) fn each<T: Send>(
        &self,
        count: usize,
        among: usize,
        is_kept: impl Fn(usize, usize) -> bool + Sync,
        of: impl Fn(usize, &[Neighbor]) -> T + Sync,
    ) -> Vec<T> {
        let blocks = self.blocks();
        let found = blocks.par_chunks(64).map(|blocks| {
            let mut usual = Usual::default();
            blocks
                .iter()
                .flat_map(|block| self.block(block, count, among, &is_kept, &of, &mut usual))
                .collect::<Vec<_>>()
        });
        let mut all: Vec<(usize, T)> = found.collect::<Vec<_>>().into_iter().flatten().collect();
        all.sort_unstable_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, made)| made).collect()
    }

    /// Like [`each`](Self::each), for chosen points, in no order.
    pub(super) fn some<T: Send>(
        &self,
        is_chosen: impl Fn(usize) -> bool + Sync + Send,
        count: usize,
        among: usize,
        is_kept: impl Fn(usize, usize) -> bool + Sync,
        of: impl Fn(usize, &[Neighbor]) -> T + Sync,
    ) -> Vec<T> {
        let chosen = (0..self.places.len()).into_par_iter().filter(|&at| is_chosen(self.numbers[at] as usize));
        let found = chosen.map(|at| self.block(&[at], count, among, &is_kept, &of, &mut Usual::default()));
        found.collect::<Vec<_>>().into_iter().flatten().map(|(_, made)| made).collect()
    }

    /// Neighbors of the points of a block, which are found together: they are among those of its center. How many of those
    /// were needed, and how far they reached, is passed on to the next block, which is close.
    fn block<T>(
        &self,
        block: &[usize],
        count: usize,
        among: usize,
        is_kept: &impl Fn(usize, usize) -> bool,
        of: &impl Fn(usize, &[Neighbor]) -> T,
        usual: &mut Usual,
    ) -> Vec<(usize, T)> {
        let center = block.iter().map(|&at| self.places[at]).sum::<DVec3>() / block.len() as f64;
        let radius = block.iter().map(|&at| self.places[at].distance(center)).fold(0.0, f64::max);
        let (mut made, mut near) = (Vec::with_capacity(block.len()), Vec::new());
        let Usual { times, mut reach } = std::mem::take(usual);
        let mut wanted = (times.max(1.0) * count as f64) as usize;
        let mut pending = block.to_vec();
        let (mut distances, mut last) = (Vec::new(), 0.0);
        loop {
            let mut around = if reach > 0.0 { self.around(center, reach + 2.0 * radius) } else { Vec::new() };
            let within = around.iter().filter(|(place, _)| place.distance_squared(center) <= reach * reach).count();
            if within < wanted {
                self.nearest(center, wanted, &mut near);
                reach = farthest(&near).sqrt();
                around = self.around(center, reach + 2.0 * radius);
            }
            let is_last = wanted >= among * count || around.len() == self.places.len();
            let (mut looked_at, mut taken) = (0, 0);
            near.resize(around.len(), (0.0, 0));
            pending.retain(|&at| {
                let (place, number) = (self.places[at], self.numbers[at] as usize);
                distances.clear();
                distances.extend(around.iter().map(|(other, _)| other.distance_squared(place)));
                // All points so near are among those around the center. Fewer are enough, if they are for the point before.
                let sure = (reach + 2.0 * radius - place.distance(center)).powi(2);
                for limit in [1.3 * last, sure] {
                    if limit > sure {
                        continue;
                    }
                    let mut found = 0;
                    for (&squared, (_, other)) in distances.iter().zip(&around) {
                        near[found] = (squared, *other);
                        found += usize::from(squared <= limit);
                    }
                    let most = keep_nearest(&mut near[..found], among * count);
                    let mut kept = 0;
                    for index in 0..most {
                        let neighbor = near[index];
                        near[kept] = neighbor;
                        kept += usize::from(is_kept(number, neighbor.1 as usize));
                    }
                    (looked_at, taken) = (looked_at + most, taken + kept);
                    if kept < count && most < among * count && !(is_last && limit == sure) {
                        continue;
                    }
                    let kept = keep_nearest(&mut near[..kept], count);
                    last = farthest(&near[..kept]);
                    made.push((number, of(number, &near[..kept])));
                    return false;
                }
                true
            });
            if usual.reach == 0.0 {
                // For the next block the area may hold a fifth more than is needed.
                let times = (looked_at as f64 / taken.max(1) as f64).clamp(1.0, among as f64);
                let area = 1.2 * times * count as f64 / within.max(wanted) as f64;
                *usual = Usual { times, reach: reach * area.sqrt() };
            }
            if pending.is_empty() {
                return made;
            }
            (wanted, reach) = ((2 * wanted).min(among * count), 0.0);
        }
    }

    /// The points no farther than this, with their numbers.
    fn around(&self, center: DVec3, reach: f64) -> Vec<(DVec3, u32)> {
        let mut found = Vec::new();
        let squared = reach * reach;
        self.search(self.root(), center, DVec3::ZERO, &mut { squared }, &mut |first, end| {
            let points = self.places[first..end].iter().copied().zip(self.numbers[first..end].iter().copied());
            found.extend(points.filter(|(place, _)| place.distance_squared(center) <= squared));
            squared
        });
        found
    }

    /// The numbers of points in the order of the tree's leaves: of neighbors, most are close to each other.
    pub(super) fn order(&self) -> &[u32] {
        &self.numbers
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
    // As `midpoint` of the first and the end, regardless of the first.
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |(a, i), (b, j)| a[axis].total_cmp(&b[axis]).then(i.cmp(j)));
    if let Some(split) = splits.get_mut(node) {
        *split = (axis, points[middle].0[axis]);
    }
    let (below, above) = points.split_at_mut(middle);
    divide(below, 2 * node, splits);
    divide(above, 2 * node + 1, splits);
}

/// Puts the nearest first, in no order, and tells how many they are.
fn keep_nearest(found: &mut [Neighbor], count: usize) -> usize {
    if found.len() > count {
        // Of numbers that are not negative, the bits are in order.
        found.select_nth_unstable_by_key(count, |(squared, number)| {
            (u128::from(squared.to_bits()) << 32) | u128::from(*number)
        });
    }
    found.len().min(count)
}

/// The largest squared distance of neighbors.
pub(super) fn farthest(found: &[Neighbor]) -> f64 {
    found.iter().fold(0.0, |farthest, (squared, _)| squared.max(farthest))
}
