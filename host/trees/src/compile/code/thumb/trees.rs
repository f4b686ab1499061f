//! Trees of one object each: leaves that add a number.

use super::super::program::{CodeNode, CodeTree, Program};
use super::assembler::Assembler;
use super::exits::Exits;
use super::walk::{Pins, Walk, node};
use super::{Chip, Frame, vectors};

/// Adds up all trees: those of each object, then those with a value for each. The columns are at the stack pointer.
pub(in super::super) fn write(out: &mut Assembler, program: &Program, frame: &Frame, exits: Option<&Exits>) {
    let address = frame.margins(out.chip);
    let mut parts = program.parts();
    let first = if program.has_vectors() { None } else { parts.next() };
    let first_trees = first.map_or(program.trees.as_slice(), |(trees, _)| trees);
    for object in 0..program.objects() {
        let trees: Vec<&CodeTree> = first_trees.iter().filter(|tree| tree.object == Some(object)).collect();
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
        vectors::write(out, program, &trees, address, exits);
    } else if let (Some(exits), Some((_, Some(bound)))) = (exits, first) {
        // Back to the first margin.
        out.ins(&format!("ldr r1, [sp, #{address}]"), 2);
        out.number("r3", 4 * program.objects() as u32);
        out.ins("subs r1, r1, r3", 2);
        out.ins(&format!("str r1, [sp, #{address}]"), 2);
        out.instructions += 4.0;
        exits.place(out, bound);
        for (trees, bound) in parts {
            later(out, program, trees, address);
            if let Some(bound) = bound {
                exits.place(out, bound);
            }
        }
    }
}

/// The trees in the order in which they are written, and what the base has instead of each.
pub(super) fn order(program: &Program, chip: Chip) -> Vec<(usize, i32)> {
    let mut order = Vec::new();
    let mut first = 0;
    for (trees, _) in program.parts() {
        for object in 0..program.objects() {
            let own = trees.iter().zip(first..).filter(|(tree, _)| tree.object == Some(object));
            order.extend(own.map(|(tree, number)| (number, zero(tree, chip))));
        }
        first += trees.len();
    }
    let each = program.trees.iter().zip(0..).filter(|(tree, _)| tree.object.is_none());
    order.extend(each.map(|(_, number)| (number, 0)));
    order
}

/// Adds trees of one object each to margins that are there.
fn later(out: &mut Assembler, program: &Program, trees: &[CodeTree], address: usize) {
    for object in 0..program.objects() {
        let trees: Vec<&CodeTree> = trees.iter().filter(|tree| tree.object == Some(object)).collect();
        if trees.is_empty() {
            continue;
        }
        one(out, program, &trees, 0);
        let count = out.count();
        out.ins(&format!("ldr r3, [sp, #{address}]"), 2);
        if object > 0 {
            out.number("r2", 4 * object as u32);
            out.ins("adds r3, r3, r2", 2);
        }
        out.ins("ldr r2, [r3]", 2);
        out.ins("adds r1, r1, r2", 2);
        out.ins("str r1, [r3]", 2);
        out.instructions += (out.count() - count) as f64;
    }
}

/// The sum of an object's trees, from `start` on, in r1.
fn one(out: &mut Assembler, program: &Program, trees: &[&CodeTree], start: i32) {
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
    // Among the likely ones: a tree has thousands of leaves at most, and few are likely.
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
fn signed(out: &mut Assembler, register: &str, number: i32) {
    out.number(register, number.unsigned_abs());
    if number < 0 {
        out.ins(&format!("rsbs {register}, {register}, #0"), 2);
    }
}
