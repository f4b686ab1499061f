//! Every case that an ensemble distinguishes, where they can be counted.
//!
//! Between its thresholds an ensemble is constant. Over two features that leaves some ten thousand cells at most, few
//! enough to compute its margins for all values: the worst error of a margin is the largest in any cell. Planes of a schema
//! have fewer dimensions than there are features.

use super::axes::different_splits;
use super::forest::{Branch, Forest};
use crate::ensemble::Occurring;
use std::mem::take;
use std::ops::{AddAssign, Range};

/// Cells times trees that are visited; beyond, the worst case is bounded instead of found.
const MAX_WORK: usize = 2_000_000_000;
/// The most cells held in memory at once.
const MAX_CELLS: usize = 4_000_000;

/// A feature and its thresholds.
type Dimension = (u8, Vec<i32>);

/// The cells of a forest. A place along a dimension is the number of thresholds at or below the value; a missing value
/// has the place after the last.
pub(super) struct Cells {
    /// Features and their thresholds.
    dimensions: Vec<Dimension>,
    /// Boxes of places; values fall into one of them.
    planes: Vec<Vec<Range<usize>>>,
}

/// The places along a dimension that lead to a leaf.
#[derive(Clone)]
struct Span {
    places: Range<usize>,
    /// The place of a missing value, if that leads there too.
    missing: Option<usize>,
}

impl Cells {
    pub(super) fn new(forest: &Forest<'_>) -> Option<Self> {
        let mut dimensions: Vec<(u8, Vec<i32>)> = Vec::new();
        for splits in different_splits(forest).chunk_by(|a, b| a.0 == b.0) {
            let mut cuts: Vec<i32> = splits.iter().map(|split| split.1).collect();
            cuts.dedup();
            dimensions.push((splits[0].0, cuts));
        }
        if forest.schema.is_some_and(|schema| schema.has_all_planes) {
            let mut cuts = |feature| dimensions.iter_mut().find(|(of, _)| *of == feature).map(|(_, cuts)| take(cuts));
            dimensions = (0..).zip(0..forest.features).map(|(of, _)| (of, cuts(of).unwrap_or_default())).collect();
        }
        // Planes are over all features.
        let planes = forest.schema.map_or(&[][..], |schema| schema.planes);
        let mut planes: Vec<Vec<Range<usize>>> = match dimensions.len() == forest.features {
            true => planes.iter().map(|plane| places(plane, &dimensions)).collect(),
            false => Vec::new(),
        };
        if planes.is_empty() {
            planes.push(dimensions.iter().map(|(_, cuts)| 0..cuts.len() + 2).collect());
        }
        let cells = Self { dimensions, planes };
        let count = cells.count().filter(|&count| count <= MAX_CELLS)?;
        let trees: usize = (0..forest.objects()).map(|object| forest.trees_of(object).count()).sum();
        (count.checked_mul(trees)? <= MAX_WORK).then_some(cells)
    }

    /// Number of cells.
    fn count(&self) -> Option<usize> {
        let lengths = self.planes.iter().map(|plane| plane.iter().try_fold(1_usize, |n, r| n.checked_mul(r.len())));
        lengths.sum()
    }

    /// Sums over an object's trees, in their order, in every cell: `start`, and `value` of each leaf that is reached,
    /// given the tree's index.
    pub(super) fn sums<T: Copy + AddAssign>(
        &self,
        forest: &Forest<'_>,
        object: usize,
        start: T,
        value: impl Fn(usize, f32) -> T,
    ) -> Vec<T> {
        let mut sums = Vec::new();
        for plane in &self.planes {
            let count = plane.iter().map(Range::len).product();
            let mut cells = vec![start; count];
            for (index, tree) in forest.trees.iter().enumerate().filter(|(_, tree)| tree.values_for(object)) {
                let all = self
                    .dimensions
                    .iter()
                    .map(|(_, cuts)| Span { places: 0..cuts.len() + 1, missing: Some(cuts.len() + 1) });
                self.leaves(&tree.root, &mut all.collect(), &mut |spans, leaf| {
                    fill(&mut cells, plane, spans, value(index, tree.value_of(object, leaf)));
                });
            }
            sums.append(&mut cells);
        }
        sums
    }

    /// Calls `see` on every leaf with the places that lead to it.
    fn leaves(&self, branch: &Branch<'_>, spans: &mut Vec<Span>, see: &mut impl FnMut(&[Span], &[f32])) {
        let split = match branch {
            Branch::Leaf(values) => return see(spans, values),
            Branch::Split(split) => split,
        };
        let Some(dimension) = self.dimensions.iter().position(|(feature, _)| *feature == split.feature) else { return };
        let cut = self.dimensions[dimension].1.partition_point(|&cut| cut < split.cut) + 1;
        let whole = spans[dimension].clone();
        let Range { start, end } = whole.places;
        spans[dimension] = Span { places: start..end.min(cut), missing: whole.missing.filter(|_| split.missing_left) };
        self.leaves(&split.left, spans, see);
        spans[dimension] = Span { places: start.max(cut)..end, missing: whole.missing.filter(|_| !split.missing_left) };
        self.leaves(&split.right, spans, see);
        spans[dimension] = Span { places: start..end, missing: whole.missing };
    }
}

/// The places of a plane, along each dimension.
fn places(plane: &[Occurring], dimensions: &[(u8, Vec<i32>)]) -> Vec<Range<usize>> {
    let places = |(occurring, (_, cuts)): (&Occurring, &(u8, Vec<i32>))| {
        let missing = cuts.len() + 1;
        match occurring {
            Occurring::Any => 0..missing + 1,
            Occurring::Known => 0..missing,
            Occurring::Only(value) => {
                let place = cuts.partition_point(|cut| cut <= value);
                place..place + 1
            }
            Occurring::Missing => missing..missing + 1,
        }
    };
    plane.iter().zip(dimensions).map(places).collect()
}

/// Adds `value` to the cells of a plane that lie within all spans.
fn fill<T: Copy + AddAssign>(cells: &mut [T], plane: &[Range<usize>], spans: &[Span], value: T) {
    let ([places, planes @ ..], [span, spans @ ..]) = (plane, spans) else {
        cells.iter_mut().for_each(|cell| *cell += value);
        return;
    };
    let stride = cells.len() / places.len();
    let mut add = |part: Range<usize>| {
        if part.start >= part.end {
            return;
        }
        let part = &mut cells[(part.start - places.start) * stride..(part.end - places.start) * stride];
        if planes.is_empty() {
            part.iter_mut().for_each(|cell| *cell += value);
        } else {
            part.chunks_mut(stride).for_each(|row| fill(row, planes, spans, value));
        }
    };
    add(span.places.start.max(places.start)..span.places.end.min(places.end));
    if let Some(place) = span.missing.filter(|place| places.contains(place)) {
        add(place..place + 1);
    }
}
