//! Repetitions of tests that may fail by chance, and the allowed probability of failure.

/// Number of repetitions of a simulation: as the variable PALPATE_REPETITIONS says, else `few` times.
pub(crate) fn repetitions(few: u64) -> u64 {
    std::env::var("PALPATE_REPETITIONS").map_or(few, |count| count.parse().expect("PALPATE_REPETITIONS is a number"))
}

/// Asserts that what fails with a probability of at most `share` did not fail more often than that: a binomial test at 1 %.
pub(crate) fn assert_rare(what: &str, failures: u64, repetitions: u64, share: f64) {
    // Of 40 at most 6, of 200 at most 18, where the share is 5 %.
    let (mut most, all) = (0, repetitions as f64);
    let mut exactly = (1.0 - share).powf(all);
    let mut at_most = exactly;
    while at_most < 0.99 {
        exactly *= (all - most as f64) / (most as f64 + 1.0) * share / (1.0 - share);
        at_most += exactly;
        most += 1;
    }
    println!("{what}: {failures} of {repetitions} failed; at most {most} may");
    assert!(failures <= most, "{what}: {failures} of {repetitions} failed; at most {most} may");
}
