//! Fewer trees with the same sums: what a tree without splits adds goes into the base, and trees of one split, for one
//! object and over one feature, become one tree.
//!
//! Exact: integers are added, and integers come out. Sums of f32 depend on their order, so trees with f32 leaves stay as
//! they are.

use super::forest::{Branch, Branches, Forest, Split};
use super::quantize::Scale;
use crate::ensemble::Output;
use palpate_shared::format::LeafType;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest number of thresholds of a merged tree, which is then no deeper than a complete tree may be.
const MAX_CUTS: usize = 255;

/// A forest whose sums are those of another one that may have more trees.
pub(super) struct Merged<'a> {
    pub(super) forest: Forest<'a>,
    pub(super) scale: Scale,
    /// Base margins: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    /// For each tree, the trees of the ensemble that it replaces.
    pub(super) sources: Vec<Source>,
}

/// The trees of an ensemble that one tree of a model replaces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Source {
    /// Their numbers.
    pub(crate) trees: Vec<usize>,
    /// Amount by which they add more than the model's tree, in units times 2^shift of its leaves; the base includes it.
    pub(crate) offset: i32,
}

/// A tree of one split.
struct Stump<'f> {
    tree: usize,
    split: &'f Split<'f>,
    /// Leaves in units times 2^shift.
    left: i64,
    right: i64,
}

/// Sums of stumps over one feature, constant from each threshold to the next.
struct Steps {
    cuts: Vec<i32>,
    values: Vec<i64>,
}

/// Replaces trees by fewer ones with the same sums.
pub(super) fn merge<'a>(forest: &Forest<'a>, leaf: LeafType, scale: &Scale) -> Merged<'a> {
    let largest_leaf = match leaf {
        LeafType::I8 => 127,
        LeafType::I16 => 32767,
        LeafType::F32 => {
            return Merged {
                forest: Forest { trees: forest.trees.clone(), ..*forest },
                scale: scale.clone(),
                base: forest.base.iter().map(|base| base.to_bits().cast_signed()).collect(),
                sources: (0..forest.trees.len()).map(Source::tree).collect(),
            };
        }
    };
    let integer = |tree: usize, value: f32| scale.integer(value, scale.shifts[tree]);
    let mut base: Vec<i32> = forest.base.iter().map(|&base| scale.integer(base, 0)).collect();
    let mut stumps: BTreeMap<(usize, u8, bool, u8), Vec<Stump<'_>>> = BTreeMap::new();
    // By the first of their trees.
    let mut kept: BTreeMap<usize, (Source, Arc<Branches<'a>>, u8)> = BTreeMap::new();
    for (index, tree) in forest.trees.iter().enumerate() {
        let shift = scale.shifts[index];
        match (&tree.root, tree.output) {
            (Branch::Leaf(values), output) => {
                let first = if let Output::One(object) = output { object } else { 0 };
                for (base, &value) in base[first..].iter_mut().zip(values.iter()) {
                    *base += integer(index, value) << shift;
                }
            }
            (Branch::Split(split), Output::One(object)) => match (&split.left, &split.right) {
                (Branch::Leaf(left), Branch::Leaf(right)) => {
                    let [left, right] = [left[0], right[0]].map(|value| i64::from(integer(index, value)));
                    let key = (object, split.feature, split.missing_left, shift);
                    stumps.entry(key).or_default().push(Stump { tree: index, split, left, right });
                }
                _ => _ = kept.insert(index, (Source::tree(index), tree.clone(), shift)),
            },
            (Branch::Split(_), Output::Each) => _ = kept.insert(index, (Source::tree(index), tree.clone(), shift)),
        }
    }
    for ((object, feature, missing_left, shift), stumps) in stumps {
        for group in groups(&stumps, largest_leaf) {
            let first = group[0].tree;
            if group.len() == 1 {
                kept.insert(first, (Source::tree(first), forest.trees[first].clone(), shift));
                continue;
            }
            let steps = Steps::of(group);
            let offset = steps.offset(largest_leaf);
            base[object] += (offset as i32) << shift;
            let value = |sum: i64| ((sum - offset) as f64 * f64::from(scale.unit) * f64::from(1_u32 << shift)) as f32;
            let values: Vec<f32> = steps.values.iter().map(|&sum| value(sum)).collect();
            let tree = balanced(&steps.cuts, &values, feature, missing_left, object);
            let source = Source { trees: group.iter().map(|stump| stump.tree).collect(), offset: offset as i32 };
            kept.insert(first, (source, Arc::new(tree), shift));
        }
    }
    let mut merged = Merged {
        forest: Forest { trees: Vec::new(), ..*forest },
        scale: Scale { unit: scale.unit, shifts: Vec::new() },
        base,
        sources: Vec::new(),
    };
    for (source, tree, shift) in kept.into_values() {
        merged.forest.trees.push(tree);
        merged.scale.shifts.push(shift);
        merged.sources.push(source);
    }
    merged
}

impl Source {
    /// The source of a tree that is kept as it is.
    fn tree(tree: usize) -> Self {
        Self { trees: vec![tree], offset: 0 }
    }
}

/// Divides stumps, in their order, into groups: the sums of each fit the leaves of one tree.
fn groups<'s, 'f>(mut stumps: &'s [Stump<'f>], largest_leaf: i64) -> Vec<&'s [Stump<'f>]> {
    let mut groups = Vec::new();
    while !stumps.is_empty() {
        // Stops at the first stump that does not fit, although more of them together might fit again.
        let mut count = 1;
        while count < stumps.len() && Steps::of(&stumps[..count + 1]).fits(largest_leaf) {
            count += 1;
        }
        let (group, rest) = stumps.split_at(count);
        groups.push(group);
        stumps = rest;
    }
    groups
}

impl Steps {
    fn of(stumps: &[Stump<'_>]) -> Self {
        let mut changes: BTreeMap<i32, i64> = BTreeMap::new();
        for stump in stumps {
            *changes.entry(stump.split.cut).or_default() += stump.right - stump.left;
        }
        let mut sum: i64 = stumps.iter().map(|stump| stump.left).sum();
        let (mut cuts, mut values) = (Vec::new(), vec![sum]);
        for (cut, change) in changes.into_iter().filter(|(_, change)| *change != 0) {
            sum += change;
            cuts.push(cut);
            values.push(sum);
        }
        Self { cuts, values }
    }

    fn range(&self) -> (i64, i64) {
        let first = self.values[0];
        self.values.iter().fold((first, first), |(low, high), &value| (low.min(value), high.max(value)))
    }

    fn fits(&self, largest_leaf: i64) -> bool {
        let (low, high) = self.range();
        // A merged tree has a threshold: trees without one are in the base.
        (1..=MAX_CUTS).contains(&self.cuts.len()) && high - low <= 2 * largest_leaf
    }

    /// Amount to subtract from all values so that leaves hold them; 0 if they do already.
    fn offset(&self, largest_leaf: i64) -> i64 {
        let (low, high) = self.range();
        if low < -largest_leaf || high > largest_leaf { (low + high).div_euclid(2) } else { 0 }
    }
}

/// Makes the shallowest tree with these thresholds and values.
fn balanced<'a>(cuts: &[i32], values: &[f32], feature: u8, missing_left: bool, object: usize) -> Branches<'a> {
    fn branch<'a>(cuts: &[i32], values: &[f32], feature: u8, missing_left: bool) -> Branch<'a> {
        let middle = cuts.len() / 2;
        let Some(&cut) = cuts.get(middle) else { return Branch::Leaf(Cow::Owned(vec![values[0]])) };
        let left = branch(&cuts[..middle], &values[..=middle], feature, missing_left);
        let right = branch(&cuts[middle + 1..], &values[middle + 1..], feature, missing_left);
        let split = Split { feature, cut, missing_left, left, right, left_splits: middle };
        Branch::Split(Box::new(split))
    }
    let root = branch(cuts, values, feature, missing_left);
    let largest = values.iter().fold(0.0, |largest: f32, value| largest.max(value.abs()));
    Branches { root, output: Output::One(object), splits: cuts.len(), largest }
}

#[cfg(test)]
mod tests {
    use super::super::container::groups_and_splits;
    use super::super::{Leaf, Settings, compile, open};
    use crate::compile::code::tests::Numbers;
    use crate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};
    use palpate_shared::MISSING_FEATURE;
    use palpate_shared::format::f32_key;

    fn leaf(value: f32) -> Node {
        Node::Leaf(vec![value])
    }

    /// Random trees of no split, one split and two, of three objects over four features; every fourth of thresholds that
    /// come again.
    fn random(seed: u64, trees: usize, largest: f32) -> Ensemble {
        let mut random = Numbers(seed);
        let trees = (0..trees).map(|_| {
            let [a, b, c] = [0; 3].map(|_| leaf(largest * (random.below(20_001) as f32 / 10_000.0 - 1.0)));
            let mut split = |left, right| Node::Split {
                feature: random.below(4) as usize,
                threshold: random.below(16) as f32 - 8.0,
                missing_left: random.below(10) < 7,
                left,
                right,
            };
            let nodes = match split(0, 0) {
                Node::Split { threshold: 0.0, .. } => vec![a],
                Node::Split { feature: 3, .. } => vec![split(1, 2), split(3, 4), a, b, c],
                _ => vec![split(1, 2), a, b],
            };
            Tree { nodes, output: Output::One(random.below(3) as usize) }
        });
        Ensemble {
            inputs: Inputs::unnamed(4),
            objects: ["a", "b", "c"].map(String::from).into(),
            base_margins: vec![0.5, -0.25, 0.0],
            trees: trees.collect(),
            origin: Provenance::default(),
        }
    }

    /// Integers that the leaves of every tree are rounded to add up to what a model gives, at every threshold.
    #[test]
    fn a_model_of_merged_trees_gives_the_sums_of_all_trees() {
        for (seed, count, largest, kind) in
            [(1, 300, 0.5, Leaf::I16), (2, 300, 0.5, Leaf::I8), (3, 12, 0.1, Leaf::I16), (4, 600, 0.01, Leaf::I16)]
        {
            let ensemble = random(seed, count, largest);
            let settings = Settings { leaf: kind, ..Settings::default() };
            let compiled = compile(&ensemble, &settings).unwrap();
            let model = open(&compiled.bytes).unwrap();
            let forest = super::Forest::new(&ensemble, None).unwrap();
            let scale = super::Scale::for_trees(&forest, kind).unwrap();
            let mut rows = Numbers(9);
            for _ in 0..300 {
                let row: [f32; 4] = std::array::from_fn(|_| match rows.below(19) {
                    18 => f32::NAN,
                    whole => whole as f32 - 9.0,
                });
                let mut expected: Vec<i32> = ensemble.base_margins.iter().map(|base| scale.integer(*base, 0)).collect();
                for (index, tree) in ensemble.trees.iter().enumerate() {
                    let Output::One(object) = tree.output else { unreachable!() };
                    let shift = scale.shifts[index];
                    expected[object] += scale.integer(tree.leaf(&row)[0], shift) << shift;
                }
                let keys = row.map(|value| if value.is_nan() { MISSING_FEATURE } else { f32_key(value) });
                let mut margins = [0; 3];
                assert!(model.margins_of(&keys, &mut margins));
                assert_eq!(margins[..], expected, "{row:?}, {kind:?}");
            }
        }
    }

    #[test]
    fn stumps_become_fewer_trees_and_constants_none() {
        let ensemble = random(5, 300, 0.001);
        let forest = super::Forest::new(&ensemble, None).unwrap();
        let scale = super::Scale::for_trees(&forest, Leaf::I16).unwrap();
        let merged = super::merge(&forest, Leaf::I16, &scale);
        assert!(merged.forest.trees.len() < 200, "{}", merged.forest.trees.len());
        let mut all: Vec<usize> = merged.sources.iter().flat_map(|source| source.trees.clone()).collect();
        all.sort_unstable();
        let splits = (0..300).filter(|&tree| ensemble.trees[tree].nodes.len() > 1);
        assert!(all.into_iter().eq(splits), "every tree with a split is in one place");
        // With leaves as the trainer left them nothing is added up beforehand.
        let kept = super::merge(&forest, Leaf::F32, &scale).sources;
        assert!(kept.into_iter().eq((0..300).map(super::Source::tree)));
    }

    #[test]
    fn the_household_model_has_nothing_to_merge() {
        let bytes = include_bytes!("../../../../models/household.palpate");
        let model = open(bytes).unwrap();
        let groups = groups_and_splits(&model).0;
        assert!(groups.iter().all(|group| group.object.is_none()), "a leaf has a value for each object");
    }
}
