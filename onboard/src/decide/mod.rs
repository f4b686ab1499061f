//! Margins to a verdict: evidence, its exponential, when to stop, what fits no object, and the state as bytes.

mod evidence;
mod expected;
mod exponential;
mod recognizer;
#[cfg(feature = "link")]
mod snapshot;
mod stopping;
mod strangers;

pub use evidence::Posterior;
pub use expected::NothingExpected;
pub use exponential::exp2_negative;
#[cfg(feature = "station")]
pub(crate) use recognizer::State;
pub use recognizer::{CapacityError, Recognizer, Verdict};
#[cfg(feature = "link")]
pub use snapshot::{SNAPSHOT_LENGTH, SnapshotError};
pub use stopping::Stopping;
pub use strangers::Fit;
