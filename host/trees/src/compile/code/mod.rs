//! Trees as a chip's own instructions, or as C: the same integers as the layouts of data, to the bit.
//!
//! ```text
//! walked trees ──► Program (columns of ranks, splits, leaves in units) ──► thumb: assembly ──► model.s, model.rs
//!                                                                     └──► c: nested ifs  ──► model.h
//! ```

mod c;
mod columns;
mod program;
mod rust;
#[cfg(test)]
pub(crate) mod tests;
mod thumb;

pub use program::Program;
pub(super) use program::Statements;
pub use thumb::Chip;

use super::cost::Instructions;
use serde::Serialize;

/// A form of code that a program is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Thumb assembly for a chip.
    Thumb(Chip),
    /// C99 without a library.
    C,
}

impl Form {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Thumb(Chip::M0Plus), Self::Thumb(Chip::M4F), Self::C];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thumb(Chip::M0Plus) => "thumb",
            Self::Thumb(Chip::M4F) => "thumb-m4f",
            Self::C => "c-code",
        }
    }
}

/// Size and speed of a program in one form.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CodeCost {
    /// Name of the form.
    pub form: &'static str,
    /// Bytes of code and tables: of assembly exactly, of C estimated for a Cortex-M4F at `-Os`.
    pub bytes: usize,
    /// About how many instructions a row takes, from features to margins, where either side of a split is as likely.
    pub instructions: Instructions,
}

/// The symbol of a function in assembly. It carries the checksum of the model that was written with it: assembly of another
/// export does not link.
fn symbol(name: &str, function: &str, checksum: u32) -> String {
    format!("{name}_{function}_{checksum:08x}")
}

impl Program {
    /// Size and speed in a form.
    pub fn cost(&self, form: Form) -> CodeCost {
        match form {
            Form::Thumb(chip) => {
                let (bytes, instructions) = thumb::cost(self, chip);
                // The subset of a Cortex-M0+ takes as many on a Cortex-M4F.
                let m0_plus = (chip == Chip::M0Plus).then_some(instructions);
                CodeCost { form: form.name(), bytes, instructions: Instructions { m4f: instructions, m0_plus } }
            }
            Form::C => c::cost(self),
        }
    }

    /// The trees in the order of assembly, and what the base has instead of each, in units.
    pub(super) fn in_assembly(&self, chip: Chip) -> Vec<(usize, i32)> {
        thumb::order(self, chip)
    }

    /// The files of assembly, and of Rust that makes a safe function of it: their extensions and texts; `name`, an
    /// identifier, is what functions are called after, `file` the files. `checksum` is the model's.
    pub(super) fn sources(&self, name: &str, file: &str, checksum: u32, form: Form) -> Vec<(&'static str, String)> {
        match form {
            Form::Thumb(chip) => {
                vec![("s", thumb::text(self, name, checksum, chip)), ("rs", rust::text(self, name, file, checksum))]
            }
            Form::C => Vec::new(),
        }
    }

    /// The functions in C.
    pub(super) fn c_functions(&self, name: &str) -> String {
        c::text(self, name)
    }

    /// The declaration of functions in assembly, for C.
    pub(super) fn c_declaration(&self, name: &str, checksum: u32) -> String {
        c::declaration(self, name, checksum)
    }

    /// The function in C that opens the model with its trees.
    pub(super) fn c_opening(&self, name: &str) -> String {
        c::opening(self, name)
    }
}
