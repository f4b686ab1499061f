//! Margins to a verdict: evidence, when to stop, and what fits no object.

mod approach;
mod evidence;
mod expected;
mod recognizer;
mod seen;
mod stopping;
mod strangers;
mod together;

pub use approach::Proposal;
pub use evidence::{Posterior, Rivals};
pub use expected::NothingExpected;
#[cfg(feature = "station")]
pub(crate) use recognizer::State;
pub use recognizer::{CapacityError, Recognizer, Verdict};
pub use seen::RowsSeen;
pub use stopping::Stopping;
pub use strangers::Familiarity;
