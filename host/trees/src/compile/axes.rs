//! Ranks: which columns there are, and where each split's threshold stands in its own.

use super::forest::{Branch, Forest, Split};
use palpate_shared::format::{Axis, Columns};
use std::collections::{BTreeMap, BTreeSet};

/// The most thresholds of an axis: its ranks fit a byte.
const MAX_CUTS: usize = 255;

/// The axes of a forest: each feature's thresholds, in lists of at most 255.
pub(super) struct Axes {
    pub(super) axes: Vec<(Axis, Vec<i32>)>,
    /// The column of a split and the rank above which it goes right, by (feature, threshold, missing goes left).
    places: BTreeMap<(u8, i32, bool), (usize, u8)>,
    pub(super) columns: usize,
}

impl Axes {
    pub(super) fn new(forest: &Forest<'_>) -> Self {
        let mut splits = BTreeSet::new();
        for tree in &forest.trees {
            visit(&tree.root, &mut |split| {
                splits.insert((split.feature, split.cut, split.missing_left));
            });
        }
        let mut features: BTreeMap<u8, BTreeSet<i32>> = BTreeMap::new();
        for &(feature, cut, _) in &splits {
            features.entry(feature).or_default().insert(cut);
        }
        let mut axes = Self { axes: Vec::new(), places: BTreeMap::new(), columns: 0 };
        for (feature, cuts) in features {
            let cuts: Vec<i32> = cuts.into_iter().collect();
            for cuts in cuts.chunks(MAX_CUTS) {
                axes.push(feature, cuts, &splits);
            }
        }
        axes
    }

    fn push(&mut self, feature: u8, cuts: &[i32], splits: &BTreeSet<(u8, i32, bool)>) {
        let used = |left: bool| cuts.iter().any(|&cut| splits.contains(&(feature, cut, left)));
        let columns = match (used(true), used(false)) {
            (true, true) => Columns::Both,
            (false, true) => Columns::MissingRight,
            (_, false) => Columns::MissingLeft,
        };
        let right_column = self.columns + usize::from(columns == Columns::Both);
        for (index, &cut) in (0..=u8::MAX).zip(cuts) {
            self.places.insert((feature, cut, true), (self.columns, index));
            self.places.insert((feature, cut, false), (right_column, index));
        }
        self.columns += usize::from(columns.count());
        let axis = Axis { feature, columns, width: width(cuts), count: cuts.len() as u8 };
        self.axes.push((axis, cuts.to_vec()));
    }

    /// The column of a split and the rank above which it goes right.
    pub(super) fn place(&self, split: &Split<'_>) -> (usize, u8) {
        self.places[&(split.feature, split.cut, split.missing_left)]
    }
}

/// Bytes per threshold: two where every threshold fits them and the next axis's are then aligned like these, else four.
/// Other widths are read, too, but byte by byte.
pub(super) fn width(cuts: &[i32]) -> u8 {
    let narrow = cuts.len().is_multiple_of(2) && cuts.iter().all(|&cut| i16::try_from(cut).is_ok());
    if narrow { 2 } else { 4 }
}

/// The thresholds' bytes.
pub(super) fn cuts_bytes(axis: Axis, cuts: &[i32]) -> impl Iterator<Item = u8> {
    cuts.iter().flat_map(move |cut| cut.to_le_bytes().into_iter().take(usize::from(axis.width)))
}

/// Calls `see` on every split of a tree, in preorder.
pub(super) fn visit<'f>(branch: &'f Branch<'f>, see: &mut impl FnMut(&'f Split<'f>)) {
    if let Branch::Split(split) = branch {
        see(split);
        visit(&split.left, see);
        visit(&split.right, see);
    }
}
