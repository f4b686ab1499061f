//! The layouts: the same trees as different bytes.

use super::axes::{Axes, cuts_bytes, visit, width};
use super::cells::Cells;
use super::cost;
use super::forest::{Branch, Branches, Forest};
use super::quantize::Scale;
use crate::ensemble::Output;
use crate::error::{Error, Result};
use palpate_shared::format::{Axis, Columns, Group, HEADER_LENGTH, Layout, LeafType, MAX_COMPLETE_DEPTH};
use rayon::prelude::*;
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::ops::AddAssign;

/// A table may have this many bytes.
const MAX_TABLE: usize = 1 << 24;

/// What a layout makes of a forest.
pub(super) struct Parts {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) groups: Vec<Group>,
    pub(super) nodes: Vec<u8>,
    pub(super) leaves: Vec<u8>,
    /// What margins start from: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    pub(super) unit: f32,
    pub(super) margin_error: f32,
    /// About how many instructions a touch takes on a Cortex-M4.
    pub(super) instructions: u64,
}

impl Parts {
    /// Bytes of the model, but for its text and what is the same in all layouts.
    pub(super) fn bytes(&self) -> usize {
        let records = Axis::LENGTH * self.axes.len() + Group::LENGTH * self.groups.len() + 8 * self.base.len();
        HEADER_LENGTH + records + self.cuts.len() + self.nodes.len() + self.leaves.len()
    }
}

/// What the layouts make of a forest: the one that was asked for, or all that fit.
pub(super) fn candidates(
    forest: &Forest<'_>,
    axes: &Axes,
    cells: Option<&Cells>,
    leaf: LeafType,
    wanted: Option<Layout>,
) -> Result<Vec<(Layout, Parts)>> {
    let mut layouts =
        wanted.map_or_else(|| vec![Layout::Complete, Layout::Compact, Layout::Grid], |layout| vec![layout]);
    let narrow = fits_narrow(forest, axes);
    if !narrow {
        layouts.iter_mut().filter(|layout| **layout == Layout::Compact).for_each(|layout| *layout = Layout::Wide);
    }
    let mut candidates = Vec::new();
    let scale = Scale::of_trees(forest, leaf);
    // The same for every layout that walks trees, and slow to find.
    let error = OnceCell::new();
    let scale = scale.as_ref().map(|scale| (scale, || *error.get_or_init(|| margin_error(forest, cells, leaf, scale))));
    for layout in layouts {
        let walked = |structure: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Structure>| {
            let (scale, error) = scale.as_ref()?;
            trees(forest, scale, error, leaf, structure)
        };
        let parts = match layout {
            Layout::Complete => walked(&|order, leaves| complete(forest, axes, order, leaves)),
            Layout::Compact => walked(&|order, leaves| compact(forest, axes, order, leaves)),
            Layout::Wide => walked(&|order, leaves| wide(forest, order, leaves)),
            Layout::Grid => cells.and_then(|cells| grid(forest, cells, leaf)),
        };
        match parts {
            Some(parts) => candidates.push((layout, parts)),
            None if wanted.is_some() => return Err(unfit(layout)),
            None => {}
        }
    }
    Ok(candidates)
}

fn unfit(layout: Layout) -> Error {
    let why = match layout {
        Layout::Complete => "its trees are deeper than 8 splits, or have more thresholds than 256 columns hold",
        Layout::Grid => {
            "it uses more than two features, has more than 255 thresholds of one, or its margins are too large for a byte"
        }
        Layout::Compact | Layout::Wide => "it has more thresholds than 65,536, or a tree with more splits than that",
    };
    Error::argument(
        format!("the ensemble does not fit the layout {}: {why}", layout.name()),
        "Choose another layout, or `--layout auto`.",
    )
}

/// Whether splits fit three bytes: columns and left subtrees are numbered in a byte.
fn fits_narrow(forest: &Forest<'_>, axes: &Axes) -> bool {
    let mut narrow = axes.columns <= 256;
    for tree in &forest.trees {
        visit(&tree.root, &mut |split| narrow &= split.left_splits <= 255);
    }
    narrow
}

/// How leaves are written.
struct Leaves<'a> {
    leaf: LeafType,
    scale: &'a Scale,
    bytes: Vec<u8>,
}

impl Leaves<'_> {
    fn push(&mut self, values: &[f32], shift: u8) {
        for &value in values {
            let integer = self.scale.integer(value, shift);
            match self.leaf {
                LeafType::I8 => self.bytes.push((integer + 128) as u8),
                LeafType::I16 => self.bytes.extend((integer as i16).to_le_bytes()),
                LeafType::F32 => self.bytes.extend(value.to_le_bytes()),
            }
        }
    }
}

/// Trees that share a group, in order.
struct Run {
    object: Option<u8>,
    shift: u8,
    trees: Vec<usize>,
}

/// Axes, thresholds, groups, splits, instructions.
type Structure = (Vec<Axis>, Vec<u8>, Vec<Group>, Vec<u8>, u64);

/// The parts of a layout that walks trees; `structure` writes its splits and leaves.
fn trees(
    forest: &Forest<'_>,
    scale: &Scale,
    margin_error: &impl Fn() -> f32,
    leaf: LeafType,
    structure: &dyn Fn(&[Run], &mut Leaves<'_>) -> Option<Structure>,
) -> Option<Parts> {
    let mut leaves = Leaves { leaf, scale, bytes: Vec::new() };
    let runs = runs(forest, leaf, scale);
    let (axes, cuts, groups, nodes, instructions) = structure(&runs, &mut leaves)?;
    if groups.len() > usize::from(u16::MAX) {
        return None;
    }
    let base = forest.base.iter().map(|&base| base_bits(base, leaf, scale)).collect();
    let leaves = leaves.bytes;
    let margin_error = margin_error();
    Some(Parts { axes, cuts, groups, nodes, leaves, base, unit: scale.unit, margin_error, instructions })
}

fn base_bits(base: f32, leaf: LeafType, scale: &Scale) -> i32 {
    if leaf == LeafType::F32 { base.to_bits().cast_signed() } else { scale.integer(base, 0) }
}

/// The farthest that a margin can be from the ensemble's f32 sum: the largest error in any cell, where cells can be
/// counted; otherwise the sum of the trees' largest roundings, and what f32 sums lose.
fn margin_error(forest: &Forest<'_>, cells: Option<&Cells>, leaf: LeafType, scale: &Scale) -> f32 {
    if leaf == LeafType::F32 {
        return scale.unit / 2.0;
    }
    let unit = f64::from(scale.unit);
    let of_object = |object: usize| {
        let base = scale.integer(forest.base[object], 0);
        if let Some(cells) = cells {
            let start = Both { full: forest.base[object], compiled: base };
            let sums = cells.sums(forest, object, start, |tree, value| {
                let shift = scale.shifts[tree];
                Both { full: value, compiled: scale.integer(value, shift) << shift }
            });
            return sums.iter().fold(0.0, |worst, sum| f64::max(worst, sum.difference(unit)));
        }
        let trees = forest.trees.iter().zip(&scale.shifts).filter(|(tree, _)| tree.values_for(object));
        let rounding: f64 = trees.map(|(tree, &shift)| leaf_error(tree, object, scale, shift)).sum();
        let bound = Both { full: forest.base[object], compiled: base }.difference(unit) + rounding;
        // What f32 sums lose: half an ulp of the largest partial sum at each addition, or nothing at all while they are
        // whole numbers of units that f32 holds.
        let range = forest.range(object);
        if bound == 0.0 && range / unit <= f64::from(1 << 24) {
            return 0.0;
        }
        bound + forest.trees_of(object).count() as f64 * range * f64::from(f32::EPSILON) / 2.0
    };
    round_up((0..forest.objects()).into_par_iter().map(of_object).reduce(|| 0.0, f64::max))
}

/// A margin of the full and of the compiled model.
#[derive(Clone, Copy)]
struct Both {
    full: f32,
    compiled: i32,
}

impl Both {
    fn difference(self, unit: f64) -> f64 {
        (f64::from(self.full) - f64::from(self.compiled) * unit).abs()
    }
}

impl AddAssign for Both {
    fn add_assign(&mut self, other: Self) {
        self.full += other.full;
        self.compiled += other.compiled;
    }
}

/// The largest rounding of a tree's leaves for an object.
fn leaf_error(tree: &Branches<'_>, object: usize, scale: &Scale, shift: u8) -> f64 {
    let mut worst = 0.0_f64;
    each_leaf(&tree.root, &mut |values| {
        let value = tree.value_of(object, values);
        let rounded = f64::from(scale.integer(value, shift)) * f64::from(1_u32 << shift) * f64::from(scale.unit);
        worst = worst.max((f64::from(value) - rounded).abs());
    });
    worst
}

fn round_up(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

fn each_leaf<'f>(branch: &'f Branch<'f>, see: &mut impl FnMut(&'f [f32])) {
    match branch {
        Branch::Leaf(values) => see(values),
        Branch::Split(split) => {
            each_leaf(&split.left, see);
            each_leaf(&split.right, see);
        }
    }
}

/// Which trees go together. Integers add up in any order, so trees are sorted by shift, object and depth; f32 leaves
/// keep the order in which each object's margin adds them.
fn runs(forest: &Forest<'_>, leaf: LeafType, scale: &Scale) -> Vec<Run> {
    let object = |tree: usize| match forest.trees[tree].output {
        // There are at most 256 objects.
        Output::One(object) => Some(object as u8),
        Output::Each => None,
    };
    let mut order: Vec<usize> = (0..forest.trees.len()).collect();
    let depth = |tree: usize| if leaf == LeafType::F32 { 0 } else { forest.trees[tree].depth.max(1) };
    if leaf != LeafType::F32 {
        order.sort_by_key(|&tree| (std::cmp::Reverse(scale.shifts[tree]), object(tree), depth(tree)));
    } else if order.iter().all(|&tree| object(tree).is_some()) {
        order.sort_by_key(|&tree| object(tree));
    }
    let mut runs: Vec<Run> = Vec::new();
    for tree in order {
        let (object, shift) = (object(tree), scale.shifts[tree]);
        match runs.last_mut() {
            Some(run) if run.object == object && run.shift == shift && depth(run.trees[0]) == depth(tree) => {
                run.trees.push(tree);
            }
            _ => runs.push(Run { object, shift, trees: vec![tree] }),
        }
    }
    runs
}

fn complete(forest: &Forest<'_>, axes: &Axes, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Structure> {
    if axes.columns > 256 || forest.trees.iter().any(|tree| tree.depth > usize::from(MAX_COMPLETE_DEPTH)) {
        return None;
    }
    let (mut groups, mut nodes, mut instructions) = (Vec::new(), Vec::new(), 0);
    for run in runs {
        let depth = run.trees.iter().map(|&tree| forest.trees[tree].depth).max()?.max(1);
        let (mut columns, mut thresholds) = (Vec::new(), Vec::new());
        for &tree in &run.trees {
            let mut slots = vec![(0, 0); 1 << depth];
            // The number of the root; see `palpate_onboard`'s walk.
            slots[0].0 = 1;
            fill(&forest.trees[tree].root, &mut slots, axes, 1, depth, run.shift, leaves);
            columns.extend(slots.iter().map(|slot| slot.0));
            thresholds.extend(slots.iter().map(|slot| slot.1));
        }
        nodes.append(&mut columns);
        nodes.append(&mut thresholds);
        groups.push(group(run, u8::try_from(depth).ok()?));
        let shifted = groups.len() > 1;
        instructions += cost::complete_group(run.trees.len(), depth, leaves.leaf, values(forest, run), shifted);
    }
    let (records, cuts) = records(axes);
    instructions += cost::touch(axes.axes.len(), forest.objects());
    Some((records, cuts, groups, nodes, instructions as u64))
}

/// Writes a branch into the slots below `slot`, `levels` deep; a leaf further up is repeated, and the splits above its
/// copies are left at 0, which goes right.
fn fill(
    branch: &Branch<'_>,
    slots: &mut [(u8, u8)],
    axes: &Axes,
    slot: usize,
    levels: usize,
    shift: u8,
    leaves: &mut Leaves<'_>,
) {
    match branch {
        Branch::Leaf(values) => (0..1_usize << levels).for_each(|_| leaves.push(values, shift)),
        Branch::Split(split) => {
            let (column, threshold) = axes.place(split);
            slots[slot] = (column as u8, threshold);
            fill(&split.left, slots, axes, 2 * slot, levels - 1, shift, leaves);
            fill(&split.right, slots, axes, 2 * slot + 1, levels - 1, shift, leaves);
        }
    }
}

fn compact(forest: &Forest<'_>, axes: &Axes, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Structure> {
    if !fits_narrow(forest, axes) {
        return None;
    }
    let (groups, nodes) = preorder(forest, runs, leaves, |split, nodes| {
        let (column, threshold) = axes.place(split);
        nodes.extend([column as u8, threshold, split.left_splits as u8]);
    })?;
    let (records, cuts) = records(axes);
    let instructions =
        cost::touch(axes.axes.len(), forest.objects()) + trees_instructions(forest, runs, cost::COMPACT_STEP);
    Some((records, cuts, groups, nodes, instructions as u64))
}

fn wide(forest: &Forest<'_>, runs: &[Run], leaves: &mut Leaves<'_>) -> Option<Structure> {
    let mut cuts = BTreeSet::new();
    for tree in &forest.trees {
        visit(&tree.root, &mut |split| {
            cuts.insert(split.cut);
        });
    }
    let cuts: Vec<i32> = cuts.into_iter().collect();
    if cuts.len() > 1 << 16 {
        return None;
    }
    let (groups, nodes) = preorder(forest, runs, leaves, |split, nodes| {
        let number = cuts.partition_point(|&cut| cut < split.cut) as u16;
        nodes.extend([split.feature, u8::from(split.missing_left)]);
        nodes.extend(number.to_le_bytes());
        nodes.extend((split.left_splits as u16).to_le_bytes());
    })?;
    let instructions = cost::touch(0, forest.objects()) + trees_instructions(forest, runs, cost::WIDE_STEP);
    let cuts = cuts.into_iter().flat_map(i32::to_le_bytes).collect();
    Some((Vec::new(), cuts, groups, nodes, instructions as u64))
}

/// Writes trees in preorder.
fn preorder<'f>(
    forest: &'f Forest<'f>,
    runs: &[Run],
    leaves: &mut Leaves<'_>,
    put: impl Fn(&super::forest::Split<'f>, &mut Vec<u8>),
) -> Option<(Vec<Group>, Vec<u8>)> {
    let (mut groups, mut nodes) = (Vec::new(), Vec::new());
    for run in runs {
        for &tree in &run.trees {
            let tree = &forest.trees[tree];
            nodes.extend(u16::try_from(tree.splits).ok()?.to_le_bytes());
            visit(&tree.root, &mut |split| put(split, &mut nodes));
            each_leaf(&tree.root, &mut |values| leaves.push(values, run.shift));
        }
        groups.push(group(run, 0));
    }
    Some((groups, nodes))
}

fn grid(forest: &Forest<'_>, cells: &Cells, leaf: LeafType) -> Option<Parts> {
    let sides: Vec<usize> = cells.dimensions.iter().map(|(_, cuts)| cuts.len() + 2).collect();
    let table: usize = sides.iter().product::<usize>() * forest.objects() * leaf.size();
    if !cells.is_table() || sides.iter().any(|&side| side > 257) || table > MAX_TABLE {
        return None;
    }
    let sums: Vec<Vec<f32>> =
        (0..forest.objects()).map(|object| cells.sums(forest, object, forest.base[object], |_, value| value)).collect();
    let scale = Scale::of_cells(&sums, leaf)?;
    let mut leaves = Leaves { leaf, scale: &scale, bytes: Vec::new() };
    let mut worst = if leaf == LeafType::F32 { f64::from(scale.unit) / 2.0 } else { 0.0 };
    for cell in 0..sides.iter().product() {
        for sum in &sums {
            leaves.push(&[sum[cell]], 0);
            if leaf != LeafType::F32 {
                let compiled = f64::from(scale.integer(sum[cell], 0)) * f64::from(scale.unit);
                worst = worst.max((f64::from(sum[cell]) - compiled).abs());
            }
        }
    }
    let (axes, cuts) = grid_axes(cells);
    Some(Parts {
        axes,
        cuts,
        groups: Vec::new(),
        nodes: Vec::new(),
        leaves: leaves.bytes,
        base: vec![0; forest.objects()],
        unit: scale.unit,
        margin_error: round_up(worst),
        instructions: cost::grid(forest.objects()) as u64,
    })
}

fn grid_axes(cells: &Cells) -> (Vec<Axis>, Vec<u8>) {
    let mut bytes = Vec::new();
    let axes = cells.dimensions.iter().map(|(feature, cuts)| {
        let axis =
            Axis { feature: *feature, columns: Columns::MissingLeft, width: width(cuts), count: cuts.len() as u8 };
        bytes.extend(cuts_bytes(axis, cuts));
        axis
    });
    (axes.collect(), bytes)
}

fn records(axes: &Axes) -> (Vec<Axis>, Vec<u8>) {
    let cuts = axes.axes.iter().flat_map(|(axis, cuts)| cuts_bytes(*axis, cuts)).collect();
    (axes.axes.iter().map(|(axis, _)| *axis).collect(), cuts)
}

fn group(run: &Run, depth: u8) -> Group {
    Group { depth, shift: run.shift, object: run.object, trees: run.trees.len() as u32 }
}

/// Values of a leaf.
fn values(forest: &Forest<'_>, run: &Run) -> usize {
    if run.object.is_some() { 1 } else { forest.objects() }
}

fn trees_instructions(forest: &Forest<'_>, runs: &[Run], step: f64) -> usize {
    let of_run = |run: &Run| {
        let values = values(forest, run);
        let trees = run.trees.iter().map(|&tree| expected_steps(&forest.trees[tree].root));
        trees.map(|steps| cost::preorder_tree(steps, step, values)).sum::<usize>()
    };
    runs.iter().map(of_run).sum()
}

/// Steps to a leaf, if either side of a split is as likely.
fn expected_steps(branch: &Branch<'_>) -> f64 {
    match branch {
        Branch::Leaf(_) => 0.0,
        Branch::Split(split) => 1.0 + (expected_steps(&split.left) + expected_steps(&split.right)) / 2.0,
    }
}
