//! From features to the columns' numbers.

use super::super::columns::{Column, Kind};
use super::super::program::Program;
use super::assembler::{Assembler, Condition, Label};
use super::{Chip, Frame};
use palpate_shared::format::Key;

/// Columns that are made by the same instructions.
struct Run<'p> {
    columns: &'p [Column],
    which: Label,
    cuts: Label,
    kind: Kind,
    missing_left: bool,
    /// True if no threshold is below 0 or 0: then f32 values compare as their bits do.
    positive: bool,
}

/// Writes the numbers of all columns to the stack. The features are at r0; all registers are used.
pub(in super::super) fn write(out: &mut Assembler, program: &Program, frame: &Frame) {
    if program.columns.is_empty() {
        return;
    }
    debug_assert!(frame.columns >= program.columns.len());
    let is_one_run = |a: &Column, b: &Column| (a.kind, a.missing_left) == (b.kind, b.missing_left);
    let mut runs = Vec::new();
    for columns in program.columns.chunk_by(is_one_run) {
        let first = &columns[0];
        let positive = columns.iter().all(|column| column.cuts.iter().all(|cut| *cut > 0));
        let (which, cuts) = (out.label(), out.label());
        runs.push(Run { columns, which, cuts, kind: first.kind, missing_left: first.missing_left, positive });
    }
    let tables = out.label();
    out.ins("mov r6, sp", 2);
    out.instructions += 16.0;
    for run in &runs {
        write_run(out, program, run);
    }
    // Past the tables, which are here so that they are with the code.
    out.branch(None, tables);
    out.pool();
    for run in &runs {
        if let Kind::Search { steps } = run.kind {
            out.align();
            out.place(run.cuts);
            for column in run.columns {
                let padding = (1_usize << steps) - 1 - column.cuts.len();
                out.words(column.cuts.iter().copied().chain(std::iter::repeat_n(i32::MAX, padding)));
            }
        }
    }
    for run in &runs {
        out.place(run.which);
        out.data(run.columns.iter().map(|column| column.feature).collect());
    }
    out.align();
    out.place(tables);
}

fn write_run(out: &mut Assembler, program: &Program, run: &Run<'_>) {
    let count = run.columns.len();
    out.load_address("r1", run.which);
    out.ins("mov r3, r6", 2);
    add(out, "r3", count);
    out.ins("mov r12, r3", 2);
    let is_search = matches!(run.kind, Kind::Search { .. });
    if is_search {
        out.load_address("r2", run.cuts);
    }
    let checks = program.key == Key::Real || !run.missing_left || program.sentinel.is_some();
    if checks {
        // NaN is above this twice over; the missing whole number is half of 2^32.
        out.ins(if program.key == Key::Real { "movs r7, #255" } else { "movs r7, #128" }, 2);
        out.ins("lsls r7, r7, #24", 2);
    }
    let (missing, put, done) = (out.label(), out.label(), out.label());
    let before = out.count();
    let again = out.here();
    if out.chip == Chip::M4F {
        out.ins("ldrb r3, [r1], #1", 4);
        out.ins("ldr.w r4, [r0, r3, lsl #2]", 4);
    } else {
        out.ins("ldrb r3, [r1]", 2);
        out.ins("adds r1, #1", 2);
        out.ins("lsls r3, r3, #2", 2);
        out.ins("ldr r4, [r0, r3]", 2);
    }
    let steps = match run.kind {
        Kind::Search { steps } => {
            key(out, program, run, missing, checks);
            search(out, steps);
            // Of a step's branch and addition one half of the time only one is done.
            -0.5 * f64::from(steps)
        }
        Kind::Grid { bits, before } => {
            grid(out, bits, before, missing);
            0.0
        }
    };
    out.place(put);
    if out.chip == Chip::M4F {
        out.ins("strb r5, [r6], #1", 4);
    } else {
        out.ins("strb r5, [r6]", 2);
        out.ins("adds r6, #1", 2);
    }
    if let Kind::Search { steps } = run.kind {
        add(out, "r2", 4 * ((1 << steps) - 1));
    }
    out.ins("cmp r6, r12", 2);
    out.branch(Some(Condition::NotEqual), again);
    let labels = 4.0;
    out.instructions += count as f64 * ((out.count() - before) as f64 - labels + steps) + 8.0;
    out.branch(None, done);
    out.place(missing);
    out.ins(if run.missing_left { "movs r5, #0" } else { "movs r5, #255" }, 2);
    out.branch(None, put);
    out.pool();
    out.place(done);
}

/// Adds a number to a low register.
fn add(out: &mut Assembler, register: &str, mut number: usize) {
    while number > 0 {
        let part = number.min(255);
        out.ins(&format!("adds {register}, #{part}"), 2);
        number -= part;
    }
}

/// The key in r4, from a feature's bits.
fn key(out: &mut Assembler, program: &Program, run: &Run<'_>, missing: Label, checks: bool) {
    if !checks {
        return;
    }
    if program.key == Key::Real {
        out.ins("lsls r3, r4, #1", 2);
        out.ins("cmp r3, r7", 2);
        out.branch(Some(Condition::Higher), missing);
        if !run.positive || program.sentinel.is_some() {
            let positive = out.label();
            out.ins("cmp r4, #0", 2);
            out.branch(Some(Condition::GreaterOrEqual), positive);
            out.ins("movs r3, #128", 2);
            out.ins("lsls r3, r3, #24", 2);
            out.ins("subs r4, r3, r4", 2);
            out.place(positive);
        }
    } else {
        out.ins("cmp r4, r7", 2);
        out.branch(Some(Condition::Equal), missing);
    }
    if let Some(sentinel) = program.sentinel {
        let known = out.label();
        out.load_word("r3", sentinel.low);
        out.ins("cmp r4, r3", 2);
        out.branch(Some(Condition::Less), known);
        out.load_word("r3", sentinel.high);
        out.ins("cmp r4, r3", 2);
        out.branch(Some(Condition::LessOrEqual), missing);
        out.place(known);
    }
}

/// The number of thresholds at r2 that are at or below r4, in r5.
fn search(out: &mut Assembler, steps: u8) {
    out.ins("mov r5, r2", 2);
    for step in (0..steps).rev() {
        let (offset, length) = (4 * ((1 << step) - 1), 4 << step);
        let below = out.label();
        if offset <= 124 {
            out.ins(&format!("ldr r3, [r5, #{offset}]"), 2);
        } else {
            out.number("r3", offset);
            out.ins("ldr r3, [r5, r3]", 2);
        }
        out.ins("cmp r3, r4", 2);
        out.branch(Some(Condition::Greater), below);
        add(out, "r5", length as usize);
        out.place(below);
    }
    out.ins("subs r5, r5, r2", 2);
    out.ins("lsrs r5, r5, #2", 2);
}

/// The f32 value with the bits in r4 as a number of eight bits, in r5.
fn grid(out: &mut Assembler, bits: i8, before: bool, missing: Label) {
    out.ins("lsls r5, r4, #1", 2);
    out.ins("cmp r5, r7", 2);
    out.branch(Some(Condition::Higher), missing);
    if out.chip == Chip::M4F {
        if before {
            // What is no number then, of 0 and of -0, is converted to 0.
            out.ins("subs r4, #1", 2);
        }
        out.ins("vmov s0, r4", 4);
        match bits {
            1.. => out.ins(&format!("vcvt.s32.f32 s0, s0, #{bits}"), 4),
            _ => out.ins("vcvt.s32.f32 s0, s0", 4),
        }
        out.ins("vmov r5, s0", 4);
        match bits {
            0.. => out.ins("usat r5, #8, r5", 4),
            _ => out.ins(&format!("usat r5, #8, r5, asr #{}", -bits), 4),
        }
        return;
    }
    let (whole, full) = (out.label(), out.label());
    out.ins("movs r5, #0", 2);
    out.ins("cmp r4, #0", 2);
    if before {
        // 0 and -0, too: before them there is nothing above 0.
        out.branch(Some(Condition::LessOrEqual), whole);
        out.ins("subs r4, #1", 2);
    } else {
        out.branch(Some(Condition::Less), whole);
    }
    out.ins("lsrs r3, r4, #23", 2);
    out.ins(&format!("movs r5, #{}", 158 - i32::from(bits)), 2);
    out.ins("subs r3, r5, r3", 2);
    out.ins("movs r5, #255", 2);
    out.ins("cmp r3, #24", 2);
    out.branch(Some(Condition::Less), full);
    out.ins("lsls r4, r4, #8", 2);
    out.ins("movs r5, #128", 2);
    out.ins("lsls r5, r5, #24", 2);
    out.ins("orrs r5, r4", 2);
    out.ins("lsrs r5, r3", 2);
    out.place(full);
    out.place(whole);
}
