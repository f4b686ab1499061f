//! Margins to a verdict: evidence, when to stop, what fits no object, and the state as bytes.

mod approach;
mod evidence;
mod expected;
mod recognizer;
mod seen;
#[cfg(feature = "link")]
mod snapshot;
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
#[cfg(feature = "link")]
pub use snapshot::{SNAPSHOT_LENGTH, SnapshotError};
pub use stopping::Stopping;
pub use strangers::Familiarity;
