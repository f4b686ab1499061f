//! A line that loses, changes and delays bytes on purpose.

use crate::error::{ChipProblem, Error, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::collections::VecDeque;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Faults of a bad line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faults {
    /// Probability that a byte is lost.
    pub lost: f64,
    /// Probability that one bit of a byte is flipped.
    pub changed: f64,
    /// Probability that bytes sent together arrive twice.
    pub doubled: f64,
    /// Bytes arrive up to this much later, in order.
    pub delay: Duration,
}

impl FromStr for Faults {
    type Err = Error;

    /// `lost,changed,doubled,delay`: three probabilities and milliseconds.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = || Error::from(ChipProblem::NotFaults { text: text.into() });
        let numbers: Vec<f64> =
            text.split(',').map(|number| number.trim().parse().map_err(|_| wrong())).collect::<Result<_>>()?;
        match numbers.as_slice() {
            &[lost, changed, doubled, delay]
                if [lost, changed, doubled].iter().all(|p| (0.0..=1.0).contains(p)) && (0.0..1e6).contains(&delay) =>
            {
                Ok(Self { lost, changed, doubled, delay: Duration::from_secs_f64(delay / 1e3) })
            }
            _ => Err(wrong()),
        }
    }
}

/// One direction of a bad line.
#[derive(Debug)]
pub(crate) struct BadLine {
    faults: Faults,
    rng: ChaCha8Rng,
    under_way: VecDeque<(Instant, Vec<u8>)>,
}

impl BadLine {
    /// A line. The same seed does the same to the same bytes, except for effects of the delay.
    pub(crate) fn new(faults: Faults, seed: u64) -> Self {
        Self { faults, rng: ChaCha8Rng::seed_from_u64(seed), under_way: VecDeque::new() }
    }

    /// Puts bytes on the line.
    pub(crate) fn push(&mut self, bytes: &[u8], now: Instant) {
        if bytes.is_empty() {
            return;
        }
        let Self { faults, rng, under_way } = self;
        for _ in 0..if rng.random_bool(faults.doubled) { 2 } else { 1 } {
            let mut arriving = Vec::with_capacity(bytes.len());
            for &byte in bytes {
                if rng.random_bool(faults.lost) {
                    continue;
                }
                let flipped = if rng.random_bool(faults.changed) { 1 << rng.random_range(0..8) } else { 0 };
                arriving.push(byte ^ flipped);
            }
            let due = now + faults.delay.mul_f64(rng.random());
            let last = under_way.back().map_or(now, |(due, _)| *due);
            under_way.push_back((due.max(last), arriving));
        }
    }

    /// Takes bytes that have arrived.
    pub(crate) fn pop(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.under_way.pop_front_if(|(due, _)| *due <= now).map(|(_, bytes)| bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_lost_and_changed_as_often_as_asked_for_and_stay_in_order() {
        let faults: Faults = "0.1,0.05,0,2".parse().unwrap();
        let mut line = BadLine::new(faults, 1);
        let now = Instant::now();
        (0..10_000).for_each(|_| line.push(&[7; 10], now));
        let early: usize = std::iter::from_fn(|| line.pop(now)).map(|bytes| bytes.len()).sum();
        assert!(early < 5_000, "{early}");
        let late: Vec<u8> = std::iter::from_fn(|| line.pop(now + Duration::from_millis(2))).flatten().collect();
        let changed = late.iter().filter(|&&byte| byte != 7).count();
        assert!((89_000..91_000).contains(&(early + late.len())), "{}", late.len());
        assert!((4_000..5_000).contains(&changed), "{changed}");
    }

    #[test]
    fn faults_are_checked() {
        assert!("0.1,0.1,0.1".parse::<Faults>().is_err());
        assert!("2,0,0,0".parse::<Faults>().is_err());
        assert!("0,0,0,-1".parse::<Faults>().is_err());
        assert!("0,0,0,0".parse::<Faults>().is_ok());
        let error = "often".parse::<Faults>().unwrap_err().to_string();
        assert!(
            error.starts_with("`often` does not describe") && error.ends_with("as in 0.001,0.001,0.01,5."),
            "{error}"
        );
    }
}
