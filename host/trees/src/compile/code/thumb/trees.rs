//! Trees: comparisons of ranks, and what leaves do.

use super::super::program::{CodeNode, CodeSplit, CodeTree, Program};
use super::assembler::{Assembler, Condition, Label};
use super::{Chip, Frame, vectors};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// Registers with the numbers of columns.
pub(in super::super) struct Pins {
    registers: BTreeMap<usize, &'static str>,
    /// True if r4 is 32 beyond r0, for the columns from 32 on.
    has_second: bool,
}

/// Data that a walk uses.
struct Walk<'w> {
    pins: &'w Pins,
    put: &'w dyn Fn(&mut Assembler, &CodeNode, bool, Label) -> f64,
    bytes: &'w dyn Fn(&CodeNode) -> usize,
    /// Where leaves stand that others may branch to: with the position there.
    shared: Option<&'w Shared>,
}

/// Leaves of a tree that are there once.
type Shared = RefCell<HashMap<Vec<i32>, (usize, Label)>>;

/// A short branch reaches what is this many bytes before it.
const REACH: usize = 240;

/// Adds up all trees: those of each object, then those with a value for each. The columns are at the stack pointer.
pub(in super::super) fn write(out: &mut Assembler, program: &Program, frame: &Frame) {
    let address = frame.margins(out.chip);
    for object in 0..program.objects() {
        let trees: Vec<&CodeTree> = program.trees.iter().filter(|tree| tree.object == Some(object)).collect();
        one(out, program, &trees, program.base[object]);
        out.ins(&format!("ldr r3, [sp, #{address}]"), 2);
        out.ins("stmia r3!, {r1}", 2);
        out.ins(&format!("str r3, [sp, #{address}]"), 2);
        out.instructions += 3.0;
    }
    if program.has_vectors() {
        // Back to the first margin.
        out.ins(&format!("ldr r1, [sp, #{address}]"), 2);
        out.number("r3", 4 * program.objects() as u32);
        out.ins("subs r1, r1, r3", 2);
        out.ins(&format!("str r1, [sp, #{address}]"), 2);
        let trees: Vec<&CodeTree> = program.trees.iter().filter(|tree| tree.object.is_none()).collect();
        vectors::walk(out, program, &trees, address);
    }
}

/// The sum of an object's trees, from `start` on, in r1.
pub(in super::super) fn one(out: &mut Assembler, program: &Program, trees: &[&CodeTree], start: i32) {
    // The likeliest leaf of a tree that costs most adds nothing: the start has it.
    let zeros: Vec<i32> = trees.iter().map(|tree| zero(tree, out.chip)).collect();
    let start = zeros.iter().fold(start, |sum, zero| sum.wrapping_add(*zero));
    if trees.is_empty() {
        signed(out, "r1", start);
        return;
    }
    sums(out, start);
    let free: &[_] = match out.chip {
        Chip::M0Plus => &["r5", "r6", "r7"],
        Chip::M4F => &["r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "lr"],
    };
    let pins = Pins::new(out, program, trees, free);
    for (tree, zero) in trees.iter().zip(zeros) {
        let end = out.label();
        let chip = out.chip;
        let walk = Walk {
            pins: &pins,
            put: &|out, leaf, is_last, end| {
                let count = out.count();
                add(out, value(leaf).wrapping_sub(zero));
                if !is_last {
                    out.branch(None, end);
                }
                (out.count() - count) as f64
            },
            bytes: &|leaf| 2 + 2 * additions(value(leaf).wrapping_sub(zero), chip),
            shared: None,
        };
        node(out, &walk, &tree.root, None, true, end, 1.0);
        out.place(end);
    }
    out.ins("lsls r1, r1, #8", 2);
    out.ins("adds r1, r1, r2", 2);
    out.instructions += 2.0;
}

fn value(leaf: &CodeNode) -> i32 {
    match leaf {
        CodeNode::Leaf(values) => values.first().copied().unwrap_or(0),
        CodeNode::Split(_) => 0,
    }
}

/// The value of a leaf that all leaves of a tree are counted from, so that what they add takes the fewest instructions.
fn zero(tree: &CodeTree, chip: Chip) -> i32 {
    let mut leaves = Vec::new();
    tree.root.leaves(1.0, &mut |values, chance| leaves.push((values[0], chance)));
    let cost = |zero: i32| -> f64 {
        leaves.iter().map(|&(value, chance)| chance * additions(value.wrapping_sub(zero), chip) as f64).sum()
    };
    // Among those that are likely: a tree has thousands of leaves at most, of which few are.
    let mut candidates = leaves.clone();
    candidates.sort_by(|a, b| b.1.total_cmp(&a.1));
    candidates.truncate(16);
    let values = candidates.into_iter().map(|(value, _)| value).chain([0]);
    values.map(|zero| (zero, cost(zero))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(zero, _)| zero)
}

/// 256 · high + low, low from 0 to 255 or, with high 0, from -255 on.
fn halves(value: i32) -> (i32, i32) {
    if (-255..0).contains(&value) { (0, value) } else { (value >> 8, value & 255) }
}

/// Instructions that adding a value takes.
fn additions(value: i32, chip: Chip) -> usize {
    let (high, low) = halves(value);
    if is_wide(value, chip) {
        return 1;
    }
    usize::from(low != 0) + if high.unsigned_abs() < 1 << 10 { (high.unsigned_abs() as usize).div_ceil(255) } else { 8 }
}

/// True if a Cortex-M4 adds it at once, where others take two additions.
fn is_wide(value: i32, chip: Chip) -> bool {
    let (high, low) = halves(value);
    chip == Chip::M4F && high != 0 && low != 0 && value.unsigned_abs() < 4096
}

/// Adds a value to 256 · r1 + r2.
fn add(out: &mut Assembler, value: i32) {
    if is_wide(value, out.chip) {
        let what = if value > 0 { "addw" } else { "subw" };
        out.ins(&format!("{what} r2, r2, #{}", value.unsigned_abs()), 4);
        return;
    }
    let (high, low) = halves(value);
    let mut left = high.unsigned_abs();
    let what = if high > 0 { "adds" } else { "subs" };
    if left >= 1 << 10 {
        // Rare: leaves in a large unit.
        out.number("r3", left);
        out.ins(&format!("{what} r1, r1, r3"), 2);
        left = 0;
    }
    while left > 0 {
        let part = left.min(255);
        out.ins(&format!("{what} r1, #{part}"), 2);
        left -= part;
    }
    match low {
        0 => {}
        1.. => out.ins(&format!("adds r2, #{low}"), 2),
        _ => out.ins(&format!("subs r2, #{}", -low), 2),
    }
}

/// Starts the two sums.
fn sums(out: &mut Assembler, start: i32) {
    let count = out.count();
    signed(out, "r1", start >> 8);
    out.ins(&format!("movs r2, #{}", start & 255), 2);
    out.instructions += (out.count() - count) as f64;
}

/// Puts a number into a low register.
pub(in super::super) fn signed(out: &mut Assembler, register: &str, number: i32) {
    out.number(register, number.unsigned_abs());
    if number < 0 {
        out.ins(&format!("rsbs {register}, {register}, #0"), 2);
    }
}

impl Pins {
    /// Loads what is compared most into registers, which stay as they are.
    pub(in super::super) fn new(
        out: &mut Assembler,
        program: &Program,
        trees: &[&CodeTree],
        others: &[&'static str],
    ) -> Self {
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
    /// Where the same leaf stands already, within reach, and about what it takes there.
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
fn node(
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
pub(in super::super) fn vector(out: &mut Assembler, pins: &Pins, tree: &CodeTree, put: Put<'_>, end: Label) {
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
