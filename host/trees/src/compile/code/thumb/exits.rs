//! Places where a walk for a class alone may end.

use super::super::program::Program;
use super::Frame;
use super::assembler::{Assembler, Condition, Label};

/// Labels of what every place uses.
pub(in super::super) struct Exits {
    /// The routine that compares margins with the bound in r3.
    compare: Label,
    /// The end of the walk.
    pub(super) end: Label,
}

impl Exits {
    pub(super) fn new(out: &mut Assembler) -> Self {
        Self { compare: out.label(), end: out.label() }
    }

    /// A place: all trees so far are in the margins, whose address is on the stack. Of the registers r1, r2, r3 and lr are
    /// others afterwards, r0 is the stack pointer, and all else is as it was.
    pub(super) fn place(&self, out: &mut Assembler, bound: u32) {
        let count = out.count();
        out.number("r3", bound);
        out.call(self.compare);
        // Of the routine, where the walk may not end.
        out.instructions += (out.count() - count) as f64 + 6.0;
    }

    /// The routine; after all code that is run through.
    pub(super) fn write(&self, out: &mut Assembler, program: &Program, frame: &Frame) {
        let (over, known, again, next) = (out.label(), out.label(), out.label(), out.label());
        let saved = 12;
        let margins = saved + frame.margins(out.chip);
        out.place(self.compare);
        out.ins("push {r4, r5, r6}", 2);
        out.ins(&format!("ldr r0, [sp, #{}]", margins + 4), 2);
        out.ins("cmp r0, #0", 2);
        out.branch(Some(Condition::Equal), over);
        out.ins(&format!("ldr r0, [sp, #{margins}]"), 2);
        out.number("r5", 4 * program.known as u32);
        out.ins("adds r5, r5, r0", 2);
        out.ins("movs r1, #128", 2);
        out.ins("lsls r1, r1, #24", 2);
        out.ins("mov r2, r1", 2);
        // The largest in r1, the second in r2.
        out.place(again);
        out.ins("ldmia r0!, {r4}", 2);
        out.ins("cmp r4, r2", 2);
        out.branch(Some(Condition::LessOrEqual), next);
        out.ins("mov r2, r4", 2);
        out.ins("cmp r4, r1", 2);
        out.branch(Some(Condition::LessOrEqual), next);
        out.ins("mov r2, r1", 2);
        out.ins("mov r1, r4", 2);
        out.place(next);
        out.ins("cmp r0, r5", 2);
        out.branch(Some(Condition::NotEqual), again);
        out.ins("subs r1, r1, r2", 2);
        out.ins("cmp r1, r3", 2);
        out.branch(Some(Condition::Higher), known);
        out.place(over);
        out.ins("pop {r4, r5, r6}", 2);
        out.ins("mov r0, sp", 2);
        out.ins("bx lr", 2);
        out.place(known);
        out.ins("pop {r4, r5, r6}", 2);
        out.branch(None, self.end);
        out.pool();
    }
}
