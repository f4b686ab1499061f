//! The program `palpate`: its commands, and its main job as a library call, [`run::run`].
//!
//! Commands parse arguments, call the library `palpate`, and print what it returns. Pages are drawn by `palpate-report`.

mod commands;
pub mod run;

pub use commands::main;
