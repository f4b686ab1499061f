//! Features of recorded and simulated touches, compared one by one.

use serde::{Deserialize, Serialize};

/// Kolmogorov's distribution at 95 %.
const KOLMOGOROV: f64 = 1.358;

/// Comparison of a feature of recorded and simulated touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureComparison {
    /// The feature's name.
    pub feature: String,
    /// Its 5th, 25th, 50th, 75th and 95th percentiles among recorded touches: microseconds for times, Q15 for cosines.
    pub recorded: [f64; 5],
    /// These percentiles among simulated touches.
    pub simulated: [f64; 5],
    /// The largest difference between the shares of touches below a value: 0 to 1.
    pub apart: f64,
    /// Value that [`FeatureComparison::apart`] would exceed by chance in one of 20 comparisons.
    pub by_chance: f64,
}

impl FeatureComparison {
    /// In words: "alike", "9 % apart: smaller, wider".
    pub fn words(&self) -> String {
        if self.apart <= self.by_chance {
            return "alike".into();
        }
        let [_, low, middle, high, _] = self.recorded;
        let [_, own_low, own_middle, own_high, _] = self.simulated;
        let (width, own_width) = (high - low, own_high - own_low);
        let mut how = Vec::new();
        if (middle - own_middle).abs() > 0.1 * own_width.max(1.0) {
            how.push(if middle > own_middle { "larger" } else { "smaller" });
        }
        if width > 1.1 * own_width {
            how.push("wider");
        } else if 1.1 * width < own_width {
            how.push("narrower");
        }
        let how = if how.is_empty() { "another shape".to_owned() } else { how.join(", ") };
        format!("{:.0} % apart: {how}", 100.0 * self.apart)
    }
}

/// The values of a feature where it is not missing, in order.
pub(super) fn values(rows: &[Vec<f32>], column: usize) -> Vec<f64> {
    let there = rows.iter().filter_map(|row| row.get(column)).filter(|value| value.is_finite());
    let mut values: Vec<f64> = there.map(|value| f64::from(*value)).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Compares two samples in order; none if one is empty.
pub(super) fn feature(name: &str, [recorded, simulated]: [Vec<f64>; 2]) -> Option<FeatureComparison> {
    let percentiles = |values: &[f64]| {
        let at = |percent: usize| values.get(percent * (values.len() - 1) / 100).copied().unwrap_or_default();
        [5, 25, 50, 75, 95].map(at)
    };
    if recorded.is_empty() || simulated.is_empty() {
        return None;
    }
    let [n, m] = [recorded.len() as f64, simulated.len() as f64];
    let below = |values: &[f64], at: f64| values.partition_point(|value| *value <= at) as f64;
    let at = recorded.iter().chain(&simulated);
    let apart = at.map(|&at| (below(&recorded, at) / n - below(&simulated, at) / m).abs()).fold(0.0, f64::max);
    Some(FeatureComparison {
        feature: name.into(),
        recorded: percentiles(&recorded),
        simulated: percentiles(&simulated),
        apart,
        by_chance: KOLMOGOROV * ((n + m) / (n * m)).sqrt(),
    })
}
