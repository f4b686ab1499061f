//! Statistics that the report needs beyond `statrs`: densities, smoothing, and intervals for differences.
//!
//! The densities and the smoothing filter are written here since no kept-up crate fits: `statrs`' estimator builds a
//! search tree again for every place at which the density is evaluated, `kernel-density-estimation` had no release since
//! 2022, and `savgol-rs` 0.1 copies SciPy's interface onto a solver of its own.

use statrs::distribution::{ContinuousCDF, Normal};
use statrs::statistics::{Data, Distribution, OrderStatistics, Statistics};

/// Mean and sample standard deviation; the latter 0 for fewer than two values.
pub(crate) fn mean_deviation(values: &[f64]) -> (f64, f64) {
    let deviation = if values.len() < 2 { 0.0 } else { values.std_dev() };
    (Statistics::mean(values), deviation)
}

/// The half-width of a two-sided 95 % interval of a normal distribution, in standard deviations.
pub(crate) fn z95() -> f64 {
    Normal::standard().inverse_cdf(0.975)
}

/// The two-sided 95 % interval of a share, `successes` out of `trials`, after Wilson (1927); 0 to 1 without trials.
pub(crate) fn wilson(successes: f64, trials: f64) -> (f64, f64) {
    if trials <= 0.0 {
        return (0.0, 1.0);
    }
    let z = z95();
    let share = successes / trials;
    let center = (share + z * z / (2.0 * trials)) / (1.0 + z * z / trials);
    let half = z / (1.0 + z * z / trials) * (share * (1.0 - share) / trials + z * z / (4.0 * trials * trials)).sqrt();
    ((center - half).max(0.0), (center + half).min(1.0))
}

/// The mean of the paired differences `b − a` and its two-sided 95 % interval by Student's t over pairs: folds that both
/// methods saw. Not a number for fewer than two pairs. Folds share most of their training touches, so that their differences
/// are not independent and the interval is narrower than one of 95 % (Nadeau and Bengio, Inference for the generalization
/// error, Machine Learning 52, 2003).
pub(crate) fn paired_difference(a: &[f64], b: &[f64]) -> (f64, f64, f64) {
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| b - a).collect();
    let pairs = differences.len() as f64;
    let (mean, deviation) = mean_deviation(&differences);
    let Ok(student) = statrs::distribution::StudentsT::new(0.0, 1.0, pairs - 1.0) else {
        return (mean, f64::NAN, f64::NAN);
    };
    let half = student.inverse_cdf(0.975) * deviation / pairs.sqrt();
    (mean, mean - half, mean + half)
}

/// Number of distinct groups that an accuracy must rest on to be given.
pub const LEAST_GROUPS: usize = 300;

/// Number of different groups of `size` can be drawn from `touches` touches, without regard to order; at most
/// [`LEAST_GROUPS`] are counted.
pub fn distinct_groups(touches: usize, size: usize) -> usize {
    let Some(rest) = touches.checked_sub(size) else { return 0 };
    let mut groups = 1;
    for k in 1..=size.min(rest) {
        // The product of k consecutive numbers is divisible by k!.
        groups = groups * (touches - k + 1) / k;
        if groups >= LEAST_GROUPS {
            return LEAST_GROUPS;
        }
    }
    groups
}

/// The largest groups of which at least [`LEAST_GROUPS`] different ones can be drawn from `touches` touches; 0 if there
/// are none.
pub fn largest_group(touches: usize) -> usize {
    (1..=touches).rev().find(|&size| distinct_groups(touches, size) >= LEAST_GROUPS).unwrap_or(0)
}

/// The value below which the share `at` of `values` lies.
pub(crate) fn quantile(values: &[f64], at: f64) -> f64 {
    Data::new(values.to_vec()).quantile(at)
}

/// The Gaussian kernel density of `values` at `places` evenly spaced places from `low` to `high`, in units of one over
/// theirs. The bandwidth is Silverman's, 0.9 · min(deviation, interquartile range / 1.34) · n^(−1/5), but no less than
/// half the distance of two places. Values are first counted into eight bins a place, which moves each by less than a
/// sixteenth of that distance.
pub(crate) fn density(values: &[f64], low: f64, high: f64, places: usize) -> Vec<(f64, f64)> {
    let step = (high - low) / (places.max(2) - 1) as f64;
    let mut data = Data::new(values.to_vec());
    let spread = (data.upper_quartile() - data.lower_quartile()) / 1.34;
    let deviation = data.std_dev().unwrap_or(0.0);
    let scale = if spread > 0.0 { spread.min(deviation) } else { deviation };
    let bandwidth = (0.9 * scale * (values.len().max(1) as f64).powf(-0.2)).max(step / 2.0);

    let fine = step / 8.0;
    let reach = (5.0 * bandwidth / fine).ceil() as i64;
    let bins = 8 * (places.max(2) as i64 - 1) + 1;
    let mut counts = vec![0.0; (bins + 2 * reach) as usize];
    for value in values {
        let bin = ((value - low) / fine).round() as i64 + reach;
        if let Some(count) = usize::try_from(bin).ok().and_then(|bin| counts.get_mut(bin)) {
            *count += 1.0;
        }
    }
    let height = 1.0 / (bandwidth * std::f64::consts::TAU.sqrt() * values.len().max(1) as f64);
    let kernel: Vec<f64> =
        (-reach..=reach).map(|k| height * (-0.5 * (k as f64 * fine / bandwidth).powi(2)).exp()).collect();
    (0..places.max(2))
        .map(|place| {
            let around = &counts[8 * place..8 * place + kernel.len()];
            (low + place as f64 * step, around.iter().zip(&kernel).map(|(count, weight)| count * weight).sum())
        })
        .collect()
}

/// Evenly spaced `values` smoothed after Savitzky and Golay (1964): each becomes the value, at its place, of the
/// polynomial of degree `degree` through the `2 · half + 1` values around it in the least-squares sense; near an end, of
/// the polynomial through the first or last of them. Fewer values than that are returned as they are.
pub(crate) fn savitzky_golay(values: &[f64], half: usize, degree: usize) -> Vec<f64> {
    let window = 2 * half + 1;
    if values.len() < window || degree >= window {
        return values.to_vec();
    }
    (0..values.len())
        .map(|place| {
            let first = place.saturating_sub(half).min(values.len() - window);
            let at = place as f64 - (first + half) as f64;
            fitted(&values[first..first + window], half, degree, at)
        })
        .collect()
}

/// The least-squares polynomial through values at −half..=half, evaluated at `at`: through an orthogonal basis made by
/// Forsythe's recurrence, which needs no linear solver.
fn fitted(values: &[f64], half: usize, degree: usize, at: f64) -> f64 {
    let places: Vec<f64> = (0..values.len()).map(|k| k as f64 - half as f64).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut before, mut basis) = (vec![0.0; places.len()], vec![1.0; places.len()]);
    let (mut before_at, mut basis_at) = (0.0, 1.0);
    let (mut before_norm, mut result) = (1.0, 0.0);
    for k in 0..=degree {
        let norm = dot(&basis, &basis);
        result += dot(values, &basis) / norm * basis_at;
        let shifted: Vec<f64> = places.iter().zip(&basis).map(|(x, p)| x * p).collect();
        let alpha = dot(&shifted, &basis) / norm;
        let beta = if k == 0 { 0.0 } else { norm / before_norm };
        let next = (0..places.len()).map(|i| (places[i] - alpha) * basis[i] - beta * before[i]).collect();
        let next_at = (at - alpha) * basis_at - beta * before_at;
        (before, basis) = (basis, next);
        (before_at, basis_at) = (basis_at, next_at);
        before_norm = norm;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_agrees_with_published_values() {
        // Newcombe (1998), Statistics in Medicine 17, table I: 81/263, 15/148, 0/20, 1/29.
        for (successes, trials, low, high) in [
            (81.0, 263.0, 0.2553, 0.3662),
            (15.0, 148.0, 0.0624, 0.1605),
            (0.0, 20.0, 0.0, 0.1611),
            (1.0, 29.0, 0.0061, 0.1718),
        ] {
            let (l, h) = wilson(successes, trials);
            assert!((l - low).abs() < 1e-4 && (h - high).abs() < 1e-4, "{successes}/{trials}: {l} {h}");
        }
    }

    #[test]
    fn an_accuracy_over_a_single_possible_group_is_no_accuracy() {
        assert_eq!([distinct_groups(30, 30), distinct_groups(30, 29), distinct_groups(30, 31)], [1, 30, 0]);
        assert_eq!([distinct_groups(30, 1), distinct_groups(30, 2), distinct_groups(10, 3)], [30, LEAST_GROUPS, 120]);
        assert_eq!(distinct_groups(2_100, 1_000), LEAST_GROUPS);
        assert_eq!([largest_group(30), largest_group(2_100), largest_group(5), largest_group(0)], [28, 2_099, 0, 0]);
    }

    #[test]
    fn a_paired_difference_has_students_interval() {
        let (mean, low, high) = paired_difference(&[0.1, 0.2, 0.3, 0.4], &[0.2, 0.4, 0.4, 0.6]);
        // Differences 0.1, 0.2, 0.1, 0.2; t(3) at 97.5 % is 3.18245.
        let half = 3.182_446 * 0.057_735_027 / 2.0;
        assert!(
            (mean - 0.15).abs() < 1e-12 && (low - (0.15 - half)).abs() < 1e-6 && (high - (0.15 + half)).abs() < 1e-6
        );
        assert!(paired_difference(&[0.1], &[0.2]).1.is_nan());
    }

    #[test]
    fn a_density_integrates_to_one_and_peaks_where_the_values_are() {
        let normal = Normal::standard();
        let values: Vec<f64> = (1..20_000).map(|k| normal.inverse_cdf(f64::from(k) / 20_000.0)).collect();
        let density = density(&values, -5.0, 5.0, 201);
        let sum: f64 = density.iter().map(|(_, d)| d * 0.05).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        let (place, top) = density[100];
        assert!(place.abs() < 1e-9 && (top - 0.3989).abs() < 0.006, "{place} {top}");
        assert!((density[120].1 - 0.24197).abs() < 0.006);
    }

    #[test]
    fn a_density_of_equal_values_is_a_narrow_peak() {
        let density = density(&[0.0; 50], -1.0, 1.0, 101);
        assert!(density[50].1 > 10.0 && density[40].1 == 0.0, "{density:?}");
    }

    #[test]
    fn the_filter_keeps_polynomials_of_its_degree_and_has_the_published_weights() {
        let cubic: Vec<f64> = (0..30).map(f64::from).map(|x| 1.0 - 2.0 * x + 0.3 * x * x - 0.01 * x * x * x).collect();
        for (raw, smooth) in cubic.iter().zip(savitzky_golay(&cubic, 4, 3)) {
            assert!((raw - smooth).abs() < 1e-9 * raw.abs().max(1.0), "{raw} {smooth}");
        }
        // Savitzky and Golay's quadratic five-point weights: (−3, 12, 17, 12, −3) / 35.
        let mut impulse = [0.0; 9];
        impulse[4] = 35.0;
        let smooth = savitzky_golay(&impulse, 2, 2);
        for (smooth, weight) in smooth[2..7].iter().zip([-3.0, 12.0, 17.0, 12.0, -3.0]) {
            assert!((smooth - weight).abs() < 1e-12, "{smooth} {weight}");
        }
    }
}
