//! Terms of a promise.

use crate::error::{Error, Result};
use palpate_shared::format::Per;

/// Terms of a promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// Cases that the rate covers.
    pub per: Per,
}

impl Terms {
    /// Margin at which an uncalibrated recognizer stops at this rate, in nats: the posterior's own.
    pub(crate) fn margin(&self) -> f64 {
        ((1.0 - self.rate) / self.rate).ln()
    }

    /// Refuses terms out of their ranges.
    pub(crate) fn check(&self) -> Result<()> {
        if !(1e-9..0.5).contains(&self.rate) {
            return Err(Error::setting("error_rate", self.rate, "a number of at least 1e-9 and below 0.5"));
        }
        if !((0.5..=0.999_999).contains(&self.confidence)) {
            return Err(Error::setting("confidence", self.confidence, "a number from 0.5 to 0.999999"));
        }
        Ok(())
    }
}
