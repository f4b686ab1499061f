//! Ranks: which columns there are, and where each split's threshold stands in its own.

use super::forest::{Branch, Forest, Split};
use palpate_shared::format::{Axis, Columns};

/// The most thresholds of an axis: its ranks fit a byte.
const MAX_CUTS: usize = 255;

/// Feature, threshold, and true if a missing value goes left.
pub(super) type Key = (u8, i32, bool);

/// The axes of a forest: each feature's thresholds, in lists of at most 255.
pub(super) struct Axes {
    pub(super) axes: Vec<(Axis, Vec<i32>)>,
    /// In order: a split's feature, threshold and direction of missing values; its column and the rank above which it goes
    /// right.
    places: Vec<(Key, (usize, u8))>,
    pub(super) columns: usize,
}

impl Axes {
    pub(super) fn new(forest: &Forest<'_>) -> Self {
        let mut axes = Self { axes: Vec::new(), places: Vec::new(), columns: 0 };
        for splits in different_splits(forest).chunk_by(|a, b| a.0 == b.0) {
            let both: Vec<&[Key]> = splits.chunk_by(|a, b| a.1 == b.1).collect();
            both.chunks(MAX_CUTS).for_each(|both| axes.push(both));
        }
        axes
    }

    /// Adds an axis: the splits of one feature at each of its thresholds.
    fn push(&mut self, splits: &[&[Key]]) {
        let Some(&&[(feature, ..), ..]) = splits.first() else { return };
        let cuts: Vec<i32> = splits.iter().map(|both| both[0].1).collect();
        let used = |left: bool| splits.iter().any(|both| both.iter().any(|split| split.2 == left));
        let columns = match (used(true), used(false)) {
            (true, true) => Columns::Both,
            (false, true) => Columns::MissingRight,
            (_, false) => Columns::MissingLeft,
        };
        let right_column = self.columns + usize::from(columns == Columns::Both);
        for (index, &cut) in (0..=u8::MAX).zip(&cuts) {
            self.places.push(((feature, cut, false), (right_column, index)));
            self.places.push(((feature, cut, true), (self.columns, index)));
        }
        self.columns += usize::from(columns.count());
        let axis = Axis { feature, columns, width: width(&cuts), count: cuts.len() as u8 };
        self.axes.push((axis, cuts));
    }

    /// The column of a split and the rank above which it goes right.
    pub(super) fn place(&self, split: &Split<'_>) -> (usize, u8) {
        let key = (split.feature, split.cut, split.missing_left);
        self.places[self.places.partition_point(|(place, _)| *place < key)].1
    }

    /// All thresholds, each once.
    pub(super) fn cuts(&self) -> Vec<i32> {
        let mut cuts: Vec<i32> = self.axes.iter().flat_map(|(_, cuts)| cuts).copied().collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    }
}

/// The different splits of a forest, in order.
pub(super) fn different_splits(forest: &Forest<'_>) -> Vec<Key> {
    let mut splits = Vec::new();
    for tree in &forest.trees {
        visit(&tree.root, &mut |split| splits.push((split.feature, split.cut, split.missing_left)));
    }
    splits.sort_unstable();
    splits.dedup();
    splits
}

/// Bytes per threshold: two where every threshold fits them and the next axis's are then aligned like these, else four.
/// Other widths are read, too, but byte by byte.
fn width(cuts: &[i32]) -> u8 {
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
