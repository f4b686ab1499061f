//! Progress of long work, for whoever wants to show it; and a way to stop it.

use crate::error::{Error, Result};

/// Receives the progress of long calls, and may cancel them.
///
/// Nothing in the library draws: a program implements this with a progress bar, a log, a callback. `&()` is told
/// everything and does nothing. Calls come from the thread that made the long call and from its workers.
pub trait Progress: Sync {
    /// Work named `stage` begins, of `total` steps if their number is known. It ends when the next stage begins or the
    /// call returns.
    fn begin(&self, stage: &str, total: Option<u64>) {
        _ = (stage, total);
    }

    /// The current stage has come `steps` further.
    fn advance(&self, steps: u64) {
        _ = steps;
    }

    /// True if the call should stop as soon as it can, with [`Kind::Cancelled`](crate::error::Kind::Cancelled). Asked often; should be cheap.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Nobody is told, nothing is cancelled.
impl Progress for () {}

/// The current stage has come `steps` further; stops the call if it was cancelled.
///
/// # Errors
/// [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn advance(progress: &dyn Progress, steps: u64) -> Result<()> {
    progress.advance(steps);
    check(progress)
}

/// Stops the call if it was cancelled.
///
/// # Errors
/// [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn check(progress: &dyn Progress) -> Result<()> {
    if progress.is_cancelled() { Err(Error::cancelled()) } else { Ok(()) }
}
