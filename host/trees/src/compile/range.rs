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

/// The ensemble with margins that a model with such leaves can hold: its scales and offsets make them what they were.
pub(super) fn held(ensemble: &Ensemble, leaf: Leaf) -> Held<'_> {
    if ensemble.is_regression()
        && leaf != Leaf::F32
        && let Some(centered) = centered(ensemble)
    {
        return centered;
    }
    let rounding = ensemble.origin.imported.as_ref().map_or(0.0, |imported| imported.rounding);
    let ensemble = scaled(ensemble);
    let rounding = rounding / f64::from(ensemble.prediction().scale);
    Held { ensemble, scales: Vec::new(), rounding }
}

/// Sums over the trees of an output, as the library has them.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Where margins start, and the middles of leaves.
    middle: f64,
    /// Half the range of leaves: of all trees, and of the tree with the largest.
    reach: f64,
    largest: f64,
    /// The largest margin without its sign, after each tree.
    margin: f64,
    /// What a library that adds f32 loses.
    lost: f64,
}

/// Half a step of f32 at a number.
fn half_step(number: f64) -> f64 {
    let single = number as f32;
    f64::from(single.next_up() - single) / 2.0
}

/// A regression with centered leaves; `None` if it contradicts itself, which whoever reads its trees says.
fn centered(ensemble: &Ensemble) -> Option<Held<'_>> {
    let outputs = ensemble.objects.len();
    let start = |base: f64| Sums { middle: base, margin: base.abs(), ..Sums::default() };
    let mut sums: Vec<Sums> = ensemble.base().into_iter().map(start).collect();
    let mut middles = Vec::with_capacity(ensemble.trees.len());
    for (number, tree) in ensemble.trees.iter().enumerate() {
        let ranges = ensemble.ranges(number);
        for (value, [least, most]) in ranges.iter().enumerate() {
            let own = sums.get_mut(tree.output.of_value(value))?;
            own.middle += f64::midpoint(*least, *most);
            own.reach += (most - least) / 2.0;
            own.largest = own.largest.max((most - least) / 2.0);
            own.margin += least.abs().max(most.abs());
            own.lost += if ensemble.adds_f32() { half_step(own.margin) } else { 0.0 };
        }
        middles.push(ranges.into_iter().map(|[least, most]| f64::midpoint(least, most)).collect::<Vec<f64>>());
    }
    if sums.len() != outputs || sums.iter().any(|sums| !(sums.margin as f32).is_finite()) {
        return None;
    }
    let before = f64::from(ensemble.prediction().scale);
    let factors: Vec<f64> = sums.iter().map(|sums| factor(*sums, outputs)).collect();
    let scale = |(sums, factor): (&Sums, &f64)| OutputScale {
        scale: (before / factor) as f32,
        offset: (sums.middle * before) as f32,
    };
    let scales: Vec<OutputScale> = sums.iter().zip(&factors).map(scale).collect();
    let mut held = ensemble.clone();
    for (number, tree) in held.trees.iter_mut().enumerate() {
        let output = tree.output;
        for (index, node) in tree.nodes.iter_mut().enumerate() {
            let Node::Leaf(values) = node else { continue };
            for (value, own) in ensemble.values(number, index).enumerate() {
                values[value] = ((own - middles[number][value]) * factors[output.of_value(value)]) as f32;
            }
        }
    }
    let mut rounding = 0.0;
    for (output, (sums, own)) in sums.iter().zip(&scales).enumerate() {
        // What the offset, an f32, leaves over.
        let rest = sums.middle - f64::from(own.offset) / before;
        held.base_margins[output] = (rest * factors[output]) as f32;
        let of_import = ensemble.origin.imported.as_ref().filter(|_| ensemble.adds_f32());
        let lost = of_import.map_or(0.0, |imported| imported.rounding / before) + sums.lost;
        // Centered leaves and their sums are f32, the library's are f64.
        let (trees, range) = (ensemble.trees.len() as f64, sums.reach + rest.abs());
        let of_sums = trees * (half_step(range) + sums.margin * f64::EPSILON) + range * f64::from(f32::EPSILON);
        rounding = f64::max(rounding, (lost + of_sums) * factors[output]);
    }
    let imported = held.origin.imported.get_or_insert_with(Imported::default);
    imported.exact = None;
    imported.prediction.scale = scales.iter().fold(0.0, |most, own| own.scale.max(most));
    Some(Held { ensemble: Cow::Owned(held), scales, rounding })
}

/// The power of two that margins of an output are multiplied by: the leaves of several outputs get one size.
fn factor(Sums { middle, reach, largest, .. }: Sums, outputs: usize) -> f64 {
    let range = reach + (middle - f64::from(middle as f32)).abs();
    let size = match outputs {
        _ if range == 0.0 => return 1.0,
        1 if range > MARGIN_RANGE => range / MARGIN_RANGE,
        1 if range >= SMALL => return 1.0,
        1 => range,
        _ => largest.max(range / MARGIN_RANGE),
    };
    // A unit times the scale stays a normal number.
    (-size.log2().ceil().clamp(-100.0, 126.0)).exp2()
}

/// The ensemble with margins that a model can hold, if it is a regression over rows: its scale makes them what they were.
fn scaled(ensemble: &Ensemble) -> Cow<'_, Ensemble> {
    let range = range(ensemble);
    let is_held = !range.is_finite() || range == 0.0 || (SMALL..=MARGIN_RANGE).contains(&range);
    if !ensemble.is_regression() || is_held {
        return Cow::Borrowed(ensemble);
    }
    // From half of the range to all of it; or around 1.
    let most = if range > MARGIN_RANGE { MARGIN_RANGE } else { 1.0 };
    // A unit times the scale stays a normal number. Targets below 1e-30 keep fewer digits in integer leaves, as the
    // model's error says.
    let exponent = (range / most).log2().ceil().clamp(-100.0, 126.0);
    let factor = (-exponent).exp2() as f32;
    let mut scaled = ensemble.clone();
    let leaves = scaled.trees.iter_mut().flat_map(|tree| &mut tree.nodes).filter_map(|node| match node {
        Node::Leaf(values) => Some(values),
        Node::Split { .. } => None,
    });
    leaves.flatten().chain(&mut scaled.base_margins).for_each(|value| *value *= factor);
    let imported = scaled.origin.imported.get_or_insert_with(Imported::default);
    imported.prediction.scale *= exponent.exp2() as f32;
    Cow::Owned(scaled)
}

/// Largest distance of a margin from 0.
fn range(ensemble: &Ensemble) -> f64 {
    let largest =
        |node: &Node| node.leaf().unwrap_or_default().iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    let of_tree = ensemble.trees.iter().map(|tree| f64::from(tree.nodes.iter().map(largest).fold(0.0, f32::max)));
    of_tree.sum::<f64>() + ensemble.base_margins.iter().fold(0.0_f64, |most, base| most.max(f64::from(base.abs())))
}
