//! Trees in a model's bytes: checked once, when it is opened, and then walked.

#[cfg(feature = "rows")]
pub(crate) mod batch;
#[cfg(feature = "rows")]
mod block;
pub(crate) mod built_in;
pub(crate) mod leaves;
#[cfg(feature = "rows")]
mod masks;
pub(crate) mod preorder;
pub(crate) mod ranks;
mod sections;

pub(crate) use sections::{Places, Sections};
