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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, MeshProblem};
    use rayon::prelude::*;

    #[test]
    fn the_first_failure_in_order_is_returned_although_a_later_one_comes_sooner() {
        let later_failed = std::sync::Barrier::new(2);
        let one = |number: u32| -> Result<u32> {
            match number {
                1 => {
                    later_failed.wait();
                    std::thread::sleep(std::time::Duration::from_millis(20));
                }
                7 => _ = later_failed.wait(),
                _ => return Ok(number),
            }
            Err(Error::from(MeshProblem::NotMeshed { name: number.to_string(), seed: None }))
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
        let failed = pool.install(|| in_order((0..8).into_par_iter().with_max_len(1).map(one))).unwrap_err();
        let first = Error::from(MeshProblem::NotMeshed { name: "1".into(), seed: None });
        assert_eq!(failed.to_string(), first.to_string());
        assert_eq!(in_order([Ok(2), Ok(3)].into_par_iter()).unwrap(), [2, 3]);
    }
}
