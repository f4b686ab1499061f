//! Leaves as integers: one unit for the model, and a shift for each tree, so that the small leaves of late trees keep
//! their digits.

use super::forest::Forest;
use palpate_shared::format::{LeafType, MARGIN_LIMIT};

/// The unit of f32 leaves' margins: 2^-16 nats.
const F32_UNIT: f32 = 1.0 / 65536.0;
/// A unit is at most this many nats, so that its bits are a fraction.
const MAX_UNIT: f64 = 0.5;
/// A unit is at least this many nats.
const MIN_UNIT: f64 = 1.0 / (1 << 24) as f64;
/// A unit that is fine enough for priors.
const PRIOR_UNIT: f32 = 1.0 / 1024.0;
/// Largest margin of a group, with room for base margins and rounding.
const RANGE: f64 = MARGIN_LIMIT as f64 / 2.0;

/// Rule that turns values into integers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    /// Nats in a unit.
    pub(super) unit: f32,
    /// Each tree's leaves are in units times 2^shift.
    pub(super) shifts: Vec<u8>,
}

impl Scale {
    /// The finest scale for a forest's trees.
    pub(super) fn for_trees(forest: &Forest<'_>, leaf: LeafType) -> Option<Self> {
        let Some(most) = most(leaf) else {
            return Some(Self { unit: F32_UNIT, shifts: vec![0; forest.trees.len()] });
        };
        let largest: Vec<f64> = forest.trees.iter().map(|tree| f64::from(tree.largest)).collect();
        let all = largest.iter().copied().fold(0.0, f64::max);
        let base = forest.base.iter().map(|base| f64::from(base.abs())).fold(0.0, f64::max);
        let fits = |scale: &Self| {
            let range: f64 = scale.shifts.iter().map(|&shift| (most + 1.0) * f64::from(1_u32 << shift)).sum();
            range + base / f64::from(scale.unit) < RANGE
        };
        if let Some(exact) = Self::exact(forest, most).filter(fits) {
            return Some(exact);
        }
        // From the finest unit to the coarsest, the first that some tree needs and whose sums stay in range.
        // Leaves too large for any of these take as many shifts as they need.
        let finest = (0..=max_shift(leaf)).rev().chain(max_shift(leaf) + 1..=16).find_map(|shift| {
            let unit = unit_for(all, most * f64::from(1 << shift))?;
            let shifts: Vec<u8> = largest.iter().map(|&value| shift_for(value, most * f64::from(unit))).collect();
            let needed =
                shift == 0 || shifts.contains(&0) || unit_for(all, most * f64::from(1 << (shift - 1))).is_none();
            Some(Self { unit, shifts }).filter(|scale| needed && fits(scale))
        });
        // A base that is far larger than the leaves sets the unit.
        let coarser = || {
            let unit =
                unit_for(all, most).into_iter().flat_map(|unit| (1..32).map(move |step| unit * f32::exp2(step as f32)));
            let mut scales = unit.map(|unit| Self { unit, shifts: vec![0; largest.len()] });
            scales.find(|scale| f64::from(scale.unit) <= MAX_UNIT && fits(scale))
        };
        finest.or_else(coarser)
    }

    /// A unit of which every leaf and every base margin is a whole multiple, if there is one that all leaves fit: then
    /// nothing is rounded. Ensembles whose training rounded their leaves have one.
    fn exact(forest: &Forest<'_>, most: f64) -> Option<Self> {
        let unit = common_unit(forest.leaf_values().chain(forest.base.iter().copied()))?;
        let fits = |unit: f32| forest.trees.iter().all(|tree| f64::from(tree.largest) / f64::from(unit) <= most);
        finest(unit, fits).map(|unit| Self { unit, shifts: vec![0; forest.trees.len()] })
    }

    /// The nearest integer to a value, in units times 2^`shift`.
    pub(super) fn integer(&self, value: f32, shift: u8) -> i32 {
        (f64::from(value) / (f64::from(self.unit) * f64::from(1_u32 << shift))).round() as i32
    }
}

/// The largest power of two from 2^-24 to 2^-1 of which all values are whole multiples.
fn common_unit(values: impl Iterator<Item = f32> + Clone) -> Option<f32> {
    let mut units = (1..=24).map(|digits| 0.5_f32.powi(digits));
    units.find(|unit| values.clone().all(|value| value % unit == 0.0))
}

/// `unit`, or the finest part of it by a power of two that still fits: priors, which are rounded, are the better for it.
fn finest(unit: f32, fits: impl Fn(f32) -> bool) -> Option<f32> {
    let finer = std::iter::successors(Some(unit), |unit| (*unit > PRIOR_UNIT).then_some(unit / 2.0));
    finer.take_while(|&unit| fits(unit)).last()
}

/// Number of times that a tree's unit may be doubled: bytes need it to be exact, for two bytes it would only make
/// groups.
fn max_shift(leaf: LeafType) -> u32 {
    if leaf == LeafType::I8 { 2 } else { 0 }
}

/// The largest integer of a leaf type.
fn most(leaf: LeafType) -> Option<f64> {
    match leaf {
        LeafType::I8 => Some(127.0),
        LeafType::I16 => Some(32767.0),
        LeafType::F32 => None,
    }
}

/// The smallest unit in which `largest` is at most `most`.
fn unit_for(largest: f64, most: f64) -> Option<f32> {
    let exact = (largest / most).max(MIN_UNIT);
    let near = exact as f32;
    let unit = if f64::from(near) < exact { near.next_up() } else { near };
    (exact <= MAX_UNIT).then_some(unit)
}

/// The smallest shift with which a value is at most `most` nats times 2^shift.
fn shift_for(value: f64, most: f64) -> u8 {
    (0..=20).find(|&shift| value <= most * f64::from(1_u32 << shift)).unwrap_or(20)
}
