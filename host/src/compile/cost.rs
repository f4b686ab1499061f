//! A model of the evaluator's cost: instructions a touch on a Cortex-M4F, from contact times to margins.
//!
//! The firmware's `evaluator` prints what it says beside what the emulated chip counts, for ensembles of all shapes, and
//! fails where the two are more than 15 % apart. The figures are those of the firmware's profile (`opt-level = "s"`).

/// Features, clearing, and the base margins.
const TOUCH: usize = 450;
/// Ranking in an axis, in eight steps.
const AXIS: usize = 165;
/// An object's margin and base margin.
const OBJECT: usize = 12;
/// A group of trees, or what it has beyond a block of 128.
const BLOCK: usize = 160;
/// Shifting what was added before.
const SHIFT: usize = 60;

/// What does not depend on the trees.
pub(super) fn touch(axes: usize, objects: usize) -> usize {
    TOUCH + AXIS * axes + OBJECT * objects
}

/// A group of complete trees, whose leaves have so many values.
pub(super) fn complete_group(trees: usize, depth: usize, values: usize, shifted: bool) -> usize {
    // Depths 4 to 6 are written out; others are a loop with checks.
    let walk = if (4..=6).contains(&depth) { 12 + 6 * depth } else { 18 + 13 * depth };
    // Ten values are added together, others alone.
    let leaf = 44 * (values / 10) + 12 * (values % 10);
    trees.div_ceil(128) * BLOCK + trees * (walk + leaf) + if shifted { SHIFT } else { 0 }
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
    455 + 5 * objects
}
