//! Learn-then-Test with fixed-sequence testing (Angelopoulos and others, 2022, arXiv 2110.01052).
//!
//! Thresholds are tried from strict to loose, an order that is fixed before the data are looked at. Each is a hypothesis:
//! "at this threshold the error rate is above the promised one". It is rejected if as few errors as were found have a
//! probability of at most 1 − confidence under it, by the binomial tail. The walk ends before the first threshold whose
//! hypothesis is not rejected; the one before is kept. So the probability that a threshold is kept whose error rate is
//! above the promised one is at most 1 − confidence, however many are tried.
//!
//! The tail is exact for independent cases that are all wrong with the same probability. Where each object has its own and
//! has equally many cases, the lower tail is no heavier than the binomial one (Hoeffding, On the distribution of the number
//! of successes in independent trials, 1956). How many names are given is taken as given; the simulations of
//! `calibrate/tests.rs`, whose error rates are known, count how often a promise is broken in the end.

/// Results at a threshold: errors, of cases that could have been errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Errors.
    pub wrong: u64,
    /// Cases, errors included.
    pub all: u64,
}

/// A threshold that is kept, and what happened at it.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept<T> {
    /// The threshold.
    pub threshold: T,
    /// Results: one tally, or one of each that the rate is promised for.
    pub tallies: Vec<Tally>,
}

/// Where a walk ended without a threshold that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// This tally could not have passed without any error at any threshold; the cases that it had at most.
    TooFew {
        /// The position of the tally.
        position: usize,
        /// The most cases.
        found: u64,
    },
    /// This tally had too many errors at the strictest threshold that could be tried.
    TooMany {
        /// The position of the tally.
        position: usize,
        /// Its tally.
        tally: Tally,
    },
}

/// Walks over `steps`, thresholds from strict to loose with what happened at each, and keeps the last one at which every
/// tally passes: an error rate of at most `rate`, with probability `confidence`.
///
/// With several tallies all rates are kept at once with that probability, without dividing it among them: the
/// hypothesis is that one of the rates is above, and to reject it every test has to (an intersection-union test).
/// Thresholds whose tally is so small that it could not pass even without an error are uninformative and skipped
/// (Tarone, 1990): how many cases there are decides that, not how many are errors. That is exact as long as how many there
/// are at one threshold says nothing about how many are errors at another.
///
/// ```
/// use palpate::calibrate::{Tally, walk};
///
/// // Of 10,000 sequences 83 may be wrong, to promise 1 %.
/// let steps = [(9.0, 2), (5.0, 60), (4.0, 83), (3.5, 84), (3.4, 84)];
/// let kept = walk(steps.map(|(margin, wrong)| (margin, vec![Tally { wrong, all: 10_000 }])), 0.01, 0.95).unwrap();
/// assert_eq!(kept.threshold, 4.0);
/// ```
///
/// # Errors
/// [`Stop`], if no threshold can be kept.
pub fn walk<T>(steps: impl IntoIterator<Item = (T, Vec<Tally>)>, rate: f64, confidence: f64) -> Result<Kept<T>, Stop> {
    let needed = needed(rate, confidence);
    let mut kept = None;
    let mut most = Vec::new();
    for (threshold, tallies) in steps {
        most.resize(tallies.len(), 0);
        most.iter_mut().zip(&tallies).for_each(|(most, tally): (&mut u64, _)| *most = tally.all.max(*most));
        if tallies.iter().any(|tally| tally.all < needed) {
            continue;
        }
        let passes = |tally: &Tally| binomial_tail(*tally, rate) <= 1.0 - confidence;
        match tallies.iter().position(|tally| !passes(tally)) {
            None => kept = Some(Kept { threshold, tallies }),
            Some(position) => {
                return kept.ok_or(Stop::TooMany { position, tally: tallies[position] });
            }
        }
    }
    kept.ok_or_else(|| {
        let fewest = (0..most.len()).min_by_key(|&position| most[position]).unwrap_or(0);
        Stop::TooFew { position: fewest, found: most.get(fewest).copied().unwrap_or(0) }
    })
}

/// Smallest number of cases that allows a promise of `rate` with probability `confidence`, if none is an error.
pub fn needed(rate: f64, confidence: f64) -> u64 {
    ((1.0 - confidence).ln() / (-rate).ln_1p()).ceil() as u64
}

/// The most errors of `all` cases with which `rate` can be promised with probability `confidence`, if it can be.
pub fn allowed(all: u64, rate: f64, confidence: f64) -> Option<u64> {
    let passes = |wrong: u64| binomial_tail(Tally { wrong, all }, rate) <= 1.0 - confidence;
    if !passes(0) {
        return None;
    }
    // The tail grows with the errors: halve the range in which it passes the level.
    let (mut low, mut high) = (0, all);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if passes(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// The probability of at most `wrong` errors in `all` cases at an error rate of `rate`: Σ C(all, i) rateⁱ
/// (1 − rate)^(all − i) for i up to `wrong`.
pub fn binomial_tail(Tally { wrong, all }: Tally, rate: f64) -> f64 {
    if wrong >= all {
        return 1.0;
    }
    let (n, k) = (all as f64, wrong as f64);
    let log_choose = libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    let log_last = log_choose + k * rate.ln() + (n - k) * (-rate).ln_1p();
    let odds = (1.0 - rate) / rate;
    // Each term is the next one times i / (n − i + 1) · odds. Above the mean terms grow on the way down, to the mode.
    let (mut sum, mut term, mut index) = (1.0, 1.0, k);
    while index > 0.0 {
        term *= index / (n - index + 1.0) * odds;
        sum += term;
        index -= 1.0;
        // What is left is less than a geometric series, once the terms fall.
        if term < 1e-17 * sum && index / (n - index + 1.0) * odds < 1.0 {
            break;
        }
    }
    (log_last.exp() * sum).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tail summed up term by term.
    fn summed(Tally { wrong, all }: Tally, rate: f64) -> f64 {
        let mut term = (1.0 - rate).powi(i32::try_from(all).unwrap());
        let mut sum = term;
        for i in 0..wrong {
            term *= (all - i) as f64 / (i + 1) as f64 * rate / (1.0 - rate);
            sum += term;
        }
        sum
    }

    #[test]
    fn tails_are_sums_of_binomial_probabilities() {
        for (all, rate) in [(1, 0.3), (10, 0.5), (200, 0.01), (1_000, 0.05), (5_000, 0.1)] {
            for wrong in [0, 1, 2, all / 100, all / 20, all / 3, all - 1, all] {
                let tally = Tally { wrong, all };
                let (tail, exact) = (binomial_tail(tally, rate), summed(tally, rate).min(1.0));
                assert!((tail / exact - 1.0).abs() < 1e-8, "{tally:?} {rate}: {tail} {exact}");
            }
        }
    }

    #[test]
    fn as_many_errors_are_allowed_as_tables_of_the_binomial_say() {
        for (all, rate, most) in [
            (1_000, 0.01, Some(4)),
            (10_000, 0.01, Some(83)),
            (100_000, 0.01, Some(948)),
            (2_000, 0.001, None),
            (3_000, 0.001, Some(0)),
            (10_000, 0.001, Some(4)),
            (100_000, 0.001, Some(83)),
        ] {
            assert_eq!(allowed(all, rate, 0.95), most, "{all} {rate}");
        }
        assert_eq!((needed(0.01, 0.95), needed(0.001, 0.95)), (299, 2_995));
        assert_eq!(allowed(298, 0.01, 0.95), None);
        assert_eq!(allowed(299, 0.01, 0.95), Some(0));
    }

    fn tallies(wrong: &[u64], all: u64) -> Vec<Vec<Tally>> {
        wrong.iter().map(|&wrong| vec![Tally { wrong, all }]).collect()
    }

    #[test]
    fn a_walk_ends_before_the_first_failure_even_if_a_later_threshold_would_pass() {
        let steps = tallies(&[0, 3, 5, 2], 1_000);
        let kept = walk((0..).zip(steps), 0.01, 0.95).unwrap();
        assert_eq!((kept.threshold, kept.tallies), (1, vec![Tally { wrong: 3, all: 1_000 }]));
        let stop = walk((0..).zip(tallies(&[5, 0, 0], 1_000)), 0.01, 0.95);
        assert_eq!(stop, Err(Stop::TooMany { position: 0, tally: Tally { wrong: 5, all: 1_000 } }));
        assert_eq!(walk((0..).zip(tallies(&[0], 298)), 0.01, 0.95), Err(Stop::TooFew { position: 0, found: 298 }));
        assert_eq!(walk(Vec::<(u8, _)>::new(), 0.01, 0.95), Err(Stop::TooFew { position: 0, found: 0 }));
    }

    #[test]
    fn thresholds_at_which_too_little_happened_are_passed_over() {
        let step = |all| vec![Tally { wrong: 0, all }];
        let kept = walk([(0, step(10)), (1, step(400)), (2, step(500))], 0.01, 0.95).unwrap();
        assert_eq!(kept.threshold, 2);
    }

    #[test]
    fn every_tally_has_to_pass() {
        let step = |wrong| vec![Tally { wrong: 0, all: 1_000 }, Tally { wrong, all: 1_000 }];
        let kept = walk([(0, step(0)), (1, step(4)), (2, step(5))], 0.01, 0.95).unwrap();
        assert_eq!(kept.threshold, 1);
        let stop = walk([(0, step(9))], 0.01, 0.95);
        assert_eq!(stop, Err(Stop::TooMany { position: 1, tally: Tally { wrong: 9, all: 1_000 } }));
    }

    #[test]
    fn a_threshold_above_the_rate_is_kept_no_more_often_than_promised() {
        // Error rates from 0.2 % at the first threshold to 2 % at the last; the promise is 1 %. A thousand calibrations on
        // 2,000 sequences each, whose errors are where uniform numbers are below the rate.
        use crate::random::{Purpose, generator};
        use rand::RngExt;
        let rates: Vec<f64> = (2..=20).map(|k| f64::from(k) * 0.001).collect();
        let mut broken = 0;
        for run in 0..1_000 {
            let mut random = generator(1, Purpose::Calibration, "walk", run);
            let numbers: Vec<f64> = (0..2_000).map(|_| random.random()).collect();
            let wrong = |rate: f64| numbers.iter().filter(|number| **number < rate).count() as u64;
            let steps = rates.iter().map(|&rate| (rate, vec![Tally { wrong: wrong(rate), all: 2_000 }]));
            broken += u32::from(walk(steps, 0.01, 0.95).is_ok_and(|kept| kept.threshold > 0.01));
        }
        // 50 at most are expected, with a standard deviation of 7.
        assert!((1..=65).contains(&broken), "{broken}");
    }
}
