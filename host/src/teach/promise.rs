//! Check that there are enough recorded touches for a promise.

use super::balance::Held;
use super::rows::log_sum;
use crate::calibrate;
use crate::evaluate::best;
use crate::random::{self, Purpose};
use rand::seq::SliceRandom;
use serde::Serialize;

/// The error rate that is promised: `palpate calibrate`'s own.
pub const RATE: f64 = 0.01;
/// The probability with which it is kept.
const CONFIDENCE: f64 = 0.95;
/// Limits to which sequences of a calibration are followed, in nats beyond the posterior's threshold, and in touches.
const STRICTEST: f64 = calibrate::STRICTEST[0];
const MAX_TOUCHES: usize = crate::evaluate::MAX_TOUCHES as usize;
/// Sequences of each taught object that say how many approaches one takes.
const SEQUENCES: u64 = 100;

/// Smallest input with which `palpate calibrate` can promise 1 % wrong names of all that are given: the number of
/// sequences that end with a name and without any error, equally many of each object, of touches that the model was not
/// taught with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Needed {
    /// Sequences of all objects together.
    pub sequences: usize,
    /// Sequences of each object.
    pub of_each: usize,
    /// Approaches that these take for one object: about, for the taught object whose sequences are the longest.
    pub approaches: usize,
}

impl Needed {
    /// For objects whose held-out touches have these margins, some of which were `taught` with constants. A calibration
    /// follows its sequences to a margin at which hardly any name is wrong, or to the limit of touches.
    pub(super) fn new(
        (held, sources): (&[Held], &[Vec<Vec<usize>>]),
        taught: &[usize],
        background: Option<usize>,
        constants: &[f64],
        seed: u64,
    ) -> Self {
        let objects = held.len() - usize::from(background.is_some());
        let sequences = usize::try_from(calibrate::needed(RATE, CONFIDENCE)).unwrap_or(usize::MAX);
        let of_each = sequences.div_ceil(objects.max(1));
        let longest = taught
            .iter()
            .map(|&object| approaches(object, (&held[object], &sources[object]), (taught, constants), seed));
        let approaches = of_each as f64 * longest.fold(1.0, f64::max);
        // Two digits: it is no more than an estimate.
        let digit = 10.0_f64.powf((approaches.log10().floor() - 1.0).max(0.0));
        Self { sequences, of_each, approaches: ((approaches / digit).ceil() * digit) as usize }
    }
}

/// The approaches to an object that a sequence of a calibration takes, for each that ends with a name.
fn approaches(
    object: usize,
    (held, sources): (&Held, &[Vec<usize>]),
    (taught, constants): (&[usize], &[f64]),
    seed: u64,
) -> f64 {
    let strictest = ((1.0 - RATE) / RATE).ln() + STRICTEST;
    let (mut approaches, mut named) = (0_u64, 0_u64);
    for (sequence, own) in (0..SEQUENCES).zip(sources.iter().cycle()) {
        let mut random = random::generator(seed, Purpose::Teach, &format!("promise {object}"), sequence);
        let mut order = own.clone();
        order.shuffle(&mut random);
        let mut sums: Vec<f64> = Vec::new();
        let mut touches = 0;
        // Where there are too few for a sequence they are used again, in the same order.
        for &approach in order.iter().cycle().take(MAX_TOUCHES * 100) {
            approaches += 1;
            let Some(margins) = &held[approach] else { continue };
            sums.resize(margins.len(), 0.0);
            sums.iter_mut().zip(margins).for_each(|(sum, margin): (&mut f64, _)| *sum += margin);
            for (&taught, constant) in taught.iter().zip(constants) {
                sums.get_mut(taught).into_iter().for_each(|sum| *sum += constant);
            }
            touches += 1;
            let leader = best(&sums);
            let others = sums.iter().enumerate().filter(|(other, _)| *other != leader).map(|(_, &sum)| sum);
            if sums[leader] - log_sum(others) >= strictest {
                named += 1;
                break;
            }
            if touches >= MAX_TOUCHES {
                break;
            }
        }
    }
    approaches as f64 / named.max(1) as f64
}
