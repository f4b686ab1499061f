//! Likelihood of recorded touches under a candidate probe.

use super::candidate::{Hypothesis, NOISE};
use super::density::Densities;
use super::observed::{FULL, OUTER, Observed, wide};
use palpate_shared::format::Counted;
use std::f64::consts::TAU;

/// The share of touches that come from nowhere: so that one odd touch cannot decide a fit.
const ODD: f64 = 0.004;

/// Likelihood of one object's touches under a candidate.
pub(super) struct Explained<'a> {
    pub(super) candidate: Hypothesis,
    smoothed: super::density::Smoothed<'a>,
    shares: [f64; 8],
    /// The stroke: the recorded one as a time, and its effect on the simulated approaches.
    stroke: Option<Stroke>,
    /// The logarithm of the share of approaches that were recorded.
    pub(super) recorded: f64,
    pub(super) kept: Counted,
    /// [`product`] of each two sets of fingers.
    products: [[f64; 8]; 8],
}

/// The stroke that ended recorded approaches.
#[derive(Clone, Copy)]
struct Stroke {
    /// Stroke as a time on the recording's clock, in milliseconds.
    window: f64,
    /// The share of each set of fingers, late ones left out.
    shares: [f64; 8],
}

impl<'a> Explained<'a> {
    pub(super) fn new(candidate: &Hypothesis, object: &'a Densities, kept: Counted) -> Self {
        let late = object.late.as_ref();
        let stroke =
            late.map(|late| Stroke { window: late.window, shares: late.shares(late.window / candidate.factor) });
        let shares = stroke.map_or(object.shares, |stroke| stroke.shares);
        let touched = |fingers: u8| -> f64 { shares[usize::from(fingers)] };
        // An approach is not recorded if every finger that touched missed its contact.
        // Loops, since arrays that are made by functions take longer than all touches where assertions are on.
        let mut products = [[0.0; 8]; 8];
        for (touched, products) in (0..).zip(&mut products) {
            for (recorded, own) in (0..).zip(products) {
                *own = product(touched, recorded, &candidate.missed);
            }
        }
        let nothing: f64 = (0..8).map(|fingers| touched(fingers) * products[usize::from(fingers)][0]).sum();
        let recorded = match kept {
            Counted::All | Counted::Full => 0.0,
            Counted::Contacts => (1.0 - nothing).max(1e-9).ln(),
        };
        Self {
            candidate: *candidate,
            smoothed: object.under(candidate.noise / candidate.factor),
            shares: object.shares,
            stroke,
            recorded,
            kept,
            products,
        }
    }

    /// [`product`] under this candidate.
    pub(super) fn product(&self, touched: u8, recorded: u8) -> f64 {
        self.products[usize::from(touched & FULL)][usize::from(recorded & FULL)]
    }

    /// The stroke as a time on the recording's clock, in milliseconds; none without one.
    pub(super) fn window(&self) -> Option<f64> {
        self.stroke.map(|stroke| stroke.window)
    }

    /// The logarithm of the density of a touch in any pose.
    pub(super) fn log_density(&self, observed: &Observed) -> f64 {
        let Hypothesis { factor, late: [first, middle, third], .. } = self.candidate;
        let Observed { fingers, first: x, second: y, odd } = *observed;
        // Of two contacts the difference of their times on the simulated clock.
        let apart = match fingers {
            0b011 => Some((x - (middle - first)) / factor),
            0b110 => Some((third - middle - x) / factor),
            OUTER => Some((x - (third - first)) / factor),
            _ => None,
        };
        let apart = apart.map(|apart| self.smoothed.apart(apart));
        let times = match (fingers, &apart) {
            (FULL, _) => {
                let curvature = (x - (first - 2.0 * middle + third)) / factor;
                let slope = (y - (third - first)) / factor;
                [0.0, self.smoothed.full(curvature, slope) / (factor * factor)]
            }
            (OUTER, Some(apart)) => self.smoothed.outer(apart).map(|d| d / factor),
            (_, Some(apart)) => self.smoothed.neighbors(apart).map(|d| d / factor),
            _ => [1.0; 2],
        };
        let full = usize::from(FULL);
        if self.kept == Counted::Full {
            let within = self.stroke.map_or(1.0, |stroke| stroke.shares[full] / self.shares[full].max(1e-9));
            return (times[1] / within.max(1e-9) * (1.0 - ODD) + ODD * odd).ln();
        }
        // Times do not count where there is only one contact, or none.
        let shares = match self.stroke {
            Some(stroke) if observed.contacts() < 2 => stroke.shares,
            _ => self.shares,
        };
        // The object may have more placements than were recorded.
        let mut density = 0.0;
        for touched in (0..8).filter(|touched| touched & fingers == fingers) {
            let share = shares[usize::from(touched)] * self.product(touched, fingers);
            density += share * times[usize::from(touched == FULL)];
        }
        if let (Some(window), Some(apart)) = (self.window(), &apart) {
            // The third finger would have touched too, later than the stroke, which began with the first of these two.
            let late = |which: usize, [from, to, third]: [f64; 3]| {
                let began = if x > 0.0 { from } else { to };
                self.smoothed.late((window - third + began) / factor, which, apart) / factor
            };
            density += self.product(fingers, fingers)
                * match fingers {
                    0b011 => late(0, [first, middle, third]),
                    0b110 => late(0, [middle, third, first]),
                    _ => late(1, [first, third, middle]),
                };
        }
        (density * (1.0 - ODD) + ODD * odd / 8.0).ln() - self.recorded
    }

    /// The logarithm of the likelihood of touches in any pose.
    pub(super) fn log_likelihood(&self, touches: &[Observed]) -> f64 {
        let few = self.few();
        let of = |touch: &Observed| few[usize::from(touch.fingers)].unwrap_or_else(|| self.log_density(touch));
        touches.iter().map(of).sum()
    }

    /// The logarithms of the densities of touches with one contact or none, which have no times.
    fn few(&self) -> [Option<f64>; 8] {
        let mut few = [None; 8];
        for fingers in [0b000, 0b001, 0b010, 0b100] {
            few[usize::from(fingers)] = Some(self.log_density(&Observed::without_times(fingers)));
        }
        few
    }
}

/// The probability that of the `touched` fingers these are `recorded` and the others missed their contact.
pub(super) fn product(touched: u8, recorded: u8, missed: &[f64; 3]) -> f64 {
    let of = |finger: usize| match (touched >> finger & 1, recorded >> finger & 1) {
        (0, _) => 1.0,
        (_, 0) => missed[finger],
        _ => 1.0 - missed[finger],
    };
    of(0) * of(1) * of(2)
}

/// Presses on a flat plate: curvature is 0 except for the probe's own, and the slope is the plate's, with the other sign after each
/// half turn. They tell how late fingers are, and nothing else: a press square to a plate repeats far better than a touch
/// of an object, and misses nothing, so its noise and its missed contacts are its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Plate {
    /// Full touches of presses: 1 in one direction of the row, −1 in the other; and how likely each is as an odd one.
    presses: Vec<(f64, Observed, f64)>,
    /// Number of presses.
    pub(super) count: usize,
}

/// Repetitions of the estimate of a plate's noise; each is far closer than the one before.
const REPETITIONS: usize = 12;

impl Plate {
    pub(super) fn new(touches: impl IntoIterator<Item = Observed>) -> Self {
        let mut plate = Self::default();
        for (turn, observed) in [1.0, -1.0].into_iter().cycle().zip(touches) {
            plate.count += 1;
            if observed.fingers == FULL {
                plate.presses.push((turn, observed, ODD * wide(observed.first) * wide(observed.second)));
            }
        }
        plate
    }

    /// Their log-likelihood, at the slope of the plate and the noise that suit them best.
    pub(super) fn log_likelihood(&self, candidate: &Hypothesis) -> f64 {
        let [first, middle, third] = candidate.late;
        let [curvature, slope] = [first - 2.0 * middle + third, third - first];
        let count = self.presses.len().max(1) as f64;
        let tilt: f64 = self.presses.iter().map(|(turn, press, _)| turn * (press.second - slope)).sum::<f64>() / count;
        let normal = |x: f64, deviation: f64| (-0.5 * (x / deviation).powi(2)).exp() / (deviation * TAU.sqrt());
        // For each press its two deviations for a noise of 1, and how likely it is as an odd one.
        let presses = self.presses.iter().map(|(turn, press, odd)| {
            let [one, other] = [press.first - curvature, press.second - slope - turn * tilt];
            (one / 6.0_f64.sqrt(), other / 2.0_f64.sqrt(), *odd)
        });
        let presses: Vec<(f64, f64, f64)> = presses.collect();
        let of = |noise: f64, &(one, other, odd): &(f64, f64, f64)| {
            let times = (1.0 - ODD) * normal(one, noise) * normal(other, noise) / 12.0_f64.sqrt();
            (times, times + odd)
        };
        // Expectation and maximization: the noise of the presses that are not odd.
        let mut noise = NOISE[1];
        for _ in 0..REPETITIONS {
            let (mut square, mut weight) = (0.0, 0.0);
            for press in &presses {
                let (times, all) = of(noise, press);
                square += times / all * (press.0.powi(2) + press.1.powi(2));
                weight += times / all;
            }
            let last = noise;
            noise = (square / (2.0 * weight).max(1e-9)).sqrt().clamp(NOISE[0], NOISE[1]);
            if noise == last {
                break;
            }
        }
        presses.iter().map(|press| of(noise, press).1.ln()).sum()
    }
}
