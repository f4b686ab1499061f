//! Leaves with a value for each object: votes and short lists, or rows of a table.

use super::super::program::{CodeTree, Program};
use super::Chip;
use super::assembler::{Assembler, Condition, Label};
use super::exits::Exits;
use super::walk::{self, Pins};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// Objects whose sums fit five registers, two in each.
const LANES: usize = 10;
/// Trees whose bytes add up within sixteen bits.
const MOST: usize = 256;

/// Adds up trees with a value for each object, to margins whose address is on the stack.
pub(super) fn write(
    out: &mut Assembler,
    program: &Program,
    trees: &[&CodeTree],
    address: usize,
    exits: Option<&Exits>,
) {
    out.ins(&format!("ldr r7, [sp, #{address}]"), 2);
    if let Some(vote) = program.vote() {
        return votes(out, program, trees, vote, exits);
    }
    let mut rest = Vec::new();
    let mut by_shift: BTreeMap<u32, Vec<&CodeTree>> = BTreeMap::new();
    for &tree in trees {
        match shift(tree).filter(|_| program.objects() <= LANES) {
            Some(shift) => by_shift.entry(shift).or_default().push(tree),
            None => rest.push(tree),
        }
    }
    for (shift, trees) in by_shift {
        trees.chunks(MOST).for_each(|trees| lanes(out, program, trees, shift, address));
    }
    if !rest.is_empty() {
        rows(out, program, &rest, address);
    }
}

/// The shift with which a tree's values are bytes.
fn shift(tree: &CodeTree) -> Option<u32> {
    (0..8).find(|&shift| {
        let mut fits = true;
        tree.root.leaves(1.0, &mut |values, _| {
            fits &= values.iter().all(|value| value % (1 << shift) == 0 && (value >> shift).abs() < 128);
        });
        fits
    })
}

/// Leaves of one class add a value to its margin at r7; the others are lists.
fn votes(out: &mut Assembler, program: &Program, trees: &[&CodeTree], vote: i32, exits: Option<&Exits>) {
    out.number("r6", vote as u32);
    let free: &[_] = if out.chip == Chip::M4F { &["r5", "r8", "r9", "r10", "r11", "r12"] } else { &["r5"] };
    let pins = Pins::new(out, program, trees, free);
    let list = out.label();
    let lists: RefCell<Lists> = RefCell::default();
    for (index, tree) in trees.iter().enumerate() {
        if let (Some(exits), Some((_, bound))) = (exits, program.exits.iter().find(|(end, _)| *end == index)) {
            exits.place(out, *bound);
        }
        let (end, next, mixed) = (out.label(), out.label(), out.label());
        let highs: RefCell<BTreeMap<usize, Label>> = RefCell::default();
        let put = |out: &mut Assembler, values: &[i32], _: bool, end: Label| {
            let given: Vec<(usize, i32)> =
                values.iter().copied().enumerate().filter(|(_, value)| *value != 0).collect();
            if let [(object, value)] = given[..]
                && value == vote
            {
                out.ins(&format!("movs r1, #{}", 4 * object), 2);
                out.branch(None, end);
                return 5.0;
            }
            let length = given.len();
            let number = lists.borrow_mut().number(given);
            out.ins(&format!("movs r1, #{}", number & 255), 2);
            let target = *highs.borrow_mut().entry(number >> 8).or_insert_with(|| out.label());
            out.branch(None, target);
            20.0 + 9.0 * length as f64
        };
        walk::vector(out, &pins, tree, &put, end);
        let highs = highs.into_inner();
        let last = highs.keys().next_back().copied();
        for (high, label) in highs {
            out.place(label);
            out.ins(&format!("movs r2, #{high}"), 2);
            if Some(high) != last {
                out.branch(None, mixed);
            }
        }
        if last.is_some() {
            out.place(mixed);
            out.call(list);
            out.branch(None, next);
        }
        out.place(end);
        out.ins("ldr r2, [r7, r1]", 2);
        out.ins("adds r2, r2, r6", 2);
        out.ins("str r2, [r7, r1]", 2);
        out.place(next);
    }
    let lists = lists.into_inner();
    if !lists.all.is_empty() {
        lists.write(out, list);
    }
}

/// Lists of objects and values, each once.
#[derive(Default)]
struct Lists {
    numbers: HashMap<Vec<(usize, i32)>, usize>,
    all: Vec<Vec<(usize, i32)>>,
}

impl Lists {
    fn number(&mut self, list: Vec<(usize, i32)>) -> usize {
        *self.numbers.entry(list.clone()).or_insert_with(|| {
            self.all.push(list);
            self.all.len() - 1
        })
    }

    /// The routine that adds the list with the number 256 · r2 + r1, and the lists.
    fn write(&self, out: &mut Assembler, routine: Label) {
        let (starts, entries, past) = (out.label(), out.label(), out.label());
        out.branch(None, past);
        out.place(routine);
        out.ins("lsls r2, r2, #8", 2);
        out.ins("adds r1, r1, r2", 2);
        out.ins("lsls r1, r1, #1", 2);
        out.load_address("r2", starts);
        out.ins("ldrh r1, [r2, r1]", 2);
        out.ins("lsls r1, r1, #2", 2);
        out.load_address("r2", entries);
        out.ins("adds r1, r1, r2", 2);
        out.ins("push {r5, r6}", 2);
        let again = out.here();
        // The object's place, with the highest bit at the end of the list.
        out.ins("ldrh r2, [r1]", 2);
        out.ins("ldrh r3, [r1, #2]", 2);
        out.ins("adds r1, #4", 2);
        out.ins("lsls r6, r2, #17", 2);
        out.ins("lsrs r6, r6, #17", 2);
        out.ins("ldr r5, [r7, r6]", 2);
        out.ins("adds r5, r5, r3", 2);
        out.ins("str r5, [r7, r6]", 2);
        out.ins("lsrs r2, r2, #15", 2);
        out.branch(Some(Condition::Equal), again);
        out.ins("pop {r5, r6}", 2);
        out.ins("bx lr", 2);
        out.pool();
        out.place(past);
        let (mut offsets, mut flat) = (Vec::new(), Vec::new());
        for list in &self.all {
            offsets.push((flat.len() / 2) as u16);
            for (index, &(object, value)) in list.iter().enumerate() {
                let end = if index + 1 == list.len() { 0x8000 } else { 0 };
                flat.extend([(4 * object as u16) | end, value as u16]);
            }
            if list.is_empty() {
                // Adds nothing to the first object.
                flat.extend([0x8000, 0]);
            }
        }
        out.table(starts, offsets);
        out.table(entries, flat);
    }
}

/// Leaves of bytes, of up to ten objects: sums of two objects in each of five registers.
fn lanes(out: &mut Assembler, program: &Program, trees: &[&CodeTree], shift: u32, address: usize) {
    let (add, table, past) = (out.label(), out.label(), out.label());
    let begin = out.count();
    for register in ["r8", "r9", "r10", "r11", "r12"] {
        if register == "r8" {
            out.ins("movs r1, #0", 2);
        }
        out.ins(&format!("mov {register}, r1"), 2);
    }
    out.ins("movs r5, #255", 2);
    out.ins("lsls r1, r5, #16", 2);
    out.ins("orrs r5, r1", 2);
    out.load_address("r6", table);
    out.branch(None, past);
    // Adds the row with the number r1 of those at r6.
    out.place(add);
    for instruction in [
        "lsls r2, r1, #1",
        "adds r1, r1, r2",
        "lsls r1, r1, #2",
        "adds r1, r1, r6",
        "ldmia r1!, {r2, r3}",
        "ldr r1, [r1]",
        "add r8, r2",
        "lsrs r2, r2, #8",
        "ands r2, r5",
        "add r9, r2",
        "add r10, r3",
        "lsrs r3, r3, #8",
        "ands r3, r5",
        "add r11, r3",
        "add r12, r1",
        "bx lr",
    ] {
        out.ins(instruction, 2);
    }
    out.pool();
    out.place(past);
    out.instructions += (out.count() - begin) as f64 - 19.0;
    let pins = Pins::new(out, program, trees, &["r7"]);
    let rows: RefCell<Vec<i32>> = RefCell::default();
    for tree in trees {
        let end = out.label();
        let number = RefCell::new(0);
        let put = |out: &mut Assembler, values: &[i32], is_last: bool, end: Label| {
            let count = out.count();
            out.number("r1", *number.borrow());
            if !is_last {
                out.branch(None, end);
            }
            *number.borrow_mut() += 1;
            rows.borrow_mut().extend(row(values, shift));
            (out.count() - count) as f64
        };
        walk::vector(out, &pins, tree, &put, end);
        out.place(end);
        out.call(add);
        let mut step = 12 * *number.borrow() as usize;
        out.instructions += 17.0;
        while step > 0 {
            let part = step.min(252);
            out.ins(&format!("adds r6, #{part}"), 2);
            out.instructions += 1.0;
            step -= part;
        }
    }
    out.word_table(table, rows.into_inner());
    settle(out, program, trees.len(), shift, address);
}

/// A row of ten values: bytes of the first eight, with 128 more than they are, then halves.
fn row(values: &[i32], shift: u32) -> [i32; 3] {
    let byte = |index: usize| values.get(index).map_or(0, |value| (value >> shift) + 128) as u32;
    let word = |first: usize| (0..4).map(|place| byte(first + place) << (8 * place)).sum::<u32>();
    [word(0), word(4), byte(8) | byte(9) << 16].map(u32::cast_signed)
}

/// Adds the sums to the margins.
fn settle(out: &mut Assembler, program: &Program, trees: usize, shift: u32, address: usize) {
    let count = out.count();
    out.ins(&format!("ldr r7, [sp, #{address}]"), 2);
    // Whole words less the bytes that were cut out.
    for (whole, cut) in [("r8", "r9"), ("r10", "r11")] {
        out.ins(&format!("mov r1, {whole}"), 2);
        out.ins(&format!("mov r2, {cut}"), 2);
        out.ins("lsls r2, r2, #8", 2);
        out.ins("subs r1, r1, r2", 2);
        out.ins(&format!("mov {whole}, r1"), 2);
    }
    out.number("r4", 128 * trees as u32);
    // Objects 0 and 2, 1 and 3, and so on.
    for (register, objects) in [("r8", [0, 2]), ("r9", [1, 3]), ("r10", [4, 6]), ("r11", [5, 7]), ("r12", [8, 9])] {
        for (half, object) in objects.into_iter().enumerate().filter(|(_, object)| *object < program.objects()) {
            out.ins(&format!("mov r1, {register}"), 2);
            if half == 0 {
                out.ins("lsls r1, r1, #16", 2);
            }
            out.ins("lsrs r1, r1, #16", 2);
            out.ins("subs r1, r1, r4", 2);
            if shift > 0 {
                out.ins(&format!("lsls r1, r1, #{shift}"), 2);
            }
            out.ins(&format!("ldr r2, [r7, #{}]", 4 * object), 2);
            out.ins("adds r1, r1, r2", 2);
            out.ins(&format!("str r1, [r7, #{}]", 4 * object), 2);
        }
    }
    out.instructions += (out.count() - count) as f64;
}

/// Leaves of two bytes for each object, of any number of objects.
fn rows(out: &mut Assembler, program: &Program, trees: &[&CodeTree], address: usize) {
    let objects = program.objects();
    let (add, table, past) = (out.label(), out.label(), out.label());
    out.ins(&format!("ldr r7, [sp, #{address}]"), 2);
    out.load_address("r6", table);
    out.branch(None, past);
    out.place(add);
    // The row with the number r1 of those at r6 to the margins at r7.
    out.number("r2", 2 * objects as u32);
    out.ins("muls r1, r2, r1", 2);
    out.ins("adds r1, r1, r6", 2);
    out.ins("push {r5}", 2);
    out.ins("mov r2, r7", 2);
    let again = out.here();
    out.ins("ldrh r3, [r1]", 2);
    out.ins("sxth r3, r3", 2);
    out.ins("adds r1, #2", 2);
    out.ins("ldr r5, [r2]", 2);
    out.ins("adds r5, r5, r3", 2);
    out.ins("stmia r2!, {r5}", 2);
    out.ins("cmp r2, r8", 2);
    out.branch(Some(Condition::NotEqual), again);
    out.ins("pop {r5}", 2);
    out.ins("bx lr", 2);
    out.pool();
    out.place(past);
    out.number("r3", 4 * objects as u32);
    out.ins("adds r3, r3, r7", 2);
    out.ins("mov r8, r3", 2);
    let free: &[_] = if out.chip == Chip::M4F { &["r5", "r9", "r10", "r11", "r12"] } else { &["r5"] };
    let pins = Pins::new(out, program, trees, free);
    let rows: RefCell<Vec<u16>> = RefCell::default();
    for tree in trees {
        let end = out.label();
        let number = RefCell::new(0_u32);
        let put = |out: &mut Assembler, values: &[i32], is_last: bool, end: Label| {
            let count = out.count();
            out.number("r1", *number.borrow());
            if !is_last {
                out.branch(None, end);
            }
            *number.borrow_mut() += 1;
            rows.borrow_mut().extend(values.iter().map(|value| *value as i16 as u16));
            (out.count() - count) as f64
        };
        walk::vector(out, &pins, tree, &put, end);
        out.place(end);
        out.call(add);
        let step = 2 * objects as u32 * *number.borrow();
        let count = out.count();
        out.number("r3", step);
        out.ins("adds r6, r6, r3", 2);
        out.instructions += (out.count() - count) as f64 + 10.0 + 8.0 * objects as f64;
    }
    out.table(table, rows.into_inner());
}
