//! Walks of trees: comparisons of ranks, some of which stay in registers, and branches.

use super::super::program::{CodeNode, CodeSplit, CodeTree, Program};
use super::Chip;
use super::assembler::{Assembler, Condition, Label};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// Registers with the numbers of columns.
pub(super) struct Pins {
    registers: BTreeMap<usize, &'static str>,
    /// True if r4 is 32 beyond r0, for the columns from 32 on.
    has_second: bool,
}

/// Data that a walk uses.
pub(super) struct Walk<'w> {
    pub(super) pins: &'w Pins,
    pub(super) put: &'w dyn Fn(&mut Assembler, &CodeNode, bool, Label) -> f64,
    pub(super) bytes: &'w dyn Fn(&CodeNode) -> usize,
    /// Positions of leaves that others may branch to.
    pub(super) shared: Option<&'w Shared>,
}

/// Leaves of a tree that are there once.
pub(super) type Shared = RefCell<HashMap<Vec<i32>, (usize, Label)>>;

/// A short branch reaches what is this many bytes before it.
const REACH: usize = 240;

impl Pins {
    /// Loads what is compared most into registers, which stay as they are.
    pub(super) fn new(out: &mut Assembler, program: &Program, trees: &[&CodeTree], others: &[&'static str]) -> Self {
        let mut weights: BTreeMap<usize, f64> = BTreeMap::new();
        for tree in trees {
            tree.root.splits(1.0, &mut |split, chance| *weights.entry(split.column).or_default() += chance);
        }
        let mut order: Vec<usize> = weights.keys().copied().collect();
        order.sort_by(|a, b| weights[b].total_cmp(&weights[a]));
        let has_second = program.columns.len() > 32;
        let mut free: Vec<&'static str> = if has_second { Vec::new() } else { vec!["r4"] };
        free.extend(others);
        let count = out.count();
        out.ins("mov r0, sp", 2);
        if has_second {
            out.ins("mov r4, r0", 2);
            out.ins("adds r4, #32", 2);
        }
        let mut pins = Self { registers: BTreeMap::new(), has_second };
        // What is compared once is loaded where it is compared.
        for (&column, register) in order.iter().filter(|column| weights[column] >= 1.0).zip(free) {
            pins.load(out, column, register);
            pins.registers.insert(column, register);
        }
        out.instructions += (out.count() - count) as f64;
        pins
    }

    /// Loads a column; how many instructions that takes.
    fn load(&self, out: &mut Assembler, column: usize, register: &str) -> f64 {
        let is_low = matches!(register, "r3" | "r4" | "r5" | "r6" | "r7");
        let count = out.count();
        match (column, out.chip) {
            (0..32, _) if is_low => out.ins(&format!("ldrb {register}, [r0, #{column}]"), 2),
            (32..64, _) if is_low && self.has_second => {
                out.ins(&format!("ldrb {register}, [r4, #{}]", column - 32), 2);
            }
            (_, Chip::M4F) => out.ins(&format!("ldrb.w {register}, [r0, #{column}]"), 4),
            (_, Chip::M0Plus) => {
                out.ins(&format!("movs {register}, #{column}"), 2);
                out.ins(&format!("ldrb {register}, [r0, {register}]"), 2);
            }
        }
        (out.count() - count) as f64
    }

    /// Bytes of a comparison, about.
    fn bytes(&self, split: &CodeSplit) -> usize {
        if self.registers.contains_key(&split.column) { 2 } else { 4 }
    }
}

impl Walk<'_> {
    /// An equal leaf within reach, and about what a branch to it takes.
    fn standing(&self, out: &Assembler, node: &CodeNode) -> Option<(Label, f64)> {
        let CodeNode::Leaf(values) = node else { return None };
        let (position, label) = *self.shared?.borrow().get(values)?;
        (out.position() - position < REACH).then_some((label, 5.0))
    }
}

/// Bytes of a branch of a tree, about.
fn bytes(walk: &Walk<'_>, node: &CodeNode) -> usize {
    match node {
        CodeNode::Leaf(_) => (walk.bytes)(node),
        CodeNode::Split(split) => walk.pins.bytes(split) + 2 + bytes(walk, &split.left) + bytes(walk, &split.right),
    }
}

/// Writes a branch of a tree that is reached with this chance, where r3 has the number of the column `have`; the last of a
/// tree runs on into what follows it.
pub(super) fn node(
    out: &mut Assembler,
    walk: &Walk<'_>,
    at: &CodeNode,
    mut have: Option<usize>,
    is_last: bool,
    end: Label,
    chance: f64,
) {
    let CodeNode::Split(split) = at else {
        out.instructions += chance * (walk.put)(out, at, is_last, end);
        return;
    };
    let mut count = 2.0;
    if let Some(register) = walk.pins.registers.get(&split.column) {
        let bytes = if matches!(*register, "r4" | "r5" | "r6" | "r7") { 2 } else { 4 };
        let what = if bytes == 2 { "cmp" } else { "cmp.w" };
        out.ins(&format!("{what} {register}, #{}", split.at), bytes);
    } else {
        if have != Some(split.column) {
            count += walk.pins.load(out, split.column, "r3");
            have = Some(split.column);
        }
        out.ins(&format!("cmp r3, #{}", split.at), 2);
    }
    for (child, condition, other) in
        [(&split.left, Condition::LowerOrSame, &split.right), (&split.right, Condition::Higher, &split.left)]
    {
        if let Some((label, cost)) = walk.standing(out, child) {
            out.instructions += chance * (count + cost / 2.0);
            out.branch(Some(condition), label);
            return node(out, walk, other, have, is_last, end, chance / 2.0);
        }
    }
    let [left, right] = [bytes(walk, &split.left), bytes(walk, &split.right)];
    let (first, condition, second) = if left <= right {
        (&split.left, Condition::Higher, &split.right)
    } else {
        (&split.right, Condition::LowerOrSame, &split.left)
    };
    out.instructions += chance * count;
    let other = out.label();
    out.branch(Some(condition), other);
    node(out, walk, first, have, false, end, chance / 2.0);
    out.place(other);
    node(out, walk, second, have, is_last, end, chance / 2.0);
}

/// Writes what a leaf with these values does, `true` if it is the last one before the end, and says how many instructions that
/// takes.
type Put<'a> = &'a dyn Fn(&mut Assembler, &[i32], bool, Label) -> f64;

/// Walks a tree of vectors; `put` writes what a leaf does, and says how many instructions that takes.
pub(super) fn vector(out: &mut Assembler, pins: &Pins, tree: &CodeTree, put: Put<'_>, end: Label) {
    let values = |at: &CodeNode| match at {
        CodeNode::Leaf(values) => values.clone(),
        CodeNode::Split(_) => Vec::new(),
    };
    let shared = Shared::default();
    let put = |out: &mut Assembler, at: &CodeNode, is_last: bool, end: Label| {
        let here = (out.position(), out.here());
        let values = values(at);
        let count = put(out, &values, is_last, end);
        // What runs on into the end is no shorter as a branch.
        if !is_last {
            shared.borrow_mut().insert(values, here);
        }
        count
    };
    let walk = Walk { pins, put: &put, bytes: &|_| 4, shared: Some(&shared) };
    node(out, &walk, &tree.root, None, true, end, 1.0);
}
