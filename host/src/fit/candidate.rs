//! Probes that may have made recorded touches.

/// The least and largest noise of a candidate, in milliseconds: what tables exist for.
pub(super) const NOISE: [f64; 2] = [0.1, 25.0];

/// A probe that may have made recorded touches. Times are in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hypothesis {
    /// Factor applied to contact times: one over the speed's factor.
    pub(super) factor: f64,
    /// Delay of each finger; 0 for the first.
    pub(super) late: [f64; 3],
    /// Standard deviation of each contact time, including the timer's.
    pub(super) noise: f64,
    /// The share of contacts that each finger misses.
    pub(super) missed: [f64; 3],
}

/// Number of parameters of a candidate.
pub(super) const NUMBERS: usize = 7;

impl Hypothesis {
    /// The candidate as numbers of about the same scale, for a search.
    pub(super) fn numbers(&self) -> [f64; NUMBERS] {
        let [_, middle, third] = self.late;
        let [a, b, c] = self.missed.map(f64::sqrt);
        [self.factor.ln() / 0.03, middle, third, self.noise.ln() / 0.3, a / 0.1, b / 0.1, c / 0.1]
    }

    /// The reverse. Noise without a table becomes the nearest one with a table.
    pub(super) fn of(numbers: &[f64; NUMBERS]) -> Self {
        let [factor, middle, third, noise, a, b, c] = *numbers;
        Self {
            factor: (0.03 * factor).exp().clamp(0.2, 5.0),
            late: [0.0, middle, third],
            noise: (0.3 * noise).exp().clamp(NOISE[0], NOISE[1]),
            missed: [a, b, c].map(|root| (0.1 * root).powi(2).min(0.95)),
        }
    }
}

/// Prior of the probe's faults: standard deviations of the logarithm of the factor, of offsets in milliseconds, and of
/// the logarithm of the noise about [`USUAL_NOISE`]. Of candidates that explain touches equally well the usual one is
/// taken; a few dozen touches outweigh it if they say anything.
const USUAL: [f64; 3] = [0.15, 8.0, 1.0];
/// In milliseconds.
const USUAL_NOISE: f64 = 2.0;

impl Hypothesis {
    /// Logarithm of how usual it is, up to a constant.
    pub(super) fn usual(&self) -> f64 {
        let [factor, offset, noise] = USUAL;
        // Whichever finger counts as straight.
        let mean = self.late.iter().sum::<f64>() / 3.0;
        let late: f64 = self.late.iter().map(|late| ((late - mean) / offset).powi(2)).sum();
        let own = (self.factor.ln() / factor).powi(2) + ((self.noise / USUAL_NOISE).ln() / noise).powi(2);
        -0.5 * (own + late)
    }
}
