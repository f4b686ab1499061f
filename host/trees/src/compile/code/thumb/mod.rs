//! Thumb assembly: one function from a row of features to margins.
//!
//! For each level of a tree a rank is loaded, compared with eight bits, and branched on. A leaf of one value adds to two
//! sums, 256 · high + low, so that no value takes a constant in memory. The ranks that an object's trees compare most stay
//! in registers. Of two subtrees the smaller one comes first, so that few branches are far.

mod assembler;
mod exits;
mod ranks;
mod trees;
mod vectors;
mod walk;

use super::program::Program;
use super::symbol;
use assembler::Assembler;
use exits::Exits;
use std::fmt::Write as _;

/// A processor whose instructions are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// Cortex-M0+, whose instructions every Cortex-M has.
    M0Plus,
    /// Cortex-M4 with a float unit, and later ones: M7, M33.
    M4F,
}

/// The program as assembly, for GNU's assembler and for `global_asm!`.
pub(super) fn text(program: &Program, name: &str, checksum: u32, chip: Chip) -> String {
    let written = write(program, chip);
    let [margins, early] = ["margins", "early"].map(|function| symbol(name, function, checksum));
    let mut text = String::new();
    let what = match chip {
        Chip::M0Plus => "any Cortex-M (ARMv6-M)",
        Chip::M4F => "a Cortex-M4F (ARMv7E-M with a float unit)",
    };
    let row = if program.key == palpate_shared::format::Key::Real { "float" } else { "int32_t" };
    // Writing to a string cannot fail.
    _ = writeln!(
        text,
        "@ {} trees for {what}. Written by `palpate export`; not to be edited.\n\
         @ The model's checksum is {checksum:08x}, as in the names of functions: assembly of another export does not link.\n\
         @ void {margins}(const {row} row[{}], int32_t margins[{}])",
        program.trees.len(),
        program.features,
        program.base.len(),
    );
    if !program.exits.is_empty() {
        _ = writeln!(
            text,
            "@ {early} has the same arguments; where a class is known it ends, and no other margin is larger than that one."
        );
    }
    // No code is on the stack.
    _ = writeln!(
        text,
        "\t.syntax unified\n\t.thumb\n\t.section .note.GNU-stack,\"\",%progbits\n\
         \t.section .text.{margins},\"ax\",%progbits\n\t.balign 4"
    );
    written.print(name, checksum, &mut text);
    text
}

/// Bytes of code and tables, and about how many instructions a row takes.
pub(super) fn cost(program: &Program, chip: Chip) -> (usize, u64) {
    let written = write(program, chip);
    (written.bytes(), written.instructions.round() as u64)
}

/// The trees in the order in which they are written, and what the base has instead of each, in units.
pub(super) fn order(program: &Program, chip: Chip) -> Vec<(usize, i32)> {
    trees::order(program, chip)
}

fn write(program: &Program, chip: Chip) -> Assembler {
    let mut out = Assembler::new(chip);
    let frame = Frame::new(program);
    let exits = (!program.exits.is_empty()).then(|| Exits::new(&mut out));
    if exits.is_some() {
        let body = out.label();
        out.global("early");
        out.ins("movs r2, #1", 2);
        out.branch(None, body);
        out.global("margins");
        out.ins("movs r2, #0", 2);
        out.place(body);
    } else {
        out.global("margins");
    }
    frame.enter(&mut out, chip);
    ranks::write(&mut out, program, &frame);
    trees::write(&mut out, program, &frame, exits.as_ref());
    if let Some(exits) = exits {
        out.place(exits.end);
        frame.leave(&mut out, chip);
        exits.write(&mut out, program, &frame);
    } else {
        frame.leave(&mut out, chip);
    }
    out.finish();
    out
}

/// Contents of the stack: the columns' numbers, then words; above them the registers that are restored, the first of which is
/// where margins go.
pub(super) struct Frame {
    /// Bytes for the columns.
    pub(super) columns: usize,
    /// All bytes.
    pub(super) length: usize,
    /// True if above the margins' address is a word that says whether the walk may end early.
    pub(super) has_exits: bool,
}

impl Frame {
    fn new(program: &Program) -> Self {
        let columns = program.columns.len().next_multiple_of(4);
        let (length, has_exits) = (columns.next_multiple_of(8).max(8), !program.exits.is_empty());
        // With a register more on the stack.
        Self { columns, length: if has_exits { length + 4 } else { length }, has_exits }
    }

    /// Saves registers and makes room. The second argument, the margins' address, stays on the stack.
    pub(super) fn enter(&self, out: &mut Assembler, chip: Chip) {
        match chip {
            Chip::M0Plus => {
                out.ins(if self.has_exits { "push {r1, r2, r4-r7, lr}" } else { "push {r1, r4-r7, lr}" }, 2);
                // Six registers so far: with these two it is a multiple of eight bytes, too.
                out.ins("mov r4, r8", 2);
                out.ins("mov r5, r9", 2);
                out.ins("mov r6, r10", 2);
                out.ins("mov r7, r11", 2);
                out.ins("push {r4-r7}", 2);
            }
            Chip::M4F => {
                out.ins(if self.has_exits { "push.w {r1, r2, r4-r11, lr}" } else { "push.w {r1, r4-r11, lr}" }, 4);
            }
        }
        self.room(out, "sub");
    }

    /// Undoes it, and returns.
    pub(super) fn leave(&self, out: &mut Assembler, chip: Chip) {
        self.room(out, "add");
        match chip {
            Chip::M0Plus => {
                out.ins("pop {r4-r7}", 2);
                out.ins("mov r8, r4", 2);
                out.ins("mov r9, r5", 2);
                out.ins("mov r10, r6", 2);
                out.ins("mov r11, r7", 2);
                out.ins(if self.has_exits { "pop {r1, r2, r4-r7, pc}" } else { "pop {r1, r4-r7, pc}" }, 2);
            }
            Chip::M4F => {
                out.ins(if self.has_exits { "pop.w {r1, r2, r4-r11, pc}" } else { "pop.w {r1, r4-r11, pc}" }, 4)
            }
        }
    }

    fn room(&self, out: &mut Assembler, what: &str) {
        out.ins(&format!("{what} sp, #{}", self.length), 2);
    }

    /// Offset of the address of the margins, from the stack pointer.
    pub(super) fn margins(&self, chip: Chip) -> usize {
        self.length + if chip == Chip::M0Plus { 16 } else { 0 }
    }
}
