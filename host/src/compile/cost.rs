//! A model of the evaluator's cost: instructions a touch on a Cortex-M4F, from contact times to margins.
//!
//! The firmware's `evaluator` prints what it says beside what the emulated chip counts, for ensembles of all shapes, and
//! fails where the two are more than 15 % apart. The figures are those of the firmware's profile (`opt-level = "s"`).

use palpate_shared::format::LeafType;

/// Features, clearing, and the base margins.
const TOUCH: usize = 350;
/// Ranking in an axis, in eight steps.
const AXIS: usize = 140;
/// An object's base margin.
const OBJECT: usize = 6;
/// A group of trees, or what it has beyond a block of 64.
const BLOCK: usize = 130;
/// Shifting what was added before.
const SHIFT: usize = 60;

/// What does not depend on the trees.
pub(super) fn touch(axes: usize, objects: usize) -> usize {
    TOUCH + AXIS * axes + OBJECT * objects
}

/// A group of complete trees, whose leaves have so many values.
pub(super) fn complete_group(trees: usize, depth: usize, leaf: LeafType, values: usize, shifted: bool) -> usize {
    // Depths 4 to 6 are written out; others are a loop with checks.
    let walk = if (4..=6).contains(&depth) { 12 + 6 * depth } else { 18 + 13 * depth };
    // A few values are added together, the last ones alone.
    let (few, together) = match leaf {
        LeafType::I8 => (10, 29),
        LeafType::I16 => (5, 19),
        LeafType::F32 => (5, 30),
    };
    let leaf = together * (values / few) + 11 * (values % few);
    trees.div_ceil(64) * BLOCK + trees * (walk + leaf) + if shifted { SHIFT } else { 0 }
}

/// A tree in preorder: steps to the leaf that is reached on average, and its values.
pub(super) fn preorder_tree(steps: f64, step: f64, values: usize) -> usize {
    (25.0 + step * steps).round() as usize + 57 + 5 * values
}

/// A step in a compact tree.
pub(super) const COMPACT_STEP: f64 = 17.0;
/// A step in a wide tree.
pub(super) const WIDE_STEP: f64 = 28.0;

/// A table.
pub(super) fn grid(objects: usize) -> usize {
    350 + 5 * objects
}
