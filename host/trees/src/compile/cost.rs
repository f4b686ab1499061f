//! Cost of a compiled model on a chip: instructions, flash, RAM and stack, estimated.
//!
//! Instructions are those from measurements to margins, by a model of the evaluator. The firmware's `evaluator` prints them
//! beside what the emulated chips count, for ensembles of all shapes, and fails where the two are more than 15 % apart. Flash of
//! the code is that of the firmware's `verdict` image, RAM and stack are those that `evaluator` prints. All figures are of the
//! firmware's profile (`opt-level = "s"`).

use super::container::groups_and_splits;
use palpate_onboard::Model;
use palpate_shared::format::{Group, Layout, LeafType, Weights};
use serde::Serialize;

/// A processor that costs are known for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Core {
    /// Cortex-M4F.
    #[serde(rename = "m4f")]
    M4F,
    /// Cortex-M0+.
    #[serde(rename = "m0+")]
    M0Plus,
}

/// About how many instructions it takes from measurements to margins; right to 15 %.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Instructions {
    /// On a Cortex-M4F.
    pub m4f: u64,
    /// On a Cortex-M0+; `None` with f32 leaves, whose additions its software does.
    pub m0_plus: Option<u64>,
}

/// Memory that a model takes on a chip, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// Flash of the model.
    pub model_flash: usize,
    /// Flash of a whole image that gives verdicts, with the crate's features that the model needs or that are asked for; 1,300
    /// bytes of it are start-up, vector table and the compiler's own routines, which most programs have anyway.
    pub code_flash: usize,
    /// RAM of the opened model and of a recognizer with room for just the model's objects.
    pub ram: usize,
    /// Stack of margins with their verdict.
    pub stack: usize,
}

impl Core {
    /// The processor's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::M4F => "Cortex-M4F",
            Self::M0Plus => "Cortex-M0+",
        }
    }
}

impl Instructions {
    /// Instructions of the margins of a compiled model, with the steps to a leaf of each tree on average.
    pub fn of_model(model: &Model<'_>) -> Self {
        Self::with_steps(model, on_average)
    }

    /// The most instructions that margins take, if features lead the longest way through every tree.
    pub fn of_longest_ways(model: &Model<'_>) -> Self {
        Self::with_steps(model, f64::max)
    }

    fn with_steps(model: &Model<'_>, below: fn(f64, f64) -> f64) -> Self {
        let objects = model.object_count();
        let axes = usize::from(model.header().axes());
        let (groups, nodes) = groups_and_splits(model);
        let is_shared = model.shared_leaves().is_some();
        let leaf = model.leaf_type();
        let is_wide = model.layout() == Layout::Wide;
        let steps = match is_wide {
            false => steps_to_leaves(nodes, 3, &|node| node[2].into(), below),
            true => steps_to_leaves(nodes, 6, &|node| u16::from_le_bytes([node[4], node[5]]).into(), below),
        };
        Self::new(&Shape { is_wide, leaf, objects, axes, groups: &groups, steps: &steps, is_shared })
    }

    fn new(shape: &Shape<'_>) -> Self {
        let m0_plus = (shape.leaf != LeafType::F32).then(|| M0_PLUS.margins(shape));
        Self { m4f: M4F.margins(shape), m0_plus }
    }

    /// On a processor.
    pub fn on(self, core: Core) -> Option<u64> {
        match core {
            Core::M4F => Some(self.m4f),
            Core::M0Plus => self.m0_plus,
        }
    }
}

impl Memory {
    /// Memory of a compiled model on a processor, with these features of palpate-onboard.
    pub fn of_model(model: &Model<'_>, core: Core, features: &[&str]) -> Self {
        let objects = model.object_count();
        // A recognizer: 8 bytes per object and 32; an opened model: 64.
        let ram = 8 * objects + 32 + 64;
        // The most that was seen for ten objects, less their margins.
        let stack = 4 * objects
            + match model.layout() {
                Layout::Compact | Layout::Wide => 1_024,
                // A whole row of features, and the columns' numbers.
                Layout::Code => 1_500,
            };
        Self { model_flash: model.bytes().len(), code_flash: code_flash(core, features), ram, stack }
    }
}

/// Features of palpate-onboard that models need, and the bytes of flash of each on a Cortex-M4F and a Cortex-M0+, beyond
/// what all of them have: `verdict` images of the firmware, which the ignored tests of `tests/tests/whole/images.rs` compare.
pub(crate) const FEATURES: [(&str, [usize; 2]); 12] = [
    ("compact", [364, 424]),
    ("wide", [392, 424]),
    ("code", [600, 220]),
    ("i8-leaves", [0, 0]),
    ("i16-leaves", [136, 64]),
    ("f32-leaves", [560, 1_200]),
    ("shared-leaves", [1_372, 1_140]),
    ("sentinel", [380, 464]),
    ("row-evidence", [448, 604]),
    ("sequences", [100, 136]),
    ("strangers", [3_380, 4_380]),
    ("outputs", [1_716, 1_952]),
];

/// Flash of what all images of verdicts have.
const COMMON: [usize; 2] = [6_304, 5_956];

/// True if the model numbers the rows of a sequence, or states which of them it takes.
pub(super) fn has_sequences(model: &Model<'_>) -> bool {
    model.position().is_some() || model.guard().is_some()
}

/// Features of palpate-onboard that a model needs.
pub fn features(model: &Model<'_>) -> Vec<&'static str> {
    let leaf = model.leaf_type();
    let needed = |name: &str| match name {
        "shared-leaves" => model.shared_leaves().is_some(),
        "sentinel" => model.sentinel().is_some(),
        "strangers" => model.strangers().is_some(),
        "row-evidence" => model.row_evidence().is_some() || model.weight_of(u32::MAX) != Weights::ONE,
        "sequences" => has_sequences(model),
        "outputs" => model.outputs().is_some(),
        _ => name == model.layout().name() || name.strip_suffix("-leaves") == Some(leaf.name()),
    };
    FEATURES.iter().map(|(name, _)| *name).filter(|name| needed(name)).collect()
}

/// Flash of a whole image of verdicts with these features of palpate-onboard, within 5 % where that was measured.
pub fn code_flash(core: Core, features: &[&str]) -> usize {
    let of = |bytes: [usize; 2]| bytes[usize::from(core == Core::M0Plus)];
    let has = |name: &str| features.contains(&name);
    of(COMMON) + FEATURES.iter().filter(|(name, _)| has(name)).map(|(_, bytes)| of(*bytes)).sum::<usize>()
}

/// Properties of a model that the cost of margins depends on.
struct Shape<'a> {
    /// True for splits of six bytes.
    is_wide: bool,
    leaf: LeafType,
    objects: usize,
    axes: usize,
    groups: &'a [Group],
    /// Steps to a leaf of each tree.
    steps: &'a [f64],
    /// True if leaves are indices into a table.
    is_shared: bool,
}

/// Steps below a split if either side is as likely.
fn on_average(left: f64, right: f64) -> f64 {
    (left + right) / 2.0
}

/// The costs of the evaluator's parts on one processor, in instructions.
struct Costs {
    /// Features, clearing, and the base margins; then for each object.
    fixed: (usize, usize),
    /// Ranking in an axis.
    axis: usize,
    /// A leaf's values of one byte: of ten together; of two bytes or f32: of five together; one value alone.
    leaf: Leaf,
    /// A tree whose leaf is a number.
    shared_tree: usize,
    /// A walk, and a tree whose leaf is added by itself; then each value of that.
    tree: (f64, usize, usize),
    /// A step by a split of three bytes, and of six.
    step: (f64, f64),
}

/// Costs of a leaf's values.
struct Leaf {
    ten_i8: usize,
    five_i16: usize,
    five_f32: usize,
    alone: usize,
}

const M4F: Costs = Costs {
    fixed: (550, 6),
    axis: 90,
    leaf: Leaf { ten_i8: 24, five_i16: 19, five_f32: 30, alone: 11 },
    shared_tree: 45,
    tree: (25.0, 51, 5),
    step: (21.0, 49.0),
};

const M0_PLUS: Costs = Costs {
    fixed: (800, 9),
    axis: 110,
    // No estimate is made with f32.
    leaf: Leaf { ten_i8: 57, five_i16: 31, five_f32: 0, alone: 14 },
    shared_tree: 60,
    tree: (35.0, 51, 8),
    step: (37.0, 88.0),
};

impl Costs {
    /// Instructions of the margins.
    fn margins(&self, shape: &Shape<'_>) -> u64 {
        let step = if shape.is_wide { self.step.1 } else { self.step.0 };
        let axes = if shape.is_wide { 0 } else { shape.axes };
        (self.fixed.0 + self.axis * axes + self.fixed.1 * shape.objects + self.trees(shape, step)) as u64
    }

    /// A leaf of those that are added together.
    fn leaf_together(&self, values: usize, leaf: LeafType) -> usize {
        // A few values are added together, the last ones alone.
        let (few, together) = match leaf {
            LeafType::I8 => (10, self.leaf.ten_i8),
            LeafType::I16 => (5, self.leaf.five_i16),
            LeafType::F32 => (5, self.leaf.five_f32),
        };
        together * (values / few) + self.leaf.alone * (values % few)
    }

    /// Trees: steps to the leaf that is reached, and its values.
    fn trees(&self, shape: &Shape<'_>, step: f64) -> usize {
        let (start, tree, value) = self.tree;
        let mut trees = shape.steps.iter();
        let mut sum = 0;
        for group in shape.groups {
            let values = values(group, shape);
            let leaf = match shape.is_shared {
                true => self.shared_tree + self.leaf_together(values, shape.leaf),
                false => tree + value * values,
            };
            let own = trees.by_ref().take(group.trees as usize);
            sum += own.map(|steps| (start + step * steps).round() as usize + leaf).sum::<usize>();
        }
        sum
    }
}

/// Values of a leaf.
fn values(group: &Group, shape: &Shape<'_>) -> usize {
    if group.object.is_some() { 1 } else { shape.objects }
}

/// Steps to a leaf of each tree in preorder, each after its number of splits.
fn steps_to_leaves(
    mut nodes: &[u8],
    length: usize,
    left: &impl Fn(&[u8]) -> usize,
    below: fn(f64, f64) -> f64,
) -> Vec<f64> {
    let mut steps = Vec::new();
    while let Some((splits, rest)) = nodes.split_first_chunk() {
        let splits = length * usize::from(u16::from_le_bytes(*splits));
        let Some((splits, rest)) = rest.split_at_checked(splits) else { break };
        steps.push(steps_to_leaf(splits, length, left, below));
        nodes = rest;
    }
    steps
}

/// Steps to a leaf of a tree in preorder, where `below` joins those of a split's sides; `left` gives the splits in a split's
/// left subtree.
fn steps_to_leaf(splits: &[u8], length: usize, left: &impl Fn(&[u8]) -> usize, below: fn(f64, f64) -> f64) -> f64 {
    if splits.is_empty() {
        return 0.0;
    }
    let (root, rest) = splits.split_at(length);
    let (left_splits, right_splits) = rest.split_at((length * left(root)).min(rest.len()));
    let steps = |splits| steps_to_leaf(splits, length, left, below);
    1.0 + below(steps(left_splits), steps(right_splits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_f32_leaves_nothing_is_said_about_a_processor_without_float_unit() {
        let shape = Shape {
            is_wide: false,
            leaf: LeafType::F32,
            objects: 10,
            axes: 2,
            groups: &[],
            steps: &[],
            is_shared: false,
        };
        let instructions = Instructions::new(&shape);
        assert_eq!(instructions.on(Core::M0Plus), None);
        assert!(instructions.on(Core::M4F).is_some());
    }

    #[test]
    fn steps_are_weighted_by_the_chance_of_each_side_or_those_of_the_longest_way() {
        let left = |node: &[u8]| usize::from(node[2]);
        // A root, one split on its left, which has one on its right.
        let splits = [0, 0, 2, 0, 0, 0, 0, 0, 0];
        assert_eq!(steps_to_leaf(&splits, 3, &left, on_average), 1.75);
        assert_eq!(steps_to_leaf(&splits, 3, &left, f64::max), 3.0);
        assert_eq!(steps_to_leaf(&[], 3, &left, on_average), 0.0);
    }
}
