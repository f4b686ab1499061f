//! The kinds of trees and tables. Each checks its own bytes once, when a model is opened, and then walks them.

#[cfg(feature = "rows")]
pub(crate) mod batch;
#[cfg(feature = "rows")]
mod block;
pub(crate) mod built_in;
pub(crate) mod complete;
pub(crate) mod grid;
pub(crate) mod leaves;
#[cfg(feature = "rows")]
mod masks;
pub(crate) mod patterns;
pub(crate) mod preorder;
pub(crate) mod ranks;
mod sections;

pub(crate) use sections::{Places, Sections};
