//! The ground of Palpate's host side.
//!
//! | module | what it does | start with |
//! |---|---|---|
//! | [`error`] | one error, with any crate's problem, its place and its fix | [`error::Error`] |
//! | [`gone`] | what earlier versions had, and what to use instead | [`gone::instead`] |
//! | [`output`] | files and directories that appear whole or not at all | [`output::write_whole`] |
//! | [`progress`] | progress of long calls, and a way to cancel them | [`progress::Progress`] |
//! | [`results`] | rows of values: text, JSON, a page's table | [`results::Results`] |
//! | [`wording`] | numbers as people read them | [`wording::decimal`] |
//!
//! The crates `palpate-trees`, `palpate-simulator` and `palpate` build on this one and re-export it.

pub mod error;
pub mod gone;
pub mod output;
pub mod progress;
pub mod results;
pub mod wording;

pub use error::Error;

/// A value with some of its fields replaced, `with!(Noise::default(), time = 0.1, missed)`: the literal with `..` that other
/// crates cannot write of a type that may get more fields.
#[macro_export]
macro_rules! with {
    (@ $field:ident) => { $field };
    (@ $field:ident $value:expr) => { $value };
    ($base:expr $(, $field:ident $(= $value:expr)?)+ $(,)?) => {{
        let mut value = $base;
        $(value.$field = $crate::with!(@ $field $($value)?);)+
        value
    }};
}
