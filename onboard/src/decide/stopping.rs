//! The end of a sequence of touches.

use crate::model::Model;

/// Stopping rule of a recognizer: once the posterior of the best object exceeds 1 − error rate, or after a number of touches.
/// The posterior is that of the evidence as it is, without the model's temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopping {
    /// Error rate / (1 − error rate) in Q56: the largest sum of the other objects' weights, the best object's being 1.
    pub(crate) odds: u64,
    pub(crate) max_touches: u32,
    /// True if objects have the thresholds that their model states for each, where it does.
    pub(crate) by_object: bool,
}

impl Stopping {
    /// Stops when the posterior exceeds 1 − `error_rate`, or gives up after `max_touches`. `None` unless the error rate
    /// is between 1e-15 and 0.5 and there may be a touch.
    ///
    /// Cost: none where it is evaluated at compile time, as in `const STOPPING: Option<Stopping> = Stopping::new(…)`;
    /// otherwise a few operations in f64.
    pub const fn new(error_rate: f64, max_touches: u32) -> Option<Self> {
        if !(error_rate >= 1e-15 && error_rate < 0.5 && max_touches > 0) {
            return None;
        }
        let odds = error_rate / (1.0 - error_rate);
        Some(Self { odds: q56(odds), max_touches, by_object: false })
    }

    /// Stops once the weights of all other objects sum to at most `odds` (Q56), the best object's being 1, or after
    /// `max_touches`, where 0 counts as 1. No object weighs more than the best one: at `odds` of 2^56 for each other object
    /// every touch decides, also where all are level, unless the model's [misfit test](crate::Familiarity) or its
    /// [background](Model::background) objects.
    pub const fn from_odds(odds: u64, max_touches: u32) -> Self {
        Self { odds, max_touches: 1, by_object: false }.with_max_touches(max_touches)
    }

    /// The model's own thresholds and limit: those that it was calibrated to, or was exported with.
    pub fn from_model(model: &Model<'_>) -> Self {
        let header = model.header();
        Self { odds: header.odds(), max_touches: header.max_touches(), by_object: true }
    }

    /// This threshold with another limit of touches; 0 counts as 1.
    pub const fn with_max_touches(self, max_touches: u32) -> Self {
        Self { odds: self.odds, max_touches: if max_touches == 0 { 1 } else { max_touches }, by_object: self.by_object }
    }

    /// The limit of touches.
    pub const fn max_touches(&self) -> u32 {
        self.max_touches
    }

    /// The error rate: the posterior has to exceed 1 minus this.
    pub const fn error_rate(&self) -> f64 {
        let odds = self.odds as f64 / ONE;
        odds / (1.0 + odds)
    }

    /// Error rate / (1 − error rate) in Q56, as a model's header holds it: for an object without a threshold of its own.
    pub const fn odds(&self) -> u64 {
        self.odds
    }

    /// The loosest of all thresholds: see [`odds_of`](Self::odds_of).
    pub(crate) fn loosest(&self, model: &Model<'_>) -> u64 {
        let own = if self.by_object { model.loosest_odds() } else { None };
        own.unwrap_or(self.odds)
    }

    /// The threshold of an object of `model`, which may have one of its own.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn odds_of(&self, object: usize, model: &Model<'_>) -> u64 {
        let own = if self.by_object { model.odds_of(object) } else { None };
        own.unwrap_or(self.odds)
    }
}

const ONE: f64 = 72_057_594_037_927_936.0;

/// A number below 1 in Q56, rounded down: the bits of an f64 shifted to their place.
const fn q56(number: f64) -> u64 {
    let bits = number.to_bits();
    let exponent = bits >> 52;
    let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
    // number = mantissa · 2^(exponent − 1075), so in Q56 mantissa · 2^(exponent − 1019).
    if exponent >= 1019 { mantissa << (exponent - 1019) } else { mantissa >> (1019 - exponent) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_rate_comes_back() {
        for rate in [0.3, 0.05, 0.01, 0.001, 1e-9, 1e-12] {
            let stopping = Stopping::new(rate, 7).unwrap();
            assert!((stopping.error_rate() / rate - 1.0).abs() < 1e-4, "{rate}");
            assert_eq!(stopping.odds(), (rate / (1.0 - rate) * ONE).floor() as u64);
        }
        assert_eq!(Stopping::new(0.01, 7).unwrap().with_max_touches(0).max_touches(), 1);
    }

    #[test]
    fn rates_that_make_no_sense_are_refused() {
        for rate in [0.0, -0.1, 0.5, 1.0, 1e-16, f64::NAN, f64::INFINITY] {
            assert_eq!(Stopping::new(rate, 7), None, "{rate}");
        }
        assert_eq!(Stopping::new(0.01, 0), None);
    }
}
