//! Results of parallel work in the order of the work, so that a failure is the same one on any number of threads.

use crate::error::Result;
use rayon::iter::ParallelIterator;

/// Collects results that are made side by side; of several failures, the first in order. Collecting straight into a
/// `Result` gives the one that happens to come first in time, and another one at another run.
///
/// # Errors
/// The first failure in order.
pub fn in_order<T: Send>(results: impl ParallelIterator<Item = Result<T>>) -> Result<Vec<T>> {
    results.collect::<Vec<_>>().into_iter().collect()
}
