//! An ensemble that was checked, with thresholds as the integers that the chip compares.

use crate::ensemble::{
    Ensemble, Inputs, MAX_FEATURES, MAX_OBJECTS, Node, Output, Schema, Threshold, Tree, check_leaf, faults,
};
use crate::error::{Error, Result, problem};
use palpate_shared::format::{Key, f32_key};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Margins beyond ± this many nats are refused: e^16384 is sure enough.
pub(super) const MARGIN_RANGE: f64 = 16384.0;

/// Trees deeper than this are refused.
const MAX_DEPTH: usize = 256;

/// A checked ensemble.
pub(super) struct Forest<'a> {
    pub(super) base: &'a [f32],
    pub(super) names: &'a [String],
    pub(super) trees: Vec<Arc<Branches<'a>>>,
    pub(super) features: usize,
    pub(super) key: Key,
    pub(super) schema: Option<Schema>,
}

/// A tree of a checked ensemble.
pub(super) struct Branches<'a> {
    pub(super) root: Branch<'a>,
    pub(super) output: Output,
    pub(super) splits: usize,
    /// The largest absolute value of a leaf.
    pub(super) largest: f32,
}

/// A split or a leaf.
pub(super) enum Branch<'a> {
    Leaf(Cow<'a, [f32]>),
    Split(Box<Split<'a>>),
}

/// A split: left if the feature's key is below `cut`.
pub(super) struct Split<'a> {
    pub(super) feature: u8,
    pub(super) cut: i32,
    pub(super) missing_left: bool,
    pub(super) left: Branch<'a>,
    pub(super) right: Branch<'a>,
    /// Splits in the left subtree.
    pub(super) left_splits: usize,
}

impl<'a> Forest<'a> {
    pub(super) fn new(ensemble: &'a Ensemble, scales: Option<&'a [f32]>) -> Result<Self> {
        let objects = ensemble.objects.len();
        let base_margins = ensemble.base_margins.len();
        if !(1..=MAX_OBJECTS).contains(&objects) || base_margins != objects {
            return Err(problem!("cannot compile an ensemble of {objects} objects and {base_margins} base margins")
                .fix("Give 1 to 256 objects, and one base margin for each."));
        }
        let features = ensemble.inputs.count();
        if !(1..=MAX_FEATURES).contains(&features) {
            return Err(problem!(
                "cannot compile an ensemble over {features} features, which is not 1 to {MAX_FEATURES}"
            )
            .fix(format!("Train on the features that matter, at most {MAX_FEATURES}.")));
        }
        let thresholds = Thresholds::new(&ensemble.inputs, scales)?;
        thresholds.check_range(ensemble)?;
        let mut trees = Vec::with_capacity(ensemble.trees.len());
        for (index, tree) in ensemble.trees.iter().enumerate() {
            let place = |error: Error| {
                error
                    .within(format_args!("cannot compile the ensemble: tree {index}: "))
                    .fix("Train it again, or check the program that wrote it.")
            };
            let values = match tree.output {
                Output::One(object) if object < objects => 1,
                Output::One(object) => return Err(place(faults::object(object, objects))),
                Output::Each => objects,
            };
            let exact_threshold = |node| ensemble.threshold(index, node);
            let mut reader = Reader {
                tree,
                exact_threshold: &exact_threshold,
                values,
                features,
                thresholds,
                left: tree.nodes.len(),
                largest: 0.0,
            };
            let (root, splits) = reader.branch(0, 0).map_err(place)?;
            trees.push(Arc::new(Branches { root, output: tree.output, splits, largest: reader.largest }));
        }
        let forest = Self {
            base: &ensemble.base_margins,
            names: &ensemble.objects,
            trees,
            features,
            key: thresholds.key(),
            schema: ensemble.schema().copied(),
        };
        forest.check_range()?;
        if let Some(schema) = &forest.schema {
            check_thresholds(ensemble, schema)?;
        }
        Ok(forest)
    }

    pub(super) fn objects(&self) -> usize {
        self.base.len()
    }

    pub(super) fn splits(&self) -> usize {
        self.trees.iter().map(|tree| tree.splits).sum()
    }

    pub(super) fn leaves(&self) -> usize {
        self.trees.iter().map(|tree| tree.splits + 1).sum()
    }

    /// Every value of every leaf.
    pub(super) fn leaf_values(&self) -> impl Iterator<Item = f32> + Clone {
        let mut open: Vec<&Branch<'a>> = self.trees.iter().map(|tree| &tree.root).collect();
        let leaves = std::iter::from_fn(move || {
            loop {
                match open.pop()? {
                    Branch::Leaf(values) => return Some(values.as_ref()),
                    Branch::Split(split) => open.extend([&split.left, &split.right]),
                }
            }
        });
        leaves.flatten().copied()
    }

    /// Largest distance of an object's margin from 0.
    pub(super) fn range(&self, object: usize) -> f64 {
        let base = f64::from(self.base[object].abs());
        self.trees_of(object).map(|tree| f64::from(tree.largest)).sum::<f64>() + base
    }

    /// The trees that add to an object's margin.
    pub(super) fn trees_of(&self, object: usize) -> impl Iterator<Item = &Branches<'a>> {
        self.trees.iter().map(Arc::as_ref).filter(move |tree| tree.values_for(object))
    }

    fn check_range(&self) -> Result<()> {
        for object in 0..self.objects() {
            let range = self.range(object);
            if range.is_nan() || range > MARGIN_RANGE {
                let largest = self.trees.iter().map(|tree| tree.largest).fold(self.base[object].abs(), f32::max);
                let kind = if self.schema.is_some() { "object" } else { "class" };
                let name = self.names.get(object).map_or("", String::as_str);
                return Err(problem!(
                    "cannot compile the ensemble: the margin of the {kind} {name} can reach {range:e} (the largest single \
                     value is {largest:e}), beyond the {MARGIN_RANGE} that a model can hold"
                )
                .fix(
                    "Margins are log-probabilities, and a few dozen nats already mean certainty: train it again, or check \
                     the program that wrote it.",
                ));
            }
        }
        Ok(())
    }
}

impl Branches<'_> {
    /// True if the tree adds to an object's margin.
    pub(super) fn values_for(&self, object: usize) -> bool {
        match self.output {
            Output::One(output) => output == object,
            Output::Each => true,
        }
    }

    /// Value of a leaf for an object.
    pub(super) fn value_of(&self, object: usize, leaf: &[f32]) -> f32 {
        match self.output {
            Output::One(_) => leaf[0],
            Output::Each => leaf[object],
        }
    }
}

struct Reader<'a, 'r> {
    tree: &'a Tree,
    /// The threshold of a node as the file has it.
    exact_threshold: &'r dyn Fn(usize) -> Option<Threshold>,
    values: usize,
    features: usize,
    thresholds: Thresholds<'a>,
    /// Nodes that may still be visited: one more is a node with two parents, or a loop.
    left: usize,
    largest: f32,
}

impl<'a> Reader<'a, '_> {
    /// A branch and its splits.
    fn branch(&mut self, index: usize, depth: usize) -> Result<(Branch<'a>, usize)> {
        if depth > MAX_DEPTH {
            return Err(problem!("it is deeper than {MAX_DEPTH} splits"));
        }
        let nodes = self.tree.nodes.len();
        let node = self.tree.nodes.get(index).ok_or_else(faults::no_nodes)?;
        self.left = self.left.checked_sub(1).ok_or_else(|| faults::reached_twice(index))?;
        match node {
            Node::Leaf(values) => {
                check_leaf(index, values, self.values)?;
                self.largest = values.iter().fold(self.largest, |largest, value| largest.max(value.abs()));
                Ok((Branch::Leaf(Cow::Borrowed(values)), 0))
            }
            &Node::Split { feature, threshold, missing_left, left, right } => {
                let features = self.features;
                let number = u8::try_from(feature).ok().filter(|_| feature < features);
                let number = number.ok_or_else(|| faults::feature(index, feature, features))?;
                if threshold.is_nan() {
                    return Err(faults::threshold(index, threshold));
                }
                for (side, child) in [("left", left), ("right", right)] {
                    if child >= nodes {
                        return Err(faults::child(index, side, child, nodes));
                    }
                }
                let (left, left_splits) = self.branch(left, depth + 1)?;
                let (right, right_splits) = self.branch(right, depth + 1)?;
                let exact = (self.exact_threshold)(index).unwrap_or(Threshold::below(f64::from(threshold)));
                let split = match self.thresholds.cut(feature, threshold, exact) {
                    Some(cut) => Split { feature: number, cut, missing_left, left, right, left_splits },
                    // Every number goes left: with the sides exchanged, no number is below the smallest one.
                    None => Split {
                        feature: number,
                        cut: -i32::MAX,
                        missing_left: !missing_left,
                        left: right,
                        right: left,
                        left_splits: right_splits,
                    },
                };
                Ok((Branch::Split(Box::new(split)), 1 + left_splits + right_splits))
            }
        }
    }
}

/// Rule that turns thresholds into integers.
#[derive(Clone, Copy)]
pub(super) enum Thresholds<'a> {
    /// Features are whole numbers.
    Whole,
    /// Features are f32 values, compared by their keys.
    Real,
    /// Features are whole numbers, values times these scales.
    Scaled(&'a [f32]),
}

impl<'a> Thresholds<'a> {
    fn new(inputs: &Inputs, scales: Option<&'a [f32]>) -> Result<Self> {
        let features = inputs.count();
        match (inputs, scales) {
            (Inputs::Computed(_), None) => Ok(Self::Whole),
            (Inputs::Rows(_), None) => Ok(Self::Real),
            (Inputs::Rows(_), Some(scales))
                if scales.len() == features && scales.iter().all(|scale| scale.is_finite() && *scale > 0.0) =>
            {
                Ok(Self::Scaled(scales))
            }
            (_, Some(scales)) => {
                let text = scales.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
                let allowed = match inputs {
                    Inputs::Computed(schema) => format!("none: features of {} are whole numbers", schema.of),
                    Inputs::Rows(_) => format!("{features} positive numbers, one for each feature"),
                };
                Err(Error::setting("scales", text, allowed))
            }
        }
    }

    /// Returns an error unless whole thresholds fit 32 bits: beyond, all values would be the same. Those that part missing
    /// values from all others may be anywhere.
    fn check_range(self, ensemble: &Ensemble) -> Result<()> {
        let Self::Scaled(scales) = self else { return Ok(()) };
        for (number, tree) in ensemble.trees.iter().enumerate() {
            for (index, node) in tree.nodes.iter().enumerate() {
                let &Node::Split { feature, threshold, .. } = node else { continue };
                let Some(&scale) = scales.get(feature) else { continue };
                let is_beyond_all = ensemble.threshold(number, index).is_some_and(Threshold::is_beyond_all);
                let units = (f64::from(threshold) * f64::from(scale)).abs();
                if units > f64::from(i32::MAX - 1) && !is_beyond_all {
                    let name = ensemble.inputs.names().get(feature).map(ToString::to_string).unwrap_or_default();
                    let allowed = format!("a smaller scale: its threshold {threshold} is beyond 2^31 units");
                    return Err(Error::setting("scales", format!("{scale} for {name}"), allowed));
                }
            }
        }
        Ok(())
    }

    fn key(self) -> Key {
        match self {
            Self::Real => Key::Real,
            Self::Whole | Self::Scaled(_) => Key::Whole,
        }
    }

    /// The integer threshold that splits keys as `threshold` splits the values of `feature`; `own` is the same as the
    /// file has it. `None` if every number goes left.
    fn cut(self, feature: usize, threshold: f32, own: Threshold) -> Option<i32> {
        // `as` keeps a value beyond an i32 at its limits; -2^31 is a missing value.
        let whole = |threshold: f64| (threshold.ceil() as i32).max(i32::MIN + 1);
        match self {
            Self::Whole => Some(whole(f64::from(threshold))),
            Self::Real => Some(f32_key(threshold)),
            Self::Scaled(_) if own.is_beyond_all() && own.value > 0.0 => None,
            Self::Scaled(scales) => Some(whole(own.units(scales[feature]))),
        }
    }
}

/// Calls `see` on the values of every leaf, from left to right.
pub(super) fn each_leaf<'f>(branch: &'f Branch<'f>, see: &mut impl FnMut(&'f [f32])) {
    match branch {
        Branch::Leaf(values) => see(values),
        Branch::Split(split) => {
            each_leaf(&split.left, see);
            each_leaf(&split.right, see);
        }
    }
}

/// Refuses an ensemble that was trained on fractions, such as times in seconds: its thresholds move when they become
/// whole numbers. Trainers put thresholds at values of the data, which are whole, or halfway between two; and XGBoost's
/// outermost ones at twice a value and 1e-5 more.
fn check_thresholds(ensemble: &Ensemble, schema: &Schema) -> Result<()> {
    for (feature, &name) in schema.features.iter().enumerate() {
        let splits = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match *node {
            Node::Split { feature: own, threshold, .. } if own == feature => Some(threshold),
            _ => None,
        });
        let mut thresholds: Vec<f32> = splits.collect();
        thresholds.sort_unstable_by(f32::total_cmp);
        thresholds.dedup();
        if let Some(&example) = thresholds.iter().find(|&&threshold| is_fraction(threshold)) {
            let whole = thresholds
                .iter()
                .map(|&threshold| Thresholds::Whole.cut(feature, threshold, Threshold::below(threshold.into())));
            let rounded = whole.collect::<BTreeSet<_>>().len();
            let thresholds = thresholds.len();
            let Schema { of, whole, units, .. } = *schema;
            return Err(problem!(
                "the ensemble was not trained on whole numbers: the threshold {example} of {name} is neither whole nor \
                 halfway between two, and of {thresholds} thresholds {rounded} stay different when rounded to {whole}"
            )
            .fix(format!(
                "Train on features in whole units: {units}. If it is not a model of {of}, remove its attribute \
                 palpate_descriptor: then its features are compared as they are."
            )));
        }
    }
    Ok(())
}

/// True if the threshold shows that values are not whole numbers: between those, trainers put thresholds at whole or
/// half numbers, up to rounding in f32.
fn is_fraction(threshold: f32) -> bool {
    let from_whole = |number: f64| (number - number.round()).abs();
    let value = f64::from(threshold);
    let slack = 1e-6 * (2.0 * value).abs().max(1.0);
    let outermost = (value.abs() - 1e-5) / 2.0;
    from_whole(2.0 * value) > slack && from_whole(outermost) > slack
}
