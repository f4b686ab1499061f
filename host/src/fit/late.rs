//! Contacts that come later than the stroke: missing, and what that makes of the simulated touches.
//!
//! A late contact is censored. A touch with two recorded contacts may be one of three whose last contact came too late; how
//! often that is, and how far the other two are then apart, is known from the simulated touches at any stroke. The stroke is a
//! time on the recording's clock, so that a candidate's factor moves it: tables are made for a few strokes about the recorded
//! one and read with interpolation. What is recorded lies within the stroke, where nothing changes. Noise, a hundredth of
//! a stroke, is left out at its end, and offsets where only one contact was recorded.

use super::line::{LEVELS, Line, interpolate};
use super::observed::{FULL, OUTER, Observed, mirrored};
use palpate_shared::Touch;
use std::sync::OnceLock;

/// Strokes that tables are made for, relative to the recorded one: the range in which a probe's speed may lie.
const STEPS: [f64; 5] = [0.75, 0.87, 1.0, 1.15, 1.33];

/// Simulated touches of one object, as hands with about this stroke make them.
#[derive(Debug)]
pub(super) struct Late {
    /// The recorded stroke as a time, in milliseconds.
    pub(super) window: f64,
    steps: [Step; STEPS.len()],
}

#[derive(Debug)]
struct Step {
    /// The share of each set of fingers, late ones left out, a set and its mirror image alike.
    shares: [f64; 8],
    /// Differences between the other two fingers, in touches of three fingers with one late: of neighbors, and of the outer fingers.
    samples: [Vec<f32>; 2],
    /// Share of each of these samples among all approaches, for neighbors that of either two.
    late_shares: [f64; 2],
    levels: [OnceLock<[Line; 2]>; LEVELS],
}

impl Late {
    /// Tables of simulated approaches that no stroke ended, in milliseconds.
    pub(super) fn new(touches: &[Touch], window: f64) -> Self {
        Self { window, steps: STEPS.map(|step| Step::new(touches, window * step)) }
    }

    /// Position of a stroke of this many simulated milliseconds among the tables: the lower table, and the weight of the next
    /// one.
    fn place(&self, window: f64) -> (usize, f64) {
        let step = (window / self.window).clamp(STEPS[0], STEPS[STEPS.len() - 1]);
        let lower = (STEPS.partition_point(|table| *table <= step).max(1) - 1).min(STEPS.len() - 2);
        (lower, (step - STEPS[lower]) / (STEPS[lower + 1] - STEPS[lower]))
    }

    /// Interpolates what two neighboring tables hold.
    fn between(&self, window: f64, value: impl Fn(&Step) -> f64) -> f64 {
        let (lower, fraction) = self.place(window);
        interpolate(value(&self.steps[lower]), value(&self.steps[lower + 1]), fraction)
    }

    /// The share of each set of fingers among all approaches where the stroke takes this long.
    pub(super) fn shares(&self, window: f64) -> [f64; 8] {
        std::array::from_fn(|fingers| self.between(window, |step| step.shares[fingers]))
    }

    /// The density among all approaches of two fingers' difference while the third, which would touch too, is late: of
    /// neighbors or, with `which` 1, of the outer fingers. `deviation` is the noise of level `level`, and `away` the
    /// difference in cells of its tables.
    pub(super) fn density(&self, window: f64, level: usize, deviation: f64, which: usize, away: f64) -> f64 {
        self.between(window, |step| step.late_shares[which] * step.level(level, deviation)[which].density(away))
    }
}

impl Step {
    fn new(touches: &[Touch], window: f64) -> Self {
        let (mut counts, mut samples) = ([0_u32; 8], [Vec::new(), Vec::new()]);
        let end = (1e3 * window) as u32;
        for touch in touches {
            let kept = Observed::of(&crate::probe::hand::within(touch, Some(end)));
            counts[usize::from(kept.fingers)] += 1;
            if !touch.is_full() {
                continue;
            }
            match kept.fingers {
                0b011 => samples[0].push(kept.first as f32),
                0b110 => samples[0].push(-kept.first as f32),
                OUTER => samples[1].extend([kept.first as f32, -kept.first as f32]),
                _ => debug_assert!(kept.contacts() == 1 || kept.fingers == FULL),
            }
        }
        let approaches = touches.len().max(1) as f64;
        let late_shares = [samples[0].len(), samples[1].len()].map(|count| count as f64 / (2.0 * approaches));
        Self {
            shares: mirrored(&counts, touches.len()),
            samples,
            late_shares,
            levels: std::array::from_fn(|_| OnceLock::new()),
        }
    }

    fn level(&self, level: usize, deviation: f64) -> &[Line; 2] {
        self.levels[level].get_or_init(|| [0, 1].map(|which: usize| Line::new(&self.samples[which], deviation)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_densities_are_those_of_touches_cut_at_the_stroke() {
        // Every third touch has its last finger 100 to 400 ms late, evenly; the middle one always 10 ms.
        let touch = |i: u32| match i % 3 {
            0 => Touch::from_micros([0, 10_000, 100_000 + 100 * (i % 3_000)]),
            1 => Touch::from_micros([0, 10_000, 20_000]),
            _ => Touch::new([palpate_shared::ContactTime::MISSING; 3]),
        };
        let touches: Vec<Touch> = (0..9_000).map(touch).collect();
        let late = Late::new(&touches, 300.0);
        for (window, cut) in [(300.0, 1.0 / 3.0), (345.0, 55.0 / 300.0), (322.5, 0.258)] {
            let shares = late.shares(window);
            assert!((shares[0b011] + shares[0b110] - cut / 3.0).abs() < 2e-3, "{window}: {shares:?}");
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            // A Gaussian about 10 ms; half of it for either two neighbors.
            let away = late.steps[0].level(0, 2.0)[0].away(10.0);
            let density = late.density(window, 0, 2.0, 0, away);
            let peak = 1.0 / (2.0_f64.hypot(0.3) * std::f64::consts::TAU.sqrt());
            assert!((density / (cut / 6.0 * peak) - 1.0).abs() < 0.03, "{window}: {density}");
        }
    }
}
