//! Noise on contact times, as a sensor's latency would add.

use crate::random::{self, Purpose};
use palpate_shared::{ContactTime, Touch};
use rand::rngs::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// `touches` with Gaussian noise of `deviation` microseconds added to every contact time independently; then the
/// earliest time is subtracted, so that the first contact is 0 again, and times are rounded to whole microseconds, as in
/// the published evaluation. Missing contacts stay missing. The same name, touches and seed give the same noise.
pub fn noisy(name: &str, touches: &[Touch], deviation: f64, seed: u64) -> Vec<Touch> {
    let mut random = random::generator(seed, Purpose::Noise, name, 0);
    touches.iter().map(|touch| one(touch, deviation, &mut random)).collect()
}

fn one(touch: &Touch, deviation: f64, random: &mut ChaCha8Rng) -> Touch {
    let times = touch.times().map(|time| {
        let noise: f64 = StandardNormal.sample(random);
        time.micros().map(|micros| f64::from(micros) + deviation * noise)
    });
    let earliest = times.into_iter().flatten().fold(f64::INFINITY, f64::min);
    // A difference of two times fits: u32::MAX itself is the missing contact, so the largest time is one less.
    let shifted = times.map(|time| match time {
        Some(time) => ContactTime::from_micros((time - earliest).round().min(f64::from(u32::MAX - 1)) as u32),
        None => ContactTime::MISSING,
    });
    let noisy = Touch::new(shifted);
    touch.pose().map_or(noisy, |pose| noisy.with_pose(pose))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touches(count: u32) -> Vec<Touch> {
        (0..count).map(|i| Touch::from_micros([i % 977, 500_000, 900_000 + i])).collect()
    }

    #[test]
    fn noise_has_the_deviation_asked_for_and_no_drift() {
        let clean = touches(40_000);
        let slope = |touch: &Touch| {
            let [first, _, last] = touch.times().map(|t| f64::from(t.micros().unwrap()));
            last - first
        };
        let noisy = noisy("fork", &clean, 5_000.0, 1);
        let differences: Vec<f64> = noisy.iter().zip(&clean).map(|(a, b)| slope(a) - slope(b)).collect();
        let count = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / count;
        let deviation = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
        // The difference of two independent noises has the root of two times the deviation.
        assert!((deviation / 5_000.0 - 2.0_f64.sqrt()).abs() < 0.03, "{deviation}");
        assert!(mean.abs() < 5.0 * 7_071.0 / count.sqrt(), "{mean}");
    }

    #[test]
    fn the_first_contact_is_zero_again_and_missing_ones_stay_missing() {
        let partial = Touch::new([ContactTime::MISSING, ContactTime::from_micros(70), ContactTime::FIRST]);
        for touch in noisy("fork", &vec![partial; 200], 5_000.0, 1) {
            let [missing, first, second] = touch.times().map(|t| t.micros());
            assert_eq!(missing, None);
            assert_eq!(first.min(second), Some(0));
        }
    }

    #[test]
    fn names_and_seeds_make_other_noise_and_the_same_ones_the_same() {
        let clean = touches(50);
        let noise = |name, seed| noisy(name, &clean, 5_000.0, seed);
        assert_eq!(noise("fork", 1), noise("fork", 1));
        assert_ne!(noise("fork", 1), noise("spoon", 1));
        assert_ne!(noise("fork", 1), noise("fork", 2));
        assert_eq!(noisy("fork", &clean, 0.0, 1), clean.iter().map(|t| Touch::new(t.times())).collect::<Vec<_>>());
    }
}
