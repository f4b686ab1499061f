//! A model's trees as the chip reads them: split by split in the model's own bytes, which nothing unpacks.

use super::ProofProblem;
use super::boxes::{Rows, Rule, See, sides};
use super::format::Exit;
use palpate_onboard::Model;
use palpate_shared::format::{Axis, CHECKSUM_LENGTH, Columns, Group, HEADER_LENGTH, Layout, LeafType, SharedLeaves};

/// A model's sections.
pub(super) struct Chip<'m> {
    model: Model<'m>,
    /// Each column: its feature, where a missing value goes, its thresholds.
    columns: Vec<(usize, bool, Vec<i64>)>,
    /// All thresholds of wide trees.
    cuts: Vec<i64>,
    shared: Option<SharedLeaves<'m>>,
    /// Size of a unit in the library's margins.
    unit: f64,
    groups: Vec<Group>,
    splits: &'m [u8],
    leaves: &'m [u8],
}

/// A tree in the bytes of a model.
pub(super) struct ChipTree<'c> {
    pub(super) object: Option<usize>,
    /// Size in margins of one whole step of its leaves; 0 for f32.
    pub(super) step: f64,
    shape: Shape<'c>,
    /// Its leaves, each of `stored` bytes.
    leaves: &'c [u8],
    stored: usize,
    length: usize,
}

enum Shape<'c> {
    /// Splits of three or six bytes in preorder.
    Preorder(&'c [u8], usize),
    /// Columns and thresholds of all slots.
    Complete(&'c [u8], &'c [u8]),
}

const DAMAGED: ProofProblem = ProofProblem::Format { what: "a section ends too early" };

fn signed(bytes: &[u8]) -> i64 {
    let value = bytes.iter().rev().fold(0_u64, |value, &byte| value << 8 | u64::from(byte));
    let unused = 64 - 8 * bytes.len() as u32;
    if bytes.is_empty() { 0 } else { ((value << unused) as i64) >> unused }
}

impl<'m> Chip<'m> {
    pub(super) fn new(model: Model<'m>, unit: f64) -> Result<Self, ProofProblem> {
        let (bytes, header) = (model.bytes(), model.header());
        let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
        let mut at = HEADER_LENGTH + length(header.text_length()) + length(header.optional_length());
        let mut part = |length: usize| {
            let part = bytes.get(at..at.checked_add(length)?)?;
            at += length;
            Some(part)
        };
        let objects = model.object_count();
        part(8 * objects).ok_or(DAMAGED)?;
        let axes = part(Axis::LENGTH * usize::from(header.axes())).ok_or(DAMAGED)?;
        let thresholds = part(length(header.cuts_length())).ok_or(DAMAGED)?;
        let groups = part(Group::LENGTH * usize::from(header.groups())).ok_or(DAMAGED)?;
        let splits = part(length(header.nodes_length())).ok_or(DAMAGED)?;
        let leaves = part(length(header.leaves_length())).ok_or(DAMAGED)?;
        if at + CHECKSUM_LENGTH != bytes.len() {
            return Err(DAMAGED);
        }
        let is_wide = model.layout() == Layout::Wide;
        let (mut columns, mut rest) = (Vec::new(), thresholds);
        for axis in axes.as_chunks().0 {
            let axis = Axis::from_bytes(*axis).ok_or(DAMAGED)?;
            let (own, after) = rest.split_at_checked(axis.cuts_length()).ok_or(DAMAGED)?;
            rest = after;
            let cuts: Vec<i64> = own.chunks(usize::from(axis.width).max(1)).map(signed).collect();
            let sides: &[bool] = match axis.columns {
                Columns::MissingLeft => &[true],
                Columns::MissingRight => &[false],
                Columns::Both => &[true, false],
            };
            columns.extend(sides.iter().map(|&left| (usize::from(axis.feature), left, cuts.clone())));
        }
        let scale = f64::from(model.prediction().scale);
        let is_f32 = model.leaf_type() == LeafType::F32;
        Ok(Self {
            columns,
            cuts: if is_wide { thresholds.chunks(4).map(signed).collect() } else { Vec::new() },
            shared: model.shared_leaves(),
            unit: if is_f32 { scale } else { unit },
            groups: groups.as_chunks().0.iter().filter_map(|group| Group::from_bytes(*group)).collect(),
            splits,
            leaves,
            model,
        })
    }

    /// The trees in the model's order.
    pub(super) fn trees(&self) -> Result<Vec<ChipTree<'_>>, ProofProblem> {
        let (mut splits, mut leaves) = (self.splits, self.leaves);
        let (size, objects) = (self.model.leaf_type().size(), self.model.object_count());
        let take = |from: &mut &'m [u8], length: usize| {
            let (part, rest) = from.split_at_checked(length).ok_or(DAMAGED)?;
            *from = rest;
            Ok(part)
        };
        let mut trees = Vec::new();
        for group in &self.groups {
            let length = size * if group.object.is_some() { 1 } else { objects };
            let stored = self.shared.as_ref().map_or(length, SharedLeaves::number_length);
            let step = if self.is_f32() { 0.0 } else { self.unit * f64::from(group.shift).exp2() };
            let object = group.object.map(usize::from);
            let count = usize::try_from(group.trees).unwrap_or(usize::MAX);
            let slots = 1_usize.checked_shl(group.depth.into()).ok_or(DAMAGED)?;
            // Of all complete trees of a group the columns come first.
            let complete = match self.model.layout() {
                Layout::Complete => {
                    let all = slots.checked_mul(count).ok_or(DAMAGED)?;
                    Some((take(&mut splits, all)?, take(&mut splits, all)?))
                }
                _ => None,
            };
            for tree in 0..count {
                let (shape, leaf_count) = if let Some((columns, cuts)) = complete {
                    let own = tree * slots..(tree + 1) * slots;
                    (Shape::Complete(&columns[own.clone()], &cuts[own]), slots)
                } else {
                    let bytes = if self.model.layout() == Layout::Wide { 6 } else { 3 };
                    let count = signed(take(&mut splits, 2)?) as u16 as usize;
                    (Shape::Preorder(take(&mut splits, count * bytes)?, bytes), count + 1)
                };
                let leaves = take(&mut leaves, leaf_count * stored)?;
                trees.push(ChipTree { object, step, shape, leaves, stored, length });
            }
        }
        Ok(trees)
    }

    fn is_f32(&self) -> bool {
        self.model.leaf_type() == LeafType::F32
    }

    /// Values of a leaf of a tree.
    fn values(&self, tree: &ChipTree<'_>, leaf: usize) -> Option<Vec<f64>> {
        let mut own = tree.leaves.get(leaf * tree.stored..(leaf + 1) * tree.stored)?;
        if let Some(shared) = &self.shared {
            let number = usize::from(shared.number(tree.leaves, leaf));
            own = shared.values().get(number * tree.length..(number + 1) * tree.length)?;
        }
        let value = |bytes: &[u8]| match self.model.leaf_type() {
            LeafType::I8 => f64::from(i32::from(bytes[0]) - 128) * tree.step,
            LeafType::I16 => signed(bytes) as f64 * tree.step,
            LeafType::F32 => f64::from(f32::from_bits(signed(bytes) as u32)) * self.unit,
        };
        Some(own.chunks(self.model.leaf_type().size()).map(value).collect())
    }

    /// Rule of a split by rank: right if the rank is above `at`.
    fn ranked(&self, column: u8, at: u8) -> Rule {
        let Some((feature, is_left, cuts)) = self.columns.get(usize::from(column)) else { return Rule::EITHER };
        let cut = cuts.get(usize::from(at)).copied().unwrap_or(i64::MAX);
        // The rank of a missing value is 0 or 255.
        Rule { feature: *feature, cut, missing_left: *is_left || at == u8::MAX }
    }

    /// Calls `see` with the values of each leaf that some of `rows` reach.
    pub(super) fn reach(
        &self,
        tree: &ChipTree<'_>,
        rows: &mut Rows,
        see: &mut See<'_, ProofProblem>,
    ) -> Result<(), ProofProblem> {
        match tree.shape {
            Shape::Preorder(splits, size) => self.preorder(tree, splits, size, [0, splits.len() / size, 0], rows, see),
            Shape::Complete(columns, cuts) => self.complete(tree, [columns, cuts], 1, rows, see),
        }
    }

    /// The subtree of `below` splits from split `at` on, whose leaves begin with `leaf`.
    fn preorder(
        &self,
        tree: &ChipTree<'_>,
        splits: &[u8],
        size: usize,
        [at, below, leaf]: [usize; 3],
        rows: &mut Rows,
        see: &mut See<'_, ProofProblem>,
    ) -> Result<(), ProofProblem> {
        if below == 0 {
            return see(&self.values(tree, leaf).ok_or(DAMAGED)?, rows);
        }
        let split = splits.get(at * size..(at + 1) * size).ok_or(DAMAGED)?;
        let (rule, left) = match *split {
            [column, cut, left] => (self.ranked(column, cut), usize::from(left)),
            [feature, missing, a, b, c, d] => {
                let cut = self.cuts.get(usize::from(u16::from_le_bytes([a, b]))).copied().ok_or(DAMAGED)?;
                let rule = Rule { feature: feature.into(), cut, missing_left: missing != 0 };
                (rule, usize::from(u16::from_le_bytes([c, d])))
            }
            _ => return Err(DAMAGED),
        };
        let right = below.checked_sub(left + 1).ok_or(DAMAGED)?;
        sides(rows, rule, |side, rows| match side {
            0 => self.preorder(tree, splits, size, [at + 1, left, leaf], rows, see),
            _ => self.preorder(tree, splits, size, [at + 1 + left, right, leaf + left + 1], rows, see),
        })
    }

    fn complete(
        &self,
        tree: &ChipTree<'_>,
        slots: [&[u8]; 2],
        slot: usize,
        rows: &mut Rows,
        see: &mut See<'_, ProofProblem>,
    ) -> Result<(), ProofProblem> {
        let count = slots[0].len();
        if slot >= count {
            return see(&self.values(tree, slot - count).ok_or(DAMAGED)?, rows);
        }
        let rule = self.ranked(slots[0][slot], slots[1][slot]);
        sides(rows, rule, |side, rows| self.complete(tree, slots, 2 * slot + side, rows, see))
    }

    /// Places where walks for a class alone may end.
    pub(super) fn exits(&self) -> Vec<Exit> {
        if self.is_f32() {
            return Vec::new();
        }
        let trees = |groups: u16| self.groups.iter().take(groups.into()).map(|group| group.trees as usize).sum();
        let exit = |exit: palpate_shared::format::EarlyExit| Exit {
            trees: trees(exit.groups),
            bound: f64::from(exit.bound) * self.unit,
            later: Vec::new(),
        };
        self.model.early_exits().map(exit).collect()
    }

    /// True if margins are a table's.
    pub(super) fn is_table(&self) -> bool {
        matches!(self.model.layout(), Layout::Grid | Layout::Patterns)
    }

    /// Thresholds of a feature, in any order.
    pub(super) fn cuts_of(&self, feature: usize) -> Vec<i64> {
        let own = self.columns.iter().filter(|(of, ..)| *of == feature);
        own.flat_map(|(.., cuts)| cuts.iter().copied()).collect()
    }

    /// Margins of a row, as the chip computes them.
    pub(super) fn margins(&self, row: &[i32]) -> Option<Vec<f64>> {
        let objects = self.model.object_count();
        if self.is_f32() {
            let mut margins = vec![0.0_f32; objects];
            return self
                .model
                .f32_margins_of(row, &mut margins)
                .then(|| margins.into_iter().map(|margin| f64::from(margin) * self.unit).collect());
        }
        let mut margins = vec![0; objects];
        self.model
            .margins_of(row, &mut margins)
            .then(|| margins.into_iter().map(|margin| f64::from(margin) * self.unit).collect())
    }
}
