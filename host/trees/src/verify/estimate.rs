//! A share with its standard error.

use serde::Serialize;

/// An estimate and its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Estimate {
    /// The share of `hits` in `trials`, and the binomial standard error.
    pub fn share(hits: usize, trials: usize) -> Self {
        let value = hits as f64 / trials as f64;
        Self { value, standard_error: (value * (1.0 - value) / trials as f64).sqrt() }
    }

    /// The mean of `numbers`, and its standard error: their standard deviation over the root of their count.
    pub fn mean(numbers: impl Iterator<Item = f64> + Clone) -> Self {
        let count = numbers.clone().count() as f64;
        let value = numbers.clone().sum::<f64>() / count;
        let variance = numbers.map(|number| (number - value).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self { value, standard_error: (variance / count).sqrt() }
    }

    /// The mean of independent estimates, weighted.
    pub fn weighted(estimates: impl Iterator<Item = (Self, f64)> + Clone) -> Self {
        let all: f64 = estimates.clone().map(|(_, weight)| weight).sum();
        Self {
            value: estimates.clone().map(|(estimate, weight)| estimate.value * weight).sum::<f64>() / all,
            standard_error: estimates.map(|(of, weight)| (of.standard_error * weight).powi(2)).sum::<f64>().sqrt()
                / all,
        }
    }

    /// The mean of independent estimates.
    pub fn mean_of(estimates: impl Iterator<Item = Self> + Clone) -> Self {
        let count = estimates.clone().count() as f64;
        Self {
            value: estimates.clone().map(|estimate| estimate.value).sum::<f64>() / count,
            standard_error: estimates.map(|estimate| estimate.standard_error.powi(2)).sum::<f64>().sqrt() / count,
        }
    }
}
