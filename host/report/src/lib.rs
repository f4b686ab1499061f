//! The evaluation: what is measured and shown, one section per module, written as one page with the files behind it.
//!
//! [`report`] measures the chosen parts and writes the page. [`view`] makes the page
//! that shows an object and its touches, [`play`] the one on which objects can be touched, [`watch`] the one that watches a
//! chip, [`shape`] the one of an object's map. The page of the program's main job is also drawn here, and [`page`] draws what all of them consist of.

mod confusion;
mod context;
mod cost;
mod cross_validation;
mod density;
mod instructions;
mod limit;
mod measured;
mod noise;
mod objects;
pub mod page;
pub mod play;
mod promises;
mod published;
pub mod results;
pub mod run_page;
mod settings;
pub mod shape;
#[cfg(test)]
mod small;
mod stages;
pub mod statistics;
pub mod stream;
pub mod view;
pub mod watch;

pub use settings::{Part, Settings};
pub use stages::{Report, report};

/// The error of something that cannot fail.
pub(crate) fn bug(what: String) -> palpate::error::Error {
    palpate::error::Error::new(what).fix("Report this as a bug.")
}
