//! Trees as C or as Rust: the same integers as the trees in bytes, to the bit.
//!
//! ```text
//! walked trees ──► Program (columns of ranks, splits, leaves in units) ──► c: nested ifs    ──► model.h
//!                                                                     └──► rust: the same ──► model.rs
//! ```

mod c;
mod columns;
mod cost;
mod program;
mod rust;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use program::Program;
pub(super) use program::Statements;

impl Program {
    /// The functions in C.
    pub(super) fn c_functions(&self, name: &str) -> String {
        c::text(self, name)
    }

    /// The function in C that opens the model with its trees.
    pub(super) fn c_opening(&self, name: &str) -> String {
        c::opening(self, name)
    }

    /// The module in Rust; `about` describes the model in one line, and `checksum` is the model's.
    pub(super) fn rust(&self, about: &str, checksum: u32) -> String {
        rust::text(self, about, checksum)
    }
}
