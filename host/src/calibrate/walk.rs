//! Learn-then-Test with fixed-sequence testing from several starts (Angelopoulos and others, 2022, arXiv 2110.01052).
//!
//! Thresholds are tried from strict to loose, an order that is fixed before the data are looked at. Each is a hypothesis:
//! "at this threshold the error rate is above the promised one". Its p-value is the probability of as few errors as were
//! found if the rate were the promised one: the binomial tail. The walk may begin at several thresholds, its *starts*, each of
//! which has an equal share of the level 1 − confidence:
//!
//! - at a start, its share is added to the level that the walk brings with it;
//! - a threshold whose p-value is at most that level is rejected, and the walk goes on to the next looser one with it;
//! - at a failure the walk ends, and goes on at the next start with that start's share alone.
//!
//! The loosest threshold that was rejected is kept. With one start that is fixed-sequence testing; shares that are handed on
//! make it the fallback procedure (Wiens, A fixed sequence Bonferroni procedure for testing multiple endpoints, 2003).
//!
//! *Theorem (Wiens and Dmitrienko, The fallback procedure for evaluating a single family of hypotheses, 2005).* With
//! probability of at least the confidence, no threshold that was rejected has an error rate above the promised one.
//!
//! *Proof.* Let t₁, t₂, … be the thresholds whose rate is above, in the order of the walk, and sⱼ the sum of the shares of the
//! starts after tⱼ₋₁, up to and including tⱼ. Let Eⱼ be the event that the p-value of tⱼ is at most sⱼ. If no Eⱼ happens, no tⱼ
//! is rejected: t₁ is tested at s₁ at most, so the walk fails there; what it brings to t₂ are shares of later starts only, at
//! most s₂, so it fails there too, and so on. A p-value is at most s with a probability of at most s, so that P(Eⱼ) ≤ sⱼ; and
//! no share is in two of the sums, so that the probability of any Eⱼ is at most 1 − confidence (Bonferroni). ∎
//!
//! Nothing is assumed of how errors at different thresholds depend on each other. All rejected thresholds hold at once, so any
//! rule may choose among them.
//!
//! The tail is exact for independent cases that are all wrong with the same probability. Where each object has its own and
//! has equally many cases, the lower tail is no heavier than the binomial one (Hoeffding, On the distribution of the number
//! of successes in independent trials, 1956). How many names are given is taken as given; the simulations of
//! `calibrate/tests.rs`, whose error rates are known, count how often a promise is broken in the end.

/// Between two thresholds that are tried, in nats.
pub(super) const STEP: f64 = 0.01;
/// The loosest threshold that is tried, in nats.
pub(super) const LOOSEST: f64 = 0.05;

/// Margins from `strict` to `loose`.
pub(super) fn grid(strict: f64, loose: f64) -> impl Iterator<Item = f64> {
    let steps = ((strict - loose) / STEP).round().max(0.0) as usize;
    (0..=steps).map(move |step| strict - STEP * step as f64)
}

/// Results at a threshold: errors, of cases that could have been errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Errors.
    pub wrong: u64,
    /// Cases, errors included.
    pub all: u64,
}

/// A test of the hypothesis that an error rate is above the promised one, by what happened at a threshold.
pub(crate) trait Test {
    /// Number of cases.
    fn cases(&self) -> f64;

    /// True if the hypothesis would be rejected with this confidence if no case were an error.
    fn could_pass(&self, rate: f64, confidence: f64) -> bool;

    /// The p-value: the probability of as few errors, or a bound on it, if the rate were the promised one.
    fn p_value(&self, rate: f64) -> f64;

    /// Number of cases with which as many errors would pass; none where cases do not count alike.
    fn enough(&self, rate: f64, confidence: f64) -> Option<u64>;

    /// Errors, and cases.
    fn tally(&self) -> Tally;
}

/// The binomial test of independent cases.
impl Test for Tally {
    fn cases(&self) -> f64 {
        self.all as f64
    }

    fn could_pass(&self, rate: f64, confidence: f64) -> bool {
        self.all >= needed(rate, confidence)
    }

    fn p_value(&self, rate: f64) -> f64 {
        binomial_tail(*self, rate)
    }

    fn enough(&self, rate: f64, confidence: f64) -> Option<u64> {
        Some(enough(self.wrong, rate, confidence))
    }

    fn tally(&self) -> Tally {
        *self
    }
}

/// A threshold that is kept, and what happened at it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kept<T> {
    /// The threshold.
    pub(crate) threshold: T,
    /// Results: one tally, or one of each that the rate is promised for.
    pub(crate) tallies: Vec<Tally>,
}

/// End of a walk without a threshold that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// This tally could not have passed without any error at any threshold; the cases that it had at most.
    TooFew {
        /// The position of the tally.
        position: usize,
        /// The most cases.
        found: u64,
        /// Number needed if none is an error.
        needed: u64,
    },
    /// This tally had too many errors at each start, and the fewest too many here.
    TooMany {
        /// The position of the tally.
        position: usize,
        /// Its tally.
        tally: Tally,
        /// The cases with which as many errors would pass; none where cases do not count alike.
        needed: Option<u64>,
    },
    /// No threshold may be kept: all are looser than they may be.
    Looser,
}

/// Walks over `steps`, thresholds from strict to loose with what happened at each, and keeps the loosest one at which every
/// test passes: an error rate of at most `rate`, with probability `confidence`. `starts` are the positions of the thresholds
/// at which the walk may begin, ascending; before the first of them nothing is tested. They are chosen without a look at
/// what happened. With one, and [`needed`] cases without an error, the rate can be promised; with several it takes more
/// cases, and fewer walks end before they have begun.
///
/// With several tests all rates are kept at once with that probability, without dividing it among them: the
/// hypothesis is that one of the rates is above, and to reject it every test has to (an intersection-union test).
/// Thresholds whose cases are so few that it could not pass with the share of one start, even without an error, are
/// uninformative and skipped (Tarone, 1990): how many cases there are decides that, not how many are errors. That is exact as
/// long as how many there are at one threshold says nothing about how many are errors at another.
///
/// # Errors
/// [`Stop`], if no threshold can be kept.
pub(crate) fn walk<T, E: Test>(
    steps: impl IntoIterator<Item = (T, Vec<E>)>,
    starts: &[usize],
    rate: f64,
    confidence: f64,
) -> Result<Kept<T>, Stop> {
    let share = of_share(confidence, starts.len());
    let mut level = Level::new(starts, confidence);
    let mut kept = None;
    let mut nearest = Nearest::default();
    let mut most = Vec::new();
    for (position, (threshold, tests)) in steps.into_iter().enumerate() {
        most.resize(tests.len(), 0.0_f64);
        most.iter_mut().zip(&tests).for_each(|(most, test)| *most = test.cases().max(*most));
        let own = level.at(position);
        if !tests.iter().all(|test| test.could_pass(rate, share)) {
            continue;
        }
        let Some(own) = own else { continue };
        let p_values: Vec<f64> = tests.iter().map(|test| test.p_value(rate)).collect();
        match Nearest::failed(&p_values, own) {
            None => kept = Some(Kept { threshold, tallies: tests.iter().map(Test::tally).collect() }),
            Some(position) => {
                nearest.see(p_values[position], || {
                    let test = &tests[position];
                    Stop::TooMany { position, tally: test.tally(), needed: test.enough(rate, 1.0 - own) }
                });
                level.fail();
                if level.is_over() {
                    break;
                }
            }
        }
    }
    kept.ok_or_else(|| {
        nearest.stop().unwrap_or_else(|| {
            let fewest = (0..most.len()).min_by(|&a, &b| most[a].total_cmp(&most[b])).unwrap_or(0);
            let found = most.get(fewest).copied().unwrap_or(0.0).round() as u64;
            Stop::TooFew { position: fewest, found, needed: needed(rate, share) }
        })
    })
}

/// The confidence with which a threshold is tested that has the share of one start of so many.
pub(super) fn of_share(confidence: f64, starts: usize) -> f64 {
    1.0 - (1.0 - confidence) / starts.max(1) as f64
}

/// The level at which thresholds are tested along a walk.
struct Level<'s> {
    starts: &'s [usize],
    whole: f64,
    /// Starts that were passed, and how many of their shares the walk has.
    passed: usize,
    held: usize,
}

impl<'s> Level<'s> {
    fn new(starts: &'s [usize], confidence: f64) -> Self {
        Self { starts, whole: 1.0 - confidence, passed: 0, held: 0 }
    }

    /// The level at the threshold in this position, after all before; none where nothing is tested.
    fn at(&mut self, position: usize) -> Option<f64> {
        let new = self.starts.iter().skip(self.passed).take_while(|start| **start <= position).count();
        self.passed += new;
        self.held += new;
        // All shares are the whole, to the last bit.
        (self.held > 0).then(|| self.whole * (self.held as f64 / self.starts.len() as f64))
    }

    /// The threshold there was not rejected.
    fn fail(&mut self) {
        self.held = 0;
    }

    /// True if nothing more will be tested.
    fn is_over(&self) -> bool {
        self.held == 0 && self.passed == self.starts.len()
    }
}

/// The failure that was nearest to passing.
#[derive(Default)]
struct Nearest(Option<(f64, Stop)>);

impl Nearest {
    /// The position of the largest p-value, if it is above the level.
    fn failed(p_values: &[f64], level: f64) -> Option<usize> {
        let largest = (0..p_values.len()).max_by(|&a, &b| p_values[a].total_cmp(&p_values[b]).then(b.cmp(&a)))?;
        (p_values[largest] > level).then_some(largest)
    }

    /// A failure with this p-value.
    fn see(&mut self, p_value: f64, stop: impl FnOnce() -> Stop) {
        if self.0.as_ref().is_none_or(|(nearest, _)| p_value < *nearest) {
            self.0 = Some((p_value, stop()));
        }
    }

    fn stop(self) -> Option<Stop> {
        self.0.map(|(_, stop)| stop)
    }
}

/// Smallest number of cases that allows a promise of `rate` with probability `confidence`, if none is an error.
pub fn needed(rate: f64, confidence: f64) -> u64 {
    ((1.0 - confidence).ln() / (-rate).ln_1p()).ceil() as u64
}

/// Smallest number of cases with which `wrong` errors allow a promise of `rate` with probability `confidence`.
pub(crate) fn enough(wrong: u64, rate: f64, confidence: f64) -> u64 {
    let passes = |all: u64| binomial_tail(Tally { wrong, all }, rate) <= 1.0 - confidence;
    let mut high = needed(rate, confidence).max(wrong + 1);
    while !passes(high) {
        high = high.saturating_mul(2);
    }
    // The tail falls with the cases.
    let mut low = wrong;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if passes(middle) { high = middle } else { low = middle }
    }
    high
}

/// The most errors of `all` cases with which `rate` can be promised with probability `confidence`, if it can be.
pub(crate) fn allowed(all: u64, rate: f64, confidence: f64) -> Option<u64> {
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
pub(crate) fn binomial_tail(Tally { wrong, all }: Tally, rate: f64) -> f64 {
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
    fn the_loosest_threshold_before_the_first_failure_is_kept() {
        // Of 10,000 sequences 83 may be wrong, to promise 1 %.
        let steps = [(9.0, 2), (5.0, 60), (4.0, 83), (3.5, 84), (3.4, 84)];
        let steps = steps.map(|(margin, wrong)| (margin, vec![Tally { wrong, all: 10_000 }]));
        assert_eq!(walk(steps.clone(), &[0], 0.01, 0.95).unwrap().threshold, 4.0);
        // Two starts that both pass have their whole level in the end.
        assert_eq!(walk(steps, &[0, 1], 0.01, 0.95).unwrap().threshold, 4.0);
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
        let kept = walk((0..).zip(steps), &[0], 0.01, 0.95).unwrap();
        assert_eq!((kept.threshold, kept.tallies), (1, vec![Tally { wrong: 3, all: 1_000 }]));
        let stop = walk((0..).zip(tallies(&[5, 0, 0], 1_000)), &[0], 0.01, 0.95);
        assert_eq!(
            stop,
            Err(Stop::TooMany { position: 0, tally: Tally { wrong: 5, all: 1_000 }, needed: Some(1_049) })
        );
        let few = |found| Err(Stop::TooFew { position: 0, found, needed: 299 });
        assert_eq!(walk((0..).zip(tallies(&[0], 298)), &[0], 0.01, 0.95), few(298));
        assert_eq!(walk(Vec::<(i32, Vec<Tally>)>::new(), &[0], 0.01, 0.95), few(0));
    }

    #[test]
    fn thresholds_at_which_too_little_happened_are_passed_over() {
        let step = |all| vec![Tally { wrong: 0, all }];
        let kept = walk([(0, step(10)), (1, step(400)), (2, step(500))], &[0], 0.01, 0.95).unwrap();
        assert_eq!(kept.threshold, 2);
    }

    #[test]
    fn every_tally_has_to_pass() {
        let step = |wrong| vec![Tally { wrong: 0, all: 1_000 }, Tally { wrong, all: 1_000 }];
        let kept = walk([(0, step(0)), (1, step(4)), (2, step(5))], &[0], 0.01, 0.95).unwrap();
        assert_eq!(kept.threshold, 1);
        let stop = walk([(0, step(9))], &[0], 0.01, 0.95);
        let needed = Some(enough(9, 0.01, 0.95));
        assert_eq!(stop, Err(Stop::TooMany { position: 1, tally: Tally { wrong: 9, all: 1_000 }, needed }));
    }

    #[test]
    fn a_walk_that_fails_at_one_start_goes_on_at_the_next_with_its_share() {
        // 1,000 cases allow 4 errors at 5 %, and 3 at half or a third of that.
        let walked = |wrong: &[u64], starts: &[usize]| {
            walk((0..).zip(tallies(wrong, 1_000)), starts, 0.01, 0.95).map(|kept| kept.threshold)
        };
        assert_eq!(walked(&[4, 3, 3, 4], &[0, 1]), Ok(2));
        assert_eq!(walked(&[3, 4, 4, 5], &[0, 1]), Ok(2), "shares of both");
        assert_eq!(
            walked(&[3, 4, 3, 4], &[0, 2]),
            Ok(2),
            "the first walk ends at 4, which its own share does not allow"
        );
        assert_eq!(walked(&[0, 0, 9, 3, 3, 4, 0], &[0, 3]), Ok(4), "the loosest of both walks");
        // A failure leaves nothing of the shares before it.
        assert_eq!(walked(&[9, 9, 3, 4], &[0, 1, 2]), Ok(2));
        assert_eq!(walked(&[9, 0, 9, 0], &[0]), walked(&[9], &[0]));
        // The failure that is told is the one that was nearest to passing.
        let stop = walk((0..).zip(tallies(&[9, 4, 7], 1_000)), &[0, 1, 2], 0.01, 0.95).unwrap_err();
        let needed = Some(enough(4, 0.01, 1.0 - 0.05 / 3.0));
        assert_eq!(stop, Stop::TooMany { position: 0, tally: Tally { wrong: 4, all: 1_000 }, needed });
    }

    #[test]
    fn several_starts_take_as_many_names_as_the_share_of_one_does() {
        for (starts, least) in [(1, 299), (2, 368), (7, 492)] {
            let positions: Vec<usize> = (0..starts).collect();
            let walked =
                |all| walk((0..).zip(tallies(&[0; 9], all)), &positions, 0.01, 0.95).map(|kept| kept.threshold);
            assert_eq!(walked(least), Ok(8), "{starts}");
            let few = Stop::TooFew { position: 0, found: least - 1, needed: least };
            assert_eq!(walked(least - 1), Err(few), "{starts}");
        }
    }

    #[test]
    fn as_many_cases_are_enough_as_the_errors_among_them_take() {
        for (wrong, rate, least) in [(0, 0.01, 299), (0, 0.05, 59), (1, 0.05, 93), (2, 0.05, 124), (4, 0.01, 913)] {
            assert_eq!(enough(wrong, rate, 0.95), least);
            assert_eq!(
                (allowed(least, rate, 0.95), allowed(least - 1, rate, 0.95)),
                (Some(wrong), wrong.checked_sub(1))
            );
        }
    }

    #[test]
    fn a_threshold_above_the_rate_is_kept_no_more_often_than_promised() {
        // Error rates from 0.2 % at the first threshold to 2 % at the last; the promise is 1 %. A thousand calibrations on
        // 2,000 sequences each, whose errors are where uniform numbers are below the rate.
        use crate::random::{Purpose, generator};
        use rand::RngExt;
        let rates: Vec<f64> = (2..=20).map(|k| f64::from(k) * 0.001).collect();
        let mut broken = [0; 3];
        for run in 0..1_000 {
            let mut random = generator(1, Purpose::Calibration, "walk", run);
            let numbers: Vec<f64> = (0..2_000).map(|_| random.random()).collect();
            let wrong = |rate: f64| numbers.iter().filter(|number| **number < rate).count() as u64;
            // Starts below the rate, above it, and on both sides.
            for (broken, starts) in broken.iter_mut().zip([&[0][..], &[9, 12, 15], &[0, 5, 9, 10, 11, 12, 13]]) {
                let steps = rates.iter().map(|&rate| (rate, vec![Tally { wrong: wrong(rate), all: 2_000 }]));
                *broken += u32::from(walk(steps, starts, 0.01, 0.95).is_ok_and(|kept| kept.threshold > 0.01));
            }
        }
        // 50 at most are expected, with a standard deviation of 7.
        assert!(broken.iter().all(|broken| (1..=65).contains(broken)), "{broken:?}");
    }

    #[test]
    fn the_guides_least_numbers_are_those_of_the_test() {
        let guide = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide/streams.md");
        let guide = std::fs::read_to_string(guide).unwrap();
        let mut rows = guide.lines().skip_while(|line| !line.starts_with("| promise |")).skip(2);
        let stated: Vec<(f64, Vec<u64>)> = rows
            .by_ref()
            .map_while(|row| row.strip_prefix("| "))
            .map(|row| {
                let mut cells = row.trim_end_matches(" |").split(" | ");
                let rate: f64 = cells.next().unwrap().trim_end_matches(" %").parse().unwrap();
                (rate / 100.0, cells.map(|cell| cell.replace(',', "").parse().unwrap()).collect())
            })
            .collect();
        assert_eq!(stated.len(), 3, "{stated:?}");
        for (rate, least) in stated {
            let one_wrong = enough(1, rate, 0.95);
            assert_eq!(least, [needed(rate, 0.95), one_wrong], "{rate}");
        }
    }
}
