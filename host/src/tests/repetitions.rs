//! Repetitions of tests that may fail by chance.

/// Number of repetitions of a simulation: as the variable PALPATE_REPETITIONS says, else `few` times.
pub(crate) fn repetitions(few: u64) -> u64 {
    std::env::var("PALPATE_REPETITIONS").map_or(few, |count| count.parse().expect("PALPATE_REPETITIONS is a number"))
}
