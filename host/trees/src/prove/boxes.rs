//! Boxes of rows: for each feature an interval of keys, and whether a missing value is in it.

use crate::ensemble::Threshold;
use crate::error::{Error, Result, problem};
use palpate_shared::format::f32_key;

/// Values of a feature: keys from `low` to `high`, both included, and perhaps a missing one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Values {
    pub(super) low: i64,
    pub(super) high: i64,
    pub(super) missing: bool,
}

impl Values {
    /// No value but a missing one.
    pub(super) const MISSING: Self = Self { low: 1, high: 0, missing: true };

    pub(super) const fn of(low: i64, high: i64, missing: bool) -> Self {
        Self { low, high, missing }
    }

    fn is_empty(self) -> bool {
        self.low > self.high && !self.missing
    }
}

/// Rule of a split: left if the key is below `cut`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule {
    pub(super) feature: usize,
    pub(super) cut: i64,
    pub(super) missing_left: bool,
}

impl Rule {
    /// A split by a column that is not there: no tree needs it, and nothing says where it goes.
    pub(super) const EITHER: Self = Self { feature: usize::MAX, cut: 0, missing_left: true };

    /// The values that go left, and those that go right.
    fn sides(self, Values { low, high, missing }: Values) -> [Values; 2] {
        [
            Values { low, high: high.min(self.cut - 1), missing: missing && self.missing_left },
            Values { low: low.max(self.cut), high, missing: missing && !self.missing_left },
        ]
    }
}

/// Rows: every combination of the values of each feature.
pub(super) type Rows = [Values];

/// Calls `see` with the rows that go left (0) and those that go right (1), if there are any; `rows` are the same
/// afterwards. Stops at the first error.
pub(super) fn sides<E>(
    rows: &mut Rows,
    rule: Rule,
    mut see: impl FnMut(usize, &mut Rows) -> Result<(), E>,
) -> Result<(), E> {
    if rule.feature == Rule::EITHER.feature {
        return see(0, rows).and_then(|()| see(1, rows));
    }
    // A feature that no row has is missing.
    let Some(&before) = rows.get(rule.feature) else { return see(usize::from(!rule.missing_left), rows) };
    for (side, values) in rule.sides(before).into_iter().enumerate() {
        if !values.is_empty() {
            rows[rule.feature] = values;
            let done = see(side, rows);
            rows[rule.feature] = before;
            done?;
        }
    }
    Ok(())
}

/// Handler of a leaf's values, and of the rows that reach it.
pub(super) type See<'s, E> = dyn FnMut(&[f64], &mut Rows) -> Result<(), E> + 's;

/// A tree whose leaves have values in nats, or in the unit of the library's margins.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Step>,
    /// The object of trees with one value in a leaf.
    pub(super) object: Option<usize>,
}

/// A split, with the numbers of its two children, or a leaf.
#[derive(Debug)]
pub(super) enum Step {
    Split(Rule, [usize; 2]),
    Leaf(Vec<f64>),
}

/// Bytes that are accepted as a model and break its format.
pub(super) fn no_model(what: &str) -> Error {
    problem!("the model does not follow its format: {what}").fix("Export the model again.")
}

/// Splits above a leaf, at most: as many as the compiler takes.
const DEEPEST: usize = 256;

impl Tree {
    /// A tree whose first node is its root.
    ///
    /// # Errors
    /// If it is too deep to be walked, or its nodes do not make a tree.
    pub(super) fn new(nodes: Vec<Step>, object: Option<usize>) -> Result<Self> {
        let (mut open, mut seen) = (vec![(0, 0)], 0);
        while let Some((at, depth)) = open.pop() {
            seen += 1;
            let node = nodes.get(at).filter(|_| seen <= nodes.len());
            match node.ok_or_else(|| no_model("nodes that are no tree"))? {
                Step::Split(..) if depth == DEEPEST => return Err(no_model("a tree of more than 256 levels")),
                Step::Split(_, children) => open.extend(children.map(|child| (child, depth + 1))),
                Step::Leaf(_) => {}
            }
        }
        Ok(Self { nodes, object })
    }

    /// The most splits above a leaf.
    pub(super) fn depth(&self) -> usize {
        let (mut open, mut deepest) = (vec![(0, 0)], 0);
        while let Some((at, depth)) = open.pop() {
            deepest = deepest.max(depth);
            if let Step::Split(_, children) = &self.nodes[at] {
                open.extend(children.map(|child| (child, depth + 1)));
            }
        }
        deepest
    }

    /// Calls `see` on each leaf that some of `rows` reach, with these rows.
    pub(super) fn leaves<E>(&self, rows: &mut Rows, see: &mut See<'_, E>) -> Result<(), E> {
        self.below(0, rows, see)
    }

    fn below<E>(&self, at: usize, rows: &mut Rows, see: &mut See<'_, E>) -> Result<(), E> {
        match &self.nodes[at] {
            Step::Leaf(values) => see(values, rows),
            Step::Split(rule, children) => sides(rows, *rule, |side, rows| self.below(children[side], rows, see)),
        }
    }

    /// The values of the leaf that one row reaches.
    pub(super) fn leaf(&self, row: &Rows) -> &[f64] {
        let mut at = 0;
        loop {
            match &self.nodes[at] {
                Step::Leaf(values) => return values,
                Step::Split(rule, children) => {
                    let is_left = match row.get(rule.feature) {
                        Some(values) if !values.missing => values.low < rule.cut,
                        _ => rule.missing_left,
                    };
                    at = children[usize::from(!is_left)];
                }
            }
        }
    }

    /// The values of the only leaf, if there is no split.
    pub(super) fn constant(&self) -> Option<&[f64]> {
        if let Step::Leaf(values) = &self.nodes[0] { Some(values) } else { None }
    }
}

/// Numbers that a model's features are counted in.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Keys {
    /// Whole numbers.
    Whole,
    /// Keys of f32 values.
    Real,
    /// Whole numbers of units, this many in 1.
    Scaled(Vec<f32>),
}

impl Keys {
    /// All rows of this many features.
    pub(super) fn all(&self, features: usize) -> Vec<Values> {
        let most = match self {
            Self::Real => i64::from(f32_key(f32::INFINITY)),
            Self::Whole | Self::Scaled(_) => i64::from(i32::MAX),
        };
        vec![Values::of(-most, most, true); features]
    }

    /// The value that a key of a feature stands for.
    pub(super) fn value(&self, feature: usize, key: i64) -> f64 {
        match self {
            Self::Real => {
                let magnitude = f32::from_bits(key.unsigned_abs() as u32);
                f64::from(if key < 0 { -magnitude } else { magnitude })
            }
            Self::Scaled(scales) => key as f64 / f64::from(scales.get(feature).copied().unwrap_or(1.0)),
            Self::Whole => key as f64,
        }
    }

    /// The smallest key that is not below a threshold.
    pub(super) fn cut(&self, feature: usize, threshold: Threshold) -> i64 {
        // `as` keeps what is beyond an i32 at its limits.
        let whole = |number: f64| i64::from((number.ceil() as i32).max(-i32::MAX));
        match self {
            Self::Whole => whole(threshold.value),
            Self::Real => threshold.single().map_or(i64::MAX, |single| f32_key(single).into()),
            // Every number is below.
            Self::Scaled(_) if threshold.is_beyond_all() && threshold.value > 0.0 => i64::from(i32::MAX) + 1,
            Self::Scaled(scales) => whole(threshold.units(scales.get(feature).copied().unwrap_or(1.0))),
        }
    }
}

/// Thresholds of a feature, as keys.
pub(super) fn cuts_of<'t>(trees: impl Iterator<Item = &'t Tree>, feature: usize) -> impl Iterator<Item = i64> {
    trees.flat_map(|tree| &tree.nodes).filter_map(move |step| match step {
        Step::Split(rule, _) if rule.feature == feature => Some(rule.cut),
        _ => None,
    })
}

/// The intervals between thresholds, ascending, of the values that are not missing.
pub(super) fn between(values: Values, mut cuts: Vec<i64>) -> Vec<Values> {
    cuts.sort_unstable();
    cuts.dedup();
    let mut own = Vec::new();
    let mut low = values.low;
    for cut in cuts.into_iter().filter(|&cut| cut > values.low && cut <= values.high) {
        own.push(Values::of(low, cut - 1, false));
        low = cut;
    }
    if low <= values.high {
        own.push(Values::of(low, values.high, false));
    }
    own
}
