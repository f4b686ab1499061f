//! Regressions of any size and place of target, as a model holds them.
//!
//! Leaves that become integers are centered: of each tree and output the middle between the least and the largest is taken
//! out, in f64, and the sum of these is the output's offset, so that the unit follows the differences that a tree makes and
//! not the target's mean. Powers of two then make margins fit, which rounds nothing. Leaves of f32 stay the library's.

use super::Leaf;
use super::forest::MARGIN_RANGE;
use crate::ensemble::{Ensemble, Imported, Node};
use palpate_shared::format::OutputScale;
use std::borrow::Cow;

/// Margins that stay below this are scaled up: a unit has 2^-24 nats at least.
const SMALL: f64 = 1.0 / 16.0;

/// An ensemble as a model holds it.
pub(super) struct Held<'e> {
    pub(super) ensemble: Cow<'e, Ensemble>,
    /// The scale and the offset of each output, where leaves are centered.
    pub(super) scales: Vec<OutputScale>,
    /// The farthest that its margins can be from the library's before leaves are rounded, in nats.
    pub(super) rounding: f64,
}

/// Sums over the trees of an output.
#[derive(Default)]
struct Sums {
    /// Starting value of the margin, and what is taken out of leaves.
    middle: f64,
    /// The largest values of leaves that are left: of all trees together, and of the tree with the largest.
    reach: f64,
    largest: f64,
    /// The library's largest margin without its sign, and what it loses if it adds f32.
    margin: f64,
    lost: f64,
}

/// The ensemble with margins that a model with such leaves can hold: its scales and offsets make them what they were. One that
/// contradicts itself is left as it is, for whoever reads its trees.
pub(super) fn held(ensemble: &Ensemble, leaf: Leaf) -> Held<'_> {
    let before = f64::from(ensemble.prediction().scale);
    let rounding = ensemble.origin.imported.as_ref().map_or(0.0, |imported| imported.rounding) / before;
    let as_it_is = Held { ensemble: Cow::Borrowed(ensemble), scales: Vec::new(), rounding };
    if !ensemble.is_regression() || ensemble.base().len() != ensemble.objects.len() {
        return as_it_is;
    }
    let is_f32 = leaf == Leaf::F32;
    let start = |base: f64| Sums { middle: base, margin: base.abs(), ..Sums::default() };
    let mut sums: Vec<Sums> = ensemble.base().into_iter().map(start).collect();
    let mut middles = Vec::with_capacity(ensemble.trees.len());
    for (number, tree) in ensemble.trees.iter().enumerate() {
        let ranges = ensemble.ranges(number);
        let middle = |[least, most]: &[f64; 2]| if is_f32 { 0.0 } else { f64::midpoint(*least, *most) };
        for (value, range) in ranges.iter().enumerate() {
            let Some(own) = sums.get_mut(tree.output.of_value(value)) else { return as_it_is };
            let farthest = |from: f64| range.iter().fold(0.0, |most, end| f64::max(most, (end - from).abs()));
            own.middle += middle(range);
            own.reach += farthest(middle(range));
            own.largest = own.largest.max(farthest(middle(range)));
            own.margin += farthest(0.0);
            own.lost += if ensemble.adds_f32() { half_step(own.margin) } else { 0.0 };
        }
        middles.push(ranges.iter().map(middle).collect::<Vec<f64>>());
    }
    if sums.iter().any(|sums| !(sums.margin as f32).is_finite()) {
        return as_it_is;
    }
    let offset = |sums: &Sums| if is_f32 { 0.0 } else { (sums.middle * before) as f32 };
    // The part of a middle that its offset, an f32, leaves over.
    let rest = |sums: &Sums| sums.middle - f64::from(offset(sums)) / before;
    let range = |sums: &Sums| sums.reach + rest(sums).abs();
    // Sums of f32 have one scale.
    let widest = sums.iter().map(range).fold(0.0, f64::max);
    let factor = |sums: &Sums| match sums {
        _ if is_f32 => factor(widest, None),
        sums => factor(range(sums), Some(sums.largest).filter(|_| ensemble.objects.len() > 1)),
    };
    let factors: Vec<f64> = sums.iter().map(factor).collect();
    if is_f32 && factors.iter().all(|factor| *factor == 1.0) {
        return as_it_is;
    }
    let mut held = ensemble.clone();
    for (number, tree) in held.trees.iter_mut().enumerate() {
        for (index, node) in tree.nodes.iter_mut().enumerate() {
            let Node::Leaf(values) = node else { continue };
            for (value, exact) in ensemble.values(number, index).enumerate() {
                let own = if is_f32 { values[value].into() } else { exact - middles[number][value] };
                values[value] = (own * factors[tree.output.of_value(value)]) as f32;
            }
        }
    }
    let (trees, mut scales, mut most) = (ensemble.trees.len() as f64, Vec::new(), 0.0);
    for ((sums, factor), base) in sums.iter().zip(factors).zip(&mut held.base_margins) {
        *base = (rest(sums) * factor) as f32;
        scales.push(OutputScale { scale: (before / factor) as f32, offset: offset(sums) });
        // Centered leaves and their sums are f32, the library's are f64, unless it adds f32 as well.
        let of_library = if ensemble.adds_f32() { rounding + sums.lost } else { trees * sums.margin * f64::EPSILON };
        let of_sums = trees * half_step(range(sums)) + range(sums) * f64::from(f32::EPSILON);
        most = f64::max(most, if is_f32 { rounding } else { of_library + of_sums } * factor);
    }
    let imported = held.origin.imported.get_or_insert_with(Imported::default);
    imported.exact = None;
    imported.prediction.scale = scales.iter().fold(0.0, |most, own| own.scale.max(most));
    if is_f32 {
        scales.clear();
    }
    Held { ensemble: Cow::Owned(held), scales, rounding: most }
}

/// Half a step of f32 at a number.
fn half_step(number: f64) -> f64 {
    let single = number as f32;
    f64::from(single.next_up() - single) / 2.0
}

/// The power of two that makes margins of this range fit; of several outputs, that gives their largest leaves one size.
fn factor(range: f64, largest: Option<f64>) -> f64 {
    let size = match largest {
        _ if range == 0.0 => return 1.0,
        Some(largest) => largest.max(range / MARGIN_RANGE),
        None if range > MARGIN_RANGE => range / MARGIN_RANGE,
        None if range >= SMALL => return 1.0,
        None => range,
    };
    // A unit times the scale stays a normal number. Targets below 1e-30 keep fewer digits in integer leaves, as the
    // model's error says.
    (-size.log2().ceil().clamp(-100.0, 126.0)).exp2()
}
